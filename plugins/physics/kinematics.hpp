// Motion of two bodies at their contact.
#pragma once

#include "vec3.hpp"

namespace dembark {

/// Whether this "normal" is that of coincident centres: any direction would be a guess. The square of a unit normal is 1 but for rounding,
/// that of coincident centres is NaN or infinite; any bound above 1 distinguishes them.
DEMBARK_FUNCTION inline bool has_no_direction(const Vec3<double>& normal) { return !(dot(normal, normal) < 2.0); }

/// Motion of body 1 against body 2 at the contact.
template <class Real>
struct SurfaceMotion {
  Real normal_velocity{};            ///< m/s, > 0 when parting
  Vec3<Real> tangential_velocity{};  ///< m/s, of the surfaces
  Real arm_1{}, arm_2{};             ///< m, from the centres, or the surface of a wall, to the middle of overlap or gap
};

/// `normal`: unit, from body 2 to body 1; `relative`: velocity of the centre of 1 relative to that of 2 (a wall: of its surface), m/s;
/// `spin_1`, `spin_2`: angular velocities, rad/s.
template <class Real>
DEMBARK_HOT SurfaceMotion<Real> surface_motion(const Vec3<Real>& normal, const Vec3<Real>& relative, Real arm_1, const Vec3<Real>& spin_1,
                                               Real arm_2, const Vec3<Real>& spin_2) {
  const Real along = dot(relative, normal);
  return {along, relative - along * normal - cross(arm_1 * spin_1 + arm_2 * spin_2, normal), arm_1, arm_2};
}

/// Angle (rad) by which the tangential spring turns about the normal in dt (s): that of the mean spin of the two bodies, of which a wall is
/// one, so that a contact that turns as a rigid body takes its spring along. A sphere that spins on a wall at rest carries the spring half
/// as far as it turns: of the two equally soft halves of a contact one turns with the sphere, the other stays with the wall, and the spring
/// is the difference of the two.
template <class Real>
DEMBARK_HOT Real contact_twist(const Vec3<Real>& normal, const Vec3<Real>& spin_1, const Vec3<Real>& spin_2, Real dt) {
  return 0.5 * dt * dot(spin_1 + spin_2, normal);
}

/// Angular velocity (rad/s) of a rigid triangle from two of its edges (m) and from the velocities (m/s) of their ends against their common
/// beginning.
inline Vec3<double> triangle_spin(const Vec3<double>& edge_1, const Vec3<double>& edge_2, const Vec3<double>& velocity_1,
                                  const Vec3<double>& velocity_2) {
  const Vec3<double> normal = cross(edge_1, edge_2), across = cross(normal, edge_1);
  const double area = dot(normal, normal);
  return (1.0 / area) *
         (dot(velocity_2, normal) * edge_1 - dot(velocity_1, normal) * edge_2 + (dot(velocity_1, across) / dot(edge_1, edge_1)) * normal);
}

}  // namespace dembark
