#include "WallMotion.hpp"

#include <cmath>
#include <stdexcept>

#include <core/Body.hpp>
#include <core/InteractionLoop.hpp>
#include <core/Scene.hpp>
#include <core/TimeStepper.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "ContactView.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((WallMotion));

using ::dembark::WallState;
using ::dembark::WallStep;
using dembark_yade::fail;
using dembark_yade::vec;

namespace {

Quaternionr turned(const ::dembark::PrescribedMotion& motion, Real angle) {
	return motion.turns() ? Quaternionr(AngleAxisr(angle, vec(motion.axis()))) : Quaternionr::Identity();
}

}  // namespace

void WallMotion::postLoad(WallMotion&) {
	if (motion.empty()) return;
	try {
		prescribed = ::dembark::PrescribedMotion(motion);
	} catch (const std::invalid_argument& wrong) {
		fail(std::string("WallMotion: ") + wrong.what());
	}
	// Of a saved scene.
	if (begun >= 0 && motion == begunMotion) take();
}

void WallMotion::check() const {
	if (motion.empty()) fail("WallMotion.motion is not set; give terms such as 'harmonic amplitude 0 0 1e-3 frequency 20'");
	if (ids.empty()) fail("WallMotion.ids is empty; give the bodies that move");
	const std::string wrong = prescribed.step_error(scene->dt);
	if (!wrong.empty()) fail("WallMotion: motion '" + motion + "': " + wrong);
	bool passed = false;
	for (const auto& engine : scene->engines) {
		passed           = passed || engine.get() == this;
		const bool late  = dynamic_cast<const InteractionLoop*>(engine.get()) || engine->getClassName() == "EnergyAccount";
		const bool early = dynamic_cast<const NewtonIntegrator*>(engine.get());
		if (!engine->dead && ((passed && late) || (!passed && early)))
			fail("WallMotion must stand in O.engines after InteractionLoop and EnergyAccount, and before NewtonIntegrator");
		const auto* const stepper = dynamic_cast<const TimeStepper*>(engine.get());
		if (passed && stepper && stepper->active && !engine->dead)
			fail("WallMotion must stand in O.engines after " + stepper->getClassName() +
			     ": its velocities lead to the next place in the time step of now");
	}
}

/// Time at the beginning of a step.
Real WallMotion::now(long step) {
	::dembark::MotionClock known{clock[0], clock[1], clock[2], begun, 1.0};
	const Real             time = known.time(step, scene->dt);
	clock                       = Vector3r(known.origin, known.step, known.length);
	return time;
}

/// The motion begins where the bodies stand: when it is run first, or has become another one.
void WallMotion::begin() {
	const bool changed = motion != begunMotion || ids != begunIds;
	if (begun >= 0 && !changed) {
		// start() and measure() may have come in an earlier step.
		if (lastStep < 0 ? scene->iter == begunStep : scene->iter == lastStep || scene->iter == lastStep + 1) return;
		if (lastStep >= 0)
			fail("WallMotion moved its bodies last in step " + std::to_string(lastStep) + " and is now in step " +
			     std::to_string(scene->iter) +
			     ": they are not where its motion has them; make a new WallMotion, which begins where they stand");
	}
	// The scene's own time is a sum, which rounds.
	const Real             counted = scene->iter * scene->dt;
	const bool             exact   = std::abs(counted - scene->time) < 1e-3 * scene->dt;
	::dembark::MotionClock fresh;
	if (exact) fresh.begin(0.0, 0, scene->iter, scene->dt);
	else fresh.begin(scene->time, scene->iter, scene->iter, scene->dt);
	clock       = Vector3r(fresh.origin, fresh.step, fresh.length);
	begun       = fresh.begun;
	begunStep   = scene->iter;
	begunMotion = motion;
	begunIds    = ids;
	lastStep    = -1;
	next.clear();
	places.clear();
	take();
}

/// The motion as it began.
void WallMotion::take() {
	try {
		prescribed.begin(begun);
	} catch (const std::invalid_argument& wrong) {
		fail(std::string("WallMotion: ") + wrong.what());
	}
}

State& WallMotion::state(std::size_t k) const {
	if (!scene->bodies->exists(ids[k])) fail("WallMotion: there is no body " + std::to_string(ids[k]));
	const auto& body = Body::byId(ids[k], scene);
	if (body->isDynamic())
		fail("WallMotion: body " + std::to_string(ids[k]) + " follows its forces; hold it (fixed=True, dynamic=False)");
	return *body->state;
}

/// Where the bodies are without the motion.
void WallMotion::refer(const WallState& here) {
	if (places.size() == ids.size()) return;
	const Vector3r    centre = vec(prescribed.centre(here));
	const Quaternionr back   = turned(prescribed, -here.angle);
	places.clear();
	orientations.clear();
	for (std::size_t k = 0; k < ids.size(); ++k) {
		const State& body = state(k);
		places.push_back(back * (body.pos - centre));
		const Quaternionr first = back * body.ori;
		for (int i = 0; i < 4; ++i) orientations.push_back(first.coeffs()[i]);
	}
}

void WallMotion::start() {
	check();
	begin();
	const Real      t      = now(scene->iter);
	const WallState here   = prescribed.at(t);
	const WallStep  before = prescribed.step(t - scene->dt, scene->dt);
	const Vector3r  spin = before.rate * vec(prescribed.axis()), centre = vec(prescribed.centre(here));
	refer(here);
	for (std::size_t k = 0; k < ids.size(); ++k) {
		State& body = state(k);
		body.vel    = vec(before.velocity) + spin.cross(body.pos - centre);
		body.angVel = spin;
	}
}

void WallMotion::measure() {
	begin();
	if (measured == scene->iter) return;
	const WallState here   = prescribed.at(now(scene->iter));
	const Vector3r  centre = vec(prescribed.centre(here));
	scene->forces.sync();
	::dembark::WallLoad load;
	for (std::size_t k = 0; k < ids.size(); ++k) {
		const State& body = state(k);
		load.add(vec(Vector3r(body.pos - centre)), -vec(scene->forces.getForce(ids[k])), -vec(scene->forces.getTorque(ids[k])));
	}
	displacement        = vec(here.displacement);
	velocity            = vec(here.velocity);
	acceleration        = vec(here.acceleration);
	angle               = here.angle;
	rate                = here.rate;
	angularAcceleration = here.angular_acceleration;
	force               = vec(load.force);
	torque              = vec(load.torque);
	power               = wall_power(load, here, prescribed.axis());
	::dembark::WallSums sums{work, vec(impulse), lastPower, vec(lastForce), 1.0};
	if (measured >= 0 && measured + 1 == scene->iter) sums.step(scene->dt, power, load.force);
	work      = sums.work;
	impulse   = vec(sums.impulse);
	lastPower = power;
	lastForce = force;
	measured  = scene->iter;
}

void WallMotion::action() {
	check();
	measure();
	const Real      t = now(scene->iter), dt = scene->dt;
	const WallState here = prescribed.at(t), there = prescribed.at(t + dt);
	const WallStep  step = prescribed.step(t, dt);
	const Vector3r  spin = step.rate * vec(prescribed.axis()), from = vec(prescribed.centre(here)), to = vec(prescribed.centre(there));
	refer(here);
	next.resize(ids.size());
	const Quaternionr turn = turned(prescribed, there.angle), forward = turned(prescribed, there.angle - here.angle);
	for (std::size_t k = 0; k < ids.size(); ++k) {
		State&         body  = state(k);
		const Vector3r place = to + turn * places[k];
		next[k]              = ::dembark::six_vector(vec(Vector3r(vec(step.velocity) + spin.cross(body.pos - from))), vec(spin));
		body.vel             = vec(step.velocity) + spin.cross(place - to);
		body.angVel          = spin;
		// NewtonIntegrator goes on from here to the place at the end of the step. A chord is no tangent, and sums would round.
		body.pos = place - dt * body.vel;
		if (!prescribed.turns()) continue;
		const Real* first = &orientations[4 * k];
		body.ori          = forward.conjugate() * (turn * Quaternionr(first[3], first[0], first[1], first[2]));
	}
	lastStep = scene->iter;
}

}  // namespace yade
