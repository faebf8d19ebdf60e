// Candidates for contact: pairs of discs or spheres, planes, the inside of a drum; triangles in triangles.hpp.
//
// Every function appends to `contacts` what lies within `reach` (m): gap <= reach. A candidate that stays open costs little; a pair
// that is missed acts one step later, with the overlap it has by then. Unbounded space: no periodic images.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "../surface/point_grid.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// The reach (m) to begin a step dt (s) with: a little more than what the two fastest bodies close in it, free and by the forces that are
/// known, and never less than a hundredth of the smallest radius, so that the list of candidates seldom changes.
/// `wall_speed` (m/s): the fastest that a wall surface moves towards anything.
inline double default_reach(const std::vector<Body>& bodies, double dt, double wall_speed = 0.0) {
  double speed2 = 0.0, acceleration2 = 0.0, radius = std::numeric_limits<double>::infinity();
  for (const Body& b : bodies) {
    speed2 = std::max(speed2, dot(b.velocity, b.velocity));
    if (!std::isinf(b.mass)) acceleration2 = std::max(acceleration2, dot(b.force, b.force) / (b.mass * b.mass));
    radius = std::min(radius, b.radius);
  }
  if (bodies.empty()) return 0.0;
  const double closing = dt * (2.0 * std::sqrt(speed2) + wall_speed) + 2.0 * dt * dt * std::sqrt(acceleration2);
  return std::max(reach_factor * closing, 0.01 * radius);
}

/// The centres of the bodies in cells of an edge of `cell` (m).
inline void build_grid(const std::vector<Body>& bodies, double cell, PointGrid& grid) {
  for (const Body& b : bodies)
    if (!std::isfinite(b.position.x + b.position.y + b.position.z))
      throw std::invalid_argument("body " + std::to_string(b.id) + ": position is not a finite number");
  grid.build(bodies.size(), [&](std::size_t i) { return bodies[i].position; }, cell);
}

/// Finds pairs and remembers a wider list of them, which holds while no body has moved by half of the margin. What it finds does not
/// depend on the age of that list.
class PairFinder {
 public:
  /// Appends all pairs with gap <= reach, sorted by (key_a, key_b), key_a < key_b.
  void find(const std::vector<Body>& bodies, double reach, std::vector<Contact>& contacts) {
    if (!current(bodies, reach)) build(bodies, reach);
    for (const auto& pair : pairs_) {
      const Body &a = bodies[pair.first], &b = bodies[pair.second];
      const Vec3<double> separation = a.position - b.position;
      const double touch = a.radius + b.radius, far = touch + reach, square = dot(separation, separation);
      if (square > far * far) continue;
      const double distance = std::sqrt(square);
      contacts.emplace_back();
      Contact& c = contacts.back();
      c.a = pair.first;
      c.b = pair.second;
      c.key_a = a.id;
      c.key_b = b.id;
      c.gap = distance - touch;
      // Coincident centres have no direction; any will do to drive them apart.
      c.normal = distance > 0.0 ? separation * (1.0 / distance) : Vec3<double>{0.0, 1.0, 0.0};
    }
  }

 private:
  bool current(const std::vector<Body>& bodies, double reach) const {
    if (bodies.size() != reference_.size() || reach > reach_ || reach < 0.25 * reach_) return false;
    const double limit = 0.25 * margin_ * margin_;  // (margin / 2)^2
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Vec3<double> moved = bodies[i].position - reference_[i].position;
      if (!(dot(moved, moved) <= limit) || bodies[i].id != reference_[i].id || bodies[i].radius != reference_[i].radius) return false;
    }
    return true;
  }
  void build(const std::vector<Body>& bodies, double reach) {
    double largest = 0.0, sum = 0.0;
    for (const Body& b : bodies) largest = std::max(largest, b.radius), sum += b.radius;
    // Where bodies move by a good part of their size, no list lasts longer than a step: then no margin is worth its pairs.
    const double margin = bodies.empty() ? 0.0 : 0.3 * sum / double(bodies.size());
    const bool lasting = reach < margin;
    margin_ = lasting ? margin + reach : 0.0;
    reach_ = lasting ? 2.0 * reach : reach;
    const double range = 2.0 * largest + reach_ + margin_;
    build_grid(bodies, range, grid_);
    found_.clear();
    start_.assign(bodies.size() + 1, 0);
    grid_.pairs([&](int i, int j) {
      if (bodies[i].id == bodies[j].id) return;  // a body and its image across a periodic boundary
      if (bodies[i].id > bodies[j].id) std::swap(i, j);
      const Body &a = bodies[i], &b = bodies[j];
      const Vec3<double> d = a.position - b.position;
      const double far = a.radius + b.radius + reach_ + margin_;
      if (dot(d, d) > far * far) return;
      found_.emplace_back(i, j);
      ++start_[std::size_t(i) + 1];
    });
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    pairs_.resize(found_.size());
    for (const auto& pair : found_) pairs_[std::size_t(start_[std::size_t(pair.first)]++)] = pair;
    const auto before = [&](const auto& p, const auto& q) {
      const auto pa = bodies[p.first].id, qa = bodies[q.first].id;
      return pa != qa ? pa < qa : bodies[p.second].id < bodies[q.second].id;
    };
    // Of bodies in the order of their ids only the partners of each are out of order.
    for (auto from = pairs_.begin(), end = from; from != pairs_.end(); from = end) {
      end = std::find_if(from, pairs_.end(), [&](const auto& p) { return p.first != from->first; });
      std::sort(from, end, before);
    }
    if (!std::is_sorted(pairs_.begin(), pairs_.end(), before)) std::sort(pairs_.begin(), pairs_.end(), before);
    reference_ = bodies;
  }
  PointGrid grid_;
  std::vector<Body> reference_;
  std::vector<std::pair<int, int>> pairs_, found_;
  std::vector<int> start_;
  double reach_ = 0.0, margin_ = 0.0;
};

namespace detail {
inline void wall_contact(const Wall& wall, int body, const Body& b, std::int64_t key, double gap, const Vec3<double>& normal,
                         const Vec3<double>& velocity, std::vector<Contact>& contacts) {
  Contact c;
  c.a = body;
  c.b = -1;
  c.key_a = b.id;
  c.key_b = key;
  c.gap = gap;
  c.normal = normal;
  c.point_velocity = velocity;
  c.wall_material = wall.material;
  c.wall_stiffness = wall.stiffness;
  contacts.push_back(c);
}
}  // namespace detail

/// A plane; the free space is on the side of the normal, or on both: then a body is on the side of its centre, and one whose centre lies on
/// the plane on that of the normal.
struct Plane : Wall {
  Vec3<double> point{};                ///< m, any of the plane
  Vec3<double> normal{0.0, 1.0, 0.0};  ///< unit
  Vec3<double> velocity{};             ///< m/s, of the surface; moving `point` along is the caller's
  bool two_sided = false;
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

}  // namespace impact
}  // namespace dembark
