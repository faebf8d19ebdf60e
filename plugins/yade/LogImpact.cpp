// LogImpact: one step, from bodies to forces, its output, and the file of impacts.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/Facet.hpp>
#include <pkg/common/Wall.hpp>

#include "CylinderWall.hpp"
#include "LogImpactParts.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((LogWall)(LogImpact));

using dembark_yade::fail;
using dembark_yade::text;
namespace impact = ::dembark::impact;
using log_impact::eigen;
using log_impact::plain;

namespace log_impact {

void addShape(const Body& body, std::size_t place, const impact::Wall& common, const std::string& where, WallShapes& shapes) {
	const State&     state = *body.state;
	const Body::id_t id    = body.getId();
	if (body.isDynamic()) fail(where + ": body " + std::to_string(id) + " can move freely; hold it by blockedDOFs = 'xyzXYZ'");
	if (const auto* flat = dynamic_cast<const Wall*>(body.shape.get())) {
		impact::Plane plane;
		static_cast<impact::Wall&>(plane) = common;
		plane.point                       = plain(state.pos);
		plane.velocity                    = plain(state.vel);
		plane.normal                      = plain(Vector3r(Vector3r::Unit(flat->axis) * (flat->sense < 0 ? -1.0 : 1.0)));
		shapes.planes.push_back(plane);
		shapes.twoSided.push_back(flat->sense == 0);
		shapes.speed = std::max(shapes.speed, double(state.vel.norm()));
	} else if (const auto* round = dynamic_cast<const CylinderWall*>(body.shape.get())) {
		impact::Drum drum;
		static_cast<impact::Wall&>(drum) = common;
		drum.point                       = plain(state.pos);
		drum.axis                        = plain(round->axis);
		drum.radius                      = round->radius;
		drum.velocity                    = plain(state.vel);
		drum.omega                       = state.angVel.dot(round->axis);
		if (!(drum.radius > 0.0)) fail(where + ": CylinderWall.radius of body " + std::to_string(id) + " is not set; give it in m");
		if ((state.angVel - drum.omega * round->axis).norm() > 1e-9 * state.angVel.norm())
			fail(where + ": body " + std::to_string(id) +
			     " turns about another axis than its own; make angVel parallel to CylinderWall.axis");
		shapes.drums.push_back(drum);
		shapes.speed = std::max(shapes.speed, double(state.vel.norm()));  // turning, its surface moves along itself
	} else if (const auto* facet = dynamic_cast<const Facet*>(body.shape.get())) {
		impact::Triangle triangle;
		triangle.id = static_cast<std::int64_t>(place);
		for (int i = 0; i < 3; ++i) {
			const Vector3r arm = state.ori * facet->vertices[i], velocity = state.vel + state.angVel.cross(arm);
			triangle.node[i]     = plain(Vector3r(state.pos + arm));
			triangle.velocity[i] = plain(velocity);
			shapes.speed         = std::max(shapes.speed, double(velocity.norm()));
		}
		shapes.triangles.push_back(triangle);
	} else {
		fail(where + ": body " + std::to_string(id) + " is a " + body.shape->getClassName() +
		     "; it must be a Wall, a CylinderWall or a Facet");
	}
}

/// The body of YADE that a wall's contact belongs to.
Body::id_t bodyOfContact(const LogWall& wall, std::int64_t key) {
	const std::int64_t feature = -1 - key - impact::wall_number(key) * (std::int64_t(1) << 32);
	const std::size_t  place   = static_cast<std::size_t>(feature) / 8;
	return wall.bodies[place < wall.bodies.size() ? place : 0];
}

/// What a user sees of a key: the id of a body, or -1, -2, ... for the first, second, ... wall.
long shownId(std::int64_t key) { return key >= 0 ? static_cast<long>(key) : -1 - static_cast<long>(impact::wall_number(key)); }

}  // namespace log_impact

void LogImpact::gatherWalls(Gathered& all) {
	all.walls.resize(wallList.size());
	for (std::size_t w = 0; w < wallList.size(); ++w) {
		const LogWall&    wall  = *wallList[w];
		const std::string where = log_impact::wallName(w, wall);
		if (!(wall.stiffness > 0.0)) fail(where + ".stiffness is not set; give the local stiffness of the wall in N/m");
		if (wall.bodies.empty()) fail(where + ".bodies is empty; give the ids of the bodies that are the wall");
		impact::Wall& common = all.walls[w].common;
		common.id            = impact::wall_key(static_cast<std::int64_t>(w));
		common.material      = static_cast<int>(all.materials.size() + w);
		common.stiffness     = wall.stiffness;
		for (std::size_t k = 0; k < wall.bodies.size(); ++k) {
			if (!scene->bodies->exists(wall.bodies[k]))
				fail(where + ".bodies: body " + std::to_string(wall.bodies[k]) + " does not exist");
			log_impact::addShape(*Body::byId(wall.bodies[k], scene), k, common, where, all.walls[w]);
		}
		if (wall.bodies.size() > 1 && all.walls[w].triangles.size() != wall.bodies.size())
			fail(where +
			     ".bodies: a wall of several bodies must be all Facet; make each Wall and CylinderWall a wall of its own");
		all.wallSpeed = std::max(all.wallSpeed, all.walls[w].speed);
	}
}

void LogImpact::findContacts(const Gathered& all, double reach, std::vector<impact::Contact>& contacts) {
	pairs.find(all.bodies, reach, contacts);
	for (const log_impact::WallShapes& shapes : all.walls) {
		for (std::size_t k = 0; k < shapes.planes.size(); ++k) {
			impact::Plane plane = shapes.planes[k];
			if (!shapes.twoSided[k]) {
				impact::plane_contacts(all.bodies, plane, reach, contacts);
				continue;
			}
			// Both sides are solid: each log meets the side that its centre is on.
			for (int side = 0; side < 2; ++side, plane.normal = -plane.normal) {
				const auto before = static_cast<std::ptrdiff_t>(contacts.size());
				impact::plane_contacts(all.bodies, plane, reach, contacts);
				const auto beyond = [&](const impact::Contact& c) { return c.gap <= -all.bodies[c.a].radius; };
				contacts.erase(std::remove_if(contacts.begin() + before, contacts.end(), beyond), contacts.end());
			}
		}
		for (const auto& drum : shapes.drums) impact::cylinder_contacts(all.bodies, drum, reach, contacts);
		if (!shapes.triangles.empty()) triangles.find(all.bodies, shapes.common, shapes.triangles, reach, contacts);
	}
	const auto held = [&](int i) { return i < 0 || std::isinf(all.bodies[i].mass); };
	const auto idle = [&](const impact::Contact& c) { return held(c.a) && held(c.b); };
	contacts.erase(std::remove_if(contacts.begin(), contacts.end(), idle), contacts.end());
	if (all.axis < 0) return;
	const auto partner = [&](const impact::Contact& c) {
		if (c.b >= 0) return "log " + std::to_string(c.key_b);
		const auto number = static_cast<std::size_t>(impact::wall_number(c.key_b));
		return log_impact::wallName(number, *wallList[number]);
	};
	for (const auto& c : contacts)
		if (std::abs(eigen(c.normal)[all.axis]) > 1e-9)
			fail("LogImpact: log " + std::to_string(c.key_a) + " meets " + partner(c) +
			     " out of the plane it moves in; put all logs at one " + "xyz"[all.axis] + " and walls upright to that plane");
}

void LogImpact::action() {
	check(*scene);
	Gathered all;
	gather(all);
	gatherWalls(all);
	const bool                           first = steps == 0 && velocityAtStart;
	std::vector<::dembark::Vec3<double>> force(all.bodies.size()), torque(all.bodies.size());
	try {
		prepare(all);
		const auto search = [&](double reach, std::vector<impact::Contact>& contacts) { findContacts(all, reach, contacts); };
		report(system->step(all.bodies, search, all.wallSpeed, scene->time, first ? 0.5 : 1.0, force, torque));
	} catch (const std::invalid_argument& error) {
		fail(std::string("LogImpact, step ") + std::to_string(scene->iter) + ": " + error.what());
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
		const Body::id_t id   = log_impact::bodyOfContact(wall, contact.key_b);
		const Vector3r   on   = -(contact.normal_force * eigen(contact.normal) + eigen(contact.tangential));
		wall.force += on;
		scene->forces.addForce(id, on);
		scene->forces.addTorque(id, (eigen(contact.place) - Body::byId(id, scene)->state->pos).cross(on));
	}
	writeImpacts();
	if (scene->iter != lastIteration) ++steps;
	lastIteration = scene->iter;
}

void LogImpact::report(const impact::StepReport& now) {
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

void LogImpact::moveBack(const Gathered& all, const std::vector<::dembark::Vec3<double>>& force,
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

void LogImpact::writeImpacts() {
	const std::vector<impact::Impact> ended = system->take_finished();
	if (impactsFile.empty()) return;
	const auto put = [&](const char* mode, const std::string& lines) {
		std::FILE* file = std::fopen(impactsFile.c_str(), mode);
		const bool done = file && std::fwrite(lines.data(), 1, lines.size(), file) == lines.size();
		if (!file || std::fclose(file) != 0 || !done)
			fail("LogImpact.impactsFile '" + impactsFile +
			             "' cannot be written; give the path of a file in a folder that is there",
			     1);
		writtenBytes += static_cast<long>(lines.size());
	};
	if (!fileChecked || writtenFile != impactsFile) {
		if (writtenFile != impactsFile) writtenBytes = 0;
		writtenFile = impactsFile;
		fileChecked = true;
		if (writtenBytes > 0) {
			// Going on from a saved scene: lines that the run wrote after saving will come again.
			std::error_code wrong;
			const auto      size = std::filesystem::file_size(impactsFile, wrong);
			if (wrong || size < static_cast<std::uintmax_t>(writtenBytes))
				fail("LogImpact.impactsFile '" + impactsFile + "' " +
				     (wrong ? "is not there" : "has only " + std::to_string(size) + " bytes") +
				     ", the saved scene had written " + std::to_string(writtenBytes) +
				     " bytes; bring the file back or set impactsFile to a new name");
			std::filesystem::resize_file(impactsFile, static_cast<std::uintmax_t>(writtenBytes), wrong);
			if (wrong)
				fail("LogImpact.impactsFile '" + impactsFile + "' cannot be cut to " + std::to_string(writtenBytes) +
				             " bytes: " + wrong.message(),
				     1);
		} else {
			put("w", "# id_a id_b time duration peak_force impulse relative_speed dissipated x y z\n");
		}
	}
	if (ended.empty()) return;
	std::string lines;
	char        line[320];
	for (const auto& one : ended) {
		const int length =
			std::snprintf(line, sizeof line, "%ld %ld %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g\n",
			              log_impact::shownId(one.a), log_impact::shownId(one.b), one.time, one.duration, one.peak_force,
			              one.impulse, one.relative_speed, one.dissipated, one.place.x, one.place.y, one.place.z);
		lines.append(line, static_cast<std::size_t>(length));
	}
	put("a", lines);
}

boost::python::list LogImpact::contacts() const {
	boost::python::list result;
	if (system)
		for (const auto& c : system->contacts())
			result.append(boost::python::make_tuple(log_impact::shownId(c.key_a), log_impact::shownId(c.key_b), eigen(c.normal),
			                                        c.gap, c.normal_force, eigen(c.tangential), eigen(c.place)));
	return result;
}

Vector3r LogImpact::wallForce(const std::string& name) const {
	std::string known;
	for (const auto& wall : wallList) {
		if (wall->name == name) return wall->force;
		known += (known.empty() ? "" : ", ") + wall->name;
	}
	fail("LogImpact.wallForce: no wall has the name '" + name + "'; there are: " + known);
}

}  // namespace yade
