// SphFluid: its steps among those of YADE, the bodies of the scene in it, and what saved scenes keep of it.
#include "SphFluid.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include <core/Scene.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "ContactView.hpp"
#include "dembark/sph/best_loops.hpp"
#include "SavedNumbers.hpp"
#include "engine_access.hpp"
#include "engine_order.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((SphFluid));

using dembark_yade::fail;
using dembark_yade::text;
using dembark_yade::vec;
namespace sph = ::dembark::sph;

namespace sph_fluid {

/// A message of the headers with the names that attributes have here: soundSpeed for sound_speed.
std::string inYade(const std::string& line) {
	std::string out;
	for (std::size_t k = 0; k < line.size(); ++k)
		if (line[k] == '_' && k + 1 < line.size() && std::islower(static_cast<unsigned char>(line[k + 1])))
			out += static_cast<char>(std::toupper(static_cast<unsigned char>(line[++k])));
		else out += line[k];
	return "SphFluid: " + out;
}

}  // namespace sph_fluid

sph::Settings SphFluid::settings() const {
	sph::Settings s;
	s.dimension     = dimension;
	s.spacing       = spacing;
	s.smoothing     = smoothing;
	s.state         = {density, soundSpeed, gamma, tension};
	s.alpha         = alpha;
	s.delta         = delta;
	s.gravity       = vec(gravity);
	s.no_slip       = noSlip;
	s.shifting      = {shifting};
	s.contact       = {contactStiffness, contactExponent};
	s.skin          = skin;
	s.threads       = threads;
	s.slit_pressure = slitPressure;
	s.xsph          = {xsph};
	s.shepard       = shepard;
	dembark_yade::choose("SphFluid.kernel", kernel, sph::kernel_names(), s.kernel);
	dembark_yade::choose("SphFluid.boundary", boundary, sph::boundary_names(), s.boundary);
	dembark_yade::choose("SphFluid.moment", moment, sph::moment_names(), s.moment);
	if (const char* const wrong = s.error()) fail(sph_fluid::inYade(wrong));
	return s;
}

/// Gravity of the scene; refuses engines in an order or with settings for which momentum would be lost.
const Vector3r& SphFluid::weight() const {
	const NewtonIntegrator& newton = dembark_yade::undampedIntegratorAfter(*this, *scene);
	if (substeps < 1) fail("SphFluid.substeps is " + std::to_string(substeps) + "; it must be 1 or more");
	return newton.gravity;
}

const Body* SphFluid::bodyOf(std::size_t k) const {
	const int id = solidIds[k];
	if (id < 0) return nullptr;
	if (!scene->bodies->exists(id)) fail("SphFluid: body " + std::to_string(id) + ", which is in the fluid, does not exist any more");
	return Body::byId(id, scene).get();
}

std::size_t SphFluid::numberOf(int id) const {
	const auto found = std::find(solidIds.begin(), solidIds.end(), id);
	if (id < 0 || found == solidIds.end()) fail("SphFluid: body " + std::to_string(id) + " is not in the fluid; add it by addBody");
	return static_cast<std::size_t>(found - solidIds.begin());
}

/// Gives the solver's body place and velocities of YADE's.
void SphFluid::place(std::size_t k, sph::Body& body) const {
	const Body* const own = bodyOf(k);
	if (!own) return;
	const State& state = *own->state;
	body.position      = vec(state.pos);
	body.orientation   = {state.ori.w(), state.ori.x(), state.ori.y(), state.ori.z()};
	body.velocity      = vec(state.vel);
	body.spin          = vec(state.angVel);
}

/// The solver; made when it is needed first, from a saved state if there is one.
sph::Solver& SphFluid::fluid() {
	if (solver) return *solver;
	if (passed < 0) gravity = weight();
	try {
		const sph::Settings      s = settings();
		std::vector<sph::Vector> x, v;
		std::vector<double>      rho;
		for (std::size_t i = 0; i < firstPositions.size(); ++i) {
			x.push_back(vec(firstPositions[i]));
			v.push_back(vec(firstVelocities[i]));
			rho.push_back(sph::initial_density(s.state, firstPressures[i]));
		}
		if (x.empty()) fail("SphFluid: there is no fluid; give it particles by addParticles");
		auto        made = std::make_unique<sph::Solver>(s, std::move(x), std::move(rho), std::move(v), sph::best_loops());
		std::size_t at   = 0;
		for (std::size_t k = 0; k < solidIds.size(); ++k) {
			sph::Body body;
			body.driven = solidIds[k] >= 0;
			place(k, body);
			std::vector<sph::Vector> points;
			for (int i = 0; i < solidSizes[k]; ++i) points.push_back(vec(solidPoints[at++]));
			made->add(body, points);
		}
		for (std::size_t k = 0; k < boxNumbers.size(); ++k)
			made->add_box(boxNumbers[k], vec(boxEdges[k]), sph::lattice_counts(vec(boxEdges[k]), spacing));
		for (std::size_t k = 0; k + 1 < planes.size(); k += 2) made->add_plane(vec(planes[k]), vec(planes[k + 1]));
		if (!savedState.empty()) made->restore(dembark_yade::decode(savedState));
		savedState.clear();
		solver = std::move(made);
	} catch (const std::invalid_argument& wrong) {
		fail(sph_fluid::inYade(wrong.what()));
	}
	return *solver;
}

void SphFluid::push() {
	for (std::size_t k = 0; k < solidIds.size(); ++k) {
		if (solidIds[k] < 0) continue;
		const sph::Body& body = solver->body(static_cast<int>(k));
		scene->forces.addForce(solidIds[k], vec(body.force));
		scene->forces.addTorque(solidIds[k], vec(body.torque));
	}
}

void SphFluid::action() {
	dembark_yade::keepThreadState();
	using namespace sph_fluid;
	const Vector3r& now   = weight();
	const bool      again = scene->iter == lastIteration;
	sph::Solver&    own   = fluid();
	if (now != gravity) fail("SphFluid: NewtonIntegrator.gravity has changed since the fluid began; that is not possible");
	if (const char* const changed = settings().difference(own.scene().settings))
		fail(inYade(changed) + " has changed since the fluid began; that is not possible");
	try {
		if (passed < 0) {
			motions.clear();
			for (std::size_t k = 0; k < solidIds.size(); ++k) {
				sph::Body& body = own.body(static_cast<int>(k));
				place(k, body);
				motions.push_back({{}, {}, body.velocity, body.spin});
			}
			own.prepare();
			passed = 0;
		} else if (!again) {
			elapsed += lastLength;
			for (std::size_t k = 0; k < solidIds.size(); ++k)
				if (const Body* const body = bodyOf(k))
					motions[k].add(lastLength, vec(body->state->vel), vec(body->state->angVel));
			if (++passed >= substeps) {
				for (std::size_t k = 0; k < solidIds.size(); ++k) {
					if (solidIds[k] < 0) continue;
					sph::Body& body = own.body(static_cast<int>(k));
					place(k, body);
					motions[k].drive(body, elapsed);
				}
				own.step(elapsed);
				elapsed = 0.0;
				passed  = 0;
			}
		}
	} catch (const std::invalid_argument& wrong) {
		const std::string more = passed >= 0 && substeps > 1 ? " (" + std::to_string(substeps) + " steps of O.dt)" : "";
		fail(inYade(wrong.what()) + more);
	} catch (const std::runtime_error& error) {
		if (std::string(error.what()).rfind("dembark: ", 0) == 0) throw;
		fail(inYade(error.what()), 1);
	}
	steps         = own.steps();
	fluidTime     = own.time();
	lastLength    = scene->dt;
	lastIteration = scene->iter;
	push();
}

void SphFluid::preSave(SphFluid&) {
	if (solver && passed >= 0) savedState = dembark_yade::encode(solver->state());
	ways.clear();
	for (const sph::DrivenMotion& m : motions)
		for (const sph::Vector& v : {m.displacement, m.turn, m.velocity, m.spin}) ways.push_back(vec(v));
}

void SphFluid::postLoad(SphFluid&) {
	solver.reset();
	motions.clear();
	for (std::size_t k = 0; k + 3 < ways.size(); k += 4)
		motions.push_back({vec(ways[k]), vec(ways[k + 1]), vec(ways[k + 2]), vec(ways[k + 3])});
}

}  // namespace yade
