// Which triangles of a surface at rest may be near a point: the cells of a grid, each with the triangles within reach of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "triangle.hpp"

namespace dembark {

class TriangleCells {
 public:
  /// reach: m, how far from a point triangles are looked for.
  void build(const std::vector<Triangle>& triangles, double reach) {
    constexpr double most = 1e300;
    low_ = {most, most, most};
    Vec3<double> high{-most, -most, -most};
    for (const Triangle& t : triangles) {
      const auto [from, to] = box(t, reach);
      low_ = {std::min(low_.x, from.x), std::min(low_.y, from.y), std::min(low_.z, from.z)};
      high = {std::max(high.x, to.x), std::max(high.y, to.y), std::max(high.z, to.z)};
    }
    const double length[3] = {high.x - low_.x, high.y - low_.y, high.z - low_.z};
    double edge = 2.0 * reach;
    const auto cells = [&](int k) { return std::floor(length[k] / edge) + 1.0; };
    while (cells(0) * cells(1) * cells(2) > 64.0 * double(triangles.size()) + 4096.0) edge *= 1.26;
    for (int k = 0; k < 3; ++k) count_[k] = triangles.empty() ? 0 : int(cells(k));
    inverse_ = 1.0 / edge;

    const double around = reach + std::sqrt(0.75) * edge;
    std::vector<std::vector<int>> members(std::size_t(count_[0]) * count_[1] * count_[2]);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const auto [from, to] = box(triangles[i], reach);
      const int x0 = at(from.x, low_.x, 0), x1 = at(to.x, low_.x, 0), y0 = at(from.y, low_.y, 1), y1 = at(to.y, low_.y, 1);
      const int z0 = at(from.z, low_.z, 2), z1 = at(to.z, low_.z, 2);
      for (int z = z0; z <= z1; ++z)
        for (int y = y0; y <= y1; ++y)
          for (int x = x0; x <= x1; ++x) {
            const Vec3<double> middle = low_ + edge * Vec3<double>{x + 0.5, y + 0.5, z + 0.5};
            if (closest_point(triangles[i], middle).distance <= around) members[index(x, y, z)].push_back(int(i));
          }
    }
    start_.assign(1, 0);
    member_.clear();
    for (const std::vector<int>& one : members) {
      member_.insert(member_.end(), one.begin(), one.end());
      start_.push_back(int(member_.size()));
    }
  }

  /// Calls visit(i) for all triangles that may be within reach of the point.
  template <class Visit>
  void near(const Vec3<double>& p, Visit visit) const {
    const double place[3] = {(p.x - low_.x) * inverse_, (p.y - low_.y) * inverse_, (p.z - low_.z) * inverse_};
    for (int k = 0; k < 3; ++k)
      if (!(place[k] >= 0.0 && place[k] < count_[k])) return;
    const std::size_t cell = index(int(place[0]), int(place[1]), int(place[2]));
    for (int k = start_[cell]; k < start_[cell + 1]; ++k) visit(member_[std::size_t(k)]);
  }

 private:
  std::size_t index(int x, int y, int z) const { return (std::size_t(z) * count_[1] + y) * count_[0] + x; }
  int at(double p, double low, int axis) const { return std::clamp(int((p - low) * inverse_), 0, count_[axis] - 1); }

  Vec3<double> low_{};
  double inverse_ = 1.0;
  int count_[3] = {0, 0, 0};
  std::vector<int> start_, member_;
};

}  // namespace dembark
