// LcpImpact: its checks, the logs of a step, and the model with its parameters and its saved state.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <core/InteractionLoop.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/FieldApplier.hpp>
#include <pkg/common/Sphere.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "LcpImpactParts.hpp"
#include "report.hpp"

namespace yade {

using dembark_yade::fail;
using dembark_yade::text;
using lcp_impact::eigen;
using lcp_impact::plain;
namespace impact = ::dembark::impact;

namespace lcp_impact {

/// Numbers in hexadecimal: every archive of YADE keeps them, XML too.
std::string encode(const std::vector<double>& numbers) {
	std::string text;
	char        number[40];
	for (const double x : numbers) text.append(number, std::snprintf(number, sizeof number, "%a ", x));
	return text;
}

std::vector<double> decode(const std::string& text) {
	std::vector<double> numbers;
	char*               next = nullptr;
	for (const char* at = text.c_str(); *at; at = next + 1) numbers.push_back(std::strtod(at, &next));
	return numbers;
}

const NewtonIntegrator& integrator(const Scene& scene) {
	for (const auto& each : scene.engines)
		if (const auto* found = dynamic_cast<const NewtonIntegrator*>(each.get())) return *found;
	fail("LcpImpact: O.engines has no NewtonIntegrator; put one after LcpImpact");
}

/// Axis of the blocked translation of a log that moves in a plane, -1 of one that moves freely; the rest is refused.
int blockedAxis(const State& state, Body::id_t id) {
	const unsigned translations = state.blockedDOFs & State::DOF_XYZ, rotations = state.blockedDOFs & State::DOF_RXRYRZ;
	int            axis = -1;
	for (int i = 0; i < 3; ++i)
		if (translations == State::axisDOF(i)) axis = i;
	const bool spins = rotations != State::DOF_RXRYRZ;
	if (translations == 0 && (rotations == 0 || !spins)) return -1;
	if (axis >= 0 && (!spins || !(rotations & State::axisDOF(axis, true)))) return axis;
	fail(logName(id) + "has blockedDOFs '" + state.blockedDOFs_vec_get() +
	     "'; it must be free (''), held ('xyzXYZ'), or move in a plane, e.g. 'zXY': one translation, and not the rotation about that "
	     "axis");
}

double inertia(const State& state, int axis, Body::id_t id) {
	if ((state.blockedDOFs & State::DOF_RXRYRZ) == State::DOF_RXRYRZ) return INFINITY;
	const double value = axis >= 0 ? state.inertia[axis] : state.inertia[0];
	if (!(value > 0.0))
		fail(logName(id) + "has an inertia of " + text(value) + " kg m^2; set state.inertia, 1/2 m r^2 about the axis of a log");
	if (axis < 0 && (state.inertia - Vector3r::Constant(value)).cwiseAbs().maxCoeff() > 1e-9 * value)
		fail(logName(id) +
		     "has three different inertias and moves freely; make them equal or hold it in a plane, blockedDOFs = 'zXY'");
	return value;
}

}  // namespace lcp_impact

void LcpImpact::postLoad(LcpImpact&) {
	const auto least = [&](const char* name, double value, double low, bool open, const char* must) {
		if (!std::isfinite(value) || value < low || (open && value == low))
			fail(std::string("LcpImpact.") + name + " is " + text(value) + "; it must be " + must);
	};
	least("contactDamping", contactDamping, 0.0, false, ">= 0 N s/m");
	least("theta", theta, 0.5, false, "in 0.5...1");
	if (theta > 1.0) fail("LcpImpact.theta is " + text(theta) + "; it must be in 0.5...1");
	least("tangentialRatio", tangentialRatio, 0.0, true, "> 0");
	least("tolerance", tolerance, 0.0, true, "> 0");
	if (sweeps < 1) fail("LcpImpact.sweeps is " + std::to_string(sweeps) + "; it must be >= 1");
	try {
		::dembark::lcp_method(method);
	} catch (const std::invalid_argument&) {
		fail("LcpImpact.method is '" + method + "'; it must be auto, energy, block, murty or pgs");
	}
}

void LcpImpact::preSave(LcpImpact&) {
	if (system) savedState = lcp_impact::encode(system->state());
}

void LcpImpact::check(const Scene& on) const {
	if (on.isPeriodic) fail("LcpImpact: the scene is periodic; use an aperiodic one");
	if (stiffnessRows.empty()) fail("LcpImpact.stiffness is not set; give the stiffness of the logs' boundaries in N/m");
	bool after = false, found = false;
	for (const auto& each : on.engines) {
		if (each.get() == this) {
			after = true;
			continue;
		}
		if (const auto* newton = dynamic_cast<const NewtonIntegrator*>(each.get())) {
			if (!after) fail("LcpImpact stands after NewtonIntegrator; put it right before it in O.engines");
			if (newton->damping > 0.0)
				fail("NewtonIntegrator.damping is " + text(newton->damping) +
				     "; it must be 0 with LcpImpact, which predicts the motion of the step");
			if (newton->densityScaling) fail("NewtonIntegrator.densityScaling is on; it must be off with LcpImpact");
			if (newton->mask > 0)
				fail("NewtonIntegrator.mask is " + std::to_string(newton->mask) +
				     "; it must be -1 with LcpImpact, hold bodies by blockedDOFs");
			found = true;
			break;
		}
		if (after && (dynamic_cast<const FieldApplier*>(each.get()) || dynamic_cast<const InteractionLoop*>(each.get())))
			fail(each->getClassName() + " stands after LcpImpact; engines that add forces must stand before it in O.engines");
	}
	if (after && !found) fail("LcpImpact: O.engines has no NewtonIntegrator after it; add NewtonIntegrator(damping=0)");
}

void LcpImpact::gather(Gathered& all) {
	scene->forces.sync();
	const Vector3r gravity = lcp_impact::integrator(*scene).gravity;
	bool           first   = true;
	const auto     take    = [&](const Body& body, const Sphere& sphere) {
		const State&     state = *body.state;
		const Body::id_t id    = body.getId();
		if (body.isClump() || body.isClumpMember())
			fail(lcp_impact::logName(id) +
			     "belongs to a clump; LcpImpact knows single spheres only, leave it out by LcpImpact.mask or ids");
		impact::Body one;
		one.id       = id;
		one.radius   = sphere.radius;
		one.material = body.material ? body.material->id : -1;
		one.position = plain(state.pos);
		one.velocity = plain(state.vel);
		one.spin     = plain(state.angVel);
		all.materials.push_back(one.material);
		if (!body.isDynamic()) {
			one.mass = one.inertia = INFINITY;
			all.bodies.push_back(one);
			return;
		}
		if (body.isAspherical()) fail(lcp_impact::logName(id) + "is aspherical; set Body.aspherical to False");
		const int axis = lcp_impact::blockedAxis(state, id);
		if (!first && axis != all.axis)
			fail(lcp_impact::logName(id) + "has blockedDOFs '" + state.blockedDOFs_vec_get() +
			     "', others move in another plane or freely; all logs must be blocked alike");
		all.axis = axis;
		first    = false;
		if (!(state.mass > 0.0)) fail(lcp_impact::logName(id) + "has a mass of " + text(state.mass) + " kg; it must be > 0");
		one.mass       = state.mass;
		one.inertia    = lcp_impact::inertia(state, axis, id);
		Vector3r force = scene->forces.getForce(id) + state.mass * gravity;
		if (axis >= 0) force[axis] = 0.0;
		Vector3r torque = scene->forces.getTorque(id);
		for (int i = 0; i < 3; ++i)
			if (state.blockedDOFs & State::axisDOF(i, true)) torque[i] = 0.0;
		one.force  = plain(force);
		one.torque = plain(torque);
		all.bodies.push_back(one);
	};
	if (ids.empty()) {
		for (const auto& body : *scene->bodies) {
			const auto* sphere = body ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr;
			if (sphere && (mask == 0 || body->maskOk(mask))) take(*body, *sphere);
		}
	} else {
		std::vector<int> sorted = ids;
		std::sort(sorted.begin(), sorted.end());
		sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
		for (const int id : sorted) {
			const bool  there  = scene->bodies->exists(id);
			const auto* sphere = there ? dynamic_cast<const Sphere*>(Body::byId(id, scene)->shape.get()) : nullptr;
			if (!sphere)
				fail("LcpImpact.ids: body " + std::to_string(id) + (there ? " is no Sphere" : " does not exist") +
				     "; give ids of spheres");
			if (mask == 0 || Body::byId(id, scene)->maskOk(mask)) take(*Body::byId(id, scene), *sphere);
		}
	}
	std::sort(all.materials.begin(), all.materials.end());
	all.materials.erase(std::unique(all.materials.begin(), all.materials.end()), all.materials.end());
	for (auto& one : all.bodies)
		one.material = static_cast<int>(std::lower_bound(all.materials.begin(), all.materials.end(), one.material) -
		                                all.materials.begin());
}

impact::Settings LcpImpact::settings(const std::vector<int>& materials) const {
	const auto name = [&](int id) {
		return id < 0 ? std::string("a material that is not in O.materials") : "material " + std::to_string(id);
	};
	const auto one = [&](const std::vector<Real>& rows, int id, const char* what) {
		const Real* found = lcp_impact::byMaterial.find(rows, id);
		if (!found) fail(std::string("LcpImpact.") + what + " has no value for " + name(id) + "; add it to the dict");
		return *found;
	};
	const auto law = [&](const Real* friction) {
		impact::PairLaw pair;
		pair.tangential_stiffness_ratio = tangentialRatio;
		pair.contact_damping            = contactDamping;
		lcp_impact::setFriction(pair, friction);
		return pair;
	};
	const auto between = [&](int a, int b) {
		const Real* found = frictionRows.empty() ? lcp_impact::withoutFriction : lcp_impact::byPair.find(frictionRows, a, b);
		if (!found) fail("LcpImpact.friction has no value for " + name(a) + " and " + name(b) + "; add the pair to the dict");
		return found;
	};
	impact::Settings result;
	result.dt              = scene->dt;
	result.theta           = theta;
	result.friction_sweeps = sweeps;
	result.lcp.tolerance   = tolerance;
	result.lcp.method      = ::dembark::lcp_method(method);
	result.materials.clear();
	result.pairs.clear();
	for (const int a : materials) {
		result.materials.push_back(
			{one(stiffnessRows, a, "stiffness"), dampingRows.empty() ? 0.0 : one(dampingRows, a, "damping")});
		for (const int b : materials) result.pairs.push_back(law(between(a, b)));
	}
	for (std::size_t w = 0; w < wallList.size(); ++w) {
		const LogWall& wall = *wallList[w];
		if (wall.frictionRows.empty() && !frictionRows.empty() && frictionRows[0] >= 0.0)
			fail(lcp_impact::wallName(w, wall) +
			     " has no friction, and LcpImpact.friction is by pairs of materials; give the wall its own");
		result.add({wall.stiffness, 0.0}, law(wall.frictionRows.empty() ? between(-1, -1) : wall.frictionRows.data()));
	}
	return result;
}

void LcpImpact::prepare(const Gathered& all) {
	const impact::Settings now = settings(all.materials);
	if (system && now == system->settings()) return;
	// A change of any of it, O.dt too; the state is carried over.
	const std::vector<double> state = system ? system->state() : lcp_impact::decode(savedState);
	system                          = std::make_unique<impact::System>(now);
	if (!state.empty()) system->restore(state);
}

}  // namespace yade
