// Triangles as one surface: a sphere has a contact where its distance to the surface has a minimum.
//
// Each triangle that a sphere reaches has a point closest to the sphere. Two triangles compete when these points belong together: the point
// of one lies on the other (a shared edge or corner, wherever the triangulation puts it), or, on a smooth surface, both triangles are
// touched in the same direction. Of those that compete the nearest has the contact; equal distances are settled by the triangles' order.
// As that order is the same for all, one always remains, so that no contact is lost and none counts twice: a flat patch is a plane, an
// edge counts once, and a groove is touched on both sides unless it is smooth. Both sides of a triangle are solid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "point_grid.hpp"
#include "triangle.hpp"

namespace dembark {

class SurfaceContacts {
 public:
  SurfaceContacts() = default;
  /// smooth_angle (rad, 0 ... pi/4): a groove of a smaller angle is touched on its nearer side only. Springs on both sides would be twice
  /// as stiff; conditions on the gap (impacts) need none of it. weld: corners and edges nearer to each other than this part of the shortest
  /// edge are joined.
  SurfaceContacts(double smooth_angle, double weld) : smooth_angle_(smooth_angle), weld_(weld) {}

  /// The triangles as they are now. Which of them stand beside each other is found anew only when they are others, have changed their
  /// shape or have moved against each other. moved: whether any has since the last call.
  void update(std::vector<Triangle> triangles, bool moved = true) {
    const bool same = std::equal(triangles.begin(), triangles.end(), triangles_.begin(), triangles_.end(),
                                 [](const Triangle& a, const Triangle& b) { return a.id == b.id; });
    triangles_.swap(triangles);
    if (!same || (moved && !moved_as_one())) join();
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }

  /// Triangle t, if it has a contact with a sphere there; otherwise one that competes with it and is nearer to the sphere.
  /// here: of t, to the centre.
  int owner(int t, const ClosestPoint& here, const Vec3<double>& centre, double radius) const {
    const double touch = std::max(1e-6 * radius, weld_ * shortest_), reach = touch + radius * std::tan(smooth_angle_);
    const double* height = &height_[3 * std::size_t(t)];
    if (here.weight[0] * height[0] > reach && here.weight[1] * height[1] > reach && here.weight[2] * height[2] > reach) return t;
    const double parallel = std::cos(smooth_angle_ + 1e-9);
    thread_local std::vector<int> around;
    thread_local std::vector<std::uint64_t> seen;
    thread_local std::uint64_t search = 0;
    seen.resize(std::max(seen.size(), triangles_.size()), search++);
    around.assign(1, t);
    seen[std::size_t(t)] = search;
    for (std::size_t next = 0; next < around.size(); ++next)
      for (int k = first_[std::size_t(around[next])]; k < first_[std::size_t(around[next]) + 1]; ++k) {
        const int other = beside_[std::size_t(k)];
        if (seen[std::size_t(other)] == search) continue;
        seen[std::size_t(other)] = search;
        const double apart = distance_to(other, here.point);
        if (apart > reach) continue;
        around.push_back(other);
        const ClosestPoint there = closest_point(triangles_[std::size_t(other)], centre);
        if (there.distance > here.distance || (there.distance == here.distance && other > t)) continue;
        if (apart <= touch || distance_to(t, there.point) <= touch ||
            (smooth_angle_ > 0.0 && dot(here.arm, there.arm) >= parallel * here.distance * there.distance))
          return other;
      }
    return t;
  }

  /// The triangle that a sphere's contact with triangle t is on now.
  int follow(int t, const Vec3<double>& centre, double radius) const {
    for (int next = t;; t = next) {
      next = owner(t, closest_point(triangles_[std::size_t(t)], centre), centre, radius);
      if (next == t) return t;
    }
  }

 private:
  double distance_to(int t, const Vec3<double>& p) const { return closest_point(triangles_[std::size_t(t)], p).distance; }

  /// Calls visit(k, place) for each corner, with its place as seen from the first triangle, until one of the calls returns false.
  template <class Visit>
  bool seen_from_first(Visit visit) const {
    const Vec3<double>* n = triangles_.front().node;
    Vec3<double> x = n[1] - n[0], z = cross(x, n[2] - n[0]);
    x *= 1.0 / norm(x), z *= 1.0 / norm(z);
    const Vec3<double> y = cross(z, x);
    for (std::size_t k = 0; k < 3 * triangles_.size(); ++k) {
      const Vec3<double> p = triangles_[k / 3].node[k % 3] - n[0];
      if (!visit(k, Vec3<double>{dot(p, x), dot(p, y), dot(p, z)})) return false;
    }
    return true;
  }

  bool moved_as_one() const {
    if (triangles_.empty()) return true;
    // Two triangles may each have moved by this, and yet none is beside another that it was not beside before.
    const double limit = 0.2 * slack * shortest_;
    return seen_from_first([&](std::size_t k, const Vec3<double>& now) {
      const Vec3<double> moved = now - seen_[k];
      return dot(moved, moved) <= limit * limit;
    });
  }

  /// Finds which triangles stand beside each other: a corner of one is on the other.
  void join() {
    const std::size_t n = triangles_.size();
    height_.resize(3 * n);
    shortest_ = INFINITY;
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3<double>* node = triangles_[i].node;
      const double area = norm(cross(node[1] - node[0], node[2] - node[0]));
      if (!(area > 0.0)) throw std::invalid_argument("triangle " + std::to_string(triangles_[i].id) + " has no area");
      for (int k = 0; k < 3; ++k) {
        const double opposite = norm(node[(k + 2) % 3] - node[(k + 1) % 3]);
        height_[3 * i + std::size_t(k)] = area / opposite;
        shortest_ = std::min(shortest_, opposite);
        sum += opposite;
      }
    }
    const auto corner = [this](std::size_t k) { return triangles_[k / 3].node[k % 3]; };
    PointGrid corners;
    corners.build(3 * n, corner, n > 0 ? sum / double(3 * n) : 0.0);
    const double near = slack * shortest_;
    std::vector<std::pair<int, int>> pairs;
    for (std::size_t i = 0; i < n; ++i) {
      const auto [low, high] = box(triangles_[i], near);
      corners.in_box(low, high, [&](int k) {
        const int j = k / 3;
        if (j == int(i) || distance_to(int(i), corner(std::size_t(k))) > near) return;
        pairs.emplace_back(int(i), j);
        pairs.emplace_back(j, int(i));
      });
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    first_.assign(n + 1, 0);
    beside_.clear();
    for (const auto& [i, j] : pairs) ++first_[std::size_t(i) + 1], beside_.push_back(j);
    for (std::size_t i = 0; i < n; ++i) first_[i + 1] += first_[i];
    seen_.resize(3 * n);
    const auto keep = [this](std::size_t k, const Vec3<double>& now) { return seen_[k] = now, true; };
    if (n > 0) seen_from_first(keep);
  }

  static constexpr double slack = 0.01;  ///< of the shortest edge: triangles nearer than this may come to stand beside each other

  double smooth_angle_ = 0.0, weld_ = 1e-6, shortest_ = 0.0;
  std::vector<Triangle> triangles_;
  std::vector<double> height_;       ///< m, of each triangle over its edges
  std::vector<int> first_, beside_;  ///< of triangle i: beside_[first_[i]] ... beside_[first_[i + 1] - 1]
  std::vector<Vec3<double>> seen_;   ///< corners when they were joined
};

}  // namespace dembark
