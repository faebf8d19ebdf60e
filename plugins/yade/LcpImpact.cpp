// LcpImpact: one step, from bodies to forces, its output, and the file of impacts.
#include <algorithm>
#include <cmath>

#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/Facet.hpp>
#include <pkg/common/Wall.hpp>

#include "CylinderWall.hpp"
#include "LcpImpactParts.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((LogWall)(LcpImpact)(LogImpact));

using dembark_yade::fail;
using dembark_yade::text;
namespace impact = ::dembark::impact;
using lcp_impact::eigen;
using lcp_impact::plain;

namespace lcp_impact {

/// Takes body number `place` of a wall.
void addShape(const Body& body, std::size_t place, const impact::Wall& common, const std::string& where, LcpImpact::Gathered& all) {
	const State&      state = *body.state;
	const std::string id    = std::to_string(body.getId());
	double            speed = state.vel.norm();
	if (body.isDynamic()) fail(where + ": body " + id + " can move freely; hold it by blockedDOFs = 'xyzXYZ'");
	if (const auto* flat = dynamic_cast<const Wall*>(body.shape.get())) {
		impact::Plane& plane              = all.planes.emplace_back();
		static_cast<impact::Wall&>(plane) = common;
		plane.point                       = plain(state.pos);
		plane.velocity                    = plain(state.vel);
		plane.normal                      = plain(Vector3r(Vector3r::Unit(flat->axis) * (flat->sense < 0 ? -1.0 : 1.0)));
		plane.two_sided                   = flat->sense == 0;
	} else if (const auto* round = dynamic_cast<const CylinderWall*>(body.shape.get())) {
		impact::Drum& drum               = all.drums.emplace_back();
		static_cast<impact::Wall&>(drum) = common;
		drum.point                       = plain(state.pos);
		drum.axis                        = plain(round->axis);
		drum.radius                      = round->radius;
		drum.velocity                    = plain(state.vel);
		drum.omega                       = state.angVel.dot(round->axis);  // its surface moves along itself
		if (!(drum.radius > 0.0)) fail(where + ": CylinderWall.radius of body " + id + " is not set; give it in m");
		if ((state.angVel - drum.omega * round->axis).norm() > 1e-9 * state.angVel.norm())
			fail(where + ": body " + id + " turns about another axis than its own; make angVel parallel to CylinderWall.axis");
	} else if (const auto* facet = dynamic_cast<const Facet*>(body.shape.get())) {
		if (place == 0) all.meshes.push_back({common, {}});
		::dembark::Triangle& triangle = all.meshes.back().triangles.emplace_back();
		triangle.id                   = static_cast<std::int64_t>(place);
		for (int i = 0; i < 3; ++i) {
			const Vector3r arm = state.ori * facet->vertices[i], velocity = state.vel + state.angVel.cross(arm);
			triangle.node[i]     = plain(Vector3r(state.pos + arm));
			triangle.velocity[i] = plain(velocity);
			speed                = std::max(speed, double(velocity.norm()));
		}
	} else {
		fail(where + ": body " + id + " is a " + body.shape->getClassName() + "; it must be a Wall, a CylinderWall or a Facet");
	}
	all.wallSpeed = std::max(all.wallSpeed, speed);
}

/// The body of YADE that a wall's contact belongs to.
Body::id_t bodyOfContact(const LogWall& wall, std::int64_t key) {
	const std::int64_t feature = -1 - key - impact::wall_number(key) * (std::int64_t(1) << 32);
	const std::size_t  place   = static_cast<std::size_t>(feature) / 8;
	return wall.bodies[place < wall.bodies.size() ? place : 0];
}

}  // namespace lcp_impact

void LcpImpact::gatherWalls(Gathered& all) {
	for (std::size_t w = 0; w < wallList.size(); ++w) {
		const LogWall&    wall  = *wallList[w];
		const std::string where = lcp_impact::wallName(w, wall);
		if (!(wall.stiffness > 0.0)) fail(where + ".stiffness is not set; give the local stiffness of the wall in N/m");
		if (wall.bodies.empty()) fail(where + ".bodies is empty; give the ids of the bodies that are the wall");
		impact::Wall common;
		common.id        = impact::wall_key(static_cast<std::int64_t>(w));
		common.material  = static_cast<int>(all.materials.size() + w);
		common.stiffness = wall.stiffness;
		for (std::size_t k = 0; k < wall.bodies.size(); ++k) {
			if (!scene->bodies->exists(wall.bodies[k]))
				fail(where + ".bodies: body " + std::to_string(wall.bodies[k]) + " does not exist");
			const Body& body = *Body::byId(wall.bodies[k], scene);
			if (wall.bodies.size() > 1 && !dynamic_cast<const Facet*>(body.shape.get()))
				fail(where +
				     ".bodies: a wall of several bodies must be all Facet; make each Wall and CylinderWall a wall of its "
				     "own");
			lcp_impact::addShape(body, k, common, where, all);
		}
	}
}

void LcpImpact::findContacts(const Gathered& all, double reach, std::vector<impact::Contact>& contacts) {
	pairs.find(all.bodies, reach, contacts);
	for (const impact::Plane& plane : all.planes) impact::plane_contacts(all.bodies, plane, reach, contacts);
	for (const impact::Drum& drum : all.drums) impact::cylinder_contacts(all.bodies, drum, reach, contacts);
	for (std::size_t k = 0; k < all.meshes.size(); ++k) triangles.find(all.bodies, all.meshes[k].wall, surfaces[k], reach, contacts);
	const auto held = [&](int i) { return i < 0 || std::isinf(all.bodies[i].mass); };
	const auto idle = [&](const impact::Contact& c) { return held(c.a) && held(c.b); };
	contacts.erase(std::remove_if(contacts.begin(), contacts.end(), idle), contacts.end());
	if (all.axis < 0) return;
	const auto partner = [&](const impact::Contact& c) {
		if (c.b >= 0) return "log " + std::to_string(c.key_b);
		const auto number = static_cast<std::size_t>(impact::wall_number(c.key_b));
		return lcp_impact::wallName(number, *wallList[number]);
	};
	for (const auto& c : contacts)
		if (std::abs(eigen(c.normal)[all.axis]) > 1e-9)
			fail("LcpImpact: log " + std::to_string(c.key_a) + " meets " + partner(c) +
			     " out of the plane it moves in; put all logs at one " + "xyz"[all.axis] + " and walls upright to that plane");
}

void LcpImpact::action() {
	check(*scene);
	Gathered all;
	gather(all);
	gatherWalls(all);
	const bool                           first = steps == 0 && velocityAtStart;
	std::vector<::dembark::Vec3<double>> force(all.bodies.size()), torque(all.bodies.size());
	try {
		prepare(all);
		surfaces.resize(all.meshes.size());
		for (std::size_t k = 0; k < surfaces.size(); ++k) surfaces[k].update(all.meshes[k].triangles);
		const auto search = [&](double reach, std::vector<impact::Contact>& contacts) { findContacts(all, reach, contacts); };
		report(system->step(all.bodies, search, all.wallSpeed, scene->time, first ? 0.5 : 1.0, force, torque));
	} catch (const std::exception& error) {
		if (std::string(error.what()).rfind("dembark: ", 0) == 0) throw;  // of the search for contacts
		fail(std::string("LcpImpact, step ") + std::to_string(scene->iter) + ": " + error.what());
	}
	if (first) moveBack(all, force, torque);
	for (std::size_t i = 0; i < all.bodies.size(); ++i) {
		scene->forces.addForce(static_cast<Body::id_t>(all.bodies[i].id), eigen(force[i]));
		scene->forces.addTorque(static_cast<Body::id_t>(all.bodies[i].id), eigen(torque[i]));
	}
	for (const auto& wall : wallList) wall->force = Vector3r::Zero();
	for (const auto& contact : system->contacts()) {
		if (contact.key_b >= 0) continue;
		LogWall&         wall = *wallList[impact::wall_number(contact.key_b)];
		const Body::id_t id   = lcp_impact::bodyOfContact(wall, contact.key_b);
		const Vector3r   on   = -(contact.normal_force * eigen(contact.normal) + eigen(contact.tangential));
		wall.force += on;
		scene->forces.addForce(id, on);
		scene->forces.addTorque(id, (eigen(contact.point) - Body::byId(id, scene)->state->pos).cross(on));
	}
	writeImpacts();
	if (scene->iter != lastIteration) ++steps;
	lastIteration = scene->iter;
}

void LcpImpact::report(const impact::StepReport& now) {
	contactCount     = now.contacts;
	activeCount      = now.active;
	impactsBegun     = now.impacts_begun;
	peakForce        = now.peak_force;
	impulseSum       = now.impulse_sum;
	dissipatedEnergy = now.dissipated_energy;
	elasticEnergy    = now.elastic_energy;
	pivots           = now.pivots;
	blockSteps       = now.block_steps;
	pivotsTotal      = now.pivots_total;
	certificate      = now.certificate;
	worstCertificate = now.worst_certificate;
	highestForce     = now.peak_force_so_far;
}

void LcpImpact::moveBack(const Gathered& all, const std::vector<::dembark::Vec3<double>>& force,
                         const std::vector<::dembark::Vec3<double>>& torque) const {
	for (std::size_t i = 0; i < all.bodies.size(); ++i) {
		const impact::Body& log = all.bodies[i];
		if (std::isinf(log.mass)) continue;
		State&         state = *Body::byId(static_cast<Body::id_t>(log.id), scene)->state;
		const Vector3r f = eigen(log.force) + eigen(force[i]), t = eigen(log.torque) + eigen(torque[i]);
		for (int k = 0; k < 3; ++k) {
			if (!(state.blockedDOFs & State::axisDOF(k))) state.vel[k] -= 0.5 * scene->dt * f[k] / state.mass;
			if (!(state.blockedDOFs & State::axisDOF(k, true))) state.angVel[k] -= 0.5 * scene->dt * t[k] / state.inertia[k];
		}
	}
}

void LcpImpact::writeImpacts() {
	const std::vector<impact::Impact> ended = system->take_finished();
	if (impactsFile.empty()) return;
	try {
		if (file.path() != impactsFile) {
			// Going on from a saved scene: lines that the run wrote after saving will come again.
			if (writtenFile == impactsFile && writtenBytes > 0) file.resume(impactsFile, writtenBytes);
			else file.begin(impactsFile, "");
		}
		file.append(ended);
	} catch (const std::runtime_error& error) {
		fail(std::string("LcpImpact.impactsFile: ") + error.what(), 1);
	}
	writtenFile  = impactsFile;
	writtenBytes = file.bytes();
}

boost::python::list LcpImpact::contacts() const {
	boost::python::list result;
	if (system)
		for (const auto& c : system->contacts())
			result.append(boost::python::make_tuple(c.key_a, impact::shown_id(c.key_b), eigen(c.normal), c.gap, c.normal_force,
			                                        eigen(c.tangential), eigen(c.point)));
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
