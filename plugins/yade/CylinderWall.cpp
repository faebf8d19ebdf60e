#include "CylinderWall.hpp"

#include <core/Aabb.hpp>
#include <core/Scene.hpp>

#include "report.hpp"

namespace yade {

YADE_PLUGIN((CylinderWall)(Bo1_CylinderWall_Aabb)(Ig2_CylinderWall_Sphere_ScGeom));

using dembark_yade::fail;

void CylinderWall::postLoad(CylinderWall&) {
	if (radius <= 0.0) fail("CylinderWall.radius must be > 0 m");
	const Real length = axis.norm();
	if (!(length > 0.0)) fail("CylinderWall.axis must be a vector that is not zero");
	// Dividing a unit vector again would change its last digit with every load.
	if (math::abs(length - 1.0) > 4e-16) axis /= length;
}

void Bo1_CylinderWall_Aabb::go(const shared_ptr<Shape>& shape, shared_ptr<Bound>& bound, const Se3r& se3, const Body*) try {
	if (!bound) bound = shared_ptr<Bound>(new Aabb);
	bound->min = bound->max  = se3.position;
	const CylinderWall& wall = *static_cast<CylinderWall*>(shape.get());
	if (!(wall.radius > 0.0)) fail("CylinderWall.radius is not set; give it in m");
	for (int i = 0; i < 3; ++i) {
		const Real across = wall.radius * math::sqrt(math::max(Real(0), 1.0 - wall.axis[i] * wall.axis[i]));
		Real       half   = across;
		if (math::abs(wall.axis[i]) > 1e-12) {
			half = std::numeric_limits<Real>::infinity();
			if (scene->isPeriodic) {
				// A periodic collider sorts no infinite ends, and begins with pairs along x within one period.
				if (i == 0 || math::abs(wall.axis[i]) < 1.0 - 1e-12)
					fail("a CylinderWall in a periodic cell must lie along y or z");
				half = 1000.5 * scene->cell->getSize()[i];
			}
		}
		bound->min[i] = se3.position[i] - half;
		bound->max[i] = se3.position[i] + half;
	}
} catch (const std::exception& error) {
	dembark_yade::postpone(*scene, error, true);
}

bool Ig2_CylinderWall_Sphere_ScGeom::go(const shared_ptr<Shape>& shape1, const shared_ptr<Shape>& shape2, const State& state1,
                                        const State& state2, const Vector3r& shift2, const bool& force,
                                        const shared_ptr<Interaction>& interaction) {
	const CylinderWall& wall   = *static_cast<CylinderWall*>(shape1.get());
	const Real          radius = static_cast<Sphere*>(shape2.get())->radius;
	const Vector3r      centre = state2.pos + shift2;
	Vector3r            across = centre - state1.pos;
	across -= across.dot(wall.axis) * wall.axis;
	const Real squared = across.squaredNorm();
	if (!interaction->isReal() && !force) {
		const Real room = wall.radius - radius;
		if (room > 0.0 && squared < room * room) return false;
	}
	const Real     distance = math::sqrt(squared);
	const Vector3r normal   = distance > 0.0 ? Vector3r(-across / distance) : Vector3r(wall.axis.unitOrthogonal());
	set(interaction, state1, state2, shift2, radius, distance + radius - wall.radius, normal);
	return true;
}

}  // namespace yade
