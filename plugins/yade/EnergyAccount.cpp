#include "EnergyAccount.hpp"

#include <algorithm>
#include <iterator>

#include <core/InteractionLoop.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "report.hpp"

namespace yade {

YADE_PLUGIN((EnergyAccount));

using dembark_yade::along;
using dembark_yade::fail;
using dembark_yade::isFree;
using dembark_yade::BodyMotion;

namespace {

/// Places in the sums. The parts of a contact's force are in the order of ::dembark::ContactPart, springs in the order normal, tangential.
struct Entry {
	enum {
		kinetic, inserted, gravity, walls, parts, damping = parts + int(::dembark::contact_part_count), external, balance,
		stored, unstored = stored + 2, count = unstored + 2
	};
};
const char* const entryNames[] = {"kinetic", "inserted", "gravity", "walls", "normal_elastic", "normal_viscous", "tangential_elastic",
	"tangential_viscous", "capillary", "liquid_viscous", "numerical_damping", "external", "balance", "normal_stored", "tangential_stored",
	"normal_error", "tangential_lost"};
static_assert(std::size(entryNames) == Entry::count, "each line has a name");

/// What NewtonIntegrator's damping, a share of the acceleration against the mean velocity of the step, adds to an acceleration.
Vector3r dampingAcceleration(Real share, const Vector3r& acceleration, const Vector3r& velocity, Real dt) {
	Vector3r change;
	for (int i = 0; i < 3; ++i)
		change[i] = -share * math::sign(acceleration[i] * (velocity[i] + 0.5 * dt * acceleration[i])) * acceleration[i];
	return change;
}

std::string bodyName(Body::id_t id) { return "EnergyAccount: body " + std::to_string(id); }

}  // namespace

/// The scene's integrator, if its account can be kept.
const NewtonIntegrator& EnergyAccount::integrator() const {
	const NewtonIntegrator* found  = nullptr;
	bool                    passed = false;
	for (const auto& engine : scene->engines) {
		passed = passed || engine.get() == this;
		if (engine->dead) continue;
		const auto* newton = dynamic_cast<const NewtonIntegrator*>(engine.get());
		if ((newton && !passed) || (passed && dynamic_cast<const InteractionLoop*>(engine.get())))
			fail("EnergyAccount must stand in O.engines after InteractionLoop and before NewtonIntegrator");
		if (newton && found) fail("EnergyAccount: there is more than one NewtonIntegrator in O.engines; it needs exactly one");
		if (newton) found = newton;
	}
	if (!found) fail("EnergyAccount: there is no NewtonIntegrator in O.engines; it needs exactly one after it");
	if (found->densityScaling)
		fail("EnergyAccount: NewtonIntegrator.densityScaling moves bodies with other masses than theirs; set it to False");
	if (scene->isPeriodic && !(scene->cell->velGrad.isZero(0) && scene->cell->nextVelGrad.isZero(0)))
		fail("EnergyAccount: the periodic cell deforms, and its work cannot be booked; O.cell.velGrad must be zero");
	return *found;
}

void EnergyAccount::action() {
	const NewtonIntegrator&           newton = integrator();
	const std::lock_guard<std::mutex> lock(guard);
	if (pending && scene->iter == recorded + 1) book();
	// A step that was recorded and did not come to its end is recorded anew.
	pending = false;
	if (known.empty()) {
		begin();
		step = scene->iter - 1;
	}
	if (scene->iter != step + 1)
		fail("EnergyAccount has booked step " + std::to_string(step) + " and now sees step " + std::to_string(scene->iter) +
		     "; it must run in every step, or be told to begin anew by its reset()");
	record(newton);
	home     = Omega::instance().getScene();
	recorded = scene->iter;
	length   = scene->dt;
	pending  = true;
}

/// Books the recorded step if it has come to its end.
void EnergyAccount::update() {
	const std::lock_guard<std::mutex> lock(guard);
	const auto                        present = home.lock();
	if (pending && present && present->iter == recorded + 1) book();
}

void EnergyAccount::begin() {
	sums.assign(Entry::count, 0.0);
	springBase.assign(2, 0.0);
	known.clear();
	movers.clear();
	contacts.clear();
}

void EnergyAccount::reset() {
	const std::lock_guard<std::mutex> lock(guard);
	begin();
	pending = false;
	step    = -1;
}

/// J, of the degrees of freedom that forces change.
Real EnergyAccount::kineticEnergy(Body::id_t id) const {
	const Mover&   mover   = movers[id];
	const State&   state   = *mover.body->state;
	const unsigned blocked = motions[id].blocked;
	return 0.5 * (mover.mass * along(state.vel, state.vel, blocked, false)
	              + along(mover.inertia.cwiseProduct(state.angVel), state.angVel, blocked, true));
}

void EnergyAccount::recordForces(Body::id_t id, const NewtonIntegrator& newton) {
	Mover&       mover  = movers[id];
	BodyMotion&      motion = motions[id];
	const State& state  = *mover.body->state;
	if (!mover.body->isStandalone()) fail(bodyName(id) + " belongs to a clump, whose rotation cannot be booked; use single spheres");
	if (newton.exactAsphericalRot && mover.body->isAspherical() && !(motion.blocked & State::DOF_RXRYRZ))
		fail(bodyName(id) + " is aspherical and turns by another rule than spheres; block its rotation, or set "
		     "NewtonIntegrator.exactAsphericalRot to False");
	motion.velocity = state.vel;
	motion.spin     = state.angVel;
	mover.force = mover.torque = mover.weight = mover.damping = mover.dampingTorque = Vector3r::Zero();
	if (motion.blocked == State::DOF_ALL) return;
	mover.force  = scene->forces.getForce(id);
	mover.torque = scene->forces.getTorque(id);
	mover.weight = mover.mass * newton.gravity;
	if (newton.damping == 0.0 || !state.isDamped) return;
	Vector3r acceleration = mover.force / mover.mass;
	if (newton.dampGravity) acceleration += newton.gravity;
	const Vector3r turning = mover.torque.cwiseQuotient(mover.inertia);
	mover.damping          = mover.mass * dampingAcceleration(newton.damping, acceleration, motion.velocity, scene->dt);
	mover.dampingTorque    = mover.inertia.cwiseProduct(dampingAcceleration(newton.damping, turning, motion.spin, scene->dt));
}

/// Takes up the bodies as they are before the step. Returns whether any of them came, left, or is another one than a step ago.
bool EnergyAccount::recordBodies(const NewtonIntegrator& newton) {
	const auto&       bodies = *scene->bodies;
	const std::size_t count  = std::max(bodies.size(), known.size());
	known.resize(count, -1.0);
	movers.resize(count);
	motions.resize(count);
	changed.assign(count, false);
	sums[Entry::kinetic] = 0.0;
	bool any      = false;
	for (std::size_t id = 0; id < count; ++id) {
		const shared_ptr<Body> body  = id < bodies.size() ? bodies[id] : shared_ptr<Body>();
		Mover&                 mover = movers[id];
		const Real             had   = known[id];
		if (body) {
			const bool     moves   = newton.mask <= 0 || body->maskCompatible(newton.mask);
			const unsigned blocked = moves ? body->state->blockedDOFs : static_cast<unsigned>(State::DOF_ALL);
			const bool     same    = mover.body == body && motions[id].blocked == blocked && mover.mass == body->state->mass
			        && mover.inertia == body->state->inertia;
			// After loading nothing is known of a body but its energy.
			changed[id] = had < 0.0 || (mover.body && !same);
			if (!same) {
				mover               = {body, body->state->mass, body->state->inertia, {}, {}, {}, {}, {}};
				motions[id].blocked = blocked;
			}
			recordForces(static_cast<Body::id_t>(id), newton);
			known[id] = kineticEnergy(static_cast<Body::id_t>(id));
			sums[Entry::kinetic] += known[id];
		} else {
			changed[id] = had >= 0.0;
			mover.body  = body;
			known[id]   = -1.0;
		}
		if (!changed[id]) continue;
		any = true;
		sums[Entry::inserted] += std::max(known[id], 0.0) - std::max(had, 0.0);
	}
	return any;
}

/// Takes up the state before the step: the forces are known, the velocities are still those of half a step ago.
void EnergyAccount::record(const NewtonIntegrator& newton) {
	scene->forces.sync();
	const bool any    = recordBodies(newton);
	const auto gone   = any ? contacts.unexplained(changed, false) : std::array<double, 2>{};
	const auto totals = contacts.record(*scene, ompThreads);
	const auto come   = any ? contacts.unexplained(changed, true) : std::array<double, 2>{};
	const ::dembark::ContactPart springs[] = {::dembark::ContactPart::normal_elastic, ::dembark::ContactPart::tangential_elastic};
	for (int k = 0; k < 2; ++k) {
		springBase[k] += gone[k] + come[k];
		sums[Entry::stored + k] = totals.stored[k];
		// Up to the positions of this step the springs have done half of its part.
		sums[Entry::unstored + k] = springBase[k] - (sums[Entry::parts + int(springs[k])] + totals.half[k]) - totals.stored[k];
	}
}

/// The recorded step is over: its works, by the mean velocities.
void EnergyAccount::book() {
	Real gravity = 0.0, damping = 0.0, onFree = 0.0;
	sums[Entry::kinetic] = 0.0;
	for (std::size_t id = 0; id < movers.size(); ++id) {
		const Mover& mover = movers[id];
		BodyMotion&      mean  = motions[id];
		if (!mover.body) continue;
		mean.velocity = 0.5 * (mean.velocity + mover.body->state->vel);
		mean.spin     = 0.5 * (mean.spin + mover.body->state->angVel);
		known[id]     = kineticEnergy(static_cast<Body::id_t>(id));
		sums[Entry::kinetic] += known[id];
		gravity += along(mover.weight, mean.velocity, mean.blocked, false);
		damping += along(mover.damping, mean.velocity, mean.blocked, false) + along(mover.dampingTorque, mean.spin, mean.blocked, true);
		onFree += along(mover.force, mean.velocity, mean.blocked, false) + along(mover.torque, mean.spin, mean.blocked, true);
	}
	const auto totals = contacts.book(motions, length, ompThreads);
	sums[Entry::gravity] += length * gravity;
	sums[Entry::damping] += length * damping;
	sums[Entry::external] += length * onFree - totals.onFree;
	sums[Entry::walls] -= totals.onBlocked;
	Real explained = sums[Entry::inserted] + sums[Entry::gravity] + sums[Entry::damping] + sums[Entry::external] + sums[Entry::walls];
	for (std::size_t k = 0; k < totals.parts.size(); ++k) explained += sums[Entry::parts + k] += totals.parts[k];
	sums[Entry::balance] = sums[Entry::kinetic] - explained;
	pending       = false;
	step          = recorded;
}

Real EnergyAccount::get(const std::string& name) {
	update();
	const auto found = std::find(std::begin(entryNames), std::end(entryNames), name);
	if (found == std::end(entryNames)) {
		std::string known_;
		for (const char* each : entryNames) known_ += (known_.empty() ? "" : ", ") + std::string(each);
		PyErr_SetString(PyExc_KeyError, ("dembark: EnergyAccount has no energy '" + name + "'; it has " + known_).c_str());
		boost::python::throw_error_already_set();
	}
	const std::lock_guard<std::mutex> lock(guard);
	return sums.empty() ? 0.0 : sums[found - std::begin(entryNames)];
}

boost::python::list EnergyAccount::keys() const {
	boost::python::list all;
	for (const char* name : entryNames) all.append(name);
	return all;
}

boost::python::list EnergyAccount::items() {
	update();
	const std::lock_guard<std::mutex> lock(guard);
	boost::python::list               all;
	for (int k = 0; k < Entry::count; ++k) all.append(boost::python::make_tuple(entryNames[k], sums.empty() ? 0.0 : sums[k]));
	return all;
}

boost::python::dict EnergyAccount::energies() { return boost::python::dict(items()); }

}  // namespace yade
