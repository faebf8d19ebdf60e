// Logs in space: capsules, cylinders with rounded ends. Their inertia, and where two of them, or one and a wall, touch.
//
// A capsule is what lies within its radius of a segment. Two capsules touch where their segments come close, so a contact is that of two
// circles whose centres lie off those of the bodies. Where the axes are parallel but for an angle, two points stand for the line of
// contact, each with half of the stiffness s: the ends of the common segment. So parallel capsules rest on each other without rocking.
// Where the axes cross at a larger angle, or an end touches, there is one point with all of s. In between all moves without a jump, with
//     c = |skew| L / (crossing r),   f(x) = x^2 (3 - 2 x),   f = 0 below x = 0 and 1 above x = 1,
// L the length of the common segment, r the mean radius, skew the difference of the axes at right angles to the normal: the two points move
// together to the crossing, by f(c - 1) of their way, and then the first one takes f(c - 2) of the share of the other, as it takes
// f(2 - L / (crossing r)) where the common segment ends. A tilt leaves the end that is ahead: with g the growth of the gap from one point
// to the other along the whole common segment,
//     share = (1 -+ f(|g| / (tilted r))) / 2
// of the stiffness is at the point ahead (+) and at that behind (-). So the stiffness of both is always s, that of the cross-section.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "rotation.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// Of the mean radius; see above.
constexpr double crossing = 0.02, tilted = 0.1;

/// Moments of inertia of a capsule through its centre, kg m^2.
struct CapsuleInertia {
  double axial, across;  ///< about the axis; about any axis at right angles to it
};

/// Of a solid one with uniform density: a cylinder of `length` (m, between the centres of its caps) and two half balls. Exact;
/// infinite of an infinite mass.
inline CapsuleInertia capsule_inertia(double mass, double radius, double length) {
  if (std::isinf(mass)) return {mass, mass};
  const double cylinder = mass * length / (length + 4.0 / 3.0 * radius), caps = mass - cylinder, r2 = radius * radius;
  return {cylinder * r2 / 2.0 + caps * 0.4 * r2,
          cylinder * (length * length / 12.0 + r2 / 4.0) + caps * (0.4 * r2 + length * length / 4.0 + 0.375 * length * radius)};
}

/// A body with a length. Only `Body` takes part in contacts; begin() sets the half axis.
struct Capsule : Body {
  double length = 0.0;       ///< m, >= 0, between the centres of the caps
  Quaternion orientation{};  ///< from the axes of the body, z along its own, to space

  void begin() { half_axis = (0.5 * length) * normalised(orientation).turned({0.0, 0.0, 1.0}); }
  // NOLINTNEXTLINE(bugprone-derived-method-shadowing-base-method): of an archive, which knows the type
  auto fields() { return std::tuple_cat(Body::fields(), std::tie(axial_inertia, length, orientation)); }
};

/// Where two segments come closest: so far (m) from the centres along the axes.
struct ClosestPair {
  double along_a, along_b;
};

/// a, b: half lengths (m), u, v: unit axes, d: from the centre of b to that of a (m).
inline ClosestPair closest_pair(double a, const Vec3<double>& u, double b, const Vec3<double>& v, const Vec3<double>& d) {
  const auto within = [](double x, double half) { return std::max(-half, std::min(half, x)); };
  const double uv = dot(u, v), du = dot(d, u), dv = dot(d, v);
  const Vec3<double> sine = cross(u, v);
  const double square = dot(sine, sine);  // of the sine of their angle, to all digits
  double s = square > 0.0 ? within((uv * dv - du) / square, a) : 0.0;
  const double t = within(dv + s * uv, b);
  s = within(t * uv - du, a);
  return {s, within(dv + s * uv, b)};
}

/// m, between the surfaces of two bodies.
inline double segment_gap(const Body& a, const Body& b) {
  const double half_a = norm(a.half_axis), half_b = norm(b.half_axis);
  const Vec3<double> d = a.position - b.position, z{0.0, 0.0, 1.0};
  const Vec3<double> u = half_a > 0.0 ? a.half_axis * (1.0 / half_a) : z, v = half_b > 0.0 ? b.half_axis * (1.0 / half_b) : u;
  const ClosestPair at = closest_pair(half_a, u, half_b, v, d);
  return norm(d + at.along_a * u - at.along_b * v) - a.radius - b.radius;
}

namespace detail {

inline double smooth_step(double x) { return x <= 0.0 ? 0.0 : x < 1.0 ? x * x * (3.0 - 2.0 * x) : 1.0; }

/// Share of the stiffness at a point from which the gap grows by `growth` (m) towards the other one.
inline double point_share(double growth, double radius) {
  const double part = smooth_step(std::fabs(growth) / (tilted * radius));
  return growth < 0.0 ? 0.5 * (1.0 - part) : 0.5 * (1.0 + part);
}

/// A unit vector at right angles to u, or to both u and v where they are not parallel.
inline Vec3<double> any_normal(const Vec3<double>& u, const Vec3<double>& v) {
  Vec3<double> n = cross(u, v);
  if (!(dot(n, n) > 1e-20)) n = std::fabs(u.x) < 0.6 ? cross(u, {1.0, 0.0, 0.0}) : cross(u, {0.0, 1.0, 0.0});
  return n * (1.0 / norm(n));
}

}  // namespace detail

/// The contacts of two bodies, one or both of them capsules, with gap <= reach (m): the first point is appended to `first`, the second one,
/// if any, to `second`. i, j: their indices; a has the lower id.
inline void capsule_contacts(const Body& a, int i, const Body& b, int j, double reach, std::vector<Contact>& first,
                             std::vector<Contact>& second) {
  const double half_a = norm(a.half_axis), half_b = norm(b.half_axis), touch = a.radius + b.radius, far = touch + reach;
  const Vec3<double> d = a.position - b.position;
  const double beyond = far + half_a + half_b;
  if (dot(d, d) > beyond * beyond) return;
  // A ball has any axis.
  const Vec3<double> u = half_a > 0.0 ? a.half_axis * (1.0 / half_a) : Vec3<double>{0.0, 0.0, 1.0};
  const Vec3<double> v = half_b > 0.0 ? b.half_axis * (1.0 / half_b) : u;
  const ClosestPair closest = closest_pair(half_a, u, half_b, v, d);
  const double sense = dot(u, v) < 0.0 ? -1.0 : 1.0;
  const auto between = [&](double way) { return d + (closest.along_a + way) * u - (closest.along_b + sense * way) * v; };
  const Vec3<double> nearest = between(0.0);
  const double square = dot(nearest, nearest);
  if (square > far * far) return;
  const auto direction = [&](const Vec3<double>& arm, double distance) {
    return distance > 0.0 ? arm * (1.0 / distance) : detail::any_normal(u, v);
  };
  // The common segment reaches so far ahead and back of the closest points.
  const double ahead = std::max(0.0, std::min(half_a - closest.along_a, half_b - sense * closest.along_b));
  const double back = std::max(0.0, std::min(half_a + closest.along_a, half_b + sense * closest.along_b));
  const Vec3<double> normal = direction(nearest, std::sqrt(square)), apart = u - sense * v;
  const double tilt = dot(normal, apart), skew = norm(apart - tilt * normal), radius = 0.5 * touch;
  const double length = (ahead + back) / (crossing * radius), crossed = skew * length, growth = tilt * (ahead + back);
  const auto add = [&](double at, double part, int point, std::vector<Contact>& contacts) {
    const Vec3<double> arm = between(at);
    const double distance = norm(arm), gap = distance - touch;
    if (gap > reach || part == 0.0) return;
    Contact c;
    c.a = i, c.b = j, c.key_a = a.id, c.key_b = body_key(b.id, point);
    c.gap = gap;
    c.normal = direction(arm, distance);
    c.lever = true;
    c.share = part;
    c.offset_a = (closest.along_a + at) * u;
    c.offset_b = (closest.along_b + sense * at) * v;
    contacts.push_back(c);
  };
  const double way = 1.0 - detail::smooth_step(crossed - 1.0);
  const double share =
      detail::point_share(-growth, radius) * (1.0 - detail::smooth_step(crossed - 2.0)) * (1.0 - detail::smooth_step(2.0 - length));
  add(-way * back, 1.0 - share, 0, first);
  add(way * ahead, share, 1, second);
}

}  // namespace impact
}  // namespace dembark
