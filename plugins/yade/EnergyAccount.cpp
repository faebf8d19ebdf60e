// Energy of a run: the works of all parts of all contacts, of gravity, walls and numerical damping, beside the kinetic energy. Its sums,
// and the reason why they balance to round-off, are those of dembark/energy_ledger.hpp.
#include <algorithm>
#include <cstring>
#include <mutex>
#include <typeinfo>
#include <vector>

#include <boost/weak_ptr.hpp>

#include <core/Body.hpp>
#include <core/Clump.hpp>
#include <core/GlobalEngine.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>

#include "ContactView.hpp"
#include "FinnieRabinowicz.hpp"
#include "SavedFormat.hpp"
#include "WallMotion.hpp"
#include "attributes.hpp"
#include "dembark/energy_ledger.hpp"
#include "engine_order.hpp"
#include "report.hpp"

namespace yade {

class EnergyAccount : public GlobalEngine {
public:
	virtual ~EnergyAccount() = default;
	void                action() override;
	void                preSave(EnergyAccount&);
	void                postLoad(EnergyAccount&);
	void                reset();
	Real                get(const std::string& name);
	boost::python::list keys() { return energies().keys(); }
	boost::python::list items() { return energies().items(); }
	boost::python::dict energies();
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(EnergyAccount,GlobalEngine,"Energies [J] of a scene whose contacts are those of :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz`: kinetic energy, what springs hold, and the works of all parts of the contacts' forces, of gravity, walls, numerical damping and other forces, which balance the kinetic energy to round-off in each step. Stands after :yref:`InteractionLoop` and all engines that add forces, and before :yref:`NewtonIntegrator`. Read like :yref:`O.energy<Omega.energy>`: account['gravity'], account.keys(), account.items().",
		((vector<Real>,saved,,Attr::hidden,"The numbers of the ledger, when the scene is saved"))
		((vector<Real>,known,,Attr::hidden,"Kinetic energy [J] of each body by id, -1 = no body"))
		((long,step,-1,Attr::readonly,"Last step whose works are in the sums; -1 = none"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("keys",&EnergyAccount::keys,"Names of the energies.")
		.def("items",&EnergyAccount::items,"Tuples (name, energy [J]).")
		.def("__getitem__",&EnergyAccount::get,(boost::python::arg("name")),"One of the energies [J] by its name.")
		.def("energies",&EnergyAccount::energies,"All energies [J] by name.")
		.def("reset",&EnergyAccount::reset,"Begin anew with the next step: all works are zero there.")
	);
	// clang-format on

private:
	/// What a contact is made of while its forces are known, until the mean velocities of the step are.
	struct Contact {
		bool                     acting = false;
		Body::id_t               one = 0, two = 0;  // the bodies 1 and 2 of the parts
		::dembark::ContactParts  parts;
		::dembark::ContactLevers levers;
		Real                     half = 0.0, work = 0.0;  // J, of the normal spring: in the half step up to here, and in the step
	};

	/// A freely turning body of unequal moments: its spin changes without a torque, too, as the integrator computes. Its rotation is
	/// counted apart from its translation.
	struct Turning {
		bool     own    = false;
		Real     energy = 0.0;                                           // J, before the step
		Vector3r torque = Vector3r::Zero(), damping = Vector3r::Zero();  // N m; what numerical damping has in that
	};
	/// Of a member of a clump: the clump, which moves it, and the arm (m) from the clump's centre of mass.
	struct Member {
		Body::id_t clump = Body::ID_NONE;
		Vector3r   arm   = Vector3r::Zero();
	};

	const NewtonIntegrator& integrator() const;
	void                    update();
	void                    tally(const Scene&);
	void                    record(const NewtonIntegrator&, bool first);
	bool                    recordBodies(const NewtonIntegrator&, bool first);
	bool                    recordMember(const Body&);
	void                    recordForces(const Body&, const NewtonIntegrator&);
	void                    recordContact(Contact&, const Interaction&) const;
	bool                    changes(const Contact& c) const { return c.acting && (changed[c.one] || changed[c.two]); }
	::dembark::EnergyBody   counted(std::size_t k) const;
	void                    begin();

	::dembark::EnergyLedger            ledger;
	std::vector<const Body*>           present;  // by id, to tell whether it is still the same; to own it could mean to end a Python
	                                             // object without the interpreter
	std::vector<::dembark::EnergyBody> bodies;   // by id, before the step that is to be tallied, and then in the mean of it
	std::vector<Turning>               turning;  // by id
	std::vector<Member>                members;  // by id
	std::vector<bool>                  changed;  // by id: came, left, or is another one than a step ago
	std::vector<Contact>               contacts;
	bool                               pending  = false;  // the step `recorded` is not in the sums yet
	long                               recorded = -1;
	Real                               length   = 0.0;  // s, of that step
	boost::weak_ptr<Scene>             home;
	std::mutex                         guard;
};
REGISTER_SERIALIZABLE(EnergyAccount);

}  // namespace yade

DEMBARK_SAVED_FORMAT(EnergyAccount, 1)

namespace yade {

YADE_PLUGIN((EnergyAccount));

using ::dembark::energy_names;
using ::dembark::EnergyBody;
using dembark_yade::fail;
using dembark_yade::vec;

namespace {

static_assert(State::DOF_X == 1 && State::DOF_RX == 8 && State::DOF_ALL == 63,
              "a bit for each degree of freedom, in the order of SixVector");

::dembark::SixVector sixVector(const Vector3r& along, const Vector3r& about) { return ::dembark::six_vector(vec(along), vec(about)); }

/// What NewtonIntegrator's damping, a share of the acceleration against the mean velocity of the step, adds to an acceleration.
Vector3r dampingAcceleration(Real share, const Vector3r& acceleration, const Vector3r& velocity, Real dt) {
	Vector3r change;
	for (int i = 0; i < 3; ++i)
		change[i] = -share * math::sign(acceleration[i] * (velocity[i] + 0.5 * dt * acceleration[i])) * acceleration[i];
	return change;
}

/// J, of the rotation of a body about its centre of mass.
Real turningEnergy(const State& state) {
	const Vector3r spin = state.ori.conjugate() * state.angVel;
	return 0.5 * spin.dot(state.inertia.cwiseProduct(spin));
}

/// The latter three of six velocities.
Vector3r spinOf(const ::dembark::SixVector& velocity) { return Vector3r(velocity[3], velocity[4], velocity[5]); }

}  // namespace

/// The scene's integrator, if its account can be kept.
const NewtonIntegrator& EnergyAccount::integrator() const {
	const NewtonIntegrator& found = dembark_yade::integratorAfter(*this, *scene);
	if (found.densityScaling)
		fail("EnergyAccount: NewtonIntegrator.densityScaling moves bodies with other masses than theirs; set it to False");
	if (scene->isPeriodic && !(scene->cell->velGrad.isZero(0) && scene->cell->nextVelGrad.isZero(0)))
		fail("EnergyAccount: the periodic cell deforms, and its work cannot be tallied; O.cell.velGrad must be zero");
	return found;
}

void EnergyAccount::action() {
	const NewtonIntegrator&           newton = integrator();
	const std::lock_guard<std::mutex> lock(guard);
	if (pending && scene->iter == recorded + 1) tally(*scene);
	const bool first = known.empty();
	if (first) {
		begin();
		step = scene->iter - 1;
	}
	// A step that was recorded and did not come to its end is recorded anew.
	const bool again = pending && scene->iter == recorded;
	const long next  = (pending ? recorded : step) + 1;
	if (!again && scene->iter != next)
		fail("EnergyAccount expected step " + std::to_string(next) + " and sees step " + std::to_string(scene->iter) +
		     "; it must run in every step, or be told to begin anew by its reset()");
	record(newton, first);
	home     = Omega::instance().getScene();
	recorded = scene->iter;
	length   = scene->dt;
	pending  = true;
}

/// Tallies the recorded step if it has come to its end.
void EnergyAccount::update() {
	const std::lock_guard<std::mutex> lock(guard);
	const auto                        there = home.lock();
	if (pending && there && there->iter == recorded + 1) tally(*there);
}

void EnergyAccount::preSave(EnergyAccount&) {
	update();
	saved.resize(::dembark::energy_ledger_size);
	std::memcpy(saved.data(), &ledger, sizeof ledger);
}

void EnergyAccount::postLoad(EnergyAccount&) {
	if (saved.empty()) return;
	if (saved.size() != ::dembark::energy_ledger_size)
		fail("EnergyAccount: the saved account has " + std::to_string(saved.size()) + " numbers, not " +
		     std::to_string(::dembark::energy_ledger_size) +
		     ": it is damaged, or that of another version of dembark; set the scene up anew, or go on with the version that saved "
		     "it");
	std::memcpy(static_cast<void*>(&ledger), saved.data(), sizeof ledger);
	saved.clear();
}

void EnergyAccount::begin() {
	ledger = {};
	known.clear();
	present.clear();
	bodies.clear();
	turning.clear();
	members.clear();
	contacts.clear();
}

void EnergyAccount::reset() {
	const std::lock_guard<std::mutex> lock(guard);
	begin();
	pending = false;
	step    = -1;
}

/// Takes up the place of a member in its clump. Returns whether the body is one.
bool EnergyAccount::recordMember(const Body& body) {
	Member& member = members[body.getId()];
	member         = {};
	if (!body.isClumpMember()) return false;
	member = {body.clumpId, body.state->pos - Body::byId(body.clumpId, scene)->state->pos};
	return true;
}

/// What acts on a body in this step.
void EnergyAccount::recordForces(const Body& body, const NewtonIntegrator& newton) {
	const Body::id_t id    = body.getId();
	EnergyBody&      moved = bodies[id];
	const State&     state = *body.state;
	moved.velocity         = sixVector(state.vel, state.angVel);
	turning[id]            = {};
	if (moved.mass == ::dembark::SixVector{} || body.isClumpMember()) return moved.set_forces({}, {});
	if (body.isClump() && !moved.is_free())
		fail("EnergyAccount: clump " + std::to_string(id) +
		     " has some of its degrees of freedom blocked; block none or all of them");
	Vector3r force = Vector3r::Zero(), torque = Vector3r::Zero();
	if (body.isClump()) static_cast<Clump&>(*body.shape).addForceTorqueFromMembers(&state, scene, force, torque);
	force += scene->forces.getForce(id);
	torque += scene->forces.getTorque(id);
	const bool     turns = newton.exactAsphericalRot && body.isAspherical() && moved.is_free(3) && moved.is_free(4) && moved.is_free(5);
	const bool     isDamped = newton.damping != 0.0 && state.isDamped;
	const Vector3r weight   = state.mass * newton.gravity;
	Vector3r       damping = Vector3r::Zero(), dampingTorque = Vector3r::Zero();
	if (isDamped) {
		Vector3r acceleration = force / state.mass;
		if (newton.dampGravity) acceleration += newton.gravity;
		damping = state.mass * dampingAcceleration(newton.damping, acceleration, state.vel, scene->dt);
	}
	if (isDamped && turns) {
		for (int i = 0; i < 3; ++i) dampingTorque[i] = -newton.damping * math::sign(torque[i] * state.angVel[i]) * torque[i];
	} else if (isDamped) {
		const Vector3r acceleration = torque.cwiseQuotient(state.inertia);
		dampingTorque = state.inertia.cwiseProduct(dampingAcceleration(newton.damping, acceleration, state.angVel, scene->dt));
	}
	if (turns) {
		turning[id] = {true, turningEnergy(state), torque + dampingTorque, dampingTorque};
		torque      = Vector3r::Zero();
		dampingTorque.setZero();
	}
	moved.set_forces(sixVector(force + weight + damping, torque + dampingTorque), sixVector(weight, Vector3r::Zero()),
	                 sixVector(damping, dampingTorque));
}

/// The motion along the axes alone of a body that turns, else all of it.
::dembark::EnergyBody EnergyAccount::counted(std::size_t k) const {
	EnergyBody body = bodies[k];
	if (members[k].clump != Body::ID_NONE) body.mass = {};
	if (turning[k].own) body.mass[3] = body.mass[4] = body.mass[5] = 0.0;
	return body;
}

/// Takes up the bodies as they are before the step. Returns whether any of them came, left, or is another one than a step ago.
bool EnergyAccount::recordBodies(const NewtonIntegrator& newton, bool first) {
	const auto&       all   = *scene->bodies;
	const std::size_t count = std::max(all.size(), known.size());
	known.resize(count, -1.0);
	present.resize(count, nullptr);
	bodies.resize(count);
	turning.resize(count);
	members.resize(count);
	changed.assign(count, false);
	ledger.kinetic = 0.0;
	bool any       = false;
	for (std::size_t k = 0; k < count; ++k) {
		const Body* const body = k < all.size() ? all[k].get() : nullptr;
		const Real        had  = known[k];
		if (body) {
			const Body&          mover = recordMember(*body) ? *Body::byId(body->clumpId, scene) : *body;
			const bool           moves = newton.mask <= 0 || mover.maskCompatible(newton.mask);
			::dembark::SixVector mass  = sixVector(Vector3r::Constant(mover.state->mass), mover.state->inertia);
			for (std::size_t i = 0; i < mass.size(); ++i)
				if (!moves || mover.state->blockedDOFs >> i & 1) mass[i] = 0.0;
			// After loading nothing is known of a body but its energy.
			changed[k]     = had < 0.0 || (present[k] && (present[k] != body || bodies[k].mass != mass));
			bodies[k].mass = mass;
			recordForces(*body, newton);
			known[k] = counted(k).kinetic() + turning[k].energy;
			ledger.kinetic += known[k];
		} else {
			changed[k] = had >= 0.0;
			known[k]   = -1.0;
		}
		present[k] = body;
		any        = any || changed[k];
		// Velocities that were set since the last step are told by the same difference.
		(first ? ledger.first_kinetic : ledger.imposed) += std::max(known[k], 0.0) - std::max(had, 0.0);
	}
	return any;
}

/// Takes up an interaction after its law has run.
void EnergyAccount::recordContact(Contact& c, const Interaction& interaction) const {
	c.acting = false;
	if (!interaction.isReal()) return;
	const Body::id_t id1 = interaction.getId1(), id2 = interaction.getId2();
	const IPhys&     data = *interaction.phys;
	if (typeid(data) != typeid(FinnieRabinowiczPhys))
		fail("EnergyAccount: bodies " + std::to_string(id1) + " and " + std::to_string(id2) + " interact by " +
		     data.getClassName() +
		     ", whose energies it does not know; all contacts must be of "
		     "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz");
	const auto& phys  = static_cast<const FinnieRabinowiczPhys&>(data);
	const Body &body1 = *Body::byId(id1, scene), &body2 = *Body::byId(id2, scene);
	// Without a law that has seen it, or between two held bodies, a contact has no force.
	if (!phys.prepared() || !((phys.wallBody != 1 && body1.isDynamic()) || (phys.wallBody != 2 && body2.isDynamic()))) return;

	dembark_yade::ContactView view(phys.wallBody, *static_cast<const ScGeom*>(interaction.geom.get()), body1, body2,
	                               dembark_yade::imageShift(*scene, interaction.cellDist));
	view.move(body1.state->vel, body1.state->angVel, body2.state->vel, body2.state->angVel);
	const auto                      on1      = [&](const Vector3r& force) { return vec(Vector3r(view.sign() * force)); };
	const ::dembark::Vec3<Real>     along    = on1(phys.normalForce);
	const ::dembark::ContactBodies& bodies   = view.bodies;
	const Real                      distance = norm(bodies.separation);
	::dembark::ContactForce         force;
	force.overlap            = bodies.radius_1 + (phys.wallBody ? 0.0 : bodies.radius_2) - distance;
	force.normal             = distance > 0.0 ? bodies.separation * (1.0 / distance) : ::dembark::Vec3<Real>{0.0, 0.0, 1.0};
	force.cohesive_force     = phys.capillaryForce;
	force.viscous_normal     = phys.viscousForce;
	force.viscous_tangential = on1(phys.viscousShearForce);
	force.normal_force       = dot(along, force.normal) + force.cohesive_force - force.viscous_normal;
	force.tangential         = on1(phys.shearForce) - force.viscous_tangential;
	force.rolling            = on1(phys.rollingTorque);

	const auto motion = ::dembark::relative_motion(bodies, force.normal, force.overlap);
	c.acting          = true;
	c.one             = view.swapped() ? id2 : id1;
	c.two             = view.swapped() ? id1 : id2;
	c.parts           = ::dembark::contact_parts(phys.contact, bodies, force, phys.state());
	c.levers          = {force.normal, motion};
	if (phys.wallBody) c.levers.two += vec(view.surface);
	c.half = 0.5 * scene->dt * dot(c.parts[::dembark::ContactPart::normal_elastic], force.normal) * motion.normal_velocity;
}

/// Takes up the state before the step: the forces are known, the velocities are still those of half a step ago.
void EnergyAccount::record(const NewtonIntegrator& newton, bool first) {
	scene->forces.sync();
	const bool any = recordBodies(newton, first);
	// What the springs of bodies hold that go or come is no work of theirs.
	if (any)
		for (const Contact& c : contacts)
			if (changes(c)) ledger.first_stored += c.work - c.half - c.parts.normal_stored;

	auto& interactions = *scene->interactions;
	contacts.resize(interactions.size());
#ifdef YADE_OPENMP
#pragma omp parallel for schedule(static) num_threads(ompThreads > 0 ? std::min(ompThreads, omp_get_max_threads()) : omp_get_max_threads())
#endif
	for (std::size_t i = 0; i < contacts.size(); ++i) {
		try {
			recordContact(contacts[i], *interactions[i]);
		} catch (const std::exception& error) {
			dembark_yade::postpone(*scene, error);
		}
	}

	Real normal = 0.0, tangential = 0.0, rolling = 0.0, ahead = 0.0;
	for (const Contact& c : contacts) {
		if (!c.acting) continue;
		normal += c.parts.normal_stored;
		tangential += c.parts.tangential_stored;
		rolling += c.parts.rolling_stored;
		ahead += c.half;
		if (any && changes(c)) ledger.first_stored += c.parts.normal_stored + c.half;
	}
	ledger.set_stored(normal, tangential, rolling, ahead);
}

/// The recorded step is over: its works, by the mean velocities. Those of a body that was erased since are what the forces make.
void EnergyAccount::tally(const Scene& after) {
	const auto& all = *after.bodies;
	ledger.kinetic  = 0.0;
	ledger.now      = {};
	// A driven wall that turns has got its velocity for its next place.
	std::vector<const ::dembark::SixVector*> driven;
	for (const auto& engine : after.engines) {
		const auto* const motion = dynamic_cast<const WallMotion*>(engine.get());
		if (!motion || motion->lastStep != recorded) continue;
		driven.resize(bodies.size(), nullptr);
		motion->eachAfter([&](int id, const ::dembark::SixVector& velocity) {
			if (std::size_t(id) < driven.size()) driven[std::size_t(id)] = &velocity;
		});
	}
	for (std::size_t k = 0; k < bodies.size(); ++k) {
		if (!present[k]) continue;
		const Body* const now      = k < all.size() ? all[k].get() : nullptr;
		EnergyBody&       body     = bodies[k];
		const auto        velocity = !driven.empty() && driven[k] ? *driven[k]
		                             : now == present[k]          ? sixVector(now->state->vel, now->state->angVel)
		                                                          : body.kicked(length);
		EnergyBody        along    = counted(k);
		known[k]                   = ledger.arrive(along, length, velocity);
		ledger.now.add_body(along);
		body.velocity = along.velocity;
		if (!turning[k].own) continue;
		const Vector3r spin = spinOf(body.velocity);
		const Real     energy =
			now == present[k] ? turningEnergy(*now->state) : turning[k].energy + length * turning[k].torque.dot(spin);
		known[k] += energy;
		ledger.kinetic += energy;
		ledger.now.power[::dembark::Powers::all] += turning[k].torque.dot(spin);
		ledger.now.power[::dembark::Powers::damping] += turning[k].damping.dot(spin);
	}
	for (std::size_t k = 0; k < bodies.size(); ++k) {
		if (!present[k] || members[k].clump == Body::ID_NONE) continue;
		const ::dembark::SixVector& mean = bodies[std::size_t(members[k].clump)].velocity;
		const Vector3r              spin = spinOf(mean);
		bodies[k].velocity = sixVector(Vector3r(Vector3r(mean[0], mean[1], mean[2]) + spin.cross(members[k].arm)), spin);
	}
	for (Contact& c : contacts)
		if (c.acting) c.work = length * ledger.now.add_contact(c.parts, c.levers, bodies[c.one], bodies[c.two]);
	ledger.kick(length, 0);
	pending = false;
	step    = recorded;
}

Real EnergyAccount::get(const std::string& name) {
	if (std::find(energy_names.begin(), energy_names.end(), name) == energy_names.end()) {
		std::string all;
		for (const char* each : energy_names) all += (all.empty() ? "" : ", ") + std::string(each);
		dembark_yade::failAs(PyExc_KeyError, "EnergyAccount has no energy '" + name + "'; it has " + all);
	}
	return boost::python::extract<Real>(energies()[name]);
}

boost::python::dict EnergyAccount::energies() {
	update();
	const std::lock_guard<std::mutex> lock(guard);
	const ::dembark::Energies         values = ledger.energies();
	boost::python::dict               all;
	for (std::size_t k = 0; k < values.size(); ++k) all[energy_names[k]] = values[k];
	return all;
}

}  // namespace yade
