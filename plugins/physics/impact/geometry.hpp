// Candidates for contact: pairs of discs, spheres or capsules, across periodic boundaries too; planes, the inside of a drum; meshes of
// triangles, for discs and spheres.
//
// All searches append to `contacts` what lies within `reach` (m): gap <= reach. A candidate that stays open costs little; a pair that is
// missed acts one step later, with the overlap it has by then.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../surface/point_grid.hpp"
#include "../surface/surface_contacts.hpp"
#include "capsules.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// The reach (m) to begin a step dt (s) with: a little more than what the two fastest bodies close in it, free and by the forces that are
/// known, and never less than a hundredth of the smallest radius, so that the list of candidates seldom changes.
/// `wall_speed` (m/s): the fastest that a wall surface moves towards anything.
inline double default_reach(const std::vector<Body>& bodies, double dt, double wall_speed = 0.0) {
  double speed2 = 0.0, acceleration2 = 0.0, radius = std::numeric_limits<double>::infinity();
  for (const Body& b : bodies) {
    radius = std::min(radius, b.radius);
    if (has_length(b)) {
      const double half = norm(b.half_axis), end = norm(b.velocity) + half * norm(b.spin);
      const double gain = std::isinf(b.mass) ? 0.0 : norm(b.force) / b.mass + half * norm(b.torque) / b.inertia;
      speed2 = std::max(speed2, end * end);
      acceleration2 = std::max(acceleration2, gain * gain);
      continue;
    }
    speed2 = std::max(speed2, dot(b.velocity, b.velocity));
    if (!std::isinf(b.mass)) acceleration2 = std::max(acceleration2, dot(b.force, b.force) / (b.mass * b.mass));
  }
  if (bodies.empty()) return 0.0;
  const double closing = dt * (2.0 * std::sqrt(speed2) + wall_speed) + 2.0 * dt * dt * std::sqrt(acceleration2);
  return std::max(reach_factor * closing, 0.01 * radius);
}

/// Contacts of bodies of infinite mass with each other and with walls have no effect.
inline void leave_out_held(const std::vector<Body>& bodies, std::vector<Contact>& contacts) {
  const auto held = [&](int i) { return i < 0 || std::isinf(bodies[std::size_t(i)].mass); };
  const auto idle = [&](const Contact& c) { return held(c.a) && held(c.b); };
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), idle), contacts.end());
}

/// m, from the centre of a body to what of it is farthest.
inline double extent(const Body& b) { return has_length(b) ? b.radius + norm(b.half_axis) : b.radius; }

/// The bodies in cells: discs and balls by their centres, capsules by those of balls that cover them.
class BodyGrid {
 public:
  /// range: m, largest gap of two bodies that are to be found.
  void build(const std::vector<Body>& bodies, double range) {
    points_.clear();
    double largest = 0.0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Body& b = bodies[i];
      if (!std::isfinite(b.position.x + b.position.y + b.position.z))
        throw std::invalid_argument("body " + std::to_string(b.id) + ": position is not a finite number");
      const double half = has_length(b) ? norm(b.half_axis) : 0.0;
      const int pieces = half > 0.0 ? int(std::ceil(half / std::max(b.radius, 1e-3 * half))) : 1;
      const double cover = b.radius + half / pieces * (half > 0.0);
      for (int k = 0; k < pieces; ++k) points_.push_back({b.position + ((2.0 * k + 1.0) / pieces - 1.0) * b.half_axis, cover, int(i)});
      largest = std::max(largest, cover);
    }
    range_ = range;
    grid_.build(points_.size(), [&](std::size_t i) { return points_[i].place; }, 2.0 * largest + range);
  }

  /// Calls visit(i, j) for pairs of bodies, with capsules several times for some.
  template <class Visit>
  void pairs(Visit visit) const {
    grid_.pairs([&](int p, int q) {
      const Point &a = points_[std::size_t(p)], &b = points_[std::size_t(q)];
      const Vec3<double> d = a.place - b.place;
      const double far = a.cover + b.cover + range_;
      if (dot(d, d) <= far * far) visit(a.body, b.body);
    });
  }

 private:
  struct Point {
    Vec3<double> place;  ///< m
    double cover;        ///< m, radius of its ball
    int body;
  };
  PointGrid grid_;
  std::vector<Point> points_;
  double range_ = 0.0;
};

struct PeriodicBox {
  Vec3<double> low{}, length{};              ///< m
  bool periodic[3] = {false, false, false};  ///< x, y, z
  double beyond = 0.0;                       ///< m, by how much bodies may be outside of the box
};

/// Finds pairs and remembers a wider list of them, which holds while no body has moved by half of the margin. What it finds does not
/// depend on the age of that list.
class PairFinder {
 public:
  PeriodicBox box;

  /// Appends all pairs with gap <= reach, sorted by (key_a, key_b), key_a < key_b. Throws std::invalid_argument where a body might touch
  /// another one twice, across two boundaries.
  void find(const std::vector<Body>& own, double reach, std::vector<Contact>& contacts) {
    const bool images = !own.empty() && (box.periodic[0] || box.periodic[1] || box.periodic[2]);
    if (images) add_images(own, reach);
    const std::vector<Body>& bodies = images ? all_ : own;
    const int count = int(own.size());
    if (!current(bodies, reach)) build(bodies, reach);
    second_.clear();
    for (const auto& pair : pairs_) {
      if (pair.first >= count) continue;  // of an image: this contact across a boundary is found from the other side too
      const Body &a = bodies[pair.first], &b = bodies[pair.second];
      if (levers_ && (has_length(a) || has_length(b))) {
        capsule_contacts(a, pair.first, b, pair.second < count ? pair.second : origin_[std::size_t(pair.second - count)], reach, contacts,
                         second_);
        continue;
      }
      const Vec3<double> separation = a.position - b.position;
      const double touch = a.radius + b.radius, far = touch + reach, square = dot(separation, separation);
      if (square > far * far) continue;
      const double distance = std::sqrt(square);
      // Coincident centres have no direction; any will do to drive them apart.
      const Vec3<double> normal = distance > 0.0 ? separation * (1.0 / distance) : Vec3<double>{0.0, 1.0, 0.0};
      const int partner = pair.second < count ? pair.second : origin_[std::size_t(pair.second - count)];
      contacts.push_back({pair.first, partner, a.id, b.id, distance - touch, normal});
    }
    contacts.insert(contacts.end(), second_.begin(), second_.end());
  }

 private:
  /// Fills all_ and origin_.
  void add_images(const std::vector<Body>& own, double reach) {
    all_ = own;
    origin_.clear();
    double largest = 0.0;
    for (const Body& b : all_) largest = std::max(largest, extent(b));
    const double range = 2.0 * largest + reach + box.beyond;
    double Vec3<double>::* const axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
    for (int k = 0; k < 3; ++k) {
      const double low = box.low.*axes[k], length = box.length.*axes[k];
      const auto at = [&](const Body& b) { return b.position.*axes[k]; };
      if (!box.periodic[k]) continue;
      if (length < 2.0 * range) {
        // Between bodies that all lie in one plane across the axis (logs in cross-section) no image can touch anything.
        const auto ends = std::minmax_element(all_.begin(), all_.end(), [&](const Body& a, const Body& b) { return at(a) < at(b); });
        if (length - (at(*ends.second) - at(*ends.first)) > 2.0 * largest + reach) continue;
        throw std::invalid_argument(std::string("the periodic box is too short along ") + "xyz"[k] + ": " + std::to_string(length) +
                                    " m; a body would touch another one twice; it needs " + std::to_string(2.0 * range) +
                                    " m or a boundary that is not periodic");
      }
      const std::size_t n = all_.size();
      for (std::size_t i = 0; i < n; ++i) {
        const double shift = at(all_[i]) < low + range ? length : at(all_[i]) > low + length - range ? -length : 0.0;
        if (shift == 0.0) continue;
        all_.push_back(all_[i]);
        all_.back().position.*axes[k] += shift;
        origin_.push_back(i < own.size() ? int(i) : origin_[i - own.size()]);
      }
    }
  }

  bool current(const std::vector<Body>& bodies, double reach) const {
    if (bodies.size() != reference_.size() || reach > reach_ || reach < 0.25 * reach_) return false;
    const double limit = 0.25 * margin_ * margin_;  // (margin / 2)^2
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Vec3<double> moved = bodies[i].position - reference_[i].position;
      double square = dot(moved, moved);
      if (levers_) {
        const double most = std::sqrt(square) + norm(bodies[i].half_axis - reference_[i].half_axis);
        square = most * most;
      }
      if (!(square <= limit) || bodies[i].id != reference_[i].id || bodies[i].radius != reference_[i].radius) return false;
    }
    return true;
  }
  void build(const std::vector<Body>& bodies, double reach) {
    double sum = 0.0;
    for (const Body& b : bodies) sum += b.radius;
    levers_ = std::any_of(bodies.begin(), bodies.end(), has_length);
    // Where bodies move by a good part of their size, no list lasts longer than a step: then no margin is worth its pairs.
    const double margin = bodies.empty() ? 0.0 : 0.3 * sum / double(bodies.size());
    const bool lasting = reach < margin;
    margin_ = lasting ? margin + reach : 0.0;
    reach_ = lasting ? 2.0 * reach : reach;
    grid_.build(bodies, reach_ + margin_);
    found_.clear();
    start_.assign(bodies.size() + 1, 0);
    grid_.pairs([&](int i, int j) {
      if (bodies[i].id == bodies[j].id) return;  // a body and its image across a periodic boundary
      if (bodies[i].id > bodies[j].id) std::swap(i, j);
      found_.emplace_back(i, j);
    });
    if (levers_) {
      std::sort(found_.begin(), found_.end());
      found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
      found_.erase(std::remove_if(found_.begin(), found_.end(),
                                  [&](const auto& p) { return segment_gap(bodies[p.first], bodies[p.second]) > reach_ + margin_; }),
                   found_.end());
    }
    for (const auto& pair : found_) ++start_[std::size_t(pair.first) + 1];
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
  std::vector<Body> all_;    ///< and their images
  std::vector<int> origin_;  ///< of each image the index of its body
  BodyGrid grid_;
  std::vector<Contact> second_;  ///< points of contact of pairs that have two
  bool levers_ = false;          ///< a body of the list is a capsule
  std::vector<Body> reference_;
  std::vector<std::pair<int, int>> pairs_, found_;
  std::vector<int> start_;
  double reach_ = 0.0, margin_ = 0.0;
};

namespace detail {
inline void wall_contact(const Wall& wall, int body, const Body& b, std::int64_t key, double gap, const Vec3<double>& normal,
                         const Vec3<double>& velocity, std::vector<Contact>& contacts) {
  contacts.push_back({body, -1, b.id, key, gap, normal, velocity, wall.material, wall.stiffness});
}

/// Calls place(centre, end, key) for the circles with which a body may touch a plane or a drum: that of a disc or ball, or those of
/// the two caps of a capsule, with their offsets from its centre. In ascending order of the keys.
template <class Place>
void each_end(const Wall& wall, const Body& b, Place place) {
  if (!has_length(b)) return place(b.position, Vec3<double>(), wall.id);
  const std::int64_t number = wall_number(wall.id);
  place(b.position + b.half_axis, b.half_axis, wall_key(number, 1));
  place(b.position - b.half_axis, -b.half_axis, wall_key(number, 0));
}
/// Makes the last contact that of the cap at `end`; see capsules.hpp.
inline void on_end(const Body& b, const Vec3<double>& end, bool concave, std::vector<Contact>& contacts) {
  if (!has_length(b)) return;
  Contact& c = contacts.back();
  c.lever = true;
  c.concave = concave;
  c.offset_a = end;
  c.share = point_share(-2.0 * dot(end, c.normal), b.radius);
  if (c.share == 0.0) contacts.pop_back();
}
}  // namespace detail

/// A plane; the free space is on the side of the normal, or on both: then a body is on the side of its centre, and one whose centre lies on
/// the plane on that of the normal.
struct Plane : Wall {
  Vec3<double> point{};                ///< m, any of the plane
  Vec3<double> normal{0.0, 1.0, 0.0};  ///< unit
  Vec3<double> velocity{};             ///< m/s, of the surface; moving `point` along is the caller's
  double omega = 0.0;                  ///< rad/s, right-handed about the normal through `point`: the end plate of a drum
  bool two_sided = false;

  auto fields() { return std::tie(id, material, stiffness, point, normal, velocity, omega); }
};

inline void plane_contacts(const std::vector<Body>& bodies, const Plane& plane, double reach, std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Body& b = bodies[i];
    const double side = plane.two_sided && dot(b.position - plane.point, plane.normal) < 0.0 ? -1.0 : 1.0;
    detail::each_end(plane, b, [&](const Vec3<double>& centre, const Vec3<double>& end, std::int64_t key) {
      const Vec3<double> from = centre - plane.point;
      const double gap = side * dot(from, plane.normal) - b.radius;
      if (gap > reach) return;
      detail::wall_contact(plane, int(i), b, key, gap, side * plane.normal, plane.velocity + plane.omega * cross(plane.normal, from),
                           contacts);
      detail::on_end(b, end, false, contacts);
    });
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
    const Body& b = bodies[i];
    detail::each_end(drum, b, [&](const Vec3<double>& centre, const Vec3<double>& end, std::int64_t key) {
      Vec3<double> arm = centre - drum.point;
      arm -= dot(arm, drum.axis) * drum.axis;
      const double distance = norm(arm), gap = drum.radius - distance - b.radius;
      if (gap > reach || !(distance > 0.0)) return;
      const Vec3<double> outward = arm * (1.0 / distance);
      detail::wall_contact(drum, int(i), b, key, gap, -outward, drum.velocity + (drum.omega * drum.radius) * cross(drum.axis, outward),
                           contacts);
      detail::on_end(b, end, true, contacts);
    });
  }
}

/// The triangles of a mesh.
struct Mesh : Wall {
  SurfaceContacts surface;
  double speed = 0.0;  ///< m/s, of the fastest corner
  bool velocity_known = true;

  /// moved: as for the surface.
  void update(std::vector<Triangle> triangles, bool moved = true) {
    double square = 0.0;
    for (const Triangle& t : triangles)
      for (const Vec3<double>& v : t.velocity) square = std::max(square, dot(v, v));
    speed = std::sqrt(square);
    surface.update(std::move(triangles), moved);
  }
};

/// Contacts with the triangles of a mesh, with its work space.
class TriangleFinder {
 public:
  /// In the order of the bodies' ids. `mesh.id` must be wall_key(number); a contact's key is wall_key(number, feature of the triangle).
  void find(const std::vector<Body>& bodies, const Mesh& mesh, double reach, std::vector<Contact>& contacts) {
    hits_.clear();
    const std::vector<Triangle>& triangles = mesh.surface.triangles();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      mesh.surface.contacts(bodies[i].position, bodies[i].radius, bodies[i].radius + reach, found_);
      for (const SurfacePoint& f : found_) hits_.push_back({int(i), f.triangle, f.at});
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

  std::vector<SurfacePoint> found_;
  std::vector<Hit> hits_;
};

/// All that bodies may touch: each other and the walls.
struct ContactGeometry {
  PairFinder pairs;
  std::vector<Plane> planes;
  std::vector<Drum> drums;
  /// Periodic images of bodies are not looked for on meshes: where a mesh ends at a periodic boundary they would touch its edge.
  std::vector<Mesh> meshes;

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
