// A triangle of a surface, and where a point is closest to it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "../vec3.hpp"

namespace dembark {

struct Triangle {
  Vec3<double> node[3];        ///< m
  Vec3<double> velocity[3]{};  ///< m/s, of the nodes
  std::int64_t id = 0;         ///< >= 0, below 2^29, stable
};

/// Whether it has no area: lower than this part of its longest edge, which round-off of corners in single precision leaves.
inline bool is_flat(const Triangle& t) {
  const Vec3<double> a = t.node[1] - t.node[0], b = t.node[2] - t.node[1], c = t.node[0] - t.node[2], n = cross(a, b);
  const double longest = std::max({dot(a, a), dot(b, b), dot(c, c)});
  return !(dot(n, n) > 1e-14 * longest * longest);
}

/// Corners of the box around a triangle, wider by `grow` (m) on all sides.
inline std::pair<Vec3<double>, Vec3<double>> box(const Triangle& t, double grow) {
  const Vec3<double>* n = t.node;
  return {
      {std::min({n[0].x, n[1].x, n[2].x}) - grow, std::min({n[0].y, n[1].y, n[2].y}) - grow, std::min({n[0].z, n[1].z, n[2].z}) - grow},
      {std::max({n[0].x, n[1].x, n[2].x}) + grow, std::max({n[0].y, n[1].y, n[2].y}) + grow, std::max({n[0].z, n[1].z, n[2].z}) + grow}};
}

/// Where a point is closest to a triangle. feature: 0 face, 1 ... 3 edge (01, 12, 20), 4 ... 6 corner.
struct ClosestPoint {
  Vec3<double> point{}, arm{};  ///< m; arm: from there to the point asked for
  double distance = 0.0;
  double weight[3] = {0.0, 0.0, 0.0};  ///< barycentric
  int feature = 0;
};

/// Closest point of a triangle by the signs of the barycentric coordinates (C. Ericson, Real-Time Collision Detection, 5.1.5).
inline ClosestPoint closest_point(const Triangle& t, const Vec3<double>& p) {
  const Vec3<double> ab = t.node[1] - t.node[0], ac = t.node[2] - t.node[0];
  const Vec3<double> ap = p - t.node[0], bp = p - t.node[1], cp = p - t.node[2];
  const auto found = [&](double u, double v, double w, int feature) {
    ClosestPoint c;
    c.arm = u * ap + v * bp + w * cp;
    c.point = p - c.arm;
    c.distance = norm(c.arm);
    c.weight[0] = u, c.weight[1] = v, c.weight[2] = w;
    c.feature = feature;
    return c;
  };
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return found(1, 0, 0, 4);
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return found(0, 1, 0, 5);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return found(1.0 - d1 / (d1 - d3), d1 / (d1 - d3), 0, 1);
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return found(0, 0, 1, 6);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return found(1.0 - d2 / (d2 - d6), 0, d2 / (d2 - d6), 3);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return found(0, 1.0 - w, w, 2);
  }
  const double scale = 1.0 / (va + vb + vc);
  return found(1.0 - (vb + vc) * scale, vb * scale, vc * scale, 0);
}

}  // namespace dembark
