// How wrong the steps of a scene are: local errors, the shortest contact, and what follows. Arithmetic, rows and findings are those of
// dembark/integration/monitor_run.hpp.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <typeinfo>
#include <vector>

#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>
#include <core/Scene.hpp>
#include <pkg/common/NormShearPhys.hpp>
#include <pkg/common/Sphere.hpp>

#include "ContactView.hpp"
#include "FinnieRabinowicz.hpp"
#include "SavedFormat.hpp"
#include "SavedNumbers.hpp"
#include "attributes.hpp"
#include "dembark/integration/monitor_run.hpp"
#include "engine_order.hpp"
#include "report.hpp"

namespace yade {

class IntegrationMonitor : public GlobalEngine {
public:
	virtual ~IntegrationMonitor() = default;
	void                action() override;
	void                preSave(IntegrationMonitor&);
	void                postLoad(IntegrationMonitor&);
	void                reset();
	boost::python::dict figures();
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(IntegrationMonitor,GlobalEngine,"Tells how wrong the steps of a scene are: local errors of positions, velocities and angular velocities, and how many steps the shortest contact takes. Stands after :yref:`InteractionLoop` and all engines that add forces, and before :yref:`NewtonIntegrator`. Adds no force.",
		((Real,speed,NaN,,"Speed [m/s] that errors of velocities, and of angular velocities times the radius, are measured by. Required."))
		((Real,length,NaN,,"Length [m] that errors of positions are measured by; not given = mean diameter of the spheres in the first step"))
		((Real,limit,1e-2,,"Largest error of one step over these"))
		((int,every,20,,"Steps from sample to sample"))
		((Real,contactSteps,10,,"Fewest steps that the shortest contact shall take"))
		((string,reaction,"warn",,"What follows when a sample is beyond these limits: 'report', 'warn', 'stop' or 'adapt'"))
		((long,rows,0,,"With 'adapt': nominal time steps, of the length that O.dt had at first, in an interval; O.dt may change at its end"))
		((long,impacts,0,,"Every how many a binary impact is integrated anew, among those that begin at a sample; 0 = none. Contacts of :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz` without liquid"))
		((string,saved,"",Attr::hidden,"The tallies, when the scene is saved"))
		((vector<Real>,histories,,Attr::hidden,"Accelerations of each body by id in the last steps"))
		((long,step,-1,Attr::readonly,"Last step that was seen; -1 = none"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("figures",&IntegrationMonitor::figures,"All figures by name.")
		.def("reset",&IntegrationMonitor::reset,"Forget all that was seen.")
		.add_property("nextRow",&IntegrationMonitor::nextRow,"With 'adapt': step at which the present interval ends")
		.add_property("level",&IntegrationMonitor::level,"With 'adapt': O.dt is what it was at first over 2 to this power")
	);
	// clang-format on
	long nextRow() const { return run.interval_end(); }
	int  level() const { return run.level(); }

private:
	void                     prepare();
	bool                     judged(const Body&, const NewtonIntegrator&) const;
	void                     takeBodies(const NewtonIntegrator&);
	void                     takeContacts();
	void                     beginImpact(const Interaction&, const FinnieRabinowiczPhys&);
	void                     followImpacts(const NewtonIntegrator&);
	void                     shorten(const NewtonIntegrator&, Real now);
	::dembark::ContactBodies pairOf(const Body& one, const Body& two) const;

	::dembark::MonitorRun run;
};
REGISTER_SERIALIZABLE(IntegrationMonitor);

}  // namespace yade

DEMBARK_SAVED_FORMAT(IntegrationMonitor, 1)

namespace yade {

YADE_PLUGIN((IntegrationMonitor));

using ::dembark::AccelerationHistory;
using ::dembark::MonitorAction;
using ::dembark::MonitorRun;
using ::dembark::ShadowImpact;
using dembark_yade::fail;
using dembark_yade::vec;

namespace {

/// m, of a body that is no sphere: of the sphere that turns as hard.
Real radiusOf(const Body& body) {
	if (const auto* const sphere = dynamic_cast<const Sphere*>(body.shape.get())) return sphere->radius;
	return std::sqrt(2.5 * body.state->inertia.maxCoeff() / body.state->mass);
}

}  // namespace

/// Reads the attributes, which a script may change between two steps.
void IntegrationMonitor::prepare() {
	::dembark::MonitorCommand command;
	command.mean_length          = std::isnan(length);
	command.settings.scales      = {command.mean_length ? 1.0 : length, std::isnan(speed) ? 0.0 : speed, limit};
	command.settings.every       = every;
	command.settings.least_steps = contactSteps;
	command.impacts              = impacts;
	try {
		command.set_action(reaction);
		if (command.settings.action == MonitorAction::adapt) command.rows = rows;
		command.check();
		run.set(command);
		if (!command.mean_length || !run.mean_length) return;
		Real sum = 0.0, count = 0.0;
		for (const auto& body : *scene->bodies)
			if (body && body->isDynamic() && dynamic_cast<const Sphere*>(body->shape.get())) {
				sum += 2.0 * radiusOf(*body);
				count += 1.0;
			}
		run.measure_length(sum, count);
	} catch (const std::invalid_argument& wrong) {
		fail(std::string("IntegrationMonitor: ") + wrong.what());
	}
}

void IntegrationMonitor::action() {
	const NewtonIntegrator& newton = dembark_yade::integratorAfter(*this, *scene);
	const long              n      = scene->iter;
	prepare();
	// Steps that were not seen, or were of another length, are no history.
	if (n != step + 1 || scene->dt != run.step()) histories.clear();
	if (scene->dt != run.step()) run.take_step(scene->dt);
	if (n < step || run.interval_end() <= step) run.begin(scene->dt, n);
	step = n;
	scene->forces.sync();
	followImpacts(newton);
	if (run.monitor.settings.keeps(n)) takeBodies(newton);
	if (run.monitor.settings.samples(n)) {
		takeContacts();
		for (const std::string& found : run.new_findings(n, "body")) {
			if (run.monitor.settings.action == MonitorAction::stop) fail("IntegrationMonitor: " + found, 1);
			dembark_yade::warn("IntegrationMonitor: " + found);
		}
	}
	run.end_step(n);
	if (run.step() != scene->dt) shorten(newton, run.step());
}

bool IntegrationMonitor::judged(const Body& body, const NewtonIntegrator& newton) const {
	if (!body.isDynamic() || !(body.state->mass > 0.0) || (newton.mask > 0 && !body.maskCompatible(newton.mask))) return false;
	if (!body.isStandalone())
		fail("IntegrationMonitor: body " + std::to_string(body.getId()) +
		     " belongs to a clump, whose motion it cannot judge; use single spheres");
	return true;
}

/// Weight is left out: what is constant makes no error.
void IntegrationMonitor::takeBodies(const NewtonIntegrator& newton) {
	histories.resize(scene->bodies->size() * ::dembark::monitor_history_numbers, 0.0);
	for (const auto& body : *scene->bodies) {
		if (!body || !judged(*body, newton)) continue;
		const Body::id_t id  = body->getId();
		const auto&      own = *body->state;
		const Vector3r push = scene->forces.getForce(id) / own.mass, turn = scene->forces.getTorque(id).cwiseQuotient(own.inertia);
		::dembark::SixVector a = ::dembark::six_vector(vec(push), vec(turn));
		for (std::size_t k = 0; k < a.size(); ++k)
			if (own.blockedDOFs >> k & 1) a[k] = 0.0;
		Real* const         at = histories.data() + std::size_t(id) * ::dembark::monitor_history_numbers;
		AccelerationHistory history;
		std::memcpy(static_cast<void*>(&history), at, sizeof history);
		run.monitor.take(history, a, radiusOf(*body), id, scene->iter, scene->dt);
		std::memcpy(at, &history, sizeof history);
	}
}

void IntegrationMonitor::takeContacts() {
	for (const auto& interaction : *scene->interactions) {
		if (!interaction->isReal()) continue;
		const Body::id_t  id1 = interaction->getId1(), id2 = interaction->getId2();
		const Body &      body1 = *Body::byId(id1, scene), &body2 = *Body::byId(id2, scene);
		const auto* const geom = dynamic_cast<const ScGeom*>(interaction->geom.get());
		const auto* const phys = dynamic_cast<const NormPhys*>(interaction->phys.get());
		if (!geom || !phys || !(geom->penetrationDepth > 0.0)) continue;
		const Real mass = ::dembark::reduced(dembark_yade::inertialMass(body1), dembark_yade::inertialMass(body2));
		if (std::isinf(mass)) continue;
		Real stiffness = phys->kn;
		int  wall      = 0;
		if (const auto* const ours = dynamic_cast<const FinnieRabinowiczPhys*>(phys)) {
			if (!ours->prepared()) continue;
			wall              = ours->wallBody;
			const Real radius = wall == 1   ? geom->radius2
			                    : wall == 2 ? geom->radius1
			                                : ::dembark::reduced(geom->radius1, geom->radius2);
			if (impacts > 0 && wall == 0) beginImpact(*interaction, *ours);
			stiffness = ours->contact.respond(radius, mass, geom->penetrationDepth, 0.0).normal_stiffness;
		} else {
			for (int k = 1; k <= 2; ++k)
				if (!dynamic_cast<const Sphere*>((k == 1 ? body1 : body2).shape.get())) wall = k;
		}
		run.monitor.take_contact(mass, stiffness, scene->dt, wall == 1 ? id2 : id1, wall ? ::dembark::monitor_wall : id2);
	}
}

/// With the image of `two` that is nearest.
::dembark::ContactBodies IntegrationMonitor::pairOf(const Body& one, const Body& two) const {
	Vector3r apart = one.state->pos - two.state->pos;
	if (scene->isPeriodic) {
		const Vector3r cells = scene->cell->unshearPt(apart).cwiseQuotient(scene->cell->getSize());
		Vector3i       image;
		for (int k = 0; k < 3; ++k) image[k] = int(std::round(cells[k]));
		apart -= dembark_yade::imageShift(*scene, image);
	}
	::dembark::ContactBodies b;
	b.separation         = vec(apart);
	b.velocity_1         = vec(one.state->vel);
	b.velocity_2         = vec(two.state->vel);
	b.angular_velocity_1 = vec(one.state->angVel);
	b.angular_velocity_2 = vec(two.state->angVel);
	b.radius_1           = radiusOf(one);
	b.radius_2           = radiusOf(two);
	b.mass_1             = dembark_yade::inertialMass(one);
	b.mass_2             = dembark_yade::inertialMass(two);
	return b;
}

/// If the contact began in this step.
void IntegrationMonitor::beginImpact(const Interaction& interaction, const FinnieRabinowiczPhys& phys) {
	// The lower one first, as picked() and ShadowImpact want them.
	const auto [id1, id2] = std::minmax({interaction.getId1(), interaction.getId2()});
	const Body &body1 = *Body::byId(id1, scene), &body2 = *Body::byId(id2, scene);
	if (body1.state->blockedDOFs || body2.state->blockedDOFs || !::dembark::picked(id1, id2, scene->iter, impacts)) return;
	ShadowImpact shadow;
	if (shadow.begin(phys.contact, pairOf(body1, body2), id1, id2, scene->dt)) run.shadows.add({shadow});
}

void IntegrationMonitor::followImpacts(const NewtonIntegrator& newton) {
	run.shadows.follow(scene->dt, run.monitor, [&](const ShadowImpact& shadow) {
		const Body* const                 one = Body::byId(shadow.one, scene).get();
		const Body* const                 two = Body::byId(shadow.two, scene).get();
		::dembark::ShadowImpacts::Meeting now;
		now.here   = true;
		now.judged = one && two;
		if (now.judged) now.bodies = pairOf(*one, *two);
		now.gravity = vec(newton.gravity);
		return now;
	});
	run.shadows.drop();
}

/// The velocities are those of half a step of the old length before; the integrator makes a kick of the new length.
void IntegrationMonitor::shorten(const NewtonIntegrator& newton, Real now) {
	const Real before = scene->dt;
	for (const auto& body : *scene->bodies) {
		if (!body || !judged(*body, newton)) continue;
		auto&          own  = *body->state;
		const Vector3r push = scene->forces.getForce(body->getId()) / own.mass + newton.gravity;
		const Vector3r turn = scene->forces.getTorque(body->getId()).cwiseQuotient(own.inertia);
		for (int k = 0; k < 3; ++k) {
			if (!(own.blockedDOFs >> k & 1)) own.vel[k] += 0.5 * (before - now) * push[k];
			if (!(own.blockedDOFs >> (k + 3) & 1)) own.angVel[k] += 0.5 * (before - now) * turn[k];
		}
	}
	scene->dt = now;
	histories.clear();
}

void IntegrationMonitor::preSave(IntegrationMonitor&) { saved = dembark_yade::encode(run.saved({run.state()})); }

void IntegrationMonitor::postLoad(IntegrationMonitor&) {
	if (saved.empty()) return;
	try {
		run.restore(dembark_yade::decode(saved));
	} catch (const std::invalid_argument& wrong) {
		fail(std::string("IntegrationMonitor: ") + wrong.what());
	}
	saved.clear();
}

void IntegrationMonitor::reset() {
	run = MonitorRun();
	histories.clear();
	step = -1;
}

boost::python::dict IntegrationMonitor::figures() {
	boost::python::dict out;
	for (std::size_t k = 0; k < MonitorRun::figure_names.size(); ++k) {
		const std::string name  = MonitorRun::figure_names[k];
		const Real        value = run.figure(int(k), step);
		if (name.find("body") != std::string::npos) out[name] = long(value);
		else if (k < std::size_t(MonitorRun::energy_error) || k > 19) out[name] = value;
	}
	out["length"] = run.monitor.settings.scales.length;
	out["speed"]  = speed;
	return out;
}

}  // namespace yade
