// The order of the laws in a contact, written once: for one contact (contact_step() in contact.hpp) and for packs of contacts
// (pairs/pair_packs.hpp).
//
//   motion of the surfaces -> normal force -> twist -> friction -> rolling resistance -> attraction -> force and moment
#pragma once

#include <cmath>

#include "kinematics.hpp"
#include "normal_force.hpp"
#include "vec3.hpp"

namespace dembark {

/// Two bodies, or packs of such pairs. `separation` = position of 1 minus position of 2 (minus the nearest wall point).
template <class Real>
struct ContactPair {
  Vec3<Real> separation{};        ///< m
  Vec3<Real> velocity{};          ///< m/s, of 1 relative to 2
  Vec3<Real> spin_1{}, spin_2{};  ///< rad/s
  Real radius_1{}, radius_2{};    ///< m; 0 of a wall
};

/// What acts along the surfaces of bodies that touch; returns friction on body 1 (N). `velocity`: of the surfaces, m/s. Of `laws`:
///   friction(normal, twist, response, velocity)   its force, N
///   roll(normal, twist, response, spin)           rolling resistance at the relative spin, rad/s
template <class Real, class Laws>
DEMBARK_HOT Vec3<Real> surface_forces(const Vec3<Real>& normal, const NormalResponse<Real>& response, const Vec3<Real>& velocity,
                                      const Vec3<Real>& spin_1, const Vec3<Real>& spin_2, Real dt, Laws& laws) {
  const Real twist = contact_twist(normal, spin_1, spin_2, dt);
  const Vec3<Real> friction = laws.friction(normal, twist, response, velocity);
  laws.roll(normal, twist, response, spin_1 - spin_2);
  return friction;
}

/// One step of the contact; `laws` has the functions above and
///   touches(overlap)                                          whether the surfaces touch; the overlap (m) is negative over a gap
///   respond(overlap, normal_velocity)                         normal force, stiffness and damping
///   attract(overlap)                                          attraction, N
///   act(normal, overlap, motion, response, friction, attraction)
///                                                             puts the forces together
template <class Real, class Laws>
DEMBARK_HOT void contact_order(const ContactPair<Real>& pair, Real dt, Laws& laws) {
  using std::sqrt;
  const Real distance = sqrt(dot(pair.separation, pair.separation)), overlap = pair.radius_1 + pair.radius_2 - distance;
  const Vec3<Real> normal = pair.separation * (1.0 / distance);
  const Real half = 0.5 * overlap;
  const SurfaceMotion<Real> motion =
      surface_motion<Real>(normal, pair.velocity, pair.radius_1 - half, pair.spin_1, pair.radius_2 - half, pair.spin_2);
  NormalResponse<Real> response{};
  Vec3<Real> friction{};
  if (laws.touches(overlap)) {
    response = laws.respond(overlap, motion.normal_velocity);
    friction = surface_forces<Real>(normal, response, motion.tangential_velocity, pair.spin_1, pair.spin_2, dt, laws);
  }
  const Real attraction = laws.attract(overlap);
  laws.act(normal, overlap, motion, response, friction, attraction);
}

/// Forces along the surface turn the bodies, those along the normal do not.
template <class Real>
struct Assembly {
  Vec3<Real> force;   ///< N, on body 1
  Vec3<Real> moment;  ///< N, normal x force: the torque on a body is this times -1 and its lever arm
};
template <class Real>
DEMBARK_HOT Assembly<Real> assembled(const Vec3<Real>& normal, Real along_normal, const Vec3<Real>& along_surface) {
  return {along_normal * normal + along_surface, cross(normal, along_surface)};
}

}  // namespace dembark
