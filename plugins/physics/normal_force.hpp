// Normal contact force of two spheres, or of a sphere and a wall: Hertz and linear (Hooke), with damping from a
// coefficient of restitution.
//
//   Hertz   F = 4/3 E* sqrt(R* delta) delta - gamma_n v_n,   gamma_n = -2 sqrt(5/6) beta sqrt(S_n m*),  S_n = 2 E* sqrt(R* delta)
//           k_t = 8 G* sqrt(R* delta),                       gamma_t = -2 sqrt(5/6) beta sqrt(k_t m*)
//   Hooke   F = k_n delta - gamma_n v_n,                     k_n = 16/15 sqrt(R*) E* (15 m* v_c^2 / (16 sqrt(R*) E*))^(1/5)
//           k_t = k_n,                                       gamma_n = gamma_t = -2 beta sqrt(m* k_n)
//
// with beta = ln e / sqrt(ln^2 e + pi^2). These are the formulas of LIGGGHTS-PUBLIC 3.8.0 (`normal hertz`, `normal hooke`), so that
// the same contact has the same force in every engine. Damping of the Hertz contact: Tsuji, Tanaka & Ishida, Powder Technology
// 71 (1992) 239; k_t: Mindlin, J. Appl. Mech. 16 (1949) 259.
//
// Units SI. delta overlap (m, > 0), v_n relative normal velocity (m/s, > 0 when separating), R* = Ri Rj / (Ri + Rj) (wall: Ri),
// m* likewise, finite (contact.hpp has two frozen bodies). In the limit e = 1 both are elastic.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "constants.hpp"
#include "vec3.hpp"  // DEMBARK_HOT

namespace dembark {

constexpr double sqrt_five_sixths = 0.91287092917527685576161630466800355658790782499663875;

enum class NormalLaw { hertz, hooke };
/// Their names, in their order.
inline std::vector<std::string> normal_law_names() { return {"hertz", "hooke"}; }

/// Effective Young's modulus (Pa) of two materials, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
DEMBARK_FUNCTION inline double effective_youngs_modulus(double youngs_1, double poisson_1, double youngs_2, double poisson_2) {
  return 1.0 / ((1.0 - poisson_1 * poisson_1) / youngs_1 + (1.0 - poisson_2 * poisson_2) / youngs_2);
}

/// Effective shear modulus (Pa), 1/G* = (2 - nu1)/G1 + (2 - nu2)/G2 with G = E / (2 (1 + nu)).
DEMBARK_FUNCTION inline double effective_shear_modulus(double youngs_1, double poisson_1, double youngs_2, double poisson_2) {
  return 1.0 / (2.0 * (2.0 - poisson_1) * (1.0 + poisson_1) / youngs_1 + 2.0 * (2.0 - poisson_2) * (1.0 + poisson_2) / youngs_2);
}

/// R* or m* of two bodies; a partner that is infinite (a wall, or frozen) leaves the other's value. Infinite if both are.
template <class Real, class Truth>
DEMBARK_HOT Real reduced(Real a, Real b, Truth a_infinite, Truth b_infinite) {
  return select(b_infinite, a, select(a_infinite, b, a * b / (a + b)));
}
DEMBARK_FUNCTION inline double reduced(double a, double b) { return reduced(a, b, std::isinf(a), std::isinf(b)); }

/// What the normal contact hands on to the tangential law.
template <class Real>
struct NormalResponse {
  Real force;                 ///< N, along the normal, positive = repulsive, damping included
  Real tangential_stiffness;  ///< k_t, N/m
  Real tangential_damping;    ///< gamma_t, N s/m
  Real contact_area;          ///< pi R* delta, m^2: the apparent area of the Hertz contact
  Real normal_stiffness;      ///< S_n or k_n, N/m: what the spring's force grows with the overlap
  Real elastic_force;         ///< N, of the spring alone, > 0

  /// N of the friction law: with damping, or of the spring alone.
  DEMBARK_HOT Real limiting_force(bool elastic) const { return elastic ? elastic_force : force; }
};

/// beta = ln e / sqrt(ln^2 e + pi^2), in (-1, 0].
DEMBARK_FUNCTION inline double damping_factor(double restitution) {
  const double log_e = std::log(restitution);
  return log_e / std::sqrt(log_e * log_e + pi * pi);
}

/// Of Hertz's law; Hooke's takes the same but for G*.
struct HertzParameters {
  double effective_youngs_modulus;  ///< E*, Pa, > 0
  double effective_shear_modulus;   ///< G*, Pa, > 0
  double damping;                   ///< beta

  HertzParameters() = default;
  /// `restitution` e, 0 < e <= 1.
  HertzParameters(double youngs, double shear, double restitution)
      : effective_youngs_modulus(youngs), effective_shear_modulus(shear), damping(damping_factor(restitution)) {}
};

/// `Parameters`: HertzParameters, or the same three members as packs.
template <class Parameters, class Real>
DEMBARK_HOT NormalResponse<Real> hertz(const Parameters& p, Real effective_radius, Real effective_mass, Real overlap,
                                       Real normal_velocity) {
  using std::sqrt;
  const Real root = sqrt(effective_radius * overlap);
  const Real stiffness = 2.0 * p.effective_youngs_modulus * root;
  const Real k_t = 8.0 * p.effective_shear_modulus * root;
  const auto damping = -2.0 * sqrt_five_sixths * p.damping;
  const Real elastic = 4.0 / 3.0 * p.effective_youngs_modulus * root * overlap;
  return {elastic - damping * sqrt(stiffness * effective_mass) * normal_velocity,
          k_t,
          damping * sqrt(k_t * effective_mass),
          pi * effective_radius * overlap,
          stiffness,
          elastic};
}

/// `characteristic_velocity` v_c, m/s, > 0: impact speed at which the overlap equals that of Hertz.
template <class Real>
DEMBARK_FUNCTION inline NormalResponse<Real> hooke(const HertzParameters& p, double characteristic_velocity, Real effective_radius,
                                                   Real effective_mass, Real overlap, Real normal_velocity) {
  using std::pow;
  using std::sqrt;
  const Real rigidity = sqrt(effective_radius) * p.effective_youngs_modulus;
  const Real k_n = 16.0 / 15.0 * rigidity *
                   pow(15.0 * effective_mass * characteristic_velocity * characteristic_velocity / (16.0 * rigidity), Real(0.2));
  const Real damping = -2.0 * p.damping * sqrt(effective_mass * k_n);
  const Real elastic = k_n * overlap;
  return {elastic - damping * normal_velocity, k_n, damping, pi * effective_radius * overlap, k_n, elastic};
}

/// A response without what the user switched off: attraction by damping, or tangential damping.
template <class Real>
DEMBARK_HOT NormalResponse<Real> adjusted(NormalResponse<Real> response, bool limit_force, bool tangential_damping) {
  if (limit_force) response.force = select(response.force < 0.0, Real(0.0), response.force);
  if (!tangential_damping) response.tangential_damping = 0.0;
  return response;
}

}  // namespace dembark
