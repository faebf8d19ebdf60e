// Which triangles of a surface may be near a point: the cells of a grid, each with the triangles that pass through it. Any distance may be
// asked for.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "triangle.hpp"

namespace dembark {

class TriangleCells {
 public:
  /// Of all triangles but those without area. usual: distance (m) that is asked for most often, which searches fastest; 0: not known.
  void build(const std::vector<Triangle>& triangles, double usual) {
    constexpr double most = 1e300;
    low_ = {most, most, most};
    Vec3<double> high{-most, -most, -most};
    double sum = 0.0;
    std::size_t solid = 0;
    for (const Triangle& t : triangles) {
      if (is_flat(t)) continue;
      const auto [from, to] = box(t, 0.0);
      low_ = {std::min(low_.x, from.x), std::min(low_.y, from.y), std::min(low_.z, from.z)};
      high = {std::max(high.x, to.x), std::max(high.y, to.y), std::max(high.z, to.z)};
      sum += std::max({to.x - from.x, to.y - from.y, to.z - from.z});
      ++solid;
    }
    start_.assign(1, 0);
    member_.clear();
    for (int& count : count_) count = 0;
    if (solid == 0) return;
    const double length[3] = {high.x - low_.x, high.y - low_.y, high.z - low_.z};
    edge_ = std::max(sum / double(solid), usual);
    const auto cells = [&](int k) { return std::floor(length[k] / edge_) + 1.0; };
    while (cells(0) * cells(1) * cells(2) > 4.0 * double(solid) + 64.0) edge_ *= 1.26;
    for (int k = 0; k < 3; ++k) count_[k] = int(cells(k));
    inverse_ = 1.0 / edge_;

    // Counted first, then filled: two flat arrays, however many cells a triangle passes through.
    start_.assign(std::size_t(count_[0]) * count_[1] * count_[2] + 1, 0);
    for (const Triangle& t : triangles) each_cell(t, [&](std::size_t cell) { ++start_[cell + 1]; });
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    member_.resize(start_.back());
    for (std::size_t i = triangles.size(); i-- > 0;)
      each_cell(triangles[i], [&](std::size_t cell) { member_[--start_[cell + 1]] = std::int32_t(i); });
    // Each entry has come down to the begin of its own cell.
    start_.erase(start_.begin());
    start_.push_back(member_.size());
  }

  /// m, of the cells.
  double edge() const { return edge_; }

  /// Calls visit(i) once for each triangle that may be within `distance` (m) of the point, until one of the calls returns false.
  template <class Visit>
  void near(const Vec3<double>& p, double distance, Visit visit) const {
    int from[3], to[3];
    const double place[3] = {p.x - low_.x, p.y - low_.y, p.z - low_.z};
    for (int k = 0; k < 3; ++k) {
      const double first = (place[k] - distance) * inverse_, last = (place[k] + distance) * inverse_;
      if (!(last >= 0.0 && first < count_[k])) return;
      from[k] = first > 0.0 ? int(first) : 0;
      to[k] = last < count_[k] ? int(last) : count_[k] - 1;
    }
    if (from[0] == to[0] && from[1] == to[1] && from[2] == to[2]) {
      const std::size_t cell = index(from[0], from[1], from[2]);
      for (std::size_t k = start_[cell]; k < start_[cell + 1]; ++k)
        if (!visit(member_[k])) return;
      return;
    }
    thread_local std::vector<std::uint64_t> seen;
    thread_local std::uint64_t search = 0;
    ++search;
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (std::size_t k = start_[index(from[0], y, z)]; k < start_[index(to[0], y, z) + 1]; ++k) {
          const std::size_t t = std::size_t(member_[k]);
          if (t >= seen.size()) seen.resize(t + 1, 0);
          if (seen[t] == search) continue;
          seen[t] = search;
          if (!visit(member_[k])) return;
        }
  }

 private:
  std::size_t index(int x, int y, int z) const { return (std::size_t(z) * count_[1] + y) * count_[0] + x; }
  int at(double place, int axis) const { return std::clamp(int(place * inverse_), 0, count_[axis] - 1); }

  /// Calls visit(cell) for each cell in the triangle's box through which its plane passes; none for a triangle without area.
  template <class Visit>
  void each_cell(const Triangle& t, Visit visit) const {
    if (is_flat(t)) return;
    // By a little more than round-off on either side.
    const auto [low, high] = box(t, 1e-9 * edge_);
    const Vec3<double> normal = cross(t.node[1] - t.node[0], t.node[2] - t.node[0]);
    const double wide = (0.5 + 1e-6) * edge_ * (std::fabs(normal.x) + std::fabs(normal.y) + std::fabs(normal.z));
    const int x1 = at(high.x - low_.x, 0), y1 = at(high.y - low_.y, 1), z1 = at(high.z - low_.z, 2);
    for (int z = at(low.z - low_.z, 2); z <= z1; ++z)
      for (int y = at(low.y - low_.y, 1); y <= y1; ++y)
        for (int x = at(low.x - low_.x, 0); x <= x1; ++x) {
          const Vec3<double> middle = low_ + edge_ * Vec3<double>{x + 0.5, y + 0.5, z + 0.5};
          if (std::fabs(dot(normal, middle - t.node[0])) <= wide) visit(index(x, y, z));
        }
  }

  Vec3<double> low_{};
  double edge_ = 1.0, inverse_ = 1.0;
  int count_[3] = {0, 0, 0};
  std::vector<std::size_t> start_;
  std::vector<std::int32_t> member_;
};

}  // namespace dembark
