// When hard grains touch each other, or a wall.
//
// Two grains that fall freely move along a straight line, seen from each other: their distance is the root of a parabola, solved in the
// form that does not cancel. Grains that overlap, by rounding, and approach touch at once: no overlap grows (M. N. Bannerman, S. Strobl,
// A. Formella, T. Poeschel, Comput. Part. Mech. 1 (2014) 191).
//
// A wall follows a prescribed motion. Its gap f(t) to a grain has f'' >= m with m = n.g - (bound of the wall's acceleration), except at the
// times where the wall's velocity jumps; from a time t with f >= 0 on it is not zero before the lower parabola
//     f + f' s + m s^2 / 2
// is. The search goes from one such time to the next, never farther than to the next jump, and so from below to the first contact: it can
// neither miss a contact nor pass it, however close to tangent the motions are, and converges quadratically for others. Where the wall's
// displacement has a bound it starts, and goes on, where the grain reaches the range of the wall.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "../motion/prescribed_motion.hpp"
#include "collision.hpp"

namespace dembark::events {

constexpr double never = std::numeric_limits<double>::infinity();

/// First s >= 0 at which gap + rate s + bend s^2 / 2 falls to zero, for a gap >= 0; a gap below zero is one of rounding, and counts as
/// zero.
inline double first_zero(double gap, double rate, double bend) {
  if (gap <= 0.0) {
    if (rate < 0.0 || (rate == 0.0 && bend < 0.0)) return 0.0;
    return bend < 0.0 ? -2.0 * rate / bend : never;
  }
  const double discriminant = rate * rate - 2.0 * bend * gap;
  if (rate < 0.0) return discriminant < 0.0 ? never : 2.0 * gap / (std::sqrt(discriminant) - rate);
  return bend < 0.0 ? (rate + std::sqrt(discriminant)) / -bend : never;
}

/// Time (s) until two grains whose radii (m) add up to `reach` touch; `place`, `velocity`: of one seen from the other; `latest`: contacts
/// that are later are not needed.
inline double pair_contact(const Vector& place, const Vector& velocity, double reach, double latest) {
  const double b = dot(place, velocity);
  if (!(b < 0.0)) return never;
  const double c = dot(place, place) - reach * reach;
  if (c <= 0.0) return 0.0;
  if (c > -2.0 * b * latest) return never;
  const double discriminant = b * b - dot(velocity, velocity) * c;
  return discriminant > 0.0 ? c / (std::sqrt(discriminant) - b) : never;
}

/// A plane of infinite mass, free space on the side of its normal.
struct Wall {
  Vector point{}, normal{0.0, 0.0, 1.0};  ///< m, at t = 0, and a unit vector
  PrescribedMotion motion;                ///< it does not turn
  CollisionLaw law;
};

/// Gap (m) of a grain to a wall, with its first and second derivative.
struct WallGap {
  double gap, rate, bend;
};

/// The flight of a grain from `start` (s) on.
struct Flight {
  double start;
  Vector position, velocity, gravity;
  double radius;

  WallGap to(const Wall& wall, double t) const {
    const double s = t - start;
    const WallState w = wall.motion.at(t);
    return {dot(position - wall.point - w.displacement + s * (velocity + (0.5 * s) * gravity), wall.normal) - radius,
            dot(velocity + s * gravity - w.velocity, wall.normal), dot(gravity - w.acceleration, wall.normal)};
  }
};

struct WallContact {
  double time;   ///< s; there is none before
  bool touches;  ///< or the search ended here, to be taken up again
};

/// The first contact from flight.start on, up to `latest` (s).
inline WallContact wall_contact(const Flight& flight, const Wall& wall, const motion::Bounds& bounds, double latest) {
  const double fall = dot(flight.gravity, wall.normal), bend = fall - bounds.acceleration;
  if (bounds.displacement == 0.0) {
    const double gap = dot(flight.position - wall.point, wall.normal) - flight.radius;
    return {flight.start + first_zero(gap, dot(flight.velocity, wall.normal), fall), true};
  }
  // In which a grain at rest on the wall overlaps it by less than rounding does.
  const double eps = 4.0 * std::numeric_limits<double>::epsilon(), least = bend < 0.0 ? eps * std::sqrt(-flight.radius / bend) : 0.0;
  double t = flight.start;
  for (int k = 0; k < 200; ++k) {
    // Outside of the range of the wall.
    if (bounds.displacement < never) {
      const double s = t - flight.start;
      const double out = dot(flight.position - wall.point + s * (flight.velocity + (0.5 * s) * flight.gravity), wall.normal) -
                         flight.radius - bounds.displacement;
      if (out > 0.0) t += first_zero(out, dot(flight.velocity + s * flight.gravity, wall.normal), fall);
    }
    if (t == never || t > latest) return {never, true};
    const WallGap now = flight.to(wall, t);
    const double resolution = eps * std::fabs(t) + least;
    const double free = first_zero(now.gap, now.rate, bend), jump = wall.motion.next_jump(t);
    if ((now.rate < 0.0 || (now.rate == 0.0 && now.bend < 0.0)) && free <= resolution) return {t, true};
    if (free == never && jump == never) return {never, true};
    if (jump <= t + free) t = jump;
    else t += std::max(free, resolution);
  }
  return {t, false};
}

}  // namespace dembark::events
