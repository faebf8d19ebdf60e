#include "FacetSurface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <core/Scene.hpp>

#include "ContactView.hpp"
#include "dembark/surface/stl.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((FacetSurface)(Ig2_FacetSurface_Sphere_ScGeom));

using dembark_yade::fail;
using dembark_yade::vec;

boost::python::list FacetSurface::readStl(const std::string& path, Real precision) {
	try {
		boost::python::list         found;
		const ::dembark::StlSurface read = ::dembark::read_stl(path, precision);
		if (const std::string line = read.left_out(path); !line.empty()) dembark_yade::warn(line);
		for (const ::dembark::Triangle& t : read.triangles) {
			boost::python::list corners;
			for (const auto& n : t.node) corners.append(Vector3r(n.x, n.y, n.z));
			found.append(corners);
		}
		return found;
	} catch (const std::exception& error) {
		fail(error.what());
	}
}

void FacetSurface::postLoad(FacetSurface&) {
	if (!(smoothAngle >= 0.0 && smoothAngle <= 0.25 * M_PI)) fail("FacetSurface.smoothAngle must be an angle of 0 ... pi/4 rad");
	if (!(precision >= 0.0 && std::isfinite(precision))) fail("FacetSurface.precision must be a length >= 0 [m]");
	bodiesSeen = 0;
	members.clear();
}

/// Takes up new and lost facets, and where all of them are now.
void FacetSurface::refresh() {
	BodyContainer& bodies  = *scene->bodies;
	const auto     isFacet = [](const Body* body) { return body && dynamic_cast<const Facet*>(body->shape.get()); };
	bool           changed = bodiesSeen > bodies.size();
	for (std::size_t id = bodiesSeen; id < bodies.size() && !changed; ++id) changed = isFacet(bodies[id].get());
	for (const Member& m : members) changed = changed || bodies[m.id].get() != m.body;
	bodiesSeen = bodies.size();
	if (changed) {
		members.clear();
		indexOf.assign(bodies.size(), -1);
		for (const auto& body : bodies) {
			if (!isFacet(body.get())) continue;
			indexOf[body->getId()] = int(members.size());
			members.push_back({body->getId(), body.get(), {}, {}});
		}
		triangles.resize(members.size());
		surface      = ::dembark::SurfaceContacts(smoothAngle, precision);
		Real largest = 0.0;
		for (const auto& body : bodies)
			if (const Sphere* sphere = body ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr)
				largest = std::max(largest, sphere->radius);
		surface.expect(largest);
	}
	bool moved = changed;
	for (std::size_t i = 0; i < members.size(); ++i) {
		Member&      m     = members[i];
		const State& state = *m.body->state;
		if (!changed && state.pos == m.position && state.ori.coeffs() == m.orientation.coeffs()) continue;
		moved              = true;
		m.position         = state.pos;
		m.orientation      = state.ori;
		const Facet& facet = *static_cast<Facet*>(m.body->shape.get());
		triangles[i].id    = m.id;
		for (int k = 0; k < 3; ++k) triangles[i].node[k] = vec(Vector3r(state.pos + state.ori * facet.vertices[k]));
	}
	if (moved) surface.update(triangles);
}

void FacetSurface::handOver(const shared_ptr<Interaction>& from, int facet) {
	const Body::id_t id = members[facet].id, sphere = from->getId2();
	// Another material has other parameters; there the contact ends and a new one begins.
	if (Body::byId(from->getId1(), scene)->material != members[facet].body->material) return;
	shared_ptr<Interaction> to = scene->interactions->find(id, sphere);
	if (to && to->isReal()) return;
	if (!to) {
		to = shared_ptr<Interaction>(new Interaction(id, sphere));
		scene->interactions->insert(to);
	}
	to->reset();
	if (to->getId1() != id) to->swapOrder();
	to->cellDist     = from->cellDist;
	to->geom         = from->geom;
	to->phys         = from->phys;
	to->iterMadeReal = from->iterMadeReal;
	to->iterLastSeen = from->iterLastSeen;
	from->reset();
	++handedOver;
}

void FacetSurface::action() {
	refresh();
	lastRun = scene->iter;
	std::vector<std::pair<shared_ptr<Interaction>, int>> moved;
	for (const auto& each : *scene->interactions) {
		const int facet = each->isReal() ? index(each->getId1()) : -1;
		if (facet < 0) continue;
		const auto&   body   = Body::byId(each->getId2(), scene);
		const Sphere* sphere = body ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr;
		if (!sphere) continue;
		const Vector3r centre = body->state->pos + dembark_yade::imageShift(*scene, each->cellDist);
		const int      now    = surface.follow(facet, vec(centre), sphere->radius);
		if (now != facet && now >= 0) moved.push_back({each, now});
	}
	for (const auto& [interaction, facet] : moved) handOver(interaction, facet);
}

bool Ig2_FacetSurface_Sphere_ScGeom::go(const shared_ptr<Shape>& shape1, const shared_ptr<Shape>& shape2, const State& state1,
                                        const State& state2, const Vector3r& shift2, const bool& force,
                                        const shared_ptr<Interaction>& interaction) try {
	if (!surface) fail("Ig2_FacetSurface_Sphere_ScGeom.surface is not set; give it the FacetSurface that stands among the engines");
	if (!surface->upToDate(scene->iter))
		fail("the FacetSurface of Ig2_FacetSurface_Sphere_ScGeom did not run in this step; put it before InteractionLoop");
	const int facet = surface->index(interaction->getId1());
	if (facet < 0) fail("facet " + std::to_string(interaction->getId1()) + " is not known to FacetSurface; add bodies before it runs");
	const Real radius = static_cast<Sphere*>(shape2.get())->radius;
	const auto centre = vec(Vector3r(state2.pos + shift2));
	const auto here   = closest_point(surface->contacts().triangles()[facet], centre);
	const bool begins = !interaction->isReal() && !force;
	if (begins && here.distance > radius) return false;
	const bool owner = surface->contacts().owner(facet, here, centre, radius) == facet;
	if (begins && !owner) return false;
	// What has no place of its own any more is so far away that every law ends it. A centre on the facet is on the side of its normal.
	const Vector3r arm(here.arm.x, here.arm.y, here.arm.z);
	set(interaction, state1, state2, shift2, radius, owner ? radius - here.distance : -1e3 * radius,
	    here.distance > 0.0 ? Vector3r(arm / here.distance) : Vector3r(state1.ori * static_cast<Facet*>(shape1.get())->normal));
	return true;
} catch (const std::exception& error) {
	dembark_yade::postpone(*scene, error);
	return false;
}

}  // namespace yade
