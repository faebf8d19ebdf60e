// Cells of half the reach in which particles are sorted, rows of neighbours, and slabs that threads may work on at once.
//
// Cells are numbered with the longest side of the region last, and particles in the order of their cells: those of a row of cells lie side
// by side, and a slab of two layers of cells is one range of particles. A pair i < j has j in the slab of i or the next one, so that slabs
// 0, 2, 4 ... never touch the same particle, nor do 1, 3, 5 ...: sums are the same bits on any number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "../pack.hpp"
#include "vector.hpp"

namespace dembark::sph {

/// The region in cells.
class Grid {
 public:
  /// low, high: corners (m) of all particles; reach (m): of the search.
  void set(const Vector& low, const Vector& high, double reach) {
    reach_ = reach;
    inverse_ = 2.0 / reach;
    const std::array<double, 3> from{low.x, low.y, low.z}, length{high.x - low.x, high.y - low.y, high.z - low.z};
    axis_ = {0, 1, 2};
    std::stable_sort(axis_.begin(), axis_.end(), [&](int a, int b) { return length[a] < length[b]; });
    double all = 1.0;
    for (int k = 0; k < 3; ++k) {
      low_[k] = from[axis_[k]];
      const double cells = std::floor(length[axis_[k]] * inverse_) + 1.0;
      all *= cells;
      if (!(all < 2e8))
        throw std::runtime_error("particles are spread over " + std::to_string(length[axis_[2]]) +
                                 " m, too far for cells of the smoothing length: fluid has left its walls, or the time step is too large");
      count_[k] = int(cells);
    }
  }

  double reach() const { return reach_; }
  int cells() const { return count_[0] * count_[1] * count_[2]; }
  int layers() const { return count_[2]; }
  int cells_of_layer() const { return count_[0] * count_[1]; }
  int cell(const Vector& p) const {
    const std::array<double, 3> x = turned(p);
    return (at(x[2], 2) * count_[1] + at(x[1], 1)) * count_[0] + at(x[0], 0);
  }

  /// Calls row(first cell, last cell, c) for each row of cells that may hold points within the reach of p; c: 0 the row of p's own cell,
  /// > 0 rows after it, < 0 before.
  template <class Row>
  void rows(const Vector& p, bool later_only, Row row) const {
    const std::array<double, 3> x = turned(p);
    const int own_1 = at(x[1], 1), own_2 = at(x[2], 2), last_2 = at(x[2] + reach_, 2), last_1 = at(x[1] + reach_, 1);
    const int first_1 = at(x[1] - reach_, 1);
    for (int c2 = later_only ? own_2 : at(x[2] - reach_, 2); c2 <= last_2; ++c2)
      for (int c1 = later_only && c2 == own_2 ? own_1 : first_1; c1 <= last_1; ++c1) {
        const double d1 = away(x[1], c1, 1), d2 = away(x[2], c2, 2), left = reach_ * reach_ - d1 * d1 - d2 * d2;
        if (left < 0.0) continue;
        const double width = std::sqrt(left);
        const int base = (c2 * count_[1] + c1) * count_[0];
        row(base + at(x[0] - width, 0), base + at(x[0] + width, 0), c2 != own_2 ? c2 - own_2 : c1 - own_1);
      }
  }

 private:
  std::array<double, 3> turned(const Vector& p) const {
    const std::array<double, 3> x{p.x, p.y, p.z};
    return {x[axis_[0]], x[axis_[1]], x[axis_[2]]};
  }
  int at(double x, int k) const {
    const double c = std::floor((x - low_[k]) * inverse_);
    return c < 0.0 ? 0 : c >= count_[k] ? count_[k] - 1 : int(c);
  }
  /// Distance of x from a layer of cells; those at the border hold what lies beyond, too.
  double away(double x, int c, int k) const {
    const double edge = 1.0 / inverse_, from = low_[k] + c * edge;
    if (x < from) return c == 0 ? 0.0 : from - x;
    if (x > from + edge) return c == count_[k] - 1 ? 0.0 : x - from - edge;
    return 0.0;
  }

  double reach_ = 1.0, inverse_ = 1.0;
  std::array<int, 3> axis_{0, 1, 2}, count_{1, 1, 1};
  std::array<double, 3> low_{};
};

/// Points in the order of their cells.
class CellOrder {
 public:
  /// Sorts n points; members()[k] is the k-th in the order of the cells, those of a cell in the order they were given in.
  void sort(const Grid& grid, const Vector* points, std::size_t n) {
    start_.assign(std::size_t(grid.cells()) + 1, 0);
    cell_.resize(n);
    member_.resize(n);
    for (std::size_t i = 0; i < n; ++i) ++start_[(cell_[i] = grid.cell(points[i])) + 1];
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    fill_.assign(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < n; ++i) member_[fill_[cell_[i]]++] = int(i);
  }
  const std::vector<int>& members() const { return member_; }
  int begin(int cell) const { return start_[cell]; }
  int end(int cell) const { return start_[cell + 1]; }

 private:
  std::vector<int> start_, fill_, member_, cell_;
};

/// Neighbours of the particles begin ... end - 1: those of begin + k are neighbour[start[k]] ... neighbour[start[k + 1] - 1].
struct Rows {
  int begin = 0, end = 0;
  std::vector<int> start, neighbour;

  void clear(int from, int to) {
    begin = from;
    end = to;
    start.assign(1, 0);
    neighbour.clear();
  }
  /// Ends a row, filled up with `none` to whole packs of four.
  void end_row(int none) {
    while (neighbour.size() % 4 != 0) neighbour.push_back(none);
    start.push_back(int(neighbour.size()));
  }
  /// Calls work(i, j) for each particle i and each of its neighbours j; none: what the rows were filled up with.
  template <class Work>
  void each(int none, const Work& work) const {
    for (int i = begin; i < end; ++i)
      for (int k = start[i - begin]; k < start[i - begin + 1] && neighbour[k] != none; ++k) work(i, neighbour[k]);
  }
};

/// Appends those of points[from] ... points[to - 1] that lie within the reach of p; map, if any: their numbers.
inline void append_near(const Vector& p, double reach, const Vector* points, int from, int to, const int* map, std::vector<int>& out) {
  const std::size_t size = out.size();
  out.resize(size + std::size_t(std::max(to - from, 0)));
  int* const place = out.data() + size;
  int found = 0;
  const double limit = reach * reach;
  for (int k = from; k < to; ++k) {
    const double x = points[k].x - p.x, y = points[k].y - p.y, z = points[k].z - p.z;
    place[found] = map ? map[k] : k;
    found += int(x * x + y * y + z * z < limit);
  }
  out.resize(size + std::size_t(found));
}

/// Pairs i < j of sorted points, for i in the slab's range.
inline void pair_rows(const Grid& grid, const CellOrder& order, const std::vector<Vector>& sorted, int none, Rows& rows) {
  for (int i = rows.begin; i < rows.end; ++i) {
    grid.rows(sorted[i], true, [&](int first, int last, int row) {
      append_near(sorted[i], grid.reach(), sorted.data(), row == 0 ? i + 1 : order.begin(first), order.end(last), nullptr, rows.neighbour);
    });
    rows.end_row(none);
  }
}

/// Appends all of `others`, in the order of their cells, near p; map: numbers of the others, or nullptr.
inline void append_row(const Grid& grid, const Vector& p, const CellOrder& order, const std::vector<Vector>& others, const int* map,
                       std::vector<int>& out) {
  if (others.empty()) return;
  grid.rows(p, false,
            [&](int first, int last, int) { append_near(p, grid.reach(), others.data(), order.begin(first), order.end(last), map, out); });
}

/// The same for points begin ... end - 1.
inline void all_rows(const Grid& grid, const std::vector<Vector>& points, const CellOrder& order, const std::vector<Vector>& others,
                     const int* map, int none, Rows& rows) {
  for (int i = rows.begin; i < rows.end; ++i) {
    append_row(grid, points[i], order, others, map, rows.neighbour);
    rows.end_row(none);
  }
}

}  // namespace dembark::sph
