// A grid that is wider than the periodic one by `halo` cells on both sides: what leaves the grid is caught there and added on the other
// side, which saves spreading the images of all lines near a border.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "fields_sources.hpp"

namespace dembark::fields {

struct Wide {
  Cells cells;
  Box box;
  int halo[3] = {0, 0, 0};

  template <class Source>
  Wide(const Cells& inner, const Box& around, const Kernel& kernel, const Source& source, int threads) : cells(inner), box(around) {
    // Across a sheared border the cells do not fit together; a spherical kernel is normalised over its window, wherever that is.
    const bool sheared = box.edge[1][0] != 0.0 || box.edge[2][0] != 0.0 || box.edge[2][1] != 0.0;
    if (sheared || kernel.kind != KernelKind::gaussian || source.count == 0) return;
    const std::array<double, 3> longest = reach_of_branches(source, threads);
    for (int axis = 0; axis < 3; ++axis) {
      if (!inner.periodic[axis] || !box.periodic[axis]) continue;
      halo[axis] = int(std::ceil((kernel.reach + longest[std::size_t(axis)]) / inner.spacing[axis]));
      box.folded[axis] = true;
      box.home[axis] = inner.low[axis];
      cells.low[axis] -= halo[axis] * inner.spacing[axis];
      cells.high[axis] += halo[axis] * inner.spacing[axis];
      cells.shape[axis] += 2 * halo[axis];
    }
  }

  bool any() const { return halo[0] || halo[1] || halo[2]; }

  // Adds `wide` (nx, ny, source.columns, nz of this grid) to `out` (of the inner one); the planes of `out` are shared among the threads.
  template <class Source>
  void fold(const Cells& inner, const Source& source, int threads, const double* wide, double* out) const {
    const std::size_t columns = std::size_t(source.columns), depth = std::size_t(cells.shape[2]), inner_depth = std::size_t(inner.shape[2]);
    on_threads(threads, [&](int n) {
      const Range range(inner.shape[0], n, threads);
      std::vector<double> values(columns);
      for (int i = 0; i < cells.shape[0]; ++i) {
        const Home x = home(inner, 0, i);
        if (x.cell < range.begin || x.cell >= range.end) continue;
        for (int j = 0; j < cells.shape[1]; ++j) {
          const Home y = home(inner, 1, j);
          const double* const from = wide + (std::size_t(i) * std::size_t(cells.shape[1]) + std::size_t(j)) * columns * depth;
          double* const to = out + (std::size_t(x.cell) * std::size_t(inner.shape[1]) + std::size_t(y.cell)) * columns * inner_depth;
          // Runs of cells along z that go to the same period.
          for (int k = 0, stop = 0; k < cells.shape[2]; k = stop) {
            const Home z = home(inner, 2, k);
            stop = std::min(cells.shape[2], k + inner.shape[2] - z.cell);
            const double shift[3] = {x.shift, y.shift, z.shift};
            add_run<Source>(shift, std::size_t(stop - k), from + k, depth, to + z.cell, inner_depth, values);
          }
        }
      }
    });
  }

 private:
  // Where a cell of this grid lies in the inner one, and how far that is away (m).
  struct Home {
    int cell;
    double shift;
  };

  Home home(const Cells& inner, int axis, int cell) const {
    const int count = inner.shape[axis], away = cell - halo[axis];
    const int periods = away >= 0 ? away / count : -((count - 1 - away) / count);
    return {away - periods * count, -periods * box.edge[axis][axis]};
  }

  // Adds `count` cells of columns `depth` apart to those `to_depth` apart, moved by `shift`; `values` (columns,) is scratch.
  template <class Source>
  static void add_run(const double shift[3], std::size_t count, const double* from, std::size_t depth, double* to, std::size_t to_depth,
                      std::vector<double>& values) {
    const std::size_t columns = values.size();
    if constexpr (Source::placed) {
      if (shift[0] != 0.0 || shift[1] != 0.0 || shift[2] != 0.0) {
        for (std::size_t k = 0; k < count; ++k) {
          for (std::size_t c = 0; c < columns; ++c) values[c] = from[c * depth + k];
          Source::moved(shift, values.data());
          for (std::size_t c = 0; c < columns; ++c) to[c * to_depth + k] += values[c];
        }
        return;
      }
    }
    for (std::size_t c = 0; c < columns; ++c)
      for (std::size_t k = 0; k < count; ++k) to[c * to_depth + k] += from[c * depth + k];
  }

  // The longest components (m) of the branches.
  template <class Source>
  static std::array<double, 3> reach_of_branches(const Source& source, int threads) {
    std::vector<std::array<double, 3>> parts(std::size_t(threads), {0.0, 0.0, 0.0});
    on_threads(threads, [&](int n) {
      std::array<double, 3>& part = parts[std::size_t(n)];
      const Range range(source.count, n, threads);
      for (std::int64_t line = range.begin; line < range.end; ++line) {
        const typename Source::Place place = source.place(line);
        for (std::size_t axis = 0; axis < 3; ++axis) part[axis] = std::max(part[axis], std::abs(place.branch[axis]));
      }
    });
    for (const auto& part : parts)
      for (std::size_t axis = 0; axis < 3; ++axis) parts[0][axis] = std::max(parts[0][axis], part[axis]);
    return parts[0];
  }
};

}  // namespace dembark::fields
