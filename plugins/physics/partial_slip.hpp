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
// the springs of both sides are gathered in eight rings whose edges stand at outer / q^i, outer following the contact radius; the pressure
// is integrated over each ring. Under a constant normal force the curve lies within 1 % of mu N of Cattaneo's and Mindlin's; a cycle
// that stays below a sixth of the displacement at which all slides slips nowhere.
//
// Limits: a ring at its limit everywhere is the contact that slides as a whole, with the limit T_max of finnie_rabinowicz.hpp; far below
// the limit at a constant radius it is the linear spring k_t. Units SI.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "finnie_rabinowicz.hpp"
#include "normal_force.hpp"  // pi
#include "pack.hpp"

namespace dembark {

/// The springs of one contact: displacements (m) in the contact plane along `axis` and across it, from the rim inwards, positive as
/// body 1 moves. An engine keeps them beside the FrictionState and forgets them when the contact ends.
struct SlipRings {
  static constexpr int count = 8;
  static constexpr double ratio = 1.2;  ///< q, of neighbouring edges

  std::array<double, count> along{}, across{};
  Vec3<double> axis{};  ///< unit, in the contact plane, with which it turns
  double outer = 0.0;   ///< m, edge of the first ring; 0 = never touched
  double radius = 0.0;  ///< m, of the contact in the last step
};

namespace detail {

typedef Pack<SlipRings::count> Rings;  // one number for each ring

/// Inner edges of the rings, in units of `outer`; the outer edge of a ring is the inner one of the ring before.
constexpr double ring_edges[SlipRings::count + 1] = {1.0,
                                                     1.0 / 1.2,
                                                     0.694444444444444444,
                                                     0.578703703703703703,
                                                     0.482253086419753086,
                                                     0.401877572016460905,
                                                     0.334897976680384087,
                                                     0.279081647233653406,
                                                     0.0};

DEMBARK_HOT double sum(const Rings& p) { return ((p[0] + p[1]) + (p[2] + p[3])) + ((p[4] + p[5]) + (p[6] + p[7])); }

/// How far ring i lies inside of the radius a (m).
inline double ring_width(const SlipRings& rings, int i, double a) {
  return std::min(rings.outer * ring_edges[i], a) - std::min(rings.outer * ring_edges[i + 1], a);
}

}  // namespace detail

/// Elastic energy (J) of the springs for k_t (N/m).
inline double stored_energy(const SlipRings& rings, double stiffness) {
  if (!(rings.radius > 0.0)) return 0.0;
  double sum = 0.0;
  for (int i = 0; i < SlipRings::count; ++i)
    sum += detail::ring_width(rings, i, rings.radius) * (rings.along[i] * rings.along[i] + rings.across[i] * rings.across[i]);
  return 0.5 * stiffness / rings.radius * sum;
}

namespace detail {

/// The rings of a contact whose radius `a` (m) leaves its first ring: edges move by whole rings. Returns the energy lost (J) per k_t.
DEMBARK_COLD inline double shift(SlipRings& rings, double a) {
  const double held = stored_energy(rings, 1.0);
  constexpr int last = SlipRings::count - 1;
  if (!(rings.outer > 0.0)) rings.outer = a;
  while (a > rings.outer) {  // the two innermost rings become one
    const double middle = ring_width(rings, last, rings.radius), next = ring_width(rings, last - 1, rings.radius);
    for (auto* u : {&rings.along, &rings.across}) {
      if (middle + next > 0.0) (*u)[last] = (middle * (*u)[last] + next * (*u)[last - 1]) / (middle + next);
      std::copy_backward(u->begin(), u->end() - 2, u->end() - 1);
      (*u)[0] = 0.0;
    }
    rings.outer *= SlipRings::ratio;
  }
  while (a * SlipRings::ratio < rings.outer) {  // the outermost has left the contact, the innermost becomes two
    for (auto* u : {&rings.along, &rings.across}) std::copy(u->begin() + 1, u->end(), u->begin());
    rings.outer /= SlipRings::ratio;
  }
  for (int i = 0; i <= last; ++i) {  // springs that join are without load
    const double now = ring_width(rings, i, a), before = ring_width(rings, i, rings.radius);
    if (!(now > before)) continue;
    rings.along[i] *= before / now;
    rings.across[i] *= before / now;
  }
  rings.radius = a;
  return held - stored_energy(rings, 1.0);
}

/// The rings for the contact radius `a` (m). Returns the energy lost (J) per k_t: that of springs that have left the contact, and what
/// the mean of a ring does not know of those that join.
DEMBARK_HOT double follow(SlipRings& rings, double a) {
  if (a > rings.outer || a * SlipRings::ratio < rings.outer || !(rings.radius > 0.0)) return shift(rings, a);
  const double edge = rings.outer * ring_edges[1], before = rings.radius - edge, now = a - edge;
  const double squared = rings.along[0] * rings.along[0] + rings.across[0] * rings.across[0];
  rings.radius = a;
  if (!(now > before)) return 0.5 / a * (before - now) * squared;
  rings.along[0] *= before / now;
  rings.across[0] *= before / now;
  return 0.5 / a * before * squared * (1.0 - before / now);
}

}  // namespace detail

/// One step of the law with partial slip: as friction_step(), with `rings` in the contact plane of the last step, which turns to `normal`
/// and by `twist` (rad, see rotate_to_plane). The radius of the contact follows from its area. `state.displacement` becomes the linear
/// spring's that carries the same force.
inline Vec3<double> partial_slip_step(const FinnieRabinowicz& law, const Vec3<double>& normal, double twist, double normal_force,
                                      double stiffness, double damping, double contact_area, const Vec3<double>& velocity, double dt,
                                      FrictionState<double>& state, SlipRings& rings) {
  using detail::Rings;
  // The forces of a moment that is over; see friction_step().
  if (dt == 0.0 && state.slip > 0.0 && detail::was_sliding(law, normal_force, stiffness, contact_area, state))
    return -stiffness * rotate_to_plane(state.displacement, normal, twist);

  rings.axis = rotate_to_plane(rings.axis, normal, twist);
  const double length = dot(rings.axis, rings.axis);
  if (!(std::abs(length - 1.0) < 1e-3)) {  // a new contact, or a normal that jumped
    rings.axis = std::abs(normal.x) < 0.6 ? Vec3<double>{0.0, normal.z, -normal.y} : Vec3<double>{-normal.z, 0.0, normal.x};
    rings.axis *= 1.0 / norm(rings.axis);
  } else {
    rings.axis *= 1.5 - 0.5 * length;
  }
  const Vec3<double> other = cross(normal, rings.axis);

  const double a = std::sqrt(contact_area / pi);
  if (!(a > 0.0)) {
    rings = {};
    state.displacement = {};
    return {};
  }
  double lost = stiffness * detail::follow(rings, a);

  // Widths in units of the radius, and the displacement (m) at which each ring yields per limit (N) of the whole contact: its fraction of
  // the normal force over that of the stiffness.
  const double size = rings.outer / a;
  Rings high = size * Rings::load(detail::ring_edges), low = size * Rings::load(detail::ring_edges + 1);
  high.lanes[0] = 1.0;
  const Rings width = high - low, yield = (1.5 - 0.5 * (high * (high + low) + low * low)) * (1.0 / stiffness);

  const Rings start_along = Rings::load(rings.along.data()), start_across = Rings::load(rings.across.data());
  Rings along = start_along + dot(velocity, rings.axis) * dt, across = start_across + dot(velocity, other) * dt;

  constexpr int middle = SlipRings::count - 1;
  double limit = shear_limit(law, friction_coefficient(law, state.slip), normal_force, contact_area);
  const double reached = along[middle] * along[middle] + across[middle] * across[middle], softness = yield[middle];
  const bool slides = reached > limit * softness * limit * softness;
  if (slides) {
    const double trial = std::sqrt(reached);
    const double slip = detail::slip_to_limit(law, 1.0 / softness, trial, state.slip, normal_force, contact_area);
    state.slip += slip;
    limit = (trial - slip) / softness;
  }
  along.store(rings.along.data());
  across.store(rings.across.data());
  const Rings most = limit * yield;
  // Few rings slip at a time, mostly those at the rim.
  for (unsigned beyond = bits(along * along + across * across > most * most); beyond != 0; beyond &= beyond - 1) {
    const int i = __builtin_ctz(beyond);
    double &x = rings.along[i], &y = rings.across[i];
    const double kept = most[i] / std::sqrt(x * x + y * y), slid_x = x * (1.0 - kept), slid_y = y * (1.0 - kept);
    x *= kept;
    y *= kept;
    lost += 0.5 * stiffness * width[i] * ((start_along[i] + x) * slid_x + (start_across[i] + y) * slid_y);
  }
  along = Rings::load(rings.along.data());
  across = Rings::load(rings.across.data());
  state.displacement = detail::sum(width * along) * rings.axis + detail::sum(width * across) * other;
  if (lost > 0.0) state.dissipated_energy += lost;
  if (slides) return -stiffness * state.displacement;
  return sticking_force(stiffness, damping, velocity, dt, state.slip > 0.0 ? kept_slip(law, dt) : 0.0, state);
}

}  // namespace dembark
