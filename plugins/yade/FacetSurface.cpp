#include "FacetSurface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <core/Scene.hpp>
#include <pkg/dem/ScGeom.hpp>

#include "report.hpp"

namespace yade {

YADE_PLUGIN((FacetSurface)(Ig2_FacetSurface_Sphere_ScGeom));

using dembark_yade::fail;

namespace {

inline ::dembark::Vec3<double> xyz(const Vector3r& v) { return {v[0], v[1], v[2]}; }

/// Numbers of points, the same for points nearer than `width`: those of a grid cell and of its neighbours are compared.
class Welder {
	double                                          width;
	std::map<std::array<long, 3>, std::vector<int>> cells;
	std::vector<::dembark::Vec3<double>>            points;

public:
	explicit Welder(double distance) : width(distance) {}
	int number(const ::dembark::Vec3<double>& p) {
		const std::array<long, 3> cell{long(std::floor(p.x / width)), long(std::floor(p.y / width)), long(std::floor(p.z / width))};
		for (long i = -1; i <= 1; ++i)
			for (long j = -1; j <= 1; ++j)
				for (long k = -1; k <= 1; ++k) {
					const auto found = cells.find({cell[0] + i, cell[1] + j, cell[2] + k});
					if (found == cells.end()) continue;
					for (const int each : found->second)
						if (norm(points[each] - p) <= width) return each;
				}
		cells[cell].push_back(int(points.size()));
		points.push_back(p);
		return int(points.size()) - 1;
	}
};

}  // namespace

void FacetSurface::postLoad(FacetSurface&) {
	if (!(smoothAngle >= 0.0 && smoothAngle <= 0.25 * M_PI)) fail("FacetSurface.smoothAngle must be an angle of 0 ... pi/4 rad");
	if (!(weld >= 0.0 && weld <= 0.1)) fail("FacetSurface.weld must be a number of 0 ... 0.1");
	bodiesSeen = 0;
	members.clear();
}

/// World coordinates of a facet's corners.
void FacetSurface::move(Member& member) const {
	const State& state = *member.body->state;
	const Facet& facet = *static_cast<Facet*>(member.body->shape.get());
	member.position    = state.pos;
	member.orientation = state.ori;
	for (int k = 0; k < 3; ++k) member.triangle.node[k] = xyz(Vector3r(state.pos + state.ori * facet.vertices[k]));
}

/// Which facets stand beside which, by common corners.
void FacetSurface::join() {
	double shortest = INFINITY;
	for (Member& m : members)
		for (int k = 0; k < 3; ++k) shortest = std::min(shortest, norm(m.triangle.node[(k + 1) % 3] - m.triangle.node[k]));
	if (!(shortest > 0.0)) fail("FacetSurface: a Facet has two corners at one place");
	Welder                               welder(std::max(weld, 1e-12) * shortest);
	std::vector<std::array<int, 3>>      corners;
	std::map<int, std::vector<int>>      around;  // facets at each corner
	std::vector<::dembark::Vec3<double>> normals;
	for (int f = 0; f < int(members.size()); ++f) {
		const auto* node = members[f].triangle.node;
		corners.push_back({welder.number(node[0]), welder.number(node[1]), welder.number(node[2])});
		const auto normal = cross(node[1] - node[0], node[2] - node[0]);
		normals.push_back(normal * (1.0 / norm(normal)));
		for (int k = 0; k < 3; ++k) {
			around[corners[f][k]].push_back(f);
			members[f].height[k] = norm(normal) / norm(node[(k + 2) % 3] - node[(k + 1) % 3]);
		}
	}
	const double smooth = std::cos(smoothAngle + 1e-9);
	for (int f = 0; f < int(members.size()); ++f) {
		std::map<int, int> shared;
		for (int k = 0; k < 3; ++k)
			for (const int other : around[corners[f][k]])
				if (other != f) shared[other] |= 1 << k;
		members[f].neighbours.clear();
		for (const auto& [other, mask] : shared)
			members[f].neighbours.push_back({other, mask, std::abs(dot(normals[f], normals[other])) >= smooth});
	}
}

/// Takes up new and lost facets, and where all of them are now.
void FacetSurface::refresh() {
	BodyContainer& bodies  = *scene->bodies;
	bool           changed = bodiesSeen > bodies.size();
	for (std::size_t id = bodiesSeen; id < bodies.size() && !changed; ++id)
		changed = bodies[id] && dynamic_cast<const Facet*>(bodies[id]->shape.get());
	for (const Member& m : members) changed = changed || bodies[m.id].get() != m.body;
	bodiesSeen = bodies.size();
	if (changed) {
		members.clear();
		indexOf.assign(bodies.size(), -1);
		for (const auto& body : bodies) {
			if (!body || !dynamic_cast<const Facet*>(body->shape.get())) continue;
			indexOf[body->getId()] = int(members.size());
			members.push_back({body->getId(), body.get(), {}, {}, {}, {}, {}});
			move(members.back());
		}
		join();
		return;
	}
	for (Member& m : members)
		if (m.body->state->pos != m.position || m.body->state->ori.coeffs() != m.orientation.coeffs()) move(m);
}

FacetSurface::Place FacetSurface::place(int facet, const Vector3r& centre) const {
	Place      found;
	const auto c   = xyz(centre);
	found.closest  = ::dembark::impact::closest_point(members[facet].triangle, c);
	found.distance = norm(c - found.closest.point);
	return found;
}

int FacetSurface::better(int facet, const Place& here, const Vector3r& centre, Real radius) const {
	const Member& m = members[facet];
	// The comparison of distances, then of ids, is the same for both of two facets: exactly one of them has the contact. Just beside
	// an edge the distances cannot be told apart, so the edge's neighbours are asked there, too.
	const double edge  = 1e-6 * radius;
	const double reach = edge + radius * std::tan(smoothAngle);
	int          away  = 0;
	bool         inner = true;
	for (int k = 0; k < 3; ++k) {
		const double height = here.closest.weight[k] * m.height[k];
		if (height > edge) away |= 1 << k;
		inner = inner && height > reach;
	}
	int    best     = facet;
	double distance = here.distance;
	for (const Neighbour& n : m.neighbours) {
		const bool contains = (away & ~n.shared) == 0;
		if (!contains && (!n.smooth || inner)) continue;
		const double other = place(n.facet, centre).distance;
		if (other < distance || (other == distance && n.facet < best)) best = n.facet, distance = other;
	}
	return best;
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
		if (!each->isReal()) continue;
		const int facet = index(each->getId1());
		if (facet < 0) continue;
		const auto&   body   = Body::byId(each->getId2(), scene);
		const Sphere* sphere = body ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr;
		if (!sphere) continue;
		Vector3r centre = body->state->pos;
		if (scene->isPeriodic) centre += scene->cell->intrShiftPos(each->cellDist);
		int now = facet;
		for (int next; (next = better(now, place(now, centre), centre, sphere->radius)) != now;) now = next;
		if (now != facet) moved.push_back({each, now});
	}
	for (const auto& [interaction, facet] : moved) handOver(interaction, facet);
}

bool Ig2_FacetSurface_Sphere_ScGeom::go(const shared_ptr<Shape>&, const shared_ptr<Shape>& shape2, const State& state1, const State& state2,
                                        const Vector3r& shift2, const bool& force, const shared_ptr<Interaction>& interaction) {
	if (!surface) fail("Ig2_FacetSurface_Sphere_ScGeom.surface is not set; give it the FacetSurface that stands among the engines");
	if (!surface->upToDate(scene->iter))
		fail("the FacetSurface of Ig2_FacetSurface_Sphere_ScGeom did not run in this step; put it before InteractionLoop");
	const int facet = surface->index(interaction->getId1());
	if (facet < 0) fail("facet " + std::to_string(interaction->getId1()) + " is not known to FacetSurface; add bodies before it runs");
	const Real                radius = static_cast<Sphere*>(shape2.get())->radius;
	const Vector3r            centre = state2.pos + shift2;
	const FacetSurface::Place here   = surface->place(facet, centre);
	const bool                real   = interaction->isReal();
	if (!real && !force && here.distance > radius) return false;
	const bool owner = surface->better(facet, here, centre, radius) == facet;
	if (!real && !force && !owner) return false;

	const bool isNew = !interaction->geom;
	if (isNew) interaction->geom = shared_ptr<ScGeom>(new ScGeom());
	ScGeom&        geom = *static_cast<ScGeom*>(interaction->geom.get());
	const Vector3r arm  = centre - Vector3r(here.closest.point.x, here.closest.point.y, here.closest.point.z);
	const Vector3r normal =
		here.distance > 0.0
	                ? Vector3r(arm / here.distance)
	                : Vector3r(state1.ori * static_cast<Facet*>(Body::byId(interaction->getId1(), scene)->shape.get())->normal);
	// What has no place of its own any more is so far away that every law ends it.
	geom.penetrationDepth = owner ? radius - here.distance : -1e3 * radius;
	geom.contactPoint     = centre - (radius - 0.5 * geom.penetrationDepth) * normal;
	geom.radius1          = 1e8 * radius;
	geom.radius2          = radius;
	geom.precompute(state1, state2, scene, interaction, normal, isNew, shift2, false);
	return true;
}

bool Ig2_FacetSurface_Sphere_ScGeom::goReverse(const shared_ptr<Shape>& shape1, const shared_ptr<Shape>& shape2, const State& state1,
                                               const State& state2, const Vector3r& shift2, const bool& force,
                                               const shared_ptr<Interaction>& interaction) {
	interaction->swapOrder();
	return go(shape2, shape1, state2, state1, -shift2, force, interaction);
}

}  // namespace yade
