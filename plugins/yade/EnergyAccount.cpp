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
using dembark_yade::BodyMotion;
using dembark_yade::fail;
using dembark_yade::isFree;

namespace {

/// Places in the sums; the parts of a contact's force are in the order of ::dembark::ContactPart.
struct Entry {
	enum {
		kinetic,
		firstKinetic,
		gravity,
		parts,
		walls = parts + int(::dembark::contact_part_count),
		damping,
		other,
		imposed,
		balance,
		normalStored,
		tangentialStored,
		stepError,
		scale,
		count
	};
};
const char* const entryNames[] = {"kinetic",
                                  "first_kinetic",
                                  "gravity",
                                  "normal_elastic",
                                  "normal_viscous",
                                  "tangential_elastic",
                                  "tangential_viscous",
                                  "capillary",
                                  "liquid_viscous",
                                  "walls",
                                  "numerical_damping",
                                  "other",
                                  "imposed",
                                  "balance",
                                  "normal_stored",
                                  "tangential_stored",
                                  "step_error",
                                  "scale"};
static_assert(std::size(entryNames) == Entry::count, "each entry has a name");

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
	if (pending && scene->iter == recorded + 1) book(*scene);
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

/// Books the recorded step if it has come to its end.
void EnergyAccount::update() {
	const std::lock_guard<std::mutex> lock(guard);
	const auto                        present = home.lock();
	if (pending && present && present->iter == recorded + 1) book(*present);
}

void EnergyAccount::begin() {
	sums.assign(Entry::count, 0.0);
	firstStored = 0.0;
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
Real EnergyAccount::kineticEnergy(Body::id_t id, const Vector3r& velocity, const Vector3r& spin) const {
	const unsigned blocked = motions[id].blocked;
	const Real     turning = along(movers[id].inertia.cwiseProduct(spin), spin, blocked, true);
	return 0.5 * (movers[id].mass * along(velocity, velocity, blocked, false) + turning);
}

void EnergyAccount::recordForces(const Body& body, const NewtonIntegrator& newton) {
	const Body::id_t id     = body.getId();
	Mover&           mover  = movers[id];
	BodyMotion&      motion = motions[id];
	const State&     state  = *body.state;
	if (!body.isStandalone()) fail(bodyName(id) + " belongs to a clump, whose rotation cannot be booked; use single spheres");
	if (newton.exactAsphericalRot && body.isAspherical() && !(motion.blocked & State::DOF_RXRYRZ))
		fail(bodyName(id) +
		     " is aspherical and turns by another rule than spheres; block its rotation, or set "
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
bool EnergyAccount::recordBodies(const NewtonIntegrator& newton, bool first) {
	const auto&       bodies = *scene->bodies;
	const std::size_t count  = std::max(bodies.size(), known.size());
	known.resize(count, -1.0);
	movers.resize(count);
	motions.resize(count);
	changed.assign(count, false);
	sums[Entry::kinetic] = 0.0;
	bool any             = false;
	for (std::size_t k = 0; k < count; ++k) {
		const Body* const body  = k < bodies.size() ? bodies[k].get() : nullptr;
		Mover&            mover = movers[k];
		const Real        had   = known[k];
		if (body) {
			const bool     moves   = newton.mask <= 0 || body->maskCompatible(newton.mask);
			const unsigned blocked = moves ? body->state->blockedDOFs : static_cast<unsigned>(State::DOF_ALL);
			const bool     same    = mover.body == body && motions[k].blocked == blocked && mover.mass == body->state->mass &&
			                         mover.inertia == body->state->inertia;
			// After loading nothing is known of a body but its energy.
			changed[k] = had < 0.0 || (mover.body && !same);
			if (!same) {
				mover              = {body, body->state->mass, body->state->inertia, {}, {}, {}, {}, {}};
				motions[k].blocked = blocked;
			}
			recordForces(*body, newton);
			known[k] = kineticEnergy(body->getId(), body->state->vel, body->state->angVel);
			sums[Entry::kinetic] += known[k];
		} else {
			changed[k] = had >= 0.0;
			mover.body = nullptr;
			known[k]   = -1.0;
		}
		any = any || changed[k];
		// Velocities that were set since the last step are told by the same difference.
		sums[first ? Entry::firstKinetic : Entry::imposed] += std::max(known[k], 0.0) - std::max(had, 0.0);
	}
	return any;
}

/// Takes up the state before the step: the forces are known, the velocities are still those of half a step ago.
void EnergyAccount::record(const NewtonIntegrator& newton, bool first) {
	scene->forces.sync();
	const bool any = recordBodies(newton, first);
	if (any) firstStored += contacts.unexplained(changed, false);
	const auto totals = contacts.record(*scene, ompThreads);
	if (any) firstStored += contacts.unexplained(changed, true);
	sums[Entry::normalStored]     = totals.normalStored;
	sums[Entry::tangentialStored] = totals.tangentialStored;
	// Up to the positions of this step the springs have done half of its part.
	const Real work        = sums[Entry::parts + int(::dembark::ContactPart::normal_elastic)] + totals.half;
	sums[Entry::stepError] = work + totals.normalStored - firstStored;
}

/// Makes the motion of a body the mean of the step, and takes up its kinetic energy. Velocities that are not what the forces make of
/// those before were set by a script; those of a body that was erased since (no state) are taken to be what the forces make.
void EnergyAccount::moveOn(Body::id_t id, const State* state) {
	const Mover&   mover    = movers[id];
	BodyMotion&    motion   = motions[id];
	const Vector3r before[] = {motion.velocity, motion.spin};
	const Vector3r now[]    = {state ? state->vel : before[0], state ? state->angVel : before[1]};
	Vector3r       after[]  = {now[0], now[1]};
	bool           differs  = false;
	for (int turn = 0; turn < 2; ++turn)
		for (int i = 0; i < 3; ++i) {
			if (!isFree(motion.blocked, i, turn)) continue;
			const Real push = turn ? mover.torque[i] : mover.force[i], weight = turn ? 0.0 : mover.weight[i];
			const Real rate     = length / (turn ? mover.inertia[i] : mover.mass),
				   damping  = turn ? mover.dampingTorque[i] : mover.damping[i];
			const Real expected = before[turn][i] + rate * (push + weight + damping);
			const Real roundOff = 1e-13 * (math::abs(before[turn][i]) + rate * (math::abs(push) + math::abs(weight)));
			if (math::abs(now[turn][i] - expected) <= roundOff) continue;
			differs        = true;
			after[turn][i] = expected;
		}
	known[id] = kineticEnergy(id, after[0], after[1]);
	if (differs && state) {
		const Real set = kineticEnergy(id, now[0], now[1]);
		sums[Entry::imposed] += set - known[id];
		known[id] = set;
	}
	sums[Entry::kinetic] += known[id];
	motion.velocity = 0.5 * (before[0] + after[0]);
	motion.spin     = 0.5 * (before[1] + after[1]);
}

/// The recorded step is over: its works, by the mean velocities.
void EnergyAccount::book(const Scene& after) {
	const auto& bodies  = *after.bodies;
	Real        gravity = 0.0, damping = 0.0, onFree = 0.0;
	sums[Entry::kinetic] = 0.0;
	for (std::size_t k = 0; k < movers.size(); ++k) {
		const Mover&      mover = movers[k];
		const BodyMotion& mean  = motions[k];
		if (!mover.body) continue;
		const Body* const now = k < bodies.size() ? bodies[k].get() : nullptr;
		moveOn(static_cast<Body::id_t>(k), now == mover.body ? now->state.get() : nullptr);
		gravity += along(mover.weight, mean.velocity, mean.blocked, false);
		damping += along(mover.damping, mean.velocity, mean.blocked, false) +
		           along(mover.dampingTorque, mean.spin, mean.blocked, true);
		onFree += along(mover.force, mean.velocity, mean.blocked, false) + along(mover.torque, mean.spin, mean.blocked, true);
	}
	const auto totals = contacts.book(motions, length, ompThreads);
	sums[Entry::gravity] += length * gravity;
	sums[Entry::damping] += length * damping;
	sums[Entry::other] += length * onFree - totals.onFree;
	sums[Entry::walls] -= totals.onBlocked;
	for (std::size_t k = 0; k < totals.parts.size(); ++k) sums[Entry::parts + k] += totals.parts[k];
	Real explained = 0.0, scale = 0.0;
	for (int k = Entry::firstKinetic; k < Entry::balance; ++k) {
		explained += sums[k];
		scale += math::abs(sums[k]);
	}
	sums[Entry::balance] = sums[Entry::kinetic] - explained;
	sums[Entry::scale]   = scale;
	pending              = false;
	step                 = recorded;
}

Real EnergyAccount::get(const std::string& name) {
	update();
	const auto found = std::find(std::begin(entryNames), std::end(entryNames), name);
	if (found == std::end(entryNames)) {
		std::string all;
		for (const char* each : entryNames) all += (all.empty() ? "" : ", ") + std::string(each);
		PyErr_SetString(PyExc_KeyError, ("dembark: EnergyAccount has no energy '" + name + "'; it has " + all).c_str());
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
