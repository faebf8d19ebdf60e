// An interaction of YADE in the order and the terms of dembark/contact.hpp.
#pragma once

#include <cmath>

#include <core/Body.hpp>
#include <core/Scene.hpp>
#include <pkg/dem/ScGeom.hpp>

#include "dembark/contact.hpp"

namespace yade::dembark_yade {

inline ::dembark::Vec3<double> vec(const Vector3r& v) { return {v[0], v[1], v[2]}; }
inline Vector3r                vec(const ::dembark::Vec3<double>& v) { return Vector3r(v.x, v.y, v.z); }

/// Whether an interaction crosses a border of the periodic cell; and where (m) the image of its body 2 then is that takes part in it, from
/// the body, and how much faster (m/s): zero otherwise.
inline bool     crosses(const Scene& scene, const Vector3i& cellDist) { return scene.isPeriodic && !cellDist.isZero(); }
inline Vector3r imageShift(const Scene& scene, const Vector3i& cellDist) {
	return crosses(scene, cellDist) ? scene.cell->intrShiftPos(cellDist) : Vector3r::Zero();
}
inline Vector3r imageDrift(const Scene& scene, const Vector3i& cellDist) {
	return crosses(scene, cellDist) ? scene.cell->intrShiftVel(cellDist) : Vector3r::Zero();
}

/// Mass (kg) against contacts: infinite of a body that is not dynamic; of a clump's member that of the clump, which is what moves.
inline double inertialMass(const Body& body) {
	const Body& moved = body.isClumpMember() ? *Body::byId(body.clumpId) : body;
	return moved.isDynamic() ? moved.state->mass : INFINITY;
}

/// Bodies 1 and 2 of `bodies` are YADE's of two spheres; of a sphere and a wall body 1 is always the sphere.
struct ContactView {
	::dembark::ContactBodies bodies;
	Vector3r                 surface  = Vector3r::Zero();  // wall: its surface point below the sphere, from the wall's position
	int                      wallBody = 0;                 // 1 or 2: this body of the interaction is a wall; 0: two spheres

	bool swapped() const { return wallBody == 1; }
	/// YADE's forces of a contact are those on its body 2: this times the force on body 1 of `bodies`, and the other way round.
	double sign() const { return swapped() ? 1.0 : -1.0; }

	ContactView() = default;
	/// `shift`: of body 2, to the image that takes part. The centre of a sphere must be on the near side of a wall.
	ContactView(int wall, const ScGeom& geom, const Body& body1, const Body& body2, const Vector3r& shift) : wallBody(wall) {
		const State &state1 = *body1.state, &state2 = *body2.state;
		if (wallBody == 0) {
			setSpheres(state1.pos - (state2.pos + shift), geom.radius1, geom.radius2, inertialMass(body1), inertialMass(body2));
			return;
		}
		const Body&    round   = swapped() ? body2 : body1;
		const State&   sphere  = *round.state;
		const State&   plane   = swapped() ? state1 : state2;
		const Vector3r outward = sign() * geom.normal;  // from the wall to the sphere
		bodies.radius_1        = swapped() ? geom.radius2 : geom.radius1;
		bodies.mass_1          = inertialMass(round);
		const double distance  = bodies.radius_1 - geom.penetrationDepth;
		bodies.separation      = vec(Vector3r(distance * outward));
		surface                = sphere.pos + sign() * shift - plane.pos - distance * outward;
	}

	/// Places and masses of two spheres; `separation`: of 1 from the image of 2 that takes part.
	void setSpheres(const Vector3r& separation, double radius1, double radius2, double mass1, double mass2) {
		bodies.separation = vec(separation);
		bodies.radius_1   = radius1;
		bodies.radius_2   = radius2;
		bodies.mass_1     = mass1;
		bodies.mass_2     = mass2;
	}

	/// Velocities and angular velocities of the interaction's bodies; of a wall the velocity becomes that of its surface.
	void move(const Vector3r& velocity1, const Vector3r& spin1, const Vector3r& velocity2, const Vector3r& spin2) {
		bodies.velocity_1         = vec(swapped() ? velocity2 : velocity1);
		bodies.angular_velocity_1 = vec(swapped() ? spin2 : spin1);
		if (wallBody == 0) {
			bodies.velocity_2         = vec(velocity2);
			bodies.angular_velocity_2 = vec(spin2);
		} else {
			bodies.wall_spin  = vec(swapped() ? spin1 : spin2);
			bodies.velocity_2 = vec(Vector3r(swapped() ? velocity1 + spin1.cross(surface) : velocity2 + spin2.cross(surface)));
		}
	}
};

}  // namespace yade::dembark_yade
