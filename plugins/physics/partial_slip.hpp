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

#include "constants.hpp"
#include "finnie_rabinowicz.hpp"
#ifndef DEMBARK_DEVICE
#include "pack.hpp"
#endif

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

struct RingEdges {
  double at[SlipRings::count + 1] = {1.0};
  constexpr RingEdges() {
    for (int i = 1; i < SlipRings::count; ++i) at[i] = at[i - 1] / SlipRings::ratio;
  }
};
/// Edges of the rings, in units of `outer`; the outer edge of a ring is the inner one of the ring before.
DEMBARK_HOT const double* ring_edges() {
  static constexpr RingEdges edges;  // in a function: device code cannot use a constant array of the processor
  return edges.at;
}

/// How far ring i lies inside of the radius a (m).
DEMBARK_FUNCTION inline double ring_width(const SlipRings& rings, int i, double a) {
  const double* const edges = ring_edges();
  return std::min(rings.outer * edges[i], a) - std::min(rings.outer * edges[i + 1], a);
}

/// What a ring bears of the normal force over what it has of the stiffness; edges in units of the contact radius.
template <class Real>
DEMBARK_HOT Real pressure(const Real& high, const Real& low) {
  return 1.5 - 0.5 * (high * (high + low) + low * low);
}

}  // namespace detail

/// Elastic energy (J) of the springs for k_t (N/m).
DEMBARK_FUNCTION inline double stored_energy(const SlipRings& rings, double stiffness) {
  if (!(rings.radius > 0.0)) return 0.0;
  double sum = 0.0;
  for (int i = 0; i < SlipRings::count; ++i)
    sum += detail::ring_width(rings, i, rings.radius) * (rings.along[i] * rings.along[i] + rings.across[i] * rings.across[i]);
  return 0.5 * stiffness / rings.radius * sum;
}

namespace detail {

template <class Real>
DEMBARK_HOT auto is_unit(const Real& squared) {
  return (squared > 1.0 - 1e-3) & (squared < 1.0 + 1e-3);
}

/// Whether a contact radius `a` (m) after `radius` lies in the first ring, as that did.
template <class Real>
DEMBARK_HOT auto edges_stay(const Real& outer, const Real& radius, const Real& a) {
  return (radius > 0.0) & !(a > outer) & !(a * SlipRings::ratio < outer);
}

/// The displacements of the rings when the edges have moved outwards by a ring: the two innermost, of these widths, become one.
DEMBARK_FUNCTION inline void move_outwards(std::array<double, SlipRings::count>& u, double middle, double next) {
  constexpr int last = SlipRings::count - 1;
  if (middle + next > 0.0) u[last] = (middle * u[last] + next * u[last - 1]) / (middle + next);
  for (int i = last - 1; i > 0; --i) u[i] = u[i - 1];
  u[0] = 0.0;
}

/// The same inwards: the outermost has left the contact, the innermost becomes two.
DEMBARK_FUNCTION inline void move_inwards(std::array<double, SlipRings::count>& u) {
  for (int i = 0; i < SlipRings::count - 1; ++i) u[i] = u[i + 1];
}

/// The rings of a contact whose radius `a` (m) leaves its first ring: edges move by whole rings. Returns the energy lost (J) per k_t.
DEMBARK_COLD inline double shift(SlipRings& rings, double a) {
  const double before = stored_energy(rings, 1.0);
  constexpr int last = SlipRings::count - 1;
  if (!(rings.outer > 0.0)) rings.outer = a;
  while (a > rings.outer) {
    const double middle = ring_width(rings, last, rings.radius), next = ring_width(rings, last - 1, rings.radius);
    move_outwards(rings.along, middle, next);
    move_outwards(rings.across, middle, next);
    rings.outer *= SlipRings::ratio;
  }
  while (a * SlipRings::ratio < rings.outer) {
    move_inwards(rings.along);
    move_inwards(rings.across);
    rings.outer /= SlipRings::ratio;
  }
  for (int i = 0; i <= last; ++i) {  // springs that join are without load
    const double now = ring_width(rings, i, a), was = ring_width(rings, i, rings.radius);
    if (!(now > was)) continue;
    rings.along[i] *= was / now;
    rings.across[i] *= was / now;
  }
  rings.radius = a;
  return before - stored_energy(rings, 1.0);
}

/// The rings of a new contact, of one whose normal jumped, or of one whose radius `a` (m) leaves the first ring. Returns the energy lost
/// (J) per k_t.
DEMBARK_COLD inline double rearrange(SlipRings& rings, const Vec3<double>& normal, double twist, double a) {
  rings.axis = rotate_to_plane(rings.axis, normal, twist);
  if (!is_unit(dot(rings.axis, rings.axis))) {
    rings.axis = std::abs(normal.x) < 0.6 ? Vec3<double>{0.0, normal.z, -normal.y} : Vec3<double>{-normal.z, 0.0, normal.x};
    rings.axis *= 1.0 / norm(rings.axis);
  }
  return edges_stay(rings.outer, rings.radius, a) ? 0.0 : shift(rings, a);
}

}  // namespace detail

/// What a step does to the rings of a contact (`Real` is double) or of a pack of them, as long as edges stay: springs that leave the
/// contact or join it are those of the first ring.
template <class Real>
struct RingMotion {
  Real size;           ///< edge of the first ring over the radius of the contact
  Real along, across;  ///< m, displacement of this step
  Real kept;           ///< share of its displacement that the first ring keeps: springs that join are without load
  Real released;       ///< N/m, energy lost with springs that join or leave, over the first ring's displacement squared
  Real stiffness;      ///< N/m, k_t
};

template <class Real>
struct RingStep {
  Vec3<Real> axis, other;  ///< unit, along and across
  Real radius;             ///< m, of the contact
  RingMotion<Real> motion;
  decltype(Real() < Real()) goes_on;  ///< false: a new contact, a normal that jumped, or edges that move; only `radius` is valid then
};

/// `axis`, `outer` and `radius` are those of the rings after the last step, the rest as in partial_slip_step().
template <class Real>
DEMBARK_HOT RingStep<Real> ring_step(const Vec3<Real>& axis, Real outer, Real radius, const Vec3<Real>& normal, Real twist, Real stiffness,
                                     Real contact_area, const Vec3<Real>& velocity, Real dt) {
  using std::sqrt;
  RingStep<Real> s;
  s.axis = rotate_to_plane(axis, normal, twist);
  const Real length = dot(s.axis, s.axis);
  s.axis *= 1.5 - 0.5 * length;
  s.other = cross(normal, s.axis);
  s.radius = sqrt(contact_area / pi);
  const Real edge = outer * detail::ring_edges()[1], before = radius - edge, now = s.radius - edge;
  const auto grows = now > before;
  const Real kept = select(grows, before / now, Real(1.0));
  s.motion = {outer / s.radius,
              dot(velocity, s.axis) * dt,
              dot(velocity, s.other) * dt,
              kept,
              0.5 * stiffness / s.radius * select(grows, before * (1.0 - kept), before - now),
              stiffness};
  s.goes_on = detail::is_unit(length) & detail::edges_stay(outer, radius, s.radius);
  return s;
}

/// Means of the rings' displacements (m) over the contact: that of the linear spring that carries the same force; and the energy lost (J).
struct RingSums {
  double along, across, lost;
};

namespace detail {

/// Rings that are worked on at once: as many as a pack has lanes, or one as a plain number.
template <class P>
struct Lanes {
  static constexpr int count = P::size;
  DEMBARK_HOT static P load(const double* from) { return P::load(from); }
  DEMBARK_HOT static void store(const P& p, double* to) { p.store(to); }
  DEMBARK_HOT static void set_first(P& p, double value) { p.lanes[0] = value; }
  DEMBARK_HOT static void scale_first(P& p, double factor) { p.lanes[0] *= factor; }
};
template <>
struct Lanes<double> {
  static constexpr int count = 1;
  DEMBARK_HOT static double load(const double* from) { return *from; }
  DEMBARK_HOT static void store(double p, double* to) { *to = p; }
  DEMBARK_HOT static void set_first(double& p, double value) { p = value; }
  DEMBARK_HOT static void scale_first(double& p, double factor) { p *= factor; }
};

#ifdef DEMBARK_DEVICE
typedef double RingLanes;
#else
typedef Pack<2> RingLanes;
#endif

}  // namespace detail

/// The step of the rings of one contact, in place, as many at a time as a pack `P` has lanes, with the same bits for any. `limit` (N): of
/// the whole contact. Returns whether the middle ring would pass its limit; nothing has changed then, unless the contact is known to be
/// `sliding` as a whole.
template <class P>
DEMBARK_HOT bool move_rings(const RingMotion<double>& motion, double limit, bool sliding, double* along, double* across, RingSums& sums) {
  using std::sqrt;
  typedef detail::Lanes<P> Lanes;
  constexpr int N = Lanes::count, parts = SlipRings::count / N;
  const double* const edges = detail::ring_edges();
  const double first = along[0] * along[0] + across[0] * across[0], reach = limit / motion.stiffness;
  P sum_along[parts], sum_across[parts], lost[parts];
  bool slipped = false;
#ifndef __NVCC__  // which unrolls by itself
#pragma GCC unroll 8
#endif
  for (int part = parts - 1; part >= 0; --part) {
    const int at = part * N;
    P high = motion.size * Lanes::load(edges + at), x = Lanes::load(along + at), y = Lanes::load(across + at);
    const P low = motion.size * Lanes::load(edges + at + 1);
    if (part == 0) {
      Lanes::set_first(high, 1.0);
      Lanes::scale_first(x, motion.kept);
      Lanes::scale_first(y, motion.kept);
    }
    const P width = high - low, most = reach * detail::pressure(high, low), start_x = x, start_y = y;
    x += motion.along;
    y += motion.across;
    lost[part] = 0.0;
    const P squared = x * x + y * y;
    const auto beyond = squared > most * most;
    if (const unsigned which = bits(beyond)) {  // few rings slip at a time, mostly those at the rim
      if (part == parts - 1 && which >> (N - 1) && !sliding) return true;
      const P left = select(beyond, most / sqrt(squared), P(1.0)), slid_x = x * (1.0 - left), slid_y = y * (1.0 - left);
      x *= left;
      y *= left;
      lost[part] = width * ((start_x + x) * slid_x + (start_y + y) * slid_y);
      slipped = true;
    }
    Lanes::store(x, along + at);
    Lanes::store(y, across + at);
    sum_along[part] = width * x;
    sum_across[part] = width * y;
  }
  sums = {sum(sum_along), sum(sum_across), motion.released * first};
  if (slipped) sums.lost += 0.5 * motion.stiffness * sum(lost);
  return false;
}

/// The limit (N) of a contact that slides as a whole, to go on with in move_rings(): the return of the middle ring to the limit curve,
/// which adds to the `slip` (m).
DEMBARK_FUNCTION inline double sliding_limit(const FinnieRabinowicz& law, const RingMotion<double>& motion, const double* along,
                                             const double* across, double normal_force, double contact_area, double& slip) {
  constexpr int middle = SlipRings::count - 1;
  const double softness = detail::pressure(motion.size * detail::ring_edges()[middle], 0.0) / motion.stiffness;
  const double x = along[middle] + motion.along, y = across[middle] + motion.across, trial = std::sqrt(x * x + y * y);
  const double more = detail::slip_to_limit(law, 1.0 / softness, trial, slip, normal_force, contact_area);
  slip += more;
  return (trial - more) / softness;
}

/// One step of the law with partial slip: as friction_step(), with `rings` in the contact plane of the last step, which turns to `normal`
/// and by `twist` (rad, see rotate_to_plane). The radius of the contact follows from its area. `state.displacement` becomes the linear
/// spring's that carries the same force.
DEMBARK_FUNCTION inline Vec3<double> partial_slip_step(const FinnieRabinowicz& law, const Vec3<double>& normal, double twist,
                                                       double normal_force, double stiffness, double damping, double contact_area,
                                                       const Vec3<double>& velocity, double dt, FrictionState<double>& state,
                                                       SlipRings& rings) {
  // The forces of a moment that is over; see friction_step().
  if (dt == 0.0 && state.slip > 0.0 && detail::was_sliding(law, normal_force, stiffness, contact_area, state))
    return -stiffness * rotate_to_plane(state.displacement, normal, twist);

  const auto begin = [&](double turn) __attribute__((always_inline)) {
    return ring_step(rings.axis, rings.outer, rings.radius, normal, turn, stiffness, contact_area, velocity, dt);
  };
  RingStep<double> step = begin(twist);
  double lost = 0.0;
  if (!step.goes_on) {
    if (!(step.radius > 0.0)) {
      rings = {};
      state.displacement = {};
      return {};
    }
    lost = stiffness * detail::rearrange(rings, normal, twist, step.radius);
    step = begin(0.0);
  }
  rings.axis = step.axis;
  rings.radius = step.radius;

  double limit = shear_limit(law, friction_coefficient(law, state.slip), normal_force, contact_area);
  double *const along = rings.along.data(), *const across = rings.across.data();
  bool slides = false;
  RingSums sums;
  while (move_rings<detail::RingLanes>(step.motion, limit, slides, along, across, sums)) {
    slides = true;
    limit = sliding_limit(law, step.motion, along, across, normal_force, contact_area, state.slip);
  }
  lost += sums.lost;
  if (lost > 0.0) state.dissipated_energy += lost;
  state.displacement = sums.along * step.axis + sums.across * step.other;
  if (slides) return -stiffness * state.displacement;
  return sticking_force(stiffness, damping, velocity, dt, state.slip > 0.0 ? kept_slip(law, dt) : 0.0, state);
}

}  // namespace dembark
