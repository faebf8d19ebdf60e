// The stable Young-Laplace bridge of given volume and gap, and its rupture, for the two families of young_laplace.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "young_laplace.hpp"

namespace dembark::capillary {

/// Bridges of one `Family`. Every solver takes a nearby start and leaves the solution in it.
template <class Family>
class BridgeSolver : public Family {
 public:
  using Family::Family;
  using Family::shape;

  /// Bridge of given volume and gap; false when Newton's method does not get there.
  bool solve(double volume, double gap, BridgeCoordinates& x) const {
    constexpr double wanted = 1e-11, round_off = 1e-8;
    Conditions f = conditions(shape(x), volume, gap);
    for (int iteration = 0; f.valid && iteration < 60; ++iteration) {
      if (f.norm() < wanted) return true;
      const Jacobian j = jacobian(x, f, volume, gap);
      if (!j.valid) return false;
      const BridgeCoordinates uv = cross(j.row[1], j.row[2]), vw = cross(j.row[2], j.row[0]), wu = cross(j.row[0], j.row[1]);
      const double determinant = dot(j.row[0], uv);
      double part = 1.0;
      for (; part > 1e-3; part *= 0.5) {
        BridgeCoordinates y;
        for (int i = 0; i < 3; ++i) y[i] = x[i] - part * (f.value[0] * uv[i] + f.value[1] * vw[i] + f.value[2] * wu[i]) / determinant;
        const Conditions next = conditions(shape(y), volume, gap);
        if (!(next.valid && next.norm() < f.norm())) continue;
        x = y;
        f = next;
        break;
      }
      if (part <= 1e-3) break;
    }
    return f.valid && f.norm() < round_off;
  }

  /// From the touching bridge along the branch of constant volume to where it ceases to be stable: to its largest gap, where it meets the
  /// unstable branch, or to the gap where liquid begins to drain to one of the spheres, whichever comes first. `path` receives the steps
  /// from there, without the start.
  bool rupture(double volume, BridgeCoordinates& x, std::vector<BridgeCoordinates>& path) const {
    constexpr double longest = 0.08;
    const double sense = tangent(x, volume, 1.0).stretch < 0.0 ? -1.0 : 1.0;
    Tangent d = tangent(x, volume, sense);
    double step = longest;
    for (int count = 0; d.valid && count < 5000; ++count) {
      BridgeCoordinates y = moved(x, d, step);
      Tangent next;
      if (onto_branch(volume, y)) next = tangent(y, volume, sense);
      // A small bridge runs close to the edge of the family, which a long straight step may cross; almost equal spheres have a second
      // branch close by, where the sense of the tangent is the other one.
      if (!next.valid || dot(next.to, d.to) < 0.98) {
        step *= 0.5;
        if (step < 1e-7) return false;
        continue;
      }
      const bool passed = next.margin() <= 0.0;
      if (!passed) x = y;
      else if (!bisect(volume, x, d, step, sense)) return false;
      path.push_back(x);
      if (passed) return true;
      d = next;
      step = std::min(longest, 1.5 * step);
    }
    return false;
  }

  /// The last stable bridge of a volume, from one near it.
  bool end(double volume, BridgeCoordinates& x) const {
    if (!onto_branch(volume, x)) return false;
    Tangent d = tangent(x, volume, 1.0);
    double step = 0.01;
    for (int iteration = 0; d.valid && iteration < 40; ++iteration) {
      BridgeCoordinates y = moved(x, d, step);
      Tangent next;
      if (onto_branch(volume, y)) next = tangent(y, volume, 1.0);
      if (!next.valid || dot(next.to, d.to) < 0.9) {
        step *= 0.5;
        continue;
      }
      const double change = d.margin() - next.margin();
      x = y;
      d = next;
      if (std::fabs(step) < 1e-7) return true;
      step = std::clamp(step * next.margin() / change, -0.1, 0.1);
      if (!std::isfinite(step)) return false;
    }
    return false;
  }

 private:
  // Logarithms make the conditions, and with them the tolerances, relative for bridges of any size.
  struct Conditions {
    bool valid = false;
    BridgeCoordinates value{};  // miss, ln(volume), ln(height)
    double norm() const { return std::sqrt(dot(value, value)); }
  };
  struct Jacobian {
    bool valid = false;
    std::array<BridgeCoordinates, 3> row{};
  };
  // Unit direction of constant volume, the growth of the gap along it, and the family's own measure of stability.
  struct Tangent {
    bool valid = false;
    BridgeCoordinates to{};
    double stretch = 0.0, steadiness = 0.0;
    double margin() const { return std::min(stretch, steadiness); }
  };

  static double dot(const BridgeCoordinates& a, const BridgeCoordinates& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  static BridgeCoordinates cross(const BridgeCoordinates& a, const BridgeCoordinates& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static BridgeCoordinates moved(const BridgeCoordinates& x, const Tangent& d, double step) {
    return {x[0] + step * d.to[0], x[1] + step * d.to[1], x[2] + step * d.to[2]};
  }

  static Conditions conditions(const BridgeShape& b, double volume, double gap) {
    if (!b.valid) return {};
    return {true, {b.miss, std::log(b.volume / volume), std::log((b.caps + b.gap) / (b.caps + gap))}};
  }

  Jacobian jacobian(const BridgeCoordinates& x, const Conditions& f, double volume, double gap) const {
    constexpr double h = Family::difference;
    Jacobian j;
    if (Family::first_free > 0) j.row[0][0] = 1.0;
    for (int i = Family::first_free; i < 3; ++i) {
      BridgeCoordinates above = x, below = x;
      above[i] += h;
      below[i] -= h;
      const Conditions high = conditions(shape(above), volume, gap), low = Family::central ? conditions(shape(below), volume, gap) : f;
      if (!(high.valid && low.valid)) return {};
      for (int k = 0; k < 3; ++k) j.row[k][i] += (high.value[k] - low.value[k]) / (Family::central ? 2.0 * h : h);
    }
    j.valid = true;
    return j;
  }

  Tangent tangent(const BridgeCoordinates& x, double volume, double sense) const {
    const BridgeShape b = shape(x);
    const Conditions f = conditions(b, volume, b.gap);
    if (!f.valid) return {};
    const Jacobian j = jacobian(x, f, volume, b.gap);
    Tangent d{j.valid, cross(j.row[0], j.row[1]), 0.0, Family::steadiness(x)};
    const double length = std::sqrt(dot(d.to, d.to));
    if (!(length > 0.0)) return {};
    for (double& c : d.to) c *= sense / length;
    d.stretch = dot(d.to, j.row[2]) * (b.caps + b.gap);
    return d;
  }

  // The bridge is stable at x and not a step ahead of it; the last stable one goes to x.
  bool bisect(double volume, BridgeCoordinates& x, const Tangent& d, double step, double sense) const {
    const BridgeCoordinates from = x;
    double low = 0.0, high = step;
    while (high - low > 1e-12) {
      const double middle = 0.5 * (low + high);
      x = moved(from, d, middle);
      if (!onto_branch(volume, x)) return false;
      const Tangent here = tangent(x, volume, sense);
      if (!here.valid) return false;
      (here.margin() > 0.0 ? low : high) = middle;
    }
    return true;
  }

  // The shortest steps on to a bridge of the volume.
  bool onto_branch(double volume, BridgeCoordinates& x) const {
    for (int iteration = 0; iteration < 30; ++iteration) {
      const BridgeShape b = shape(x);
      const Conditions f = conditions(b, volume, b.gap);
      if (!f.valid) return false;
      if (std::hypot(f.value[0], f.value[1]) < 1e-11) return true;
      const Jacobian j = jacobian(x, f, volume, b.gap);
      if (!j.valid) return false;
      const BridgeCoordinates &m = j.row[0], &v = j.row[1];
      const double mm = dot(m, m), mv = dot(m, v), vv = dot(v, v), determinant = mm * vv - mv * mv;
      const double a = (vv * f.value[0] - mv * f.value[1]) / determinant, c = (mm * f.value[1] - mv * f.value[0]) / determinant;
      for (int i = 0; i < 3; ++i) x[i] -= a * m[i] + c * v[i];
    }
    return false;
  }
};

using YoungLaplace = BridgeSolver<EqualSpheres>;
using PairYoungLaplace = BridgeSolver<UnequalSpheres>;

}  // namespace dembark::capillary
