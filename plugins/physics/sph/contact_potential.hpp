// Contact potential between fluid and solid particles, the older coupling that keeps both apart by a repulsive layer 2h thick.
//
//   F_i = -sum_(j in solid) V_i V_j K n W(r)^(n - 1) / W(dx)^n grad W,   F_j the reverse
//
// with volumes V = m/rho. R. Vignjevic, T. De Vuyst & J. C. Campbell, CMES 13 (2006) 35, there with W at the mean spacing, dx. It is the
// gradient of K [W/W(dx)]^n, so that elastic impacts conserve energy. The layer shuts gaps narrower than twice its thickness: for
// comparison, not advised. Limits: K = 0 is no coupling. Units SI.
#pragma once

#include <cmath>

#include "../vec3.hpp"

namespace dembark::sph {

struct ContactPotential {
  double stiffness = 0.0;  ///< K, Pa/m^3 (in the plane Pa/m^2), >= 0; 0 = off
  int exponent = 4;        ///< n, >= 1

  const char* error() const {
    if (!(stiffness >= 0.0) || std::isinf(stiffness)) return "contact_stiffness must be a number >= 0 (Pa/m^3, in the plane Pa/m^2)";
    if (exponent < 1) return "contact_exponent must be 1 or more";
    return nullptr;
  }
  bool on() const { return stiffness > 0.0; }
};

/// Force on the fluid particle over (x_i - x_j), N/m, >= 0. volumes: V_i V_j, m^6 (m^4 in the plane); at_spacing: W(dx).
template <class Kernel>
double contact_factor(const ContactPotential& law, const Kernel& kernel, double r, double volumes, double at_spacing) {
  const double w = kernel.value(r) / at_spacing;
  return -volumes * law.stiffness * law.exponent * std::pow(w, law.exponent - 1) / at_spacing * kernel.slope(r);
}

/// Potential of a pair, J.
template <class Kernel>
double contact_energy(const ContactPotential& law, const Kernel& kernel, double r, double volumes, double at_spacing) {
  return volumes * law.stiffness * std::pow(kernel.value(r) / at_spacing, law.exponent);
}

}  // namespace dembark::sph
