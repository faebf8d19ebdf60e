// Candidates for contact with walls: planes, the inside of a drum, triangles; and all candidates of a system.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "../surface/surface_contacts.hpp"
#include "pairs.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

namespace detail {
inline void wall_contact(const Wall& wall, int body, const Body& b, std::int64_t key, double gap, const Vec3<double>& normal,
                         const Vec3<double>& velocity, std::vector<Contact>& contacts) {
  contacts.push_back({body, -1, b.id, key, gap, normal, velocity, wall.material, wall.stiffness});
}
}  // namespace detail

/// A plane; the free space is on the side of the normal, or on both: then a body is on the side of its centre, and one whose centre lies on
/// the plane on that of the normal.
struct Plane : Wall {
  Vec3<double> point{};                ///< m, any of the plane
  Vec3<double> normal{0.0, 1.0, 0.0};  ///< unit
  Vec3<double> velocity{};             ///< m/s, of the surface; moving `point` along is the caller's
  bool two_sided = false;

  auto fields() { return std::tie(id, material, stiffness, point, normal, velocity); }
};

inline void plane_contacts(const std::vector<Body>& bodies, const Plane& plane, double reach, std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const double height = dot(bodies[i].position - plane.point, plane.normal);
    const double side = plane.two_sided && height < 0.0 ? -1.0 : 1.0, gap = side * height - bodies[i].radius;
    if (gap <= reach) detail::wall_contact(plane, int(i), bodies[i], plane.id, gap, side * plane.normal, plane.velocity, contacts);
  }
}

/// The inside of a drum: a circular cylinder without ends that turns about its axis.
struct Drum : Wall {
  Vec3<double> point{};              ///< m, any of the axis
  Vec3<double> axis{0.0, 0.0, 1.0};  ///< unit
  double radius = 1.0;               ///< m
  double omega = 0.0;                ///< rad/s, right-handed about the axis
  Vec3<double> velocity{};           ///< m/s, of the axis; moving `point` along is the caller's

  auto fields() { return std::tie(id, material, stiffness, point, axis, radius, omega); }
};

inline void cylinder_contacts(const std::vector<Body>& bodies, const Drum& drum, double reach, std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Vec3<double> arm = bodies[i].position - drum.point;
    arm -= dot(arm, drum.axis) * drum.axis;
    const double distance = norm(arm), gap = drum.radius - distance - bodies[i].radius;
    if (gap > reach || !(distance > 0.0)) continue;
    const Vec3<double> outward = arm * (1.0 / distance);
    detail::wall_contact(drum, int(i), bodies[i], drum.id, gap, -outward,
                         drum.velocity + (drum.omega * drum.radius) * cross(drum.axis, outward), contacts);
  }
}

/// The triangles of a mesh.
struct Mesh : Wall {
  SurfaceContacts surface;
  double speed = 0.0;  ///< m/s, of the fastest corner
  bool velocity_known = true;

  void update(const std::vector<Triangle>& triangles) {
    double square = 0.0;
    for (const Triangle& t : triangles)
      for (const Vec3<double>& v : t.velocity) square = std::max(square, dot(v, v));
    speed = std::sqrt(square);
    surface.update(triangles);
  }
};

/// Contacts with the triangles of a mesh, with its work space.
class TriangleFinder {
 public:
  /// In the order of the bodies' ids. `mesh.id` must be wall_key(number); a contact's key is wall_key(number, feature of the triangle).
  void find(const std::vector<Body>& bodies, const Mesh& mesh, double reach, std::vector<Contact>& contacts) {
    const SurfaceContacts& surface = mesh.surface;
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
      // Where the velocity is not known, better no relative motion than a wrong one, which springs would remember.
      const Vec3<double> velocity = mesh.velocity_known
                                        ? c.weight[0] * t.velocity[0] + c.weight[1] * t.velocity[1] + c.weight[2] * t.velocity[2]
                                        : b.velocity - b.radius * cross(b.spin, normal);
      detail::wall_contact(mesh, h.body, b, wall_key(wall_number(mesh.id), 8 * t.id + c.feature), c.distance - b.radius, normal, velocity,
                           contacts);
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

/// All that bodies may touch: each other and the walls.
struct Surroundings {
  PairFinder pairs;
  std::vector<Plane> planes;
  std::vector<Drum> drums;
  std::vector<Mesh> meshes;  ///< without images: at the end of one that goes through to a periodic boundary they would touch an edge

  void find(const std::vector<Body>& bodies, double reach, std::vector<Contact>& contacts) {
    pairs.find(bodies, reach, contacts);
    for (const Plane& p : planes) plane_contacts(bodies, p, reach, contacts);
    for (const Drum& d : drums) cylinder_contacts(bodies, d, reach, contacts);
    for (const Mesh& m : meshes) triangles_.find(bodies, m, reach, contacts);
  }
  /// m/s, of the fastest surface; that of a drum that turns moves along itself, not towards anything.
  double wall_speed() const {
    double speed = 0.0;
    for (const Plane& p : planes) speed = std::max(speed, norm(p.velocity));
    for (const Drum& d : drums) speed = std::max(speed, norm(d.velocity));
    for (const Mesh& m : meshes) speed = std::max(speed, m.speed);
    return speed;
  }

 private:
  TriangleFinder triangles_;
};

}  // namespace impact
}  // namespace dembark
