// The Gaussian: the shares of many lines in a row of cells, times what the lines carry.
// Part of fields_spread.hpp, compiled for several instruction sets.
#pragma once

#include "fields_factors.hpp"

namespace dembark::fields {
namespace {

// Those lines of a group that reach a plane, with what they carry.
struct Plane {
  int count = 0;
  int lines[max_group];
  const double* values[max_group];
};

inline Plane plane_of(const Group& group, int x) {
  Plane plane;
  for (int line = 0; line < group.count; ++line) {
    plane.lines[plane.count] = line;
    plane.values[plane.count] = group.values + long(line) * group.columns;
    plane.count += x >= group.windows[line].start[0] && x < group.windows[line].start[0] + group.windows[line].count[0];
  }
  return plane;
}

// Adds Q nodes of a line, from the node `place` of all lines on, to its `rows` of a plane: `height` ones, `pitch` apart. `first`: nothing
// is there yet.
template <int Q>
inline void add_nodes(const Factors& factors, long place, long x, long y, int height, long pitch, bool first, double* rows) {
  const long y_stride = factors.stride[1], z_stride = factors.stride[2];
  const double* across = factors.of[1] + place * y_stride + y;
  for (long k = 0; k < z_stride; k += LANES) {
    Pack along[Q];
    for (int q = 0; q < Q; ++q)
      along[q] = load(factors.of[2] + (place + q) * z_stride + k) * factors.of[0][(place + q) * factors.stride[0] + x];
    for (int j = 0; j < height; ++j) {
      Pack sum = along[0] * across[j];
      for (int q = 1; q < Q; ++q) sum += along[q] * across[q * y_stride + j];
      double* row = rows + j * pitch + k;
      store(row, first ? sum : load(row) + sum);
    }
  }
}

// rows (cells of y, lines of the plane, z_stride) of the plane `x`: the lines' mean shares.
inline void plane_rows(const Factors& factors, const Nodes& nodes, const Group& group, const Plane& plane, int x, double* rows) {
  const long z_stride = factors.stride[2], pitch = plane.count * z_stride;
  for (int n = 0; n < plane.count; ++n, rows += z_stride) {
    const Window& window = group.windows[plane.lines[n]];
    const int begin = window.start[1] - group.all.start[1], height = window.count[1];
    const auto clear = [&](int from, int to) {
      for (int j = from; j < to; ++j)
        for (long k = 0; k < z_stride; k += LANES) store(rows + j * pitch + k, Pack{});
    };
    clear(0, begin);
    clear(begin + height, group.all.count[1]);
    const long first = long(plane.lines[n]) * nodes.count;
    int q = 0;
    for (; q + 4 <= nodes.count; q += 4) add_nodes<4>(factors, first + q, x, begin, height, pitch, q == 0, rows + begin * pitch);
    for (; q < nodes.count; ++q) add_nodes<1>(factors, first + q, x, begin, height, pitch, q == 0, rows + begin * pitch);
  }
}

// A part of a row of cells: `cells` <= LANES of them, columns `depth` apart. `room`: a complete pack may be stored, whose lanes beyond hold
// zeros.
struct Row {
  int cells;
  long depth;
  bool room;
};

// out (N columns) += sum over lines of shares[0 ... LANES) times values[column ... column + N). The sums stay in registers.
template <int N>
inline void add_columns(int lines, const double* shares, long stride, const double* const* values, int column, const Row& row,
                        double* out) {
  Pack sum[N];
#pragma GCC unroll 32
  for (int c = 0; c < N; ++c) sum[c] = Pack{};
  for (int line = 0; line < lines; ++line, shares += stride) {
    const Pack share = load(shares);
    const double* value = values[line] + column;
    // Otherwise the compiler adds `column` to each of the N offsets beforehand, which needs more registers than there are.
    __asm__("" : "+r"(value));
#pragma GCC unroll 32
    for (int c = 0; c < N; ++c) sum[c] += share * value[c];
  }
  out += column * row.depth;
  if (row.room) {
#pragma GCC unroll 32
    for (int c = 0; c < N; ++c) store(out + c * row.depth, load(out + c * row.depth) + sum[c]);
    return;
  }
  double last[N * LANES];
#pragma GCC unroll 32
  for (int c = 0; c < N; ++c) store(last + c * LANES, sum[c]);
  for (int c = 0; c < N; ++c)
    for (int k = 0; k < row.cells; ++k) out[c * row.depth + k] += last[c * LANES + k];
}

// The same for all columns, as many at once as registers hold.
inline void add_lines(int lines, const double* shares, long stride, const double* const* values, int columns, const Row& row, double* out) {
  constexpr int at_once = LANES == 8 ? 20 : 8;
  int c = 0;
  for (; c + at_once <= columns; c += at_once) add_columns<at_once>(lines, shares, stride, values, c, row, out);
  if (LANES == 8 && c + 12 <= columns) {
    add_columns<12>(lines, shares, stride, values, c, row, out);
    c += 12;
  }
  for (; c + 4 <= columns; c += 4) add_columns<4>(lines, shares, stride, values, c, row, out);
  for (; c < columns; ++c) add_columns<1>(lines, shares, stride, values, c, row, out);
}

inline void spread_gaussian(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int from, int to,
                            double* scratch, double* out) {
  double* rows;
  const Factors factors = gaussian_factors(cells, kernel, nodes, group, scratch, &rows);
  const int *start = group.all.start, *count = group.all.count;
  const long depth = cells.shape[2], stride = factors.stride[2];
  const int begin = from > start[0] ? from : start[0], end = to < start[0] + count[0] ? to : start[0] + count[0];
  for (int i = begin; i < end; ++i) {
    const Plane plane = plane_of(group, i);
    plane_rows(factors, nodes, group, plane, i - start[0], rows);
    const auto window = [&](int n) -> const Window& { return group.windows[plane.lines[n]]; };
    // Lines come by where they end and begin along y: those that reach a row lie between two of them.
    for (int j = 0, first = 0; j < count[1]; ++j) {
      const int y = start[1] + j;
      while (first < plane.count && window(first).start[1] + window(first).count[1] <= y) ++first;
      int last = plane.count;
      while (last > first && window(last - 1).start[1] > y) --last;
      if (first == last) continue;
      double* cell = out + (long(i) * cells.shape[1] + y) * group.columns * depth + start[2];
      for (int k = 0; k < count[2]; k += LANES) {
        const Row row{count[2] - k < LANES ? count[2] - k : LANES, depth, start[2] + k + LANES <= depth};
        add_lines(last - first, rows + (long(j) * plane.count + first) * stride + k, stride, plane.values + first, group.columns, row,
                  cell + k);
      }
    }
  }
}

}  // namespace
}  // namespace dembark::fields
