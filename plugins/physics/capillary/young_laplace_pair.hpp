// Axisymmetric liquid bridge between two spheres of unequal size, or a sphere and a plane: the solutions of Young and Laplace, and the
// stable one of given volume and gap.
//
// Lengths in R = 2 R* = 2 R1 R2 / (R1 + R2), force in gamma R. The spheres have the curvatures 1 + e (body 1, the smaller) and 1 - e, with
// the asymmetry e = (R2 - R1) / (R1 + R2), 0 = equal, 1 = a plane. With t the arc length of the meridian from the contact line on body 1
// (radius r1, slope phi1 against the radius) and p the pressure inside minus outside, the first integral of young_laplace.hpp gives
//   r^2 - r1^2 = 2 r1 cos(phi1) t sinc(p t) + (1 - p r1 sin(phi1)) t^2 sinc^2(p t/2) = D(t),     r sin(phi) = r1 sin(phi1) + p D/2,
// regular for every pressure. A meridian is fixed by the half-filling angle b1 on body 1 (r1 = sin(b1) / (1 + e), phi1 = pi - b1 - theta),
// p L and its length L; it is a bridge when it meets body 2 at the contact angle, sin(phi2 - theta) = (1 - e) r2.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "young_laplace.hpp"

namespace dembark::capillary {

/// ln(b1 / (1 + e)), p L, ln(L).
struct PairCoordinates : std::array<double, 3> {};
/// From `a` a part of the way to `b`, or on beyond it.
inline PairCoordinates between(const PairCoordinates& a, const PairCoordinates& b, double part) {
  PairCoordinates c;
  for (int k = 0; k < 3; ++k) c[k] = a[k] + part * (b[k] - a[k]);
  return c;
}

/// A meridian from body 1 to the height of body 2, in units of R and gamma.
struct PairShape {
  bool valid = false;  ///< the meridian stays off the axis and holds liquid
  double miss = 0.0;   ///< 0 where it meets body 2 at the contact angle
  double gap = 0.0;
  double volume = 0.0;
  double force = 0.0;   ///< positive = attractive
  double energy = 0.0;  ///< liquid-gas area - cos(theta) * wetted area; force = d energy / d gap at constant volume
  double caps = 0.0;    ///< height of both wetted caps; caps + gap is that of the bridge
};

namespace detail {

/// Cap of a sphere or a plane: height, volume, area from the radius of its rim and its half angle.
struct Cap {
  double height, volume, area;
  Cap(double rim, double half_angle)
      : height(rim * std::tan(0.5 * half_angle)),
        volume(pi * height * (3.0 * rim * rim + height * height) / 6.0),
        area(pi * (rim * rim + height * height)) {}
};

}  // namespace detail

/// Bridges of one contact angle (rad) and one asymmetry e. Every solver takes a nearby start and leaves the solution in it.
class PairYoungLaplace {
 public:
  PairYoungLaplace(double theta, double asymmetry) : theta_(theta), near_(1.0 + asymmetry), far_(1.0 - asymmetry) {}

  /// Coordinates of a bridge between equal spheres, the start into those of unequal ones.
  PairCoordinates from_equal(const BridgeShape& equal, double phase) const {
    return {std::log(equal.half_filling_angle), 2.0 * phase, std::log(2.0 * phase / equal.pressure)};
  }

  PairShape shape(const PairCoordinates& x) const {
    static const detail::EvenGauss<16> rule;
    const double b1 = near_ * std::exp(x[0]), length = std::exp(x[2]), k = x[1], p = k / length;
    if (!(b1 < detail::pi)) return {};
    const double r1 = std::sin(b1) / near_, rise1 = r1 * std::sin(b1 + theta_), run1 = -r1 * std::cos(b1 + theta_);
    const double spread = 1.0 - p * rise1;
    double height = 0.0, revolved = 0.0, area = 0.0;
    for (std::size_t i = 0; i < rule.node.size(); ++i)
      for (const double node : {-rule.node[i], rule.node[i]}) {
        const double part = 0.5 + 0.5 * node, t = length * part, s = detail::sinc(0.5 * k * part), c = std::cos(0.5 * k * part);
        const double d = t * s * (2.0 * run1 * c + spread * t * s), r2 = r1 * r1 + d;
        if (!(r2 > 0.0)) return {};
        const double r = std::sqrt(r2), rise = (rise1 + 0.5 * p * d) / r;
        height += rule.weight[i] * rise;
        revolved += rule.weight[i] * rise * r2;
        area += rule.weight[i] * r;
      }
    const double s = detail::sinc(0.5 * k), d = length * s * (2.0 * run1 * std::cos(0.5 * k) + spread * length * s), square = r1 * r1 + d;
    if (!(square > 0.0)) return {};
    const double rise2 = rise1 + 0.5 * p * d, run2 = run1 * std::cos(k) + spread * length * detail::sinc(k);
    const double r2 = std::sqrt(square), b2 = std::atan2(rise2, run2) - theta_;
    const detail::Cap cap1(r1, b1), cap2(r2, b2);
    PairShape b;
    b.miss = (std::sin(b2) - far_ * r2) / b1;
    b.caps = cap1.height + cap2.height;
    b.gap = 0.5 * length * height - b.caps;
    b.volume = 0.5 * detail::pi * length * revolved - cap1.volume - cap2.volume;
    b.force = 2.0 * detail::pi * (rise1 - 0.5 * p * r1 * r1);
    b.energy = detail::pi * length * area - std::cos(theta_) * (cap1.area + cap2.area);
    b.valid = b.volume > 0.0 && b.caps + b.gap > 0.0;
    return b;
  }

  /// Bridge of given volume and gap; false when Newton's method does not get there.
  bool solve(double volume, double gap, PairCoordinates& x) const {
    constexpr double wanted = 1e-11, round_off = 1e-8;
    Residual f = residual(x, volume, gap);
    for (int iteration = 0; f.valid && iteration < 40; ++iteration) {
      if (f.norm() < wanted) return true;
      const Jacobian j = jacobian(x, f, volume, gap);
      if (!j.valid) return false;
      const PairCoordinates uv = cross(j.row[1], j.row[2]), vw = cross(j.row[2], j.row[0]), wu = cross(j.row[0], j.row[1]);
      const double determinant = dot(j.row[0], uv);
      const auto moved_by = [&](double part) {
        PairCoordinates y{};
        for (int i = 0; i < 3; ++i) y[i] = x[i] - part * (f.value[0] * uv[i] + f.value[1] * vw[i] + f.value[2] * wu[i]) / determinant;
        return y;
      };
      if (!detail::damped_step(x, f, moved_by, [&](const PairCoordinates& y) { return residual(y, volume, gap); })) break;
    }
    return f.valid && f.norm() < round_off;
  }

  /// From a bridge on the stable branch along the branch of constant volume to its largest gap, where it ceases to be stable. `path`, when
  /// given, receives the steps from there (without the start).
  bool rupture(double volume, PairCoordinates& x, std::vector<PairCoordinates>* path = nullptr) const {
    constexpr double longest = 0.1;
    Tangent d = tangent(x, volume, 1.0);
    const double sense = d.stretch < 0.0 ? -1.0 : 1.0;
    d = tangent(x, volume, sense);
    double step = longest;
    for (int count = 0; d.valid && count < 5000; ++count) {
      PairCoordinates y = moved(x, d, step);
      Tangent next;
      if (onto_branch(volume, y)) next = tangent(y, volume, sense);
      // Almost equal spheres have a second branch close by, where the sense of the tangent is the other one.
      if (!next.valid || next.along(d) < 0.97) {
        step *= 0.5;
        if (step < 1e-7) return false;
        continue;
      }
      x = y;
      const bool passed = next.stretch <= 0.0;
      d = next;
      if (passed && !fold(volume, x)) return false;
      if (path) path->push_back(x);
      if (passed) return true;
      step = std::min(longest, 1.5 * step);
    }
    return false;
  }

  /// The largest gap of a volume, from a bridge near it.
  bool fold(double volume, PairCoordinates& x) const {
    if (!onto_branch(volume, x)) return false;
    Tangent d = tangent(x, volume, 1.0);
    double step = 0.01;
    for (int iteration = 0; d.valid && iteration < 40; ++iteration) {
      PairCoordinates y = moved(x, d, step);
      Tangent next;
      if (onto_branch(volume, y)) next = tangent(y, volume, 1.0);
      if (!next.valid || next.along(d) < 0.9) {
        step *= 0.5;
        continue;
      }
      const double change = d.stretch - next.stretch;
      x = y;
      d = next;
      if (std::fabs(step) < 1e-7) return true;
      step = std::clamp(step * next.stretch / change, -0.1, 0.1);
      if (!std::isfinite(step)) return false;
    }
    return false;
  }

  /// Of the conditions on contact angle, volume and gap; 0 where a branch turns or another one crosses it.
  double determinant(double volume, const PairCoordinates& x) const {
    const double gap = shape(x).gap;
    const Jacobian j = jacobian(x, residual(x, volume, gap), volume, gap);
    return dot(j.row[0], cross(j.row[1], j.row[2]));
  }

 private:
  struct Residual {
    bool valid = false;
    PairCoordinates value{};  // miss, ln(volume), ln(height)
    double norm() const { return std::sqrt(dot(value, value)); }
  };
  struct Jacobian {
    bool valid = false;
    std::array<PairCoordinates, 3> row{};
  };

  // Unit direction of constant volume, and the growth of the gap along it.
  struct Tangent {
    bool valid = false;
    PairCoordinates to{};
    double stretch = 0.0;
    double along(const Tangent& o) const { return dot(to, o.to); }
  };

  double theta_, near_, far_;

  Tangent tangent(const PairCoordinates& x, double volume, double sense) const {
    const PairShape b = shape(x);
    const Residual f = residual(x, volume, b.gap);
    if (!f.valid) return {};
    const Jacobian j = jacobian(x, f, volume, b.gap);
    Tangent d{j.valid, cross(j.row[0], j.row[1]), 0.0};
    const double length = std::sqrt(dot(d.to, d.to));
    if (!(length > 0.0)) return {};
    for (double& c : d.to) c *= sense / length;
    d.stretch = dot(d.to, j.row[2]);
    return d;
  }

  static PairCoordinates moved(const PairCoordinates& x, const Tangent& d, double step) {
    return {x[0] + step * d.to[0], x[1] + step * d.to[1], x[2] + step * d.to[2]};
  }

  // The shortest steps on to a bridge of the volume.
  bool onto_branch(double volume, PairCoordinates& x) const {
    for (int iteration = 0; iteration < 30; ++iteration) {
      const PairShape b = shape(x);
      const Residual f = residual(x, volume, b.gap);
      if (!f.valid) return false;
      if (std::hypot(f.value[0], f.value[1]) < 1e-11) return true;
      const Jacobian j = jacobian(x, f, volume, b.gap);
      if (!j.valid) return false;
      const PairCoordinates &m = j.row[0], &v = j.row[1];
      const double mm = dot(m, m), mv = dot(m, v), vv = dot(v, v), determinant = mm * vv - mv * mv;
      const double a = (vv * f.value[0] - mv * f.value[1]) / determinant, c = (mm * f.value[1] - mv * f.value[0]) / determinant;
      for (int i = 0; i < 3; ++i) x[i] -= a * m[i] + c * v[i];
    }
    return false;
  }

  static double dot(const PairCoordinates& a, const PairCoordinates& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  static PairCoordinates cross(const PairCoordinates& a, const PairCoordinates& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }

  Residual residual(const PairCoordinates& x, double volume, double gap) const {
    const PairShape b = shape(x);
    if (!b.valid) return {};
    return {true, {b.miss, std::log(b.volume / volume), std::log((b.caps + b.gap) / (b.caps + gap))}};
  }

  Jacobian jacobian(const PairCoordinates& x, const Residual& f, double volume, double gap) const {
    constexpr double h = 1e-7;
    Jacobian j;
    for (int i = 0; i < 3; ++i) {
      PairCoordinates y = x;
      y[i] += h;
      const Residual moved = residual(y, volume, gap);
      if (!moved.valid) return {};
      for (int k = 0; k < 3; ++k) j.row[k][i] = (moved.value[k] - f.value[k]) / h;
    }
    j.valid = true;
    return j;
  }
};

}  // namespace dembark::capillary
