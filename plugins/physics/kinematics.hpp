// Relative motion of two bodies at their contact.
#pragma once

#include "vec3.hpp"

namespace dembark {

template <class Real>
struct ContactMotion {
  Real normal;            ///< v_n, m/s, > 0 when separating
  Vec3<Real> tangential;  ///< of body 1 relative to 2, m/s
};

/// `normal`: unit, from body 2 to body 1; `relative`: velocity of the centre of 1 relative to that of 2 (m/s); `spin`: sum of both lever
/// arms times their angular velocities (m/s).
template <class Real>
DEMBARK_HOT ContactMotion<Real> contact_motion(const Vec3<Real>& normal, const Vec3<Real>& relative, const Vec3<Real>& spin) {
  const Real along = dot(relative, normal);
  return {along, relative - along * normal - cross(spin, normal)};
}

}  // namespace dembark
