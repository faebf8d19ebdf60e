// Rolling resistance: a couple against the relative rotation of two bodies in contact.
//
//   constant torque   M = -mu_r R* N w / |w|                                                                                   (1)
//   elastic-plastic   M = -k_r theta - c w,   dtheta = w dt,   k_r |theta| <= mu_r R* N,   |M| <= mu_r R* N                       (2)
//                     k_r = k_t R*^2,   c = 2 eta sqrt(7/2 I k_r), or the largest smaller value with which |M| keeps the limit
//
// with the rolling part w of the relative spin, that of body 1 minus that of body 2, without what turns about the normal. N is the
// repulsive force of the normal law (>= 0), as in friction. theta is a vector in the contact plane, with which it turns; at the limit the
// spring yields, and rolling on is not damped. 1/I = 1/I_1 + 1/I_2 with I_k = 2/5 m_k r_k^2; 7/2 I is about the point of contact.
//
// J. Ai, J.-F. Chen, J. M. Rotter & J. Y. Ooi, Powder Technology 206 (2011) 269, models A and C, whose dashpot has no limit below that
// of the spring: a fast spin would be stopped by it in the first step of a contact. K. Iwashita & M. Oda, J. Eng. Mech. 124 (1998) 285, for
// k_r = k_t R*^2. (1) cannot hold a body at rest: at most it takes away the rotation of a step, M <= I |w| / dt, contact by contact, so
// that one contact never drives, but several of a body together may. (2) can.
//
// Beside LIGGGHTS-PUBLIC 3.8.0: `cdt` takes the spring of the normal law for N, divides by the whole relative spin (a body that twists
// rolls more freely) and turns the spin round at rest; `epsd2` takes |N|, so that a contact that damping pulls on resists too, adds up
// torques instead of angles and leaves them behind when the contact turns; it has no dashpot, and `epsd`, which has one, another stiffness.
//
// Limits: mu_r = 0 is free rolling. A sphere that rolls on a plane slows down by 5/7 mu_r g; with (2) it rests on slopes below
// arctan(mu_r). Units SI.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "finnie_rabinowicz.hpp"  // rotate_to_plane
#include "normal_force.hpp"       // reduced
#include "vec3.hpp"

namespace dembark {

enum class RollingModel { off, constant_torque, elastic_plastic };
/// Their names, in their order.
inline std::vector<std::string> rolling_names() { return {"off", "constant_torque", "elastic_plastic"}; }

struct RollingResistance {
  RollingModel model = RollingModel::off;
  double friction = 0.0;       ///< mu_r, >= 0
  double damping_ratio = 0.0;  ///< eta, >= 0, of (2); 1 = critical

  DEMBARK_FUNCTION bool on() const { return model != RollingModel::off && friction > 0.0; }
};

/// I (kg m^2) of two spheres of these masses (kg; infinite = a wall, or frozen) and radii (m).
DEMBARK_FUNCTION inline double relative_inertia(double mass_1, double radius_1, double mass_2, double radius_2) {
  return reduced(0.4 * mass_1 * radius_1 * radius_1, 0.4 * mass_2 * radius_2 * radius_2);
}

/// k_r (N m/rad) of (2).
DEMBARK_FUNCTION inline double rolling_stiffness(double tangential_stiffness, double effective_radius) {
  return tangential_stiffness * effective_radius * effective_radius;
}

/// What an engine knows of a contact that may roll.
struct RollingContact {
  Vec3<double> normal{};              ///< unit, from 2 to 1
  double twist = 0.0;                 ///< rad, see contact_twist()
  double effective_radius = 0.0;      ///< R*, m
  double inertia = 0.0;               ///< I, kg m^2; infinite between two frozen bodies
  double normal_force = 0.0;          ///< N, N; negative values count as 0
  double tangential_stiffness = 0.0;  ///< k_t, N/m
  Vec3<double> spin{};                ///< relative spin, rad/s, twisting included
};

/// One step of the law: the couple (N m) on body 1; body 2 gets its negative. `dt` in s; 0 asks for the couple of the moment. `angle`:
/// theta (rad), which the contact keeps from touch to end.
DEMBARK_FUNCTION inline Vec3<double> rolling_step(const RollingResistance& law, const RollingContact& c, double dt, Vec3<double>& angle) {
  if (!law.on()) return {};
  const double most = law.friction * c.effective_radius * std::max(c.normal_force, 0.0);
  const Vec3<double> rolling = c.spin - dot(c.spin, c.normal) * c.normal;
  if (law.model == RollingModel::constant_torque) {
    const double rate = norm(rolling);
    if (!(rate > 0.0)) return {};
    return -((dt > 0.0 ? std::min(most, c.inertia * rate / dt) : most) / rate) * rolling;
  }
  const double stiffness = rolling_stiffness(c.tangential_stiffness, c.effective_radius);
  angle = rotate_to_plane(angle, c.normal, c.twist) + dt * rolling;
  const double elastic = stiffness * norm(angle);
  if (elastic > most) angle *= most / elastic;
  // Two frozen bodies do not swing: there is nothing to damp.
  const double damping = std::isinf(c.inertia) ? 0.0 : 2.0 * law.damping_ratio * std::sqrt(3.5 * c.inertia * stiffness);
  const Vec3<double> spring = -stiffness * angle, dashpot = -damping * rolling;
  // The largest part of the dashpot with which the couple keeps the limit: |spring + part dashpot| = most.
  const double size = dot(dashpot, dashpot), along = dot(spring, dashpot), left = std::max(most * most - dot(spring, spring), 0.0);
  if (!(size + 2.0 * along > left)) return spring + dashpot;
  const double root = std::sqrt(along * along + size * left);
  // Of the two forms of the root the one without a difference of like numbers.
  return spring + (along > 0.0 ? left / (along + root) : (root - along) / size) * dashpot;
}

}  // namespace dembark
