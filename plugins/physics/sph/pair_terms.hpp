// What two particles i and j of equal mass m do to each other: density, diffusion of density, pressure and viscosity.
//
//   drho_i/dt = sum m (v_i - v_j) . grad W + 2 delta h c_0 m/rho_0 sum (s_j - s_i) (x_j - x_i) . grad W / r^2          (1)
//   dv_i/dt   = -sum m (p_i/rho_i^2 + p_j/rho_j^2 + Pi) grad W + g                                                     (2)
//   Pi = -2 alpha c_0 h v.r / [(r^2 + 0.01 h^2)(rho_i + rho_j)] if v.r < 0, else 0                                     (3)
//   s  = rho - rho_0 g.x / c_0^2
//
// (2), (3) and the first term of (1): J. J. Monaghan, Annu. Rev. Astron. Astrophys. 30 (1992) 543; they derive from one Lagrangian, so
// that pressure does no work but that of compression. The second: D. Molteni & A. Colagrossi, Comput. Phys. Commun. 180 (2009) 861, which
// takes the noise out of the pressure; of rho only what the weight of still water does not explain diffuses (G. Fourtakas et al., Comput.
// Fluids 190 (2019) 346), here linear in g.x, so that water at rest stays there. Their m/rho_j is m/rho_0 here, 1 % apart at most:
// diffusion conserves sum(rho) to round-off, but where a density is lifted to the lowest that spray may have.
//
//   P/rho_0^2 = c_0^2/(4 rho_0) (1 - r/q) if r < q = 0.9 dx, else 0                                                    (4)
//
// (4) is a pressure that fluid and solid particles have besides p in (2): a film one particle thick, or spray, that has lost the density
// of rest has no pressure to keep it out of a wall, and sinks into it. Where there is pressure, most particles are farther from each other.
// Linear, because where four particles of a wall meet r is 0.71 dx: a parabola of the same value at r = q/2 stops c/23 there, this c/12.5
// (Wendland's kernel in space, h = 1.3 dx; the wider the kernel, the less). Elastic: what it stores is counted as lost to the wall until it
// comes back.
//
// All forces are central and antisymmetric: momentum and angular momentum of a pair are conserved to round-off. Viscosity only
// dissipates, and a rigid rotation feels none: v.r = 0. Limits: delta = 0, alpha = 0 is the conservative scheme.
//
// For double and packs alike. Units SI.
#pragma once

#include "../pack.hpp"

namespace dembark::sph {

/// Coefficients of the terms, the same for all pairs.
struct PairCoefficients {
  double mass = 0.0;       ///< m, kg, over the moment of the kernel
  double diffusion = 0.0;  ///< 2 delta h c_0 / rho_0, m^5/(kg s) (per m slope)
  double viscosity = 0.0;  ///< 2 alpha c_0 h, m^2/s
  double softening = 0.0;  ///< 0.01 h^2, m^2
  double guard = 0.0;      ///< c_0^2/(4 rho_0), m^5/(kg s^2); 0: no guard
  double reach = 1.0;      ///< q, m

  /// moment: lattice_moment() of the kernel, by which all sums are divided.
  static PairCoefficients of(double mass, double moment, double h, double sound_speed, double density, double alpha, double delta) {
    return {mass / moment, 2.0 * delta * h * sound_speed / density, 2.0 * alpha * sound_speed * h, 0.01 * h * h, 0.0, 1.0};
  }
};

/// First term of (1), kg/m^3/s, the same for i and j. push: m W'(r)/r; approach: (v_i - v_j).(x_i - x_j).
template <class Real>
DEMBARK_HOT Real compression_rate(const Real& push, const Real& approach) {
  return push * approach;
}

/// Second term of (1), for i; j gets its negative.
template <class Real>
DEMBARK_HOT Real diffusion_rate(const PairCoefficients& c, const Real& push, const Real& s_i, const Real& s_j) {
  return Real(c.diffusion) * push * (s_i - s_j);
}

/// Pi, m^5/(kg s^2), >= 0.
template <class Real>
DEMBARK_HOT Real artificial_viscosity(const PairCoefficients& c, const Real& distance_squared, const Real& approach, const Real& rho_i,
                                      const Real& rho_j) {
  const Real closing = select(approach < Real(0.0), approach, Real(0.0));
  return Real(-c.viscosity) * closing / ((distance_squared + Real(c.softening)) * (rho_i + rho_j));
}

/// (4) of a fluid and a solid particle, m^5/(kg s^2).
template <class Real>
DEMBARK_HOT Real guard_stress(const PairCoefficients& c, const Real& distance) {
  const Real left = Real(1.0) - distance * Real(1.0 / c.reach), inside = select(left > Real(0.0), left, Real(0.0));
  return Real(c.guard) * inside;
}

/// Acceleration of i over (x_i - x_j), 1/s^2, from `stress` = p_i/rho_i^2 + p_j/rho_j^2 + Pi; j gets its negative.
template <class Real>
DEMBARK_HOT Real acceleration_factor(const Real& push, const Real& stress) {
  return -(push * stress);
}

}  // namespace dembark::sph
