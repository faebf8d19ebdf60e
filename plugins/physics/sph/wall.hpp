// Walls and bodies of particles whose pressure is extrapolated from the fluid around them.
//
//   p_w = [sum p_f W + (g - a_w) . sum rho_f (x_w - x_f) W] / sum W,   rho_w from the equation of state                  (1)
//   v_w = 2 v - sum v_f W / sum W                                                                                        (2)
//
// sums over the fluid f within the support of the particle w, whose own velocity and acceleration are v and a_w. S. Adami, X. Y. Hu &
// N. A. Adams, J. Comput. Phys. 231 (2012) 7057, eqs. (27), (23). v_w acts in the viscosity alone (no slip); density changes with v. (1)
// is the pressure that gives fluid between f and w the acceleration a_w: added mass needs no model. Still water under a flat wall has
// p_w = rho g depth exactly. Pressure on walls is never negative unless the fluid may be under tension.
//
// Particles of the boundary that obey continuity themselves (dynamic boundary particles, A. J. C. Crespo, M. Gomez-Gesteira & R. A.
// Dalrymple, CMC 5 (2007) 173) are the older way; they keep the fluid about 1.5 h away.
// Units SI.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "vector.hpp"

namespace dembark::sph {

enum class Boundary { extrapolated, dynamic };
/// Their names, in their order.
inline std::vector<std::string> boundary_names() { return {"extrapolated", "dynamic"}; }

/// Of one particle of a wall, over the fluid f around it.
struct WallSums {
  double weight = 0.0;    ///< sum W
  double pressure = 0.0;  ///< sum p_f W
  Vector arm{};           ///< sum rho_f (x_w - x_f) W
  Vector velocity{};      ///< sum v_f W
};

/// (1), Pa; 0 away from the fluid. weight_less: g - a_w, m/s^2.
inline double wall_pressure(const WallSums& s, const Vector& weight_less, bool tension) {
  if (!(s.weight > 0.0)) return 0.0;
  const double p = (s.pressure + dot(weight_less, s.arm)) / s.weight;
  return tension ? p : std::max(p, 0.0);
}

/// (2), m/s.
inline Vector wall_velocity(const WallSums& s, const Vector& own) {
  if (!(s.weight > 0.0)) return own;
  return 2.0 * own - (1.0 / s.weight) * s.velocity;
}

}  // namespace dembark::sph
