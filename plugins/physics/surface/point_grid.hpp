// Points sorted into the cells of a dense grid; a point lies in the cell of its place, one beyond the grid in the nearest cell of its
// border.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "../vec3.hpp"

namespace dembark {

class PointGrid {
 public:
  /// point(i): position (m) of each of n, finite; cell: least edge of the cells (m).
  template <class Point>
  void build(std::size_t n, Point point, double cell) {
    find_bounds(n, point, cell > 0.0 ? cell : 1.0);
    start_.assign(std::size_t(count_[0]) * count_[1] * count_[2] + 1, 0);
    cell_of_.resize(n);
    member_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3<double> p = point(i);
      cell_of_[i] = index(at(p.x, low_.x, 0), at(p.y, low_.y, 1), at(p.z, low_.z, 2));
      ++start_[cell_of_[i] + 1];
    }
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    fill_.assign(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < n; ++i) member_[fill_[cell_of_[i]]++] = int(i);
  }

  /// Calls visit(i, j) once for each two points in the same cell or in cells that touch.
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

  /// Calls visit(i) for all points that may lie in the box.
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
  /// The box of the points, as long as the grid has not many more cells than there are points. Otherwise the twentieth part of them at
  /// either end may be far away from the others: those farther than the others are spread lie in the cells of the border. Where that does
  /// not suffice the cells grow.
  template <class Point>
  void find_bounds(std::size_t n, Point point, double cell) {
    double Vec3<double>::* const axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
    Vec3<double> length{};
    low_ = {};
    const auto cells = [&](int k) { return std::floor(length.*axes[k] / cell) + 1.0; };
    const auto few = [&] { return cells(0) * cells(1) * cells(2) <= 8.0 * double(n) + 64.0; };
    std::vector<double> along(n);
    for (const std::size_t ends : {std::size_t(0), n / 20}) {
      for (int k = 0; k < 3 && n > 0; ++k) {
        for (std::size_t i = 0; i < n; ++i) along[i] = point(i).*axes[k];
        double first = *std::min_element(along.begin(), along.end()), last = *std::max_element(along.begin(), along.end());
        if (ends > 0) {
          std::nth_element(along.begin(), along.begin() + std::ptrdiff_t(ends), along.end());
          first = along[ends];
          std::nth_element(along.begin(), along.end() - 1 - std::ptrdiff_t(ends), along.end());
          last = along[n - 1 - ends];
        }
        const double spread = last - first;
        double from = first, to = last;
        for (const double p : along)
          if (p >= first - spread && p <= last + spread) from = std::min(from, p), to = std::max(to, p);
        low_.*axes[k] = from;
        length.*axes[k] = to - from;
      }
      if (few()) break;
    }
    while (!few()) cell *= 1.5;
    for (int k = 0; k < 3; ++k) count_[k] = int(cells(k));
    inverse_ = 1.0 / cell;
  }
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

}  // namespace dembark
