// Cells with the grains in them: no side is shorter than the largest diameter, so that a grain touches only those of its own and the next
// cells. Along a periodic direction there are three cells at least. Along others the first and the last cell have no outer face: they hold
// whatever lies beyond.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

#include "contact_times.hpp"

namespace dembark::events {

/// A component of a vector.
inline double& part(Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
inline double part(const Vector& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// A direction with a period, if high > low (m).
struct Period {
  double low = 0.0, high = 0.0;

  bool repeats() const { return high > low; }
  double length() const { return high - low; }
  auto fields() { return std::tie(low, high); }
};

typedef std::array<int, 3> Place;  ///< of a cell, along x, y and z

class Cells {
 public:
  /// A row of three cells along an axis, the middle one that of a grain: number of the cell, times what a step along the axis is, and what
  /// the grains in it are to be moved by (m) to lie next to it. `from` ... `to` are there.
  struct Row {
    std::array<int, 3> cell{};
    std::array<double, 3> shift{};
    int from = 1, to = 1;
  };

  /// Cells for n grains between `low` and `high` (m); side: the least (m).
  void set(const std::array<Period, 3>& periods, const Vector& low, const Vector& high, double side, int dimension, int n) {
    double volume = 1.0;
    for (int a = 0; a < dimension; ++a) volume *= std::max(extent(periods[a], low, high, a), side);
    const double wanted = std::max(side, 0.75 * std::pow(volume / n, 1.0 / dimension));
    for (int a = 0; a < 3; ++a) {
      const double length = extent(periods[a], low, high, a);
      periodic_[a] = periods[a].repeats();
      low_[a] = periodic_[a] ? periods[a].low : part(low, a);
      count_[a] = a >= dimension ? 1 : std::max(periodic_[a] ? 3 : 1, int(std::min(length / wanted, 1e6)));
      side_[a] = length / count_[a];
      stride_[a] = a == 0 ? 1 : stride_[a - 1] * count_[a - 1];
    }
    build();
  }

  int count() const { return stride_[2] * count_[2]; }
  int cells(int axis) const { return count_[axis]; }
  int number(const Place& p) const { return p[0] + p[1] * stride_[1] + p[2] * stride_[2]; }
  Place place(const Vector& x) const {
    Place p{};
    for (int a = 0; a < 3; ++a) {
      if (count_[a] == 1) continue;
      const double k = std::floor((part(x, a) - low_[a]) / side_[a]);
      p[a] = k < 0.0 ? 0 : k >= count_[a] ? count_[a] - 1 : int(k);
    }
    return p;
  }
  /// Whether there is a next cell on the side -1 or 1, and where (m) the face to it is.
  bool open(int axis, int k, int side) const { return periodic_[axis] || (side < 0 ? k > 0 : k < count_[axis] - 1); }
  double face(int axis, int k, int side) const { return low_[axis] + (side < 0 ? k : k + 1) * side_[axis]; }
  const Row& row(int axis, int k) const { return rows_[axis][k]; }

  /// Moves the place to the next one; returns by how many periods the grain there is to be moved, to stay inside.
  int step(Place& p, int axis, int side) const {
    p[axis] += side;
    if (p[axis] >= 0 && p[axis] < count_[axis]) return 0;
    p[axis] -= side * count_[axis];
    return -side;
  }

  /// Empty lists for n grains.
  void clear(int n) {
    head_.assign(std::size_t(count()), -1);
    next_.assign(std::size_t(n), -1);
    before_.assign(std::size_t(n), -1);
  }
  void put(int i, int cell) {
    const int first = head_[cell];
    head_[cell] = i;
    next_[i] = first;
    before_[i] = -1;
    if (first >= 0) before_[first] = i;
  }
  void take(int i, int cell) {
    if (before_[i] >= 0) next_[before_[i]] = next_[i];
    else head_[cell] = next_[i];
    if (next_[i] >= 0) before_[next_[i]] = before_[i];
  }
  int head(int cell) const { return head_[cell]; }
  int next(int i) const { return next_[i]; }

  /// The least of normal.x over a cell, minus infinity where it has no face on that side.
  double least(const Place& p, const Vector& normal) const {
    double sum = 0.0;
    for (int a = 0; a < 3; ++a) {
      const double n = part(normal, a);
      if (n == 0.0) continue;
      const int side = n > 0.0 ? -1 : 1;
      if (!open(a, p[a], side)) return -never;
      sum += n * face(a, p[a], side);
    }
    return sum;
  }

  auto fields() { return std::tie(low_[0], low_[1], low_[2], side_[0], side_[1], side_[2], count_[0], count_[1], count_[2]); }
  /// After the fields have been read; false for such that n grains cannot have.
  bool complete(const std::array<Period, 3>& periods, int n) {
    double all = 1.0;
    for (int a = 0; a < 3; ++a) {
      periodic_[a] = periods[a].repeats();
      if (!(count_[a] >= (periodic_[a] ? 3 : 1) && side_[a] >= 0.0)) return false;
      if (periodic_[a] && (low_[a] != periods[a].low || side_[a] != periods[a].length() / count_[a])) return false;
      all *= count_[a];
      if (!(all <= 27.0 * (n + 1.0))) return false;
      stride_[a] = a == 0 ? 1 : stride_[a - 1] * count_[a - 1];
    }
    build();
    return true;
  }

 private:
  static double extent(const Period& period, const Vector& low, const Vector& high, int axis) {
    return period.repeats() ? period.length() : part(high, axis) - part(low, axis);
  }
  void build() {
    for (int a = 0; a < 3; ++a) {
      rows_[a].assign(std::size_t(count_[a]), {});
      for (int k = 0; k < count_[a]; ++k) {
        Row& row = rows_[a][k];
        row.from = open(a, k, -1) ? 0 : 1;
        row.to = open(a, k, 1) ? 2 : 1;
        for (int j = row.from; j <= row.to; ++j) {
          const int cell = k + j - 1, turns = cell < 0 ? -1 : cell >= count_[a] ? 1 : 0;
          row.cell[j] = (cell - turns * count_[a]) * stride_[a];
          row.shift[j] = turns * side_[a] * count_[a];
        }
      }
    }
  }

  std::array<bool, 3> periodic_{};
  std::array<double, 3> low_{}, side_{};
  std::array<int, 3> count_{1, 1, 1}, stride_{1, 1, 1};
  std::array<std::vector<Row>, 3> rows_;
  std::vector<int> head_, next_, before_;
};

}  // namespace dembark::events
