// What the functors for spheres on dembark's walls share.
#pragma once

#include <core/Dispatching.hpp>
#include <pkg/dem/ScGeom.hpp>

namespace yade {

class WallContact : public IGeomFunctor {
public:
	bool goReverse(const shared_ptr<Shape>& shape1, const shared_ptr<Shape>& shape2, const State& state1, const State& state2,
	               const Vector3r& shift2, const bool& force, const shared_ptr<Interaction>& interaction) override {
		interaction->swapOrder();
		return go(shape2, shape1, state2, state1, -shift2, force, interaction);
	}

protected:
	/// The geometry of a sphere's contact; the normal points to the sphere. Against its radius that of the wall is without bound.
	void set(const shared_ptr<Interaction>& interaction, const State& wall, const State& sphere, const Vector3r& shift2, Real radius,
	         Real overlap, const Vector3r& normal) const {
		const bool isNew = !interaction->geom;
		if (isNew) interaction->geom = shared_ptr<ScGeom>(new ScGeom());
		ScGeom& geom          = *static_cast<ScGeom*>(interaction->geom.get());
		geom.penetrationDepth = overlap;
		geom.contactPoint     = sphere.pos + shift2 - (radius - 0.5 * overlap) * normal;
		geom.radius1          = 1e8 * radius;
		geom.radius2          = radius;
		geom.precompute(wall, sphere, scene, interaction, normal, isNew, shift2, false);
	}
};

}  // namespace yade
