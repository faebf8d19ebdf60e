// Adhesion of dry spheres, or of a sphere and a wall, in the closed forms of their theories.
//
//   constant   F = F_0 while the surfaces touch
//   DMT        F = 2 pi W R* while the surfaces touch: Hertz's deformation under the attraction around the contact.
//              B. V. Derjaguin, V. M. Muller & Yu. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314
//   JKR        the attraction acts in the contact and widens it: with its radius a, the larger root of
//                  delta = a^2/R* - sqrt(2 pi W a / E*),                                                       (1)
//              the force of springs and adhesion together is
//                  P = 4 E* a^3 / (3 R*) - sqrt(8 pi W E* a^3).                                                (2)
//              K. L. Johnson, K. Kendall & A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301
//
// W is the work of adhesion (J/m^2), twice the surface energy of equal materials. All are given as the attraction (N) in addition to
// Hertz's force 4/3 E* sqrt(R*) delta^(3/2) at the same overlap delta; of JKR that is Hertz's force less P.
//
// JKR has a hysteresis: a contact forms when the surfaces touch, where P jumps to -4/3 pi W R*, and is held over a gap up to
//     3/4 (pi^2 W^2 R* / E*^2)^(1/3).                                                                          (3)
// The pull-off forces, the minima of the complete force, are 2 pi W R* (DMT) and 3/2 pi W R* (JKR). DMT describes small, stiff spheres and
// JKR large, soft ones: Tabor's parameter (R* W^2 / (E*^2 z_0^3))^(1/3), z_0 about 0.3 nm, is far below 1 or far above it.
// D. Tabor, J. Colloid Interface Sci. 58 (1977) 2. Limit: W = 0 is Hertz. SI units.
#pragma once

#include <cmath>

#include "../constants.hpp"
#include "../normal_force.hpp"  // reduced()

namespace dembark {

/// Pull-off force (N).
DEMBARK_FUNCTION inline double dmt_pull_off(double work_of_adhesion, double effective_radius) {
  return 2.0 * pi * work_of_adhesion * effective_radius;
}

/// The gap (m, > 0) beyond which a JKR contact breaks, equation (3).
DEMBARK_FUNCTION inline double jkr_rupture_distance(double work_of_adhesion, double effective_radius, double effective_youngs_modulus) {
  const double length = pi * work_of_adhesion / effective_youngs_modulus;
  return 0.75 * std::cbrt(length * length * effective_radius);
}

/// Radius (m) of a JKR contact: the larger root a of (1). The overlap (m) may be negative, down to minus jkr_rupture_distance().
DEMBARK_FUNCTION inline double jkr_contact_radius(double work_of_adhesion, double effective_radius, double effective_youngs_modulus,
                                                  double overlap) {
  const double c = std::sqrt(2.0 * pi * work_of_adhesion / effective_youngs_modulus);
  // With s = sqrt(a), s^4 / R* - c s - delta is convex, and Newton's method descends to its larger root from any place above it.
  double s = std::cbrt(c * effective_radius) + std::sqrt(std::sqrt(effective_radius * std::fmax(overlap, 0.0)));
  for (int k = 0; k < 64; ++k) {
    const double cube = s * s * s / effective_radius, slope = 4.0 * cube - c;
    const double step = (s * cube - c * s - overlap) / slope;
    // At the gap of rupture the two roots meet, where the slope vanishes.
    if (!(slope > 0.0) || !(step > 1e-15 * s)) break;
    s -= step;
  }
  return s * s;
}

/// P (N), equation (2), > 0 repulsive.
DEMBARK_FUNCTION inline double jkr_force(double work_of_adhesion, double effective_radius, double effective_youngs_modulus,
                                         double contact_radius) {
  const double cube = contact_radius * contact_radius * contact_radius;
  return 4.0 / 3.0 * effective_youngs_modulus * cube / effective_radius -
         std::sqrt(8.0 * pi * work_of_adhesion * effective_youngs_modulus * cube);
}

/// Attraction (N) of a JKR contact in addition to Hertz's force at this overlap (m; negative: a gap).
DEMBARK_FUNCTION inline double jkr_attraction(double work_of_adhesion, double effective_radius, double effective_youngs_modulus,
                                              double overlap) {
  const double touching = std::fmax(overlap, 0.0);
  const double hertz = 4.0 / 3.0 * effective_youngs_modulus * std::sqrt(effective_radius * touching) * touching;
  const double radius = jkr_contact_radius(work_of_adhesion, effective_radius, effective_youngs_modulus, overlap);
  return hertz - jkr_force(work_of_adhesion, effective_radius, effective_youngs_modulus, radius);
}

/// Energy (J) that an elastic JKR contact loses: the work of P from the touch to rupture. In t = a / a_0 with a_0^3 = 2 pi W R*^2 / E* it
/// is E* a_0^5 / R*^2 [8/15 t^5 - 4/3 t^(7/2) + t^2 / 2] between t = 1 and 16^(-1/3). C. Thornton & Z. Ning, Powder Technology 99 (1998)
/// 154, have its value, 7.09 (W^5 R*^4 / E*^2)^(1/3).
DEMBARK_FUNCTION inline double jkr_loss(double work_of_adhesion, double effective_radius, double effective_youngs_modulus) {
  const double ratio = std::cbrt(2.0 * pi * work_of_adhesion / (effective_youngs_modulus * effective_radius));
  const double size = effective_youngs_modulus * effective_radius * effective_radius * effective_radius;
  return (0.3 + 0.2 / std::cbrt(256.0)) * size * ratio * ratio * ratio * ratio * ratio;
}

}  // namespace dembark
