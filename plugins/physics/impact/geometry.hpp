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

/// Bodies sorted into the cells of a dense grid whose edge is at least `cell` (m); a body lies in the cell of its centre.
class BodyGrid {
 public:
  void build(const std::vector<Body>& bodies, double cell) {
    const std::size_t n = bodies.size();
    Vec3<double> high{};
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3<double>& p = bodies[i].position;
      if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
        throw std::invalid_argument("body " + std::to_string(bodies[i].id) + ": position is not a finite number");
      if (i == 0) low_ = high = p;
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    // A few bodies far away must not blow up the grid: the cells grow until there are not many more of them than bodies.
    for (cell = cell > 0.0 ? cell : 1.0;; cell *= 1.5) {
      const double nx = std::floor((high.x - low_.x) / cell) + 1, ny = std::floor((high.y - low_.y) / cell) + 1;
      const double nz = std::floor((high.z - low_.z) / cell) + 1;
      if (nx * ny * nz > 8.0 * double(n) + 64.0) continue;
      count_[0] = int(nx), count_[1] = int(ny), count_[2] = int(nz);
      break;
    }
    inverse_ = 1.0 / cell;
    start_.assign(std::size_t(count_[0]) * count_[1] * count_[2] + 1, 0);
    cell_of_.resize(n);
    member_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3<double>& p = bodies[i].position;
      cell_of_[i] = index(at(p.x, low_.x, 0), at(p.y, low_.y, 1), at(p.z, low_.z, 2));
      ++start_[cell_of_[i] + 1];
    }
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    fill_.assign(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < n; ++i) member_[fill_[cell_of_[i]]++] = int(i);
  }

  /// Calls visit(i, j) once for each two bodies in the same cell or in cells that touch.
  template <class Visit>
  void pairs(Visit visit) const {
    for (int z = 0; z < count_[2]; ++z)
      for (int y = 0; y < count_[1]; ++y)
        for (int x = 0; x < count_[0]; ++x) {
          const std::size_t cell = index(x, y, z);
          const int from = start_[cell], to = start_[cell + 1];
          if (from == to) continue;
          for (int k = from; k < to; ++k)
            for (int l = k + 1; l < to; ++l) visit(member_[k], member_[l]);
          // The half of the cells around that come later; those of a row lie side by side.
          const auto row = [&](int begin, int yy, int zz) {
            if (yy < 0 || yy >= count_[1] || zz >= count_[2]) return;
            const int first = start_[index(std::max(begin, 0), yy, zz)], last = start_[index(std::min(x + 1, count_[0] - 1), yy, zz) + 1];
            for (int k = from; k < to; ++k)
              for (int l = first; l < last; ++l) visit(member_[k], member_[l]);
          };
          if (x + 1 < count_[0]) row(x + 1, y, z);
          row(x - 1, y + 1, z);
          for (int yy = y - 1; yy <= y + 1; ++yy) row(x - 1, yy, z + 1);
        }
  }

  /// Calls visit(body index) for all bodies whose centre may lie in the box.
  template <class Visit>
  void in_box(const Vec3<double>& from, const Vec3<double>& to, Visit visit) const {
    if (member_.empty()) return;
    const int x0 = at(from.x, low_.x, 0), x1 = at(to.x, low_.x, 0), y0 = at(from.y, low_.y, 1), y1 = at(to.y, low_.y, 1);
    const int z0 = at(from.z, low_.z, 2), z1 = at(to.z, low_.z, 2);
    for (int z = z0; z <= z1; ++z)
      for (int y = y0; y <= y1; ++y)
        for (int k = start_[index(x0, y, z)]; k < start_[index(x1, y, z) + 1]; ++k) visit(member_[k]);
  }

 private:
  std::size_t index(int x, int y, int z) const { return (std::size_t(z) * count_[1] + y) * count_[0] + x; }
  int at(double p, double low, int axis) const {
    const double c = std::floor((p - low) * inverse_);
    return c < 0.0 ? 0 : c >= count_[axis] ? count_[axis] - 1 : int(c);
  }
  Vec3<double> low_{};
  double inverse_ = 1.0;
  int count_[3] = {1, 1, 1};
  std::vector<int> start_, fill_, member_;
  std::vector<std::size_t> cell_of_;
};

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
    grid_.build(bodies, range);
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
  BodyGrid grid_;
  std::vector<Body> reference_;
  std::vector<std::pair<int, int>> pairs_, found_;
  std::vector<int> start_;
  double reach_ = 0.0, margin_ = 0.0;
};

/// All pairs with gap <= reach, for a single call; PairFinder is faster step after step.
inline void find_pairs(const std::vector<Body>& bodies, double reach, std::vector<Contact>& contacts) {
  PairFinder finder;
  finder.find(bodies, reach, contacts);
}

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

/// A plane; the free space is on the side of the normal.
struct Plane : Wall {
  Vec3<double> point{};                ///< m, any of the plane
  Vec3<double> normal{0.0, 1.0, 0.0};  ///< unit
  Vec3<double> velocity{};             ///< m/s, of the surface; moving `point` along is the caller's
};

inline void plane_contacts(const std::vector<Body>& bodies, const Plane& plane, double reach, std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const double gap = dot(bodies[i].position - plane.point, plane.normal) - bodies[i].radius;
    if (gap <= reach) detail::wall_contact(plane, int(i), bodies[i], plane.id, gap, plane.normal, plane.velocity, contacts);
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
