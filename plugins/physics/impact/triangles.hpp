// Candidates with a triangle mesh: each body against the closest points of the triangles, an edge or corner that triangles share
// counted once, and one that only belongs to a face the body touches beside it not at all.
#pragma once

#include "geometry.hpp"

namespace dembark {
namespace impact {

struct Triangle {
  Vec3<double> node[3];        ///< m
  Vec3<double> velocity[3]{};  ///< m/s, of the nodes
  std::int64_t id = 0;         ///< >= 0, below 2^29, stable: part of the contact's key
};

/// Where a point is closest to a triangle. feature: 0 face, 1 ... 3 edge (01, 12, 20), 4 ... 6 corner.
struct ClosestPoint {
  Vec3<double> point{};
  double weight[3] = {0.0, 0.0, 0.0};  ///< barycentric
  int feature = 0;
};

/// Closest point of a triangle by the signs of the barycentric coordinates (C. Ericson, Real-Time Collision Detection, 5.1.5).
inline ClosestPoint closest_point(const Triangle& t, const Vec3<double>& p) {
  const Vec3<double> ab = t.node[1] - t.node[0], ac = t.node[2] - t.node[0], ap = p - t.node[0];
  ClosestPoint c;
  const auto set = [&](double u, double v, double w, int feature) {
    c.weight[0] = u, c.weight[1] = v, c.weight[2] = w;
    c.feature = feature;
    c.point = u * t.node[0] + v * t.node[1] + w * t.node[2];
    return c;
  };
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return set(1, 0, 0, 4);
  const Vec3<double> bp = p - t.node[1];
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return set(0, 1, 0, 5);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return set(1.0 - d1 / (d1 - d3), d1 / (d1 - d3), 0, 1);
  const Vec3<double> cp = p - t.node[2];
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return set(0, 0, 1, 6);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return set(1.0 - d2 / (d2 - d6), 0, d2 / (d2 - d6), 3);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return set(0, 1.0 - w, w, 2);
  }
  const double scale = 1.0 / (va + vb + vc);
  return set(1.0 - (vb + vc) * scale, vb * scale, vc * scale, 0);
}

/// Contacts with the triangles of a mesh, with its work space.
class TriangleFinder {
 public:
  /// Appends the contacts with gap <= reach (m). `wall.id` must be wall_key(number); a contact's key is wall_key(number, feature of the
  /// triangle). Both sides of a triangle are solid.
  void find(const std::vector<Body>& bodies, const Wall& wall, const std::vector<Triangle>& triangles, double reach,
            std::vector<Contact>& contacts) {
    if (bodies.empty()) return;
    double largest = 0.0;
    for (const Body& b : bodies) largest = std::max(largest, b.radius);
    const double range = largest + reach;
    grid_.build(bodies, 2.0 * range);
    hits_.clear();
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      const Vec3<double>*n = triangles[k].node, grow{range, range, range};
      const Vec3<double> low{std::min({n[0].x, n[1].x, n[2].x}), std::min({n[0].y, n[1].y, n[2].y}), std::min({n[0].z, n[1].z, n[2].z})};
      const Vec3<double> high{std::max({n[0].x, n[1].x, n[2].x}), std::max({n[0].y, n[1].y, n[2].y}), std::max({n[0].z, n[1].z, n[2].z})};
      grid_.in_box(low - grow, high + grow, [&](int i) {
        const ClosestPoint c = closest_point(triangles[k], bodies[i].position);
        const Vec3<double> arm = bodies[i].position - c.point;
        const double distance = norm(arm);
        if (distance - bodies[i].radius <= reach) hits_.push_back({i, int(k), bodies[i].id, triangles[k].id, distance, c, arm});
      });
    }
    // Faces before edges before corners, then by number, so that which of two triangles owns a shared edge is settled.
    std::sort(hits_.begin(), hits_.end(), [](const Hit& p, const Hit& q) {
      if (p.body_id != q.body_id) return p.body_id < q.body_id;
      const int pr = (p.closest.feature + 2) / 3, qr = (q.closest.feature + 2) / 3;
      return pr != qr ? pr < qr : p.triangle_id < q.triangle_id;
    });
    for (std::size_t from = 0, to; from < hits_.size(); from = to) {
      for (to = from; to < hits_.size() && hits_[to].body == hits_[from].body;) ++to;
      for (std::size_t h = from; h < to; ++h)
        if (genuine(triangles, from, to, h, bodies[hits_[h].body].radius)) add(bodies, wall, triangles, hits_[h], contacts);
    }
  }

 private:
  struct Hit {
    int body, triangle;
    std::int64_t body_id, triangle_id;
    double distance;
    ClosestPoint closest;
    Vec3<double> arm;
  };

  /// Whether the point is the closest one of all triangles it belongs to, and the first hit at this place.
  bool genuine(const std::vector<Triangle>& triangles, std::size_t from, std::size_t to, std::size_t h, double radius) const {
    const Hit& hit = hits_[h];
    const double near = 1e-7 * radius;
    for (std::size_t g = from; g < to; ++g) {
      if (g == h) continue;
      const Vec3<double> apart = hits_[g].closest.point - hit.closest.point;
      if (dot(apart, apart) <= near * near) {
        if (g < h) return false;
        continue;
      }
      if (hit.closest.feature == 0 || hits_[g].distance >= hit.distance) continue;
      const Vec3<double> off = closest_point(triangles[hits_[g].triangle], hit.closest.point).point - hit.closest.point;
      if (dot(off, off) <= near * near) return false;
    }
    return true;
  }

  static void add(const std::vector<Body>& bodies, const Wall& wall, const std::vector<Triangle>& triangles, const Hit& hit,
                  std::vector<Contact>& contacts) {
    const Triangle& t = triangles[hit.triangle];
    const double* w = hit.closest.weight;
    Vec3<double> normal;
    if (hit.distance > 0.0) normal = hit.arm * (1.0 / hit.distance);
    else {  // the centre lies on the triangle: its own normal, whichever way it points
      normal = cross(t.node[1] - t.node[0], t.node[2] - t.node[0]);
      const double size = norm(normal);
      if (!(size > 0.0)) return;
      normal *= 1.0 / size;
    }
    const Body& b = bodies[hit.body];
    const std::int64_t key = wall_key(wall_number(wall.id), 8 * hit.triangle_id + hit.closest.feature);
    detail::wall_contact(wall, hit.body, b, key, hit.distance - b.radius, normal,
                         w[0] * t.velocity[0] + w[1] * t.velocity[1] + w[2] * t.velocity[2], contacts);
  }

  BodyGrid grid_;
  std::vector<Hit> hits_;
};

/// Contacts with the triangles of a mesh, for a single call; TriangleFinder keeps its work space.
inline void triangle_contacts(const std::vector<Body>& bodies, const Wall& wall, const std::vector<Triangle>& triangles, double reach,
                              std::vector<Contact>& contacts) {
  TriangleFinder finder;
  finder.find(bodies, wall, triangles, reach, contacts);
}

}  // namespace impact
}  // namespace dembark
