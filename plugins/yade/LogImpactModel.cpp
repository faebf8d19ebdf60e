// LogImpact: its checks, the logs of a step, and the model with its parameters and its saved state.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include <core/InteractionLoop.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/FieldApplier.hpp>
#include <pkg/common/Sphere.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "LogImpactParts.hpp"
#include "report.hpp"

namespace yade {

using dembark_yade::fail;
using dembark_yade::text;
using log_impact::eigen;
using log_impact::plain;
namespace impact = ::dembark::impact;

namespace log_impact {

/// Numbers as hexadecimal digits of their bits: every archive of YADE keeps them, XML too.
std::string encode(const std::vector<double>& numbers) {
	std::string text;
	char        digits[17];
	for (const double x : numbers) {
		std::uint64_t bits;
		std::memcpy(&bits, &x, sizeof bits);
		std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(bits));
		text += digits;
	}
	return text;
}

std::vector<double> decode(const std::string& text) {
	std::vector<double> numbers;
	for (std::size_t i = 0; i + 16 <= text.size(); i += 16) {
		const std::uint64_t bits = std::stoull(text.substr(i, 16), nullptr, 16);
		double              x;
		std::memcpy(&x, &bits, sizeof x);
		numbers.push_back(x);
	}
	return numbers;
}

const NewtonIntegrator& integrator(const Scene& scene) {
	for (const auto& each : scene.engines)
		if (const auto* found = dynamic_cast<const NewtonIntegrator*>(each.get())) return *found;
	fail("LogImpact: O.engines has no NewtonIntegrator; put one after LogImpact");
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

}  // namespace log_impact

void LogImpact::postLoad(LogImpact&) {
	const auto least = [&](const char* name, double value, double low, bool open, const char* must) {
		if (!std::isfinite(value) || value < low || (open && value == low))
			fail(std::string("LogImpact.") + name + " is " + text(value) + "; it must be " + must);
	};
	least("contactDamping", contactDamping, 0.0, false, ">= 0 N s/m");
	least("theta", theta, 0.5, false, "in 0.5...1");
	if (theta > 1.0) fail("LogImpact.theta is " + text(theta) + "; it must be in 0.5...1");
	least("tangentialRatio", tangentialRatio, 0.0, true, "> 0");
	least("tolerance", tolerance, 0.0, true, "> 0");
	if (sweeps < 1) fail("LogImpact.sweeps is " + std::to_string(sweeps) + "; it must be >= 1");
	try {
		::dembark::lcp_method(method);
	} catch (const std::invalid_argument&) {
		fail("LogImpact.method is '" + method + "'; it must be auto, energy, block, murty or pgs");
	}
}

void LogImpact::preSave(LogImpact&) {
	if (system) savedState = log_impact::encode(system->state());
}

void LogImpact::check(const Scene& on) const {
	if (on.isPeriodic) fail("LogImpact: the scene is periodic; use an aperiodic one");
	if (stiffnessRows.empty()) fail("LogImpact.stiffness is not set; give the stiffness of the logs' boundaries in N/m");
	bool after = false, found = false;
	for (const auto& each : on.engines) {
		if (each.get() == this) {
			after = true;
			continue;
		}
		if (const auto* newton = dynamic_cast<const NewtonIntegrator*>(each.get())) {
			if (!after) fail("LogImpact stands after NewtonIntegrator; put it right before it in O.engines");
			if (newton->damping > 0.0)
				fail("NewtonIntegrator.damping is " + text(newton->damping) +
				     "; it must be 0 with LogImpact, which predicts the motion of the step");
			if (newton->densityScaling) fail("NewtonIntegrator.densityScaling is on; it must be off with LogImpact");
			if (newton->mask > 0)
				fail("NewtonIntegrator.mask is " + std::to_string(newton->mask) +
				     "; it must be -1 with LogImpact, hold bodies by blockedDOFs");
			found = true;
			break;
		}
		if (after && (dynamic_cast<const FieldApplier*>(each.get()) || dynamic_cast<const InteractionLoop*>(each.get())))
			fail(each->getClassName() + " stands after LogImpact; engines that add forces must stand before it in O.engines");
	}
	if (after && !found) fail("LogImpact: O.engines has no NewtonIntegrator after it; add NewtonIntegrator(damping=0)");
}

void LogImpact::gather(Gathered& all) {
	scene->forces.sync();
	const Vector3r gravity = log_impact::integrator(*scene).gravity;
	bool           first   = true;
	const auto     take    = [&](const Body& body, const Sphere& sphere) {
		const State&     state = *body.state;
		const Body::id_t id    = body.getId();
		if (body.isClump() || body.isClumpMember())
			fail(log_impact::logName(id) +
			     "belongs to a clump; LogImpact knows single spheres only, leave it out by LogImpact.mask or ids");
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
		if (body.isAspherical()) fail(log_impact::logName(id) + "is aspherical; set Body.aspherical to False");
		const int axis = log_impact::blockedAxis(state, id);
		if (!first && axis != all.axis)
			fail(log_impact::logName(id) + "has blockedDOFs '" + state.blockedDOFs_vec_get() +
			     "', others move in another plane or freely; all logs must be blocked alike");
		all.axis = axis;
		first    = false;
		if (!(state.mass > 0.0)) fail(log_impact::logName(id) + "has a mass of " + text(state.mass) + " kg; it must be > 0");
		one.mass       = state.mass;
		one.inertia    = log_impact::inertia(state, axis, id);
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
				fail("LogImpact.ids: body " + std::to_string(id) + (there ? " is no Sphere" : " does not exist") +
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

impact::Settings LogImpact::settings(const std::vector<int>& materials) const {
	const auto name = [&](int id) {
		return id < 0 ? std::string("a material that is not in O.materials") : "material " + std::to_string(id);
	};
	const auto one = [&](const std::vector<Real>& rows, int id, const char* what) {
		for (std::size_t i = 0; i + 1 < rows.size(); i += 2)
			if (rows[i] < 0.0 || rows[i] == id) return rows[i + 1];
		fail(std::string("LogImpact.") + what + " has no value for " + name(id) + "; add it to the dict");
	};
	static const Real none[6] = {0.0, 0.0, 0.0, ::dembark::unlimited_strength, 0.0, 0.0};
	const auto        between = [&](int a, int b) -> const Real* {
		if (frictionRows.empty()) return none;
		for (std::size_t i = 0; i + 8 <= frictionRows.size(); i += 8) {
			const Real x = frictionRows[i], y = frictionRows[i + 1];
			if (x < 0.0 || (x == a && y == b) || (x == b && y == a)) return &frictionRows[i + 2];
		}
		fail("LogImpact.friction has no value for " + name(a) + " and " + name(b) + "; add the pair to the dict");
	};
	const auto withWall = [&](std::size_t number) -> const Real* {
		const LogWall& wall = *wallList[number];
		if (!wall.frictionRows.empty()) return wall.frictionRows.data();
		if (frictionRows.empty()) return none;
		if (frictionRows[0] < 0.0) return &frictionRows[2];
		fail(log_impact::wallName(number, wall) +
		     " has no friction, and LogImpact.friction is by pairs of materials; give the wall its own");
	};
	// Each wall is a material of its own, after those of the logs.
	const std::size_t logs = materials.size(), n = logs + wallList.size();
	impact::Settings  result;
	result.dt              = scene->dt;
	result.theta           = theta;
	result.friction_sweeps = sweeps;
	result.lcp.tolerance   = tolerance;
	result.lcp.method      = ::dembark::lcp_method(method);
	result.materials.resize(n);
	result.pairs.resize(n * n);
	for (std::size_t i = 0; i < n; ++i) {
		const bool log                = i < logs;
		result.materials[i].stiffness = log ? one(stiffnessRows, materials[i], "stiffness") : wallList[i - logs]->stiffness;
		result.materials[i].damping   = log && !dampingRows.empty() ? one(dampingRows, materials[i], "damping") : 0.0;
		for (std::size_t j = 0; j < n; ++j) {
			impact::PairLaw& law                  = result.pairs[i * n + j];
			law.tangential_stiffness_ratio        = tangentialRatio;
			law.contact_damping                   = contactDamping;
			const std::size_t last                = std::max(i, j);
			const Real*       six                 = last < logs ? between(materials[i], materials[j]) : withWall(last - logs);
			law.friction.static_friction          = six[0];
			law.friction.kinetic_friction         = six[1];
			law.friction.critical_slip_distance   = six[2];
			law.friction.interface_shear_strength = six[3];
			law.friction.healing_time             = six[4];
			law.contact_area                      = six[5];
		}
	}
	return result;
}

void LogImpact::prepare(const Gathered& all) {
	// Everything that the model is built from, so that a change of any of it, O.dt too, is seen; its state is carried over.
	std::vector<double> from{scene->dt,       theta,          tolerance,         double(sweeps),
	                         tangentialRatio, contactDamping, double(method[0]), double(all.materials.size())};
	from.insert(from.end(), all.materials.begin(), all.materials.end());
	for (const auto* rows : {&stiffnessRows, &dampingRows, &frictionRows}) {
		from.push_back(rows->size());
		from.insert(from.end(), rows->begin(), rows->end());
	}
	for (const auto& wall : wallList) {
		from.push_back(wall->stiffness);
		from.push_back(wall->frictionRows.size());
		from.insert(from.end(), wall->frictionRows.begin(), wall->frictionRows.end());
	}
	if (system && from == builtFrom) return;
	const std::vector<double> state = system ? system->state() : log_impact::decode(savedState);
	system                          = std::make_unique<impact::System>(settings(all.materials));
	if (!state.empty()) system->restore(state);
	builtFrom = from;
}

}  // namespace yade
