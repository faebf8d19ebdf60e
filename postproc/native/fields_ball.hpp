// The spherical kernels: shares in all cells of a window by Gauss points.
// Part of fields_spread.hpp, compiled for several instruction sets.
#pragma once

#include "fields_factors.hpp"

namespace dembark::fields {
namespace {

inline double radial(const Kernel& kernel, double square) {
  const double share = clamp(std::sqrt(square) / kernel.width, 0.0, 1.0), rest = 1.0 - share;
  return kernel.kind == KernelKind::lucy ? (1.0 + 3.0 * share) * rest * rest * rest : 1.0;
}

// Integral of a spherical kernel about 0 along z between `low` and `high` within +-chord, at the distance^2 `flat` from the axis.
inline double along_z(const Kernel& kernel, double low, double high, double chord, double flat) {
  const double a = clamp(low, -chord, chord), length = clamp(high, -chord, chord) - a;
  if (length <= 0.0) return 0.0;
  if (kernel.kind == KernelKind::heaviside) return length;
  double sum = 0.0;
  for (int n = 0; n < kernel.cell_nodes; ++n) {
    const double z = a + length * kernel.cell_place[n];
    sum += kernel.cell_weight[n] * radial(kernel, flat + z * z);
  }
  return sum * length;
}

inline double root(double square) { return square > 0.0 ? std::sqrt(square) : 0.0; }

// Shares of a spherical kernel about `place` in the window, normalised over the window (over its part within the cells when closed).
inline void ball_shares(const Cells& cells, const Kernel& kernel, const Window& window, const double place[3], double* share) {
  const int nx = window.count[0], ny = window.count[1], nz = window.count[2], nodes = kernel.cell_nodes;
  const double radius = kernel.width;
  const auto edge = [&](int axis, int i) { return cells.low[axis] + (window.start[axis] + i) * cells.spacing[axis] - place[axis]; };
  const auto open = [&](int axis, int i) {
    if (!kernel.closed || cells.periodic[axis]) return true;
    if (place[axis] < cells.low[axis] || place[axis] > cells.high[axis]) return false;
    return window.start[axis] + i >= 0 && window.start[axis] + i < cells.shape[axis];
  };
  for (long n = 0, end = long(nx) * ny * nz; n < end; ++n) share[n] = 0.0;
  for (int i = 0; i < nx; ++i) {
    const double x0 = clamp(edge(0, i), -radius, radius), x_length = clamp(edge(0, i + 1), -radius, radius) - x0;
    if (x_length <= 0.0 || !open(0, i)) continue;
    for (int a = 0; a < nodes; ++a) {
      const double x = x0 + x_length * kernel.cell_place[a], chord = root(radius * radius - x * x);
      if (chord <= 0.0) continue;
      for (int j = 0; j < ny; ++j) {
        // In the angle the chords along z are smooth up to the rim of the ball.
        const double from = std::asin(clamp(edge(1, j) / chord, -1.0, 1.0));
        const double angle = std::asin(clamp(edge(1, j + 1) / chord, -1.0, 1.0)) - from;
        if (angle <= 0.0 || !open(1, j)) continue;
        for (int b = 0; b < nodes; ++b) {
          const double at = from + angle * kernel.cell_place[b];
          const double y = chord * std::sin(at), flat = x * x + y * y, reach = root(radius * radius - flat);
          const double weight = x_length * kernel.cell_weight[a] * chord * std::cos(at) * angle * kernel.cell_weight[b];
          double* row = share + (long(i) * ny + j) * nz;
          for (int k = 0; k < nz; ++k)
            if (open(2, k)) row[k] += weight * along_z(kernel, edge(2, k), edge(2, k + 1), reach, flat);
        }
      }
    }
  }
  double total = 0.0;
  for (long n = 0, end = long(nx) * ny * nz; n < end; ++n) total += share[n];
  const double scale = total > 0.0 ? 1.0 / total : 0.0;
  for (long n = 0, end = long(nx) * ny * nz; n < end; ++n) share[n] *= scale;
}

inline void spread_ball(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int line, int from, int to,
                        double* scratch, double* out) {
  const Window& window = group.windows[line];
  const int *n = window.count, *start = window.start, columns = group.columns;
  if (start[0] >= to || start[0] + n[0] <= from) return;
  const long size = long(n[0]) * n[1] * n[2], depth = cells.shape[2];
  double *share = scratch, *sum = scratch + size;
  for (long m = 0; m < size; ++m) sum[m] = 0.0;
  for (int q = 0; q < nodes.count; ++q) {
    double place[3];
    for (int axis = 0; axis < 3; ++axis) place[axis] = group.first[3 * line + axis] + nodes.place[q] * group.branch[3 * line + axis];
    ball_shares(cells, kernel, window, place, share);
    for (long m = 0; m < size; ++m) sum[m] += nodes.weight[q] * share[m];
  }
  // A window of a spherical kernel may reach beyond the grid; only what is inside is added.
  const int z_begin = start[2] < 0 ? -start[2] : 0, z_end = start[2] + n[2] > depth ? int(depth) - start[2] : n[2];
  const double* values = group.values + long(line) * columns;
  for (int i = 0; i < n[0]; ++i) {
    if (start[0] + i < from || start[0] + i >= to) continue;
    for (int j = 0; j < n[1]; ++j) {
      if (start[1] + j < 0 || start[1] + j >= cells.shape[1]) continue;
      const double* row = sum + (long(i) * n[1] + j) * n[2];
      double* cell = out + (long(start[0] + i) * cells.shape[1] + start[1] + j) * columns * depth + start[2];
      for (int c = 0; c < columns; ++c, cell += depth)
        for (int k = z_begin; k < z_end; ++k) cell[k] += values[c] * row[k];
    }
  }
}

}  // namespace
}  // namespace dembark::fields
