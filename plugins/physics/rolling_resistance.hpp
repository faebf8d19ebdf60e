// Rolling resistance: a torque against the relative rotation of two bodies in contact.
//
//   constant torque  (LIGGGHTS `cdt`)     M = -mu_r R* F_el w / |w|                                                          (1)
//   elastic-plastic  (LIGGGHTS `epsd2`)   dM = -k_r w dt,  |M| <= mu_r R* |N|,  k_r = k_t R*^2                               (2)
//
// with w = spin of body 1 minus that of body 2 (a wall: as it turns), F_el the spring of the normal law, N its whole force. By default
// torques resist rolling alone: the part along the normal is left out, in (1) of the torque, in (2) of the rotation. A constant torque
// cannot hold a body at rest: its direction changes in every step. The spring can.
//
// J. Ai, J.-F. Chen, J. M. Rotter & J. Y. Ooi, Powder Technology 206 (2011) 269 (models A and C); K. Iwashita & M. Oda, J. Eng. Mech. 124
// (1998) 285 for k_r = k_t R*^2. Beside LIGGGHTS-PUBLIC 3.8.0 the spring turns here with the contact plane.
//
// Limits: mu_r = 0 is free rolling; a sphere that rolls on a plane slows down by 5/7 mu_r g, and rests on a slope below arctan(mu_r).
// Units SI.
#pragma once

#include <cmath>

#include "vec3.hpp"

namespace dembark {

enum class RollingModel { none, constant_torque, elastic_plastic };

struct RollingResistance {
  RollingModel model = RollingModel::none;
  double friction = 0.0;  ///< mu_r, >= 0
  bool torsion = false;   ///< also against rotation about the normal

  /// The one clear line about what is wrong with these parameters, or nullptr.
  const char* error() const { return friction >= 0.0 && std::isfinite(friction) ? nullptr : "rolling friction must be a number >= 0"; }
};

/// Torque on body 1 (N m; body 2 gets its negative).
///
/// normal         unit                                          radius   R*, m
/// spring_force   F_el, N       normal_force  N, N              tangential_stiffness  k_t, N/m
/// spin           w, rad/s      dt  s                           torque   M of (2), N m, which the contact keeps; turned by the caller
inline Vec3<double> rolling_step(const RollingResistance& law, const Vec3<double>& normal, double radius, double spring_force,
                                 double normal_force, double tangential_stiffness, const Vec3<double>& spin, double dt,
                                 Vec3<double>& torque) {
  const auto rolling = [&](const Vec3<double>& v) { return law.torsion ? v : v - dot(v, normal) * normal; };
  if (law.model == RollingModel::constant_torque) {
    const double rate = norm(spin);
    return rate > 0.0 ? rolling((-law.friction * radius * spring_force / rate) * spin) : Vec3<double>{};
  }
  if (law.model == RollingModel::none) return {};
  torque -= (tangential_stiffness * radius * radius * dt) * rolling(spin);
  const double size = norm(torque), most = law.friction * radius * std::abs(normal_force);
  if (size > most) torque *= most / size;
  return torque;
}

/// Energy (J) that the spring of (2) holds.
inline double rolling_energy(const Vec3<double>& torque, double radius, double tangential_stiffness) {
  return 0.5 * dot(torque, torque) / (tangential_stiffness * radius * radius);
}

}  // namespace dembark
