// Partial slip of a Hertzian contact: the third pre-sliding curve of the Finnie-Rabinowicz law, with its loading history.
//
// Under a tangential load the rim of a contact slips while its middle sticks (Cattaneo 1938; R. D. Mindlin, J. Appl. Mech. 16 (1949) 259).
// With a normal force that varies too, the traction depends on the whole history (R. D. Mindlin & H. Deresiewicz, J. Appl. Mech. 20
// (1953) 327). The method of dimensionality reduction gives the same forces as a row of independent springs: at the distance x from the
// middle of a contact of radius a a spring carries
//
//     normal   dN = 3 N / (4 a) (1 - x^2 / a^2) dx,    tangential   dT = k_t / (2 a) u(x) dx,    |dT| <= mu dN,                  (1)
//
// for -a < x < a, and it is free of traction when the growing contact reaches it (V. L. Popov & M. Hess, Method of Dimensionality
// Reduction in Contact Mechanics and Friction, Springer 2015, ch. 5; J. Jaeger, Arch. Appl. Mech. 65 (1995) 478: any plane history). Here
// the springs of both sides are gathered in six rings whose edges stand at outer / q^i, outer following the contact radius; the pressure
// is integrated over each ring. Under a constant normal force the curve lies within 1.4 % of mu N of Cattaneo's and Mindlin's; a cycle
// that stays below a fifth of the displacement at which all slides slips nowhere.
//
// Limits: a ring at its limit everywhere is the contact that slides as a whole, with the limit T_max of finnie_rabinowicz.hpp; far below
// the limit at a constant radius it is the linear spring k_t. Units SI.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "finnie_rabinowicz.hpp"
#include "normal_force.hpp"  // pi

namespace dembark {

/// The springs of one contact. An engine keeps these beside the FrictionState, turns them with the contact plane and forgets them when
/// the contact ends.
struct SlipRings {
  static constexpr int count = 6;
  static constexpr double ratio = 1.25;  ///< q, of neighbouring edges

  std::array<Vec3<double>, count> displacement{};  ///< u, m, in the contact plane, from the rim inwards; positive as body 1 moves
  double outer = 0.0;                              ///< m, edge of the first ring; 0 = never touched
  double radius = 0.0;                             ///< m, of the contact in the last step

  /// Edge i (m), from the rim inwards; the last is the middle.
  double edge(int i) const {
    constexpr double at[count + 1] = {1.0, 0.8, 0.64, 0.512, 0.4096, 0.32768, 0.0};
    return outer * at[i];
  }
  /// How far ring i lies inside of the radius a (m).
  double width(int i, double a) const { return std::min(edge(i), a) - std::min(edge(i + 1), a); }
};

/// Elastic energy (J) of the springs for k_t (N/m).
inline double stored_energy(const SlipRings& rings, double stiffness) {
  if (!(rings.radius > 0.0)) return 0.0;
  double sum = 0.0;
  for (int i = 0; i < SlipRings::count; ++i) sum += rings.width(i, rings.radius) * dot(rings.displacement[i], rings.displacement[i]);
  return 0.5 * stiffness / rings.radius * sum;
}

/// Turn the springs with the contact plane; see rotate_to_plane().
inline void rotate_to_plane(SlipRings& rings, const Vec3<double>& normal, double twist) {
  for (auto& u : rings.displacement) u = rotate_to_plane(u, normal, twist);
}

namespace detail {

/// The rings for the contact radius a (m): edges move by whole rings, springs that join are without load.
inline void follow(SlipRings& rings, double a) {
  auto& u = rings.displacement;
  constexpr int last = SlipRings::count - 1;
  if (!(rings.outer > 0.0)) rings.outer = a;
  while (a > rings.outer) {  // the two innermost rings become one
    const double middle = rings.width(last, rings.radius), next = rings.width(last - 1, rings.radius);
    if (middle + next > 0.0) u[last] = (middle * u[last] + next * u[last - 1]) * (1.0 / (middle + next));
    for (int i = last - 1; i > 0; --i) u[i] = u[i - 1];
    u[0] = {};
    rings.outer *= SlipRings::ratio;
  }
  while (a * SlipRings::ratio < rings.outer) {  // the outermost has left the contact, the innermost becomes two
    for (int i = 0; i < last; ++i) u[i] = u[i + 1];
    rings.outer /= SlipRings::ratio;
  }
  for (int i = 0; i < SlipRings::count; ++i) {
    const double now = rings.width(i, a), before = rings.width(i, rings.radius);
    if (now > before) u[i] *= before / now;
    else if (!(now > 0.0)) u[i] = {};
  }
  rings.radius = a;
}

}  // namespace detail

/// One step of the law with partial slip: as friction_step(), with `rings` that have been turned into the contact plane. The radius of
/// the contact follows from its area. `state.displacement` becomes the linear spring's that carries the same force.
inline Vec3<double> partial_slip_step(const FinnieRabinowicz& law, double normal_force, double stiffness, double damping,
                                      double contact_area, const Vec3<double>& velocity, double dt, FrictionState<double>& state,
                                      SlipRings& rings) {
  constexpr int middle = SlipRings::count - 1;
  // The forces of a moment that is over; see friction_step().
  if (dt == 0.0 && state.slip > 0.0 && detail::was_sliding(law, normal_force, stiffness, contact_area, state))
    return -stiffness * state.displacement;
  auto& u = rings.displacement;
  const Vec3<double> increment = velocity * dt;
  const double a = std::sqrt(contact_area / pi), held = stored_energy(rings, stiffness);
  detail::follow(rings, a);
  double lost = held - stored_energy(rings, stiffness);

  // Limit of the displacement of ring i (m) per limit of the whole contact (N): its share of the normal force over that of the stiffness.
  const auto yield = [&](int i) {
    const double high = std::min(rings.edge(i), a) / a, low = rings.edge(i + 1) / a;
    return (1.5 - 0.5 * (high * high + high * low + low * low)) / stiffness;
  };
  const auto start = u;
  for (auto& displacement : u) displacement += increment;

  double limit = shear_limit(law, friction_coefficient(law, state.slip), normal_force, contact_area);
  const double trial = norm(u[middle]), softness = yield(middle);
  const bool slides = trial > limit * softness;
  if (slides) {
    const double slip = detail::slip_to_limit(law, 1.0 / softness, trial, state.slip, normal_force, contact_area);
    state.slip += slip;
    limit = (trial - slip) / softness;
  }
  Vec3<double> sum{};
  for (int i = 0; i < SlipRings::count; ++i) {
    const double fraction = rings.width(i, a) / a, size = norm(u[i]), most = limit * yield(i);
    if (size > most) {
      const Vec3<double> slid = u[i] * (1.0 - most / size);
      u[i] -= slid;
      lost += 0.5 * stiffness * fraction * dot(start[i] + u[i], slid);
    }
    sum += fraction * u[i];
  }
  state.displacement = sum;
  if (lost > 0.0) state.dissipated_energy += lost;
  if (slides) return -stiffness * sum;
  return sticking_force(stiffness, damping, velocity, dt, state.slip > 0.0 ? kept_slip(law, dt) : 0.0, state);
}

}  // namespace dembark
