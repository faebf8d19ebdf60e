// Candidates with a mesh: the contacts of each body with the surface that its triangles make up.
#pragma once

#include "../surface/surface_contacts.hpp"
#include "geometry.hpp"

namespace dembark {
namespace impact {

/// Contacts with the triangles of a mesh, with its work space.
class TriangleFinder {
 public:
  /// Appends the contacts with gap <= reach (m), in the order of the bodies' ids. `wall.id` must be wall_key(number); a contact's key is
  /// wall_key(number, feature of the triangle).
  void find(const std::vector<Body>& bodies, const Wall& wall, const SurfaceContacts& surface, double reach,
            std::vector<Contact>& contacts) {
    double largest = 0.0;
    for (const Body& b : bodies) largest = std::max(largest, b.radius);
    const double range = largest + reach;
    build_grid(bodies, 2.0 * range, grid_);
    hits_.clear();
    const std::vector<Triangle>& triangles = surface.triangles();
    for (int t = 0; t < int(triangles.size()); ++t) {
      const auto [low, high] = box(triangles[std::size_t(t)], range);
      grid_.in_box(low, high, [&, t](int i) {
        const Body& b = bodies[std::size_t(i)];
        const ClosestPoint here = closest_point(triangles[std::size_t(t)], b.position);
        if (here.distance - b.radius <= reach && surface.owner(t, here, b.position, b.radius) == t) hits_.push_back({i, t, here});
      });
    }
    // Faces before edges before corners.
    const auto order = [&](const Hit& h) {
      return std::make_tuple(bodies[std::size_t(h.body)].id, (h.closest.feature + 2) / 3, triangles[std::size_t(h.triangle)].id);
    };
    std::sort(hits_.begin(), hits_.end(), [&](const Hit& p, const Hit& q) { return order(p) < order(q); });
    for (const Hit& h : hits_) {
      const Triangle& t = triangles[std::size_t(h.triangle)];
      const ClosestPoint& c = h.closest;
      // A centre on the triangle is pushed to the side of the triangle's own normal.
      Vec3<double> normal = h.closest.distance > 0.0 ? c.arm : cross(t.node[1] - t.node[0], t.node[2] - t.node[0]);
      normal *= 1.0 / norm(normal);
      const Body& b = bodies[std::size_t(h.body)];
      detail::wall_contact(wall, h.body, b, wall_key(wall_number(wall.id), 8 * t.id + c.feature), c.distance - b.radius, normal,
                           c.weight[0] * t.velocity[0] + c.weight[1] * t.velocity[1] + c.weight[2] * t.velocity[2], contacts);
    }
  }

 private:
  struct Hit {
    int body, triangle;
    ClosestPoint closest;
  };

  PointGrid grid_;
  std::vector<Hit> hits_;
};

}  // namespace impact
}  // namespace dembark
