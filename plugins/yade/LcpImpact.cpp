// LcpImpact: one step, from bodies to forces, its output, and the file of impacts.
#include "LcpImpact.hpp"

#include <algorithm>
#include <cmath>

#include <core/Scene.hpp>
#include <pkg/common/Facet.hpp>
#include <pkg/common/FieldApplier.hpp>
#include <pkg/common/Sphere.hpp>
#include <pkg/common/Wall.hpp>

#include "Capsule.hpp"
#include "ContactView.hpp"
#include "CylinderWall.hpp"
#include "SavedNumbers.hpp"
#include "engine_access.hpp"
#include "engine_order.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((LogWall)(LcpImpact));

using dembark_yade::fail;
using dembark_yade::text;
using dembark_yade::vec;
namespace impact = ::dembark::impact;

namespace lcp_impact {

constexpr int unknown = -2;  // plane of the logs
std::string   logName(Body::id_t id) { return "LcpImpact: log " + std::to_string(id) + " "; }

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

/// As blockedAxis(), of a capsule, which NewtonIntegrator must not turn.
int freeCapsule(const State& state, Body::id_t id) {
	if (state.blockedDOFs != State::DOF_RXRYRZ)
		fail(logName(id) + "is a Capsule and has blockedDOFs '" + state.blockedDOFs_vec_get() +
		     "'; it must be 'XYZ' (LcpImpact turns it) or 'xyzXYZ' (held)");
	return -1;
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

using lcp_impact::logName;

std::string LcpImpact::wallName(std::size_t number) const {
	const std::string& name = wallList[number]->name;
	return "LcpImpact.walls[" + std::to_string(number) + "]" + (name.empty() ? "" : " '" + name + "'");
}

/// The NewtonIntegrator of the scene; refuses engines in an order or with settings for which the forces would be wrong.
const NewtonIntegrator& LcpImpact::integrator() const {
	const NewtonIntegrator& newton = dembark_yade::undampedIntegratorAfter(*this, *scene);
	if (newton.mask > 0)
		fail("NewtonIntegrator.mask is " + std::to_string(newton.mask) +
		     "; it must be -1 with LcpImpact, hold bodies by blockedDOFs");
	bool after = false;
	for (const auto& each : scene->engines) {
		if (each.get() == &newton) break;
		after = after || each.get() == this;
		if (after && !each->dead && dynamic_cast<const FieldApplier*>(each.get()))
			fail(each->getClassName() + " stands after LcpImpact; engines that add forces must stand before it in O.engines");
	}
	return newton;
}

/// A sphere as the model sees it, with YADE's id of its material and without forces.
impact::Body LcpImpact::logOf(const Body& body) {
	const State&     state = *body.state;
	const Body::id_t id    = body.getId();
	if (body.isClump() || body.isClumpMember())
		fail(logName(id) + "belongs to a clump; LcpImpact knows single spheres only, leave it out by LcpImpact.mask or ids");
	impact::Body      log{id,
	                      INFINITY,
	                      INFINITY,
	                      static_cast<const Sphere&>(*body.shape).radius,
	                      body.material ? body.material->id : -1,
	                      vec(state.pos),
	                      vec(state.vel),
	                      vec(state.angVel)};
	const auto* const capsule = dynamic_cast<const Capsule*>(body.shape.get());
	if (body.isDynamic()) {
		if (body.isAspherical() && !capsule) fail(logName(id) + "is aspherical; set Body.aspherical to False");
		const int axis = capsule ? lcp_impact::freeCapsule(state, id) : lcp_impact::blockedAxis(state, id);
		if (plane != lcp_impact::unknown && axis != plane)
			fail(logName(id) + "has blockedDOFs '" + state.blockedDOFs_vec_get() +
			     "', others move in another plane or freely; all logs must be blocked alike");
		plane = axis;
		if (!(state.mass > 0.0)) fail(logName(id) + "has a mass of " + text(state.mass) + " kg; it must be > 0");
		log.mass = state.mass;
		if (!capsule) log.inertia = lcp_impact::inertia(state, axis, id);
	}
	if (capsule) layCapsule(state, capsule->length, log);
	return log;
}

/// The attitude of a capsule, which is to be the next of `logs`. Its angular momentum is that of the last step or, where its spin is not,
/// that of the spin.
void LcpImpact::layCapsule(const State& state, Real length, impact::Body& log) {
	const Quaternionr& q = state.ori;
	impact::Attitude   attitude{length, {q.w(), q.x(), q.y(), q.z()}, vec(state.angMom)};
	attitude.shape(log);
	if (std::isinf(log.mass)) return;
	const auto last =
		std::lower_bound(turned.begin(), turned.end(), log.id, [](const Turned& one, std::int64_t id) { return one.id < id; });
	if (last == turned.end() || last->id != log.id || vec(last->spin) != state.angVel) attitude.begin(log);
	else if (scene->iter == lastIteration) attitude.momentum = last->momentum;
	attitude.spin(log);
	capsules.push_back({logs.size(), attitude});
}

/// Fills `logs` and `materials`.
void LcpImpact::gatherLogs(const Vector3r& gravity) {
	scene->forces.sync();
	logs.clear();
	capsules.clear();
	materials.clear();
	plane           = lcp_impact::unknown;
	const auto take = [&](const Body& body) {
		if (mask != 0 && !body.maskOk(mask)) return;
		impact::Body& log = logs.emplace_back(logOf(body));
		materials.push_back(log.material);
		if (std::isinf(log.mass)) return;
		Vector3r force  = scene->forces.getForce(body.getId()) + body.state->mass * gravity;
		Vector3r torque = scene->forces.getTorque(body.getId());
		if (plane >= 0) force[plane] = 0.0;
		const bool turns = !capsules.empty() && capsules.back().log + 1 == logs.size();
		for (int i = 0; i < 3; ++i)
			if (!turns && (body.state->blockedDOFs & State::axisDOF(i, true))) torque[i] = 0.0;
		log.force  = vec(force);
		log.torque = vec(torque);
	};
	const auto isSphere = [](const shared_ptr<Body>& body) { return body && dynamic_cast<const Sphere*>(body->shape.get()); };
	if (ids.empty())
		for (const auto& body : *scene->bodies)
			if (isSphere(body)) take(*body);
	std::vector<int> sorted = ids;
	std::sort(sorted.begin(), sorted.end());
	sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
	for (const int id : sorted) {
		const bool there = scene->bodies->exists(id);
		if (!there || !isSphere(Body::byId(id, scene)))
			fail("LcpImpact.ids: body " + std::to_string(id) + (there ? " is no Sphere" : " does not exist") +
			     "; give ids of spheres");
		take(*Body::byId(id, scene));
	}
	std::sort(materials.begin(), materials.end());
	materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
	for (auto& log : logs)
		log.material = static_cast<int>(std::lower_bound(materials.begin(), materials.end(), log.material) - materials.begin());
}

/// Adds a body of a wall to the surroundings; of a Facet the triangle to `mesh`.
void LcpImpact::addShape(const Body& body, const impact::Wall& wall, std::vector<::dembark::Triangle>& mesh) {
	const State&      state = *body.state;
	const std::string where = wallName(impact::wall_number(wall.id)), id = std::to_string(body.getId());
	if (body.isDynamic()) fail(where + ": body " + id + " can move freely; hold it by blockedDOFs = 'xyzXYZ'");
	// So that its surface moves along itself.
	const auto about = [&](const Vector3r& axis, const char* what) {
		const double omega = state.angVel.dot(axis);
		if ((state.angVel - omega * axis).norm() > 1e-9 * state.angVel.norm())
			fail(where + ": body " + id + " turns about another axis than its own; make angVel parallel to " + what);
		return omega;
	};
	if (const auto* flat = dynamic_cast<const Wall*>(body.shape.get())) {
		const Vector3r normal = Vector3r::Unit(flat->axis) * (flat->sense < 0 ? -1.0 : 1.0);
		const double   omega  = about(normal, "its normal");
		if (plane >= 0 && omega != 0.0)
			fail(where + ": body " + id + " turns, and carries logs out of the plane they move in; set its angVel to 0");
		around.planes.push_back({wall, vec(state.pos), vec(normal), vec(state.vel), omega, flat->sense == 0});
	} else if (const auto* round = dynamic_cast<const CylinderWall*>(body.shape.get())) {
		const double omega = about(round->axis, "CylinderWall.axis");
		if (!(round->radius > 0.0)) fail(where + ": CylinderWall.radius of body " + id + " is not set; give it in m");
		around.drums.push_back({wall, vec(state.pos), vec(round->axis), round->radius, omega, vec(state.vel)});
	} else if (const auto* facet = dynamic_cast<const Facet*>(body.shape.get())) {
		::dembark::Triangle triangle;
		triangle.id = static_cast<std::int64_t>(mesh.size());
		for (int i = 0; i < 3; ++i) {
			const Vector3r arm   = state.ori * facet->vertices[i];
			triangle.node[i]     = vec(Vector3r(state.pos + arm));
			triangle.velocity[i] = vec(Vector3r(state.vel + state.angVel.cross(arm)));
		}
		mesh.push_back(triangle);
	} else {
		fail(where + ": body " + id + " is a " + body.shape->getClassName() + "; it must be a Wall, a CylinderWall or a Facet");
	}
}

void LcpImpact::gatherWalls() {
	around.planes.clear();
	around.drums.clear();
	std::size_t meshes = 0;  // a mesh keeps what it knows of its triangles
	for (std::size_t w = 0; w < wallList.size(); ++w) {
		const LogWall&                   wall = *wallList[w];
		std::vector<::dembark::Triangle> mesh;
		if (!(wall.stiffness > 0.0)) fail(wallName(w) + ".stiffness is not set; give the local stiffness of the wall in N/m");
		if (wall.bodies.empty()) fail(wallName(w) + ".bodies is empty; give the ids of the bodies that are the wall");
		const impact::Wall common{impact::wall_key(static_cast<std::int64_t>(w)), static_cast<int>(materials.size() + w),
		                          wall.stiffness};
		for (const Body::id_t id : wall.bodies) {
			if (!scene->bodies->exists(id)) fail(wallName(w) + ".bodies: body " + std::to_string(id) + " does not exist");
			const Body& body = *Body::byId(id, scene);
			if (wall.bodies.size() > 1 && !dynamic_cast<const Facet*>(body.shape.get()))
				fail(wallName(w) +
				     ".bodies: a wall of several bodies must be all Facet; make each Wall and CylinderWall a wall of its "
				     "own");
			addShape(body, common, mesh);
		}
		if (mesh.empty()) continue;
		const auto capsule = std::find_if(logs.begin(), logs.end(), impact::has_length);
		if (capsule != logs.end())
			fail(wallName(w) + ": a Facet is for logs without a length, and log " + std::to_string(capsule->id) +
			     " has one; use Wall and CylinderWall");
		if (around.meshes.size() == meshes) around.meshes.emplace_back();
		static_cast<impact::Wall&>(around.meshes[meshes]) = common;
		around.meshes[meshes++].update(std::move(mesh));
	}
	around.meshes.resize(meshes);
}

void LcpImpact::findContacts(double reach, std::vector<impact::Contact>& contacts) {
	around.find(logs, reach, contacts);
	impact::leave_out_held(logs, contacts);
	if (plane < 0) return;
	for (const auto& c : contacts) {
		if (std::abs(vec(c.normal)[plane]) <= 1e-9) continue;
		const std::string partner = c.b >= 0 ? "log " + std::to_string(c.key_b) : wallName(impact::wall_number(c.key_b));
		fail(logName(c.key_a) + "meets " + partner + " out of the plane it moves in; put all logs at one " + "xyz"[plane] +
		     " and walls upright to that plane");
	}
}

/// Logs that overlap must not begin.
void LcpImpact::checkStart() {
	std::vector<impact::Contact> contacts;
	findContacts(0.0, contacts);
	const std::string wrong =
		impact::start_error(logs, contacts, "log", [&](std::int64_t wall) { return wallName(std::size_t(wall)); });
	if (!wrong.empty()) fail("LcpImpact: " + wrong);
}

/// Makes the model, anew where anything about it has changed, O.dt too; the state is carried over.
void LcpImpact::prepare() {
	const impact::Settings now = settings();
	if (system && ::dembark::to_numbers(now) == ::dembark::to_numbers(system->settings())) return;
	if (judgedDt != now.dt) {
		judgedDt                   = now.dt;
		const std::string doubtful = impact::step_warning(now, logs, around);
		if (!doubtful.empty()) dembark_yade::warn("LcpImpact: " + doubtful);
	}
	const std::vector<double> state = system ? system->state() : loaded;
	auto                      fresh = std::make_unique<impact::System>(now);
	if (!state.empty()) fresh->restore(state);
	system = std::move(fresh);
}

void LcpImpact::action() {
	dembark_yade::keepThreadState();
	if (stiffnessRows.empty()) fail("LcpImpact.stiffness is not set; give the stiffness of the logs' boundaries in N/m");
	const bool first = steps == 0 && velocityAtStart;
	try {
		if (!system && loaded.empty() && !savedState.empty()) {
			::dembark::Archive saved(dembark_yade::decode(savedState));
			archive(saved);
		}
		gatherLogs(integrator().gravity);
		gatherWalls();
		prepare();
		if (!system->begun()) checkStart();
		const auto search = [&](double reach, std::vector<impact::Contact>& contacts) { findContacts(reach, contacts); };
		auto       report = system->step(logs, search, around.wall_speed(), scene->time, first ? 0.5 : 1.0);
		std::tie(contactCount, activeCount, impactsBegun, peakForce, impulseSum, dissipatedEnergy, elasticEnergy, pivots,
		         blockSteps, pivotsTotal, certificate, worstCertificate, highestForce) = report.fields();
	} catch (const std::exception& error) {
		if (std::string(error.what()).rfind("dembark: ", 0) == 0) throw;
		fail(std::string("LcpImpact, step ") + std::to_string(scene->iter) + ": " + error.what());
	}
	writeImpacts();
	if (first) moveBack();
	turnCapsules(first ? 0.5 : 1.0);
	for (std::size_t i = 0; i < logs.size(); ++i) {
		scene->forces.addForce(static_cast<Body::id_t>(logs[i].id), vec(system->wrenches()[i].force));
		scene->forces.addTorque(static_cast<Body::id_t>(logs[i].id), vec(system->wrenches()[i].torque));
	}
	pushWalls();
	if (scene->iter != lastIteration) ++steps;
	lastIteration = scene->iter;
}

/// Velocities of the full step to those of half a step before.
void LcpImpact::moveBack() const {
	for (std::size_t i = 0; i < logs.size(); ++i) {
		if (std::isinf(logs[i].mass)) continue;
		State&         state = *Body::byId(static_cast<Body::id_t>(logs[i].id), scene)->state;
		const Vector3r f     = vec(logs[i].force) + vec(system->wrenches()[i].force);
		const Vector3r t     = vec(logs[i].torque) + vec(system->wrenches()[i].torque);
		for (int k = 0; k < 3; ++k) {
			if (!(state.blockedDOFs & State::axisDOF(k))) state.vel[k] -= 0.5 * scene->dt * f[k] / state.mass;
			if (!(state.blockedDOFs & State::axisDOF(k, true))) state.angVel[k] -= 0.5 * scene->dt * t[k] / state.inertia[k];
		}
	}
}

/// The capsules turn freely until the next step, with the spin that leads NewtonIntegrator there.
void LcpImpact::turnCapsules(double kick) {
	turned.clear();
	for (auto& [i, attitude] : capsules) {
		const impact::Body&     log    = logs[i];
		const shared_ptr<Body>& body   = Body::byId(static_cast<Body::id_t>(log.id), scene);
		const auto              gain   = scene->dt * (log.torque + system->wrenches()[i].torque);
		const auto              before = attitude.momentum - (1.0 - kick) * gain;
		attitude.momentum += kick * gain;
		State& state  = *body->state;
		state.angMom  = vec(attitude.momentum);
		state.angVel  = vec(attitude.mean_spin(log, scene->dt));
		state.inertia = Vector3r(log.inertia, log.inertia, log.axial_inertia);
		body->setAspherical(true);
		turned.push_back({log.id, before, vec(state.angVel)});
	}
}

/// The forces of the logs on the bodies of the walls.
void LcpImpact::pushWalls() {
	for (const auto& wall : wallList) wall->force = Vector3r::Zero();
	for (const auto& contact : system->contacts()) {
		if (contact.key_b >= 0) continue;
		LogWall&          wall = *wallList[impact::wall_number(contact.key_b)];
		const std::size_t body = static_cast<std::size_t>(impact::wall_feature(contact.key_b)) / 8;  // of a mesh, the triangle
		const Body::id_t  id   = wall.bodies[body < wall.bodies.size() ? body : 0];
		const Vector3r    on   = -(contact.normal_force * vec(contact.normal) + vec(contact.tangential));
		wall.force += on;
		scene->forces.addForce(id, on);
		scene->forces.addTorque(id, (vec(contact.point) - Body::byId(id, scene)->state->pos).cross(on));
	}
}

/// What saved scenes keep: the state of the model, and where its file of impacts ends.
void LcpImpact::archive(::dembark::Archive& a) {
	::dembark::FormatVersion format{4.0};
	std::vector<double>      state = a.reading() ? std::vector<double>() : system->state();
	a.all(std::tie(format, state, file, turned));
	a.end();
	if (a.reading()) loaded = std::move(state);
}

void LcpImpact::preSave(LcpImpact&) {
	if (!system) return;
	::dembark::Archive out;
	archive(out);
	savedState = dembark_yade::encode(out.numbers());
}

void LcpImpact::writeImpacts() {
	const std::vector<impact::Impact> ended = system->take_finished();
	std::vector<std::string>          names;
	for (const auto& wall : wallList) names.push_back(wall->name);
	try {
		file.open(impactsFile, impact::wall_legend(names));
		file.append(ended);
	} catch (const std::runtime_error& error) {
		fail(std::string("LcpImpact.impactsFile: ") + error.what(), 1);
	}
}

boost::python::list LcpImpact::contacts() const {
	boost::python::list result;
	if (system)
		for (const auto& c : system->contacts())
			result.append(boost::python::make_tuple(c.key_a, impact::shown_id(c.key_b), vec(c.normal), c.gap, c.normal_force,
			                                        vec(c.tangential), vec(c.point)));
	return result;
}

Vector3r LcpImpact::wallForce(const std::string& name) const {
	std::string known;
	for (const auto& wall : wallList) {
		if (wall->name == name) return wall->force;
		known += (known.empty() ? "" : ", ") + wall->name;
	}
	fail("LcpImpact.wallForce: no wall has the name '" + name + "'; there are: " + known);
}

}  // namespace yade
