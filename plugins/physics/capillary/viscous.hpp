// Viscous force of a pendular liquid bridge between two spheres, or a sphere and a wall: what the liquid in the gap resists with when
// the surfaces part, approach or slide. SI units. R = 2 R* = 2 Ri Rj / (Ri + Rj), 2 Ri against a wall, as in bridge.hpp.
//
//   normal      F = -3/2 pi eta R^2 X^2 v_n / s,  X = 1 - s/H,  H^2 = s^2 + 2 V / (pi R)
//               Reynolds's equation between two spheres, from the axis out to where the liquid ends. For V -> infinity X = 1 and F =
//               -6 pi eta R*^2 v_n / s: Adams & Perchard, Inst. Chem. Eng. Symp. Ser. 91 (1985) 147. The factor X^2 of a bridge of finite
//               volume: Pitois, Moucheront & Chateau, J. Colloid Interface Sci. 231 (2000) 26. In the gap h = s + r^2/R the liquid
//               reaches out to h = H, where V = pi R (H^2 - s^2) / 2 and the pressure is that outside.
//   tangential  F = -6 pi eta R* (8/15 ln(R*/s) + 0.9588) v_t
//               a sphere that moves along a wall in unbounded liquid: Goldman, Cox & Brenner, Chem. Eng. Sci. 22 (1967) 637; with R* for
//               two spheres: Nase, Vargas, Abatan & McCarthy, Powder Technol. 116 (2001) 214. v_t is the relative velocity of the two
//               surfaces. No correction for a finite volume is known in closed form: small bridges resist less than this.
//
// Both diverge when the gap s closes, so s is taken as at least `minimum_gap`, a length that stands for the roughness; touching pairs
// are at that gap. Both oppose the motion and vanish with it, at any gap and volume.
#pragma once

#include <algorithm>
#include <cmath>

#include "../constants.hpp"
#include "../vec3.hpp"  // DEMBARK_FUNCTION

namespace dembark::capillary {

struct ViscousLiquid {
  double viscosity = 0.0;    ///< Pa s; 0 = no viscous force
  double minimum_gap = 0.0;  ///< m, > 0 with a viscosity: the gap is never taken smaller

  DEMBARK_FUNCTION bool on() const { return viscosity > 0.0; }
};

/// Force per velocity (N s/m), >= 0; the force is this times the velocity, against it.
template <class Real>
struct ViscousResistance {
  Real normal{}, tangential{};
};

/// Resistance of a bridge of `volume` (m^3) at `gap` (m; <= 0 counts as touching) between spheres of `radius` R (m); none without liquid.
template <class Real>
DEMBARK_FUNCTION inline ViscousResistance<Real> viscous_resistance(const ViscousLiquid& liquid, Real radius, Real gap, Real volume) {
  using std::log;
  using std::sqrt;
  if (!liquid.on() || !(volume > Real(0))) return {};
  const Real s = std::max(gap, Real(liquid.minimum_gap));
  const Real a = Real(6) * volume / (Real(three_pi) * radius), edge = sqrt(s * s + a);
  const Real x = a / (edge * (edge + s));  // 1 - s/edge without its cancellation
  const Real shape = Real(8.0 / 15.0) * log(Real(0.5) * radius / s) + Real(0.9588);
  return {Real(0.5 * three_pi * liquid.viscosity) * radius * radius * x * x / s,
          Real(three_pi * liquid.viscosity) * radius * std::max(shape, Real(0))};
}

/// Largest time step (s) of an explicit integration of a pair of `effective_mass` (kg): beyond it the normal force at the smallest gap
/// would turn the motion round within a step, and feed it.
DEMBARK_FUNCTION inline double viscous_time_step(const ViscousLiquid& liquid, double radius, double effective_mass) {
  return effective_mass * liquid.minimum_gap / (0.5 * three_pi * liquid.viscosity * radius * radius);
}

}  // namespace dembark::capillary
