// How wrong the steps of a scene are: local errors, the shortest contact, and what follows. The arithmetic is that of
// dembark/integration/monitor.hpp.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <typeinfo>
#include <vector>

#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>
#include <core/Scene.hpp>
#include <pkg/common/NormShearPhys.hpp>
#include <pkg/common/Sphere.hpp>

#include "ContactView.hpp"
#include "FinnieRabinowicz.hpp"
#include "attributes.hpp"
#include "dembark/integration/monitor.hpp"
#include "dembark/integration/shadow_impact.hpp"
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
	boost::python::dict figures() const;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(IntegrationMonitor,GlobalEngine,"Tells how wrong the steps of a scene are: local errors of positions, velocities and angular velocities, and how many steps the shortest contact takes. Stands after :yref:`InteractionLoop` and all engines that add forces, and before :yref:`NewtonIntegrator`. Adds no force.",
		((Real,speed,NaN,,"Speed [m/s] that errors of velocities, and of angular velocities times the radius, are measured by. Required."))
		((Real,length,NaN,,"Length [m] that errors of positions are measured by; not given = mean diameter of the spheres in the first step"))
		((Real,limit,1e-2,,"Largest error of one step over these"))
		((int,every,20,,"Steps from sample to sample"))
		((Real,contactSteps,10,,"Fewest steps that the shortest contact shall take"))
		((string,reaction,"warn",,"What follows when a sample is beyond these limits: 'report', 'warn', 'stop' or 'adapt'"))
		((long,rows,0,,"With 'adapt': steps of the length that O.dt had at first between two rows, at whose ends O.dt may change"))
		((long,impacts,0,,"Every how many a binary impact is integrated anew, among those that begin at a sample; 0 = none. Contacts of :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz` without liquid"))
		((vector<Real>,saved,,Attr::hidden,"The tallies, when the scene is saved"))
		((vector<Real>,histories,,Attr::hidden,"Accelerations of each body by id in the last steps"))
		((long,step,-1,Attr::readonly,"Last step that was seen; -1 = none"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("figures",&IntegrationMonitor::figures,"All figures by name.")
		.def("reset",&IntegrationMonitor::reset,"Forget all that was seen.")
		.add_property("nextRow",&IntegrationMonitor::nextRow,"With 'adapt': step at which the next row ends")
		.add_property("level",&IntegrationMonitor::level,"With 'adapt': O.dt is what it was at first over 2 to this power")
	);
	// clang-format on
	long nextRow() const { return state.nextRow; }
	int  level() const { return state.level; }

private:
	struct Sums {
		::dembark::MonitorTally run{}, row{};
		Real                    step    = 0.0;  // s, at first
		Real                    length  = 0.0;  // m
		long                    nextRow = -1;
		int                     level = 0, said = 0;
	};

	void prepare();
	bool judged(const Body&, const NewtonIntegrator&) const;
	void takeBodies(const NewtonIntegrator&);
	void takeContacts();
	void beginImpact(const Interaction&, const FinnieRabinowiczPhys&);
	void followImpacts(const NewtonIntegrator&);
	void act();
	void endRow(const NewtonIntegrator&);

	/// An impact that goes on, and where the second body's image is.
	struct Shadow {
		::dembark::ShadowImpact impact{};
		::dembark::Vec3<double> shift{};
	};

	::dembark::StepMonitor monitor;
	Sums                   state;
	std::vector<Shadow>    shadows;
};
REGISTER_SERIALIZABLE(IntegrationMonitor);

YADE_PLUGIN((IntegrationMonitor));

using ::dembark::AccelerationHistory;
using ::dembark::MonitorAction;
using ::dembark::MonitorTally;
using dembark_yade::fail;
using dembark_yade::vec;

namespace {

constexpr std::size_t historyNumbers = sizeof(AccelerationHistory) / sizeof(double);
static_assert(historyNumbers * sizeof(double) == sizeof(AccelerationHistory), "nothing but numbers");

/// m, of a body that is no sphere: of the sphere that turns as hard.
Real radiusOf(const Body& body) {
	if (const auto* const sphere = dynamic_cast<const Sphere*>(body.shape.get())) return sphere->radius;
	return std::sqrt(2.5 * body.state->inertia.maxCoeff() / body.state->mass);
}

}  // namespace

/// Reads the attributes, which a script may change between two steps.
void IntegrationMonitor::prepare() {
	::dembark::MonitorSettings& s = monitor.settings;
	if (std::isnan(speed)) fail("IntegrationMonitor needs 'speed', the speed (m/s) that errors of velocities are measured by");
	if (impacts < 0) fail("IntegrationMonitor.impacts must be 0 (none) or more, not " + std::to_string(impacts));
	if (!::dembark::option_from_name(::dembark::monitor_action_names(), reaction, s.action))
		fail("IntegrationMonitor.reaction '" + reaction + "' is unknown; it can be report, warn, stop, adapt");
	if (!std::isnan(length)) {
		state.length = length;
	} else if (state.length == 0.0) {
		Real sum = 0.0, count = 0.0;
		for (const auto& body : *scene->bodies)
			if (body && body->isDynamic() && dynamic_cast<const Sphere*>(body->shape.get())) {
				sum += 2.0 * radiusOf(*body);
				count += 1.0;
			}
		if (count == 0.0)
			fail("IntegrationMonitor: there are no spheres yet whose mean diameter could be taken; give 'length' (m)");
		state.length = sum / count;
	}
	s.scales      = {state.length, speed, limit};
	s.every       = every;
	s.least_steps = contactSteps;
	if (const char* const wrong = s.error()) fail(std::string("IntegrationMonitor: ") + wrong);
	if (s.action == MonitorAction::adapt && rows < 1)
		fail("IntegrationMonitor: reaction 'adapt' needs 'rows', the number (1 or more) of steps between two rows of output");
}

void IntegrationMonitor::action() {
	const NewtonIntegrator& newton = dembark_yade::integratorAfter(*this, *scene);
	const long              n      = scene->iter;
	prepare();
	// Steps that were not seen, or were of another length, are no history.
	const Real expected = std::ldexp(state.step, -state.level);
	if (n != step + 1 || scene->dt != expected) histories.clear();
	if (scene->dt != expected) {
		state.step  = scene->dt;
		state.level = 0;
	}
	const bool adapts = monitor.settings.action == MonitorAction::adapt;
	if (adapts && state.nextRow <= step) state.nextRow = n + rows;
	step = n;
	scene->forces.sync();
	followImpacts(newton);
	if (monitor.settings.keeps(n)) takeBodies(newton);
	if (monitor.settings.samples(n)) {
		takeContacts();
		if (monitor.settings.action == MonitorAction::warn || monitor.settings.action == MonitorAction::stop) act();
	}
	if (adapts && n >= state.nextRow) endRow(newton);
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
	histories.resize(scene->bodies->size() * historyNumbers, 0.0);
	for (const auto& body : *scene->bodies) {
		if (!body || !judged(*body, newton)) continue;
		const Body::id_t id  = body->getId();
		const auto&      own = *body->state;
		const Vector3r  push = scene->forces.getForce(id) / own.mass, turn = scene->forces.getTorque(id).cwiseQuotient(own.inertia);
		::dembark::Dofs a = ::dembark::dofs(vec(push), vec(turn));
		for (std::size_t k = 0; k < a.size(); ++k)
			if (own.blockedDOFs >> k & 1) a[k] = 0.0;
		Real* const         at = histories.data() + std::size_t(id) * historyNumbers;
		AccelerationHistory history;
		std::memcpy(static_cast<void*>(&history), at, sizeof history);
		monitor.take(history, a, radiusOf(*body), id, scene->iter, scene->dt);
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
		const Real mass = ::dembark::reduced<Real>(dembark_yade::inertialMass(body1), dembark_yade::inertialMass(body2));
		if (std::isinf(mass)) continue;
		Real stiffness = phys->kn;
		int  wall      = 0;
		if (const auto* const ours = dynamic_cast<const FinnieRabinowiczPhys*>(phys)) {
			if (!ours->prepared()) continue;
			wall              = ours->wallBody;
			const Real radius = wall == 1   ? geom->radius2
			                    : wall == 2 ? geom->radius1
			                                : ::dembark::reduced<Real>(geom->radius1, geom->radius2);
			if (impacts > 0 && wall == 0) beginImpact(*interaction, *ours);
			stiffness = ours->contact.respond(radius, mass, geom->penetrationDepth, 0.0).normal_stiffness;
		} else {
			for (int k = 1; k <= 2; ++k)
				if (!dynamic_cast<const Sphere*>((k == 1 ? body1 : body2).shape.get())) wall = k;
		}
		monitor.take_contact(mass, stiffness, scene->dt, wall == 1 ? id2 : id1, wall ? ::dembark::monitor_wall : id2);
	}
}

namespace {

::dembark::ContactBodies pairOf(const Body& one, const Body& two, const ::dembark::Vec3<double>& shift) {
	::dembark::ContactBodies b;
	b.separation         = vec(one.state->pos) - vec(two.state->pos) - shift;
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

}  // namespace

/// If the contact began in this step.
void IntegrationMonitor::beginImpact(const Interaction& interaction, const FinnieRabinowiczPhys& phys) {
	const Body::id_t id1 = interaction.getId1(), id2 = interaction.getId2();
	const Body &     body1 = *Body::byId(id1, scene), &body2 = *Body::byId(id2, scene);
	if (body1.state->blockedDOFs || body2.state->blockedDOFs || !::dembark::picked(id1, id2, scene->iter, impacts)) return;
	Shadow shadow;
	shadow.shift = vec(dembark_yade::imageShift(*scene, interaction.cellDist));
	if (shadow.impact.begin(phys.contact, pairOf(body1, body2, shadow.shift), id1, id2, scene->dt)) shadows.push_back(shadow);
}

void IntegrationMonitor::followImpacts(const NewtonIntegrator& newton) {
	typedef ::dembark::ShadowImpact::Stage Stage;
	std::size_t                            kept = 0;
	for (Shadow& shadow : shadows) {
		const Body* const one   = Body::byId(shadow.impact.one, scene).get();
		const Body* const two   = Body::byId(shadow.impact.two, scene).get();
		Real              found = 0.0;
		const Stage stage = one && two
		                            ? shadow.impact.follow(pairOf(*one, *two, shadow.shift), vec(newton.gravity), scene->dt, found)
		                            : Stage::dropped;
		if (stage == Stage::compared) monitor.take_impact(found, shadow.impact.one);
		if (stage == Stage::going_on) shadows[kept++] = shadow;
	}
	shadows.resize(kept);
}

/// Tells what is found for the first time.
void IntegrationMonitor::act() {
	for (int kind = 0; kind < ::dembark::monitor_kinds; ++kind) {
		if (state.said >> kind & 1 || !finding(monitor.row, monitor.settings, kind)) continue;
		state.said |= 1 << kind;
		const std::string line = "IntegrationMonitor: at step " + std::to_string(scene->iter) + ' ' +
		                         finding_text(monitor.row, monitor.settings, kind, "body");
		if (monitor.settings.action == MonitorAction::stop) fail(line, 1);
		dembark_yade::warn(line);
	}
}

void IntegrationMonitor::endRow(const NewtonIntegrator& newton) {
	state.level = adapted_level(monitor.row, monitor.settings, state.level);
	monitor.close_row();
	const Real before = scene->dt, now = std::ldexp(state.step, -state.level);
	if (now != before) {
		// The velocities are those of half a step of the old length before; the integrator makes a kick of the new length.
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
	state.nextRow = scene->iter + (rows << state.level);
}

void IntegrationMonitor::preSave(IntegrationMonitor&) {
	Sums now = state;
	now.run  = monitor.run;
	now.row  = monitor.row;
	static_assert(sizeof now % sizeof(Real) == 0 && sizeof(Shadow) % sizeof(Real) == 0, "whole numbers of numbers");
	saved.resize((sizeof now + shadows.size() * sizeof(Shadow)) / sizeof(Real));
	std::memcpy(saved.data(), &now, sizeof now);
	if (!shadows.empty()) std::memcpy(saved.data() + sizeof now / sizeof(Real), shadows.data(), shadows.size() * sizeof(Shadow));
}

void IntegrationMonitor::postLoad(IntegrationMonitor&) {
	constexpr std::size_t numbers = sizeof state / sizeof(Real), each = sizeof(Shadow) / sizeof(Real);
	if (saved.size() < numbers) return;
	std::memcpy(static_cast<void*>(&state), saved.data(), sizeof state);
	shadows.resize((saved.size() - numbers) / each);
	if (!shadows.empty()) std::memcpy(static_cast<void*>(shadows.data()), saved.data() + numbers, shadows.size() * sizeof(Shadow));
	monitor.run = state.run;
	monitor.row = state.row;
	saved.clear();
}

void IntegrationMonitor::reset() {
	state   = {};
	monitor = {};
	histories.clear();
	shadows.clear();
	step = -1;
}

boost::python::dict IntegrationMonitor::figures() const {
	const MonitorTally  all = monitor.all();
	boost::python::dict out;
	const auto          put = [&out](const std::string& kind, const ::dembark::ErrorTally& e) {
		out[kind]               = e.largest;
		out[kind + "_rms"]      = e.rms();
		out[kind + "_body"]     = e.body;
		out[kind + "_exceeded"] = e.exceeded;
	};
	put("position", all.errors.position);
	put("velocity", all.errors.velocity);
	put("spin", all.errors.spin);
	out["judged"]         = all.errors.position.count;
	out["contact_steps"]  = std::isinf(all.contact.steps) ? 0.0 : all.contact.steps;
	out["contact_body_1"] = all.contact.one;
	out["contact_body_2"] = all.contact.two;
	out["impacts"]        = all.impacts.count;
	out["impact"]         = all.impacts.largest;
	out["impact_rms"]     = all.impacts.rms();
	out["impact_body"]    = all.impacts.body;
	out["length"]         = state.length;
	out["speed"]          = speed;
	return out;
}

}  // namespace yade
