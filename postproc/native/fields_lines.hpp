// Lines that carry values, and the grid of cells they are spread over. Plain data: fields_spread.hpp is compiled for several instruction
// sets, and nothing that the linker could merge between them may stand here.
#pragma once

namespace dembark::fields {

enum class KernelKind { gaussian, lucy, heaviside };

constexpr int max_cell_nodes = 16;  // Gauss points along an axis of a cell
constexpr int max_group = 64;       // lines that are spread together

struct Cells {
  double low[3], high[3], spacing[3], per_metre[3];  // per_metre: cells per length, 1 / spacing
  int shape[3];
  bool periodic[3];
};

struct Kernel {
  KernelKind kind;
  double width, reach;
  bool closed;     // scaled to stay within the cells
  int cell_nodes;  // of Lucy's and Heaviside's kernels
  double cell_place[max_cell_nodes], cell_weight[max_cell_nodes];  // on 0 ... 1
};

// Gauss points (nodes,) along a line, 0 ... 1.
struct Nodes {
  int count;
  const double *place, *weight;
};

// First cell and number of cells along each axis that a line reaches.
struct Window {
  int start[3], count[3];
};

// At most max_group lines whose windows begin close to each other.
struct Group {
  int count, columns;
  const double *first, *branch, *values;  // (count, 3), (count, 3), (count, columns)
  const Window* windows;                  // (count,)
  Window all;                             // what holds all windows
};

// Doubles of scratch that a group of `count` lines needs in windows of at most `most` cells along the axes.
static inline long scratch_size(const Nodes& nodes, long count, const int most[3]) {
  const long pad = 8, all = most[0] + most[1] + most[2];
  return count * nodes.count * (all + 3 * pad) + 6 * pad + count * most[1] * (most[2] + pad) + 2L * most[0] * most[1] * most[2];
}

// Adds a group to the planes [from, to) of `out` (nx, ny, columns, nz).
using Spread = void(const Cells&, const Kernel&, const Nodes&, const Group&, int from, int to, double* scratch, double* out);

Spread spread_baseline;
#if defined(__x86_64__) && defined(__GNUC__)
#define DEMBARK_SPREAD_X86 1
Spread spread_avx2, spread_avx512;
#endif

}  // namespace dembark::fields
