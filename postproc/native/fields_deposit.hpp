// Spreads lines over a grid on several threads, with the same bits for any number of them.
#pragma once

#include <cstdint>

#include "fields_lines.hpp"
#include "fields_sources.hpp"

namespace dembark::fields {

// Edge vectors of the simulation box, (lx, 0, 0), (xy, ly, 0), (xz, yz, lz), and along which of them it is periodic.
struct Box {
  double edge[3][3];
  bool periodic[3];
  // Along these axes one image of each line counts, the one that begins at or above `home`.
  bool folded[3] = {false, false, false};
  double home[3] = {0.0, 0.0, 0.0};
};

// Lines from `first` (count, 3) to `first + branch` (count, 3), or points where `branch` is null.
struct Lines {
  std::int64_t count;
  const double *first, *branch;
};

// Adds what `source` gives for the lines and all their periodic images to `out` (nx, ny, source.columns, nz).
template <class Source>
void deposit(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Lines& lines, const Source& source,
             int threads, double* out);

// "avx512", "avx2" or "baseline": what the processor runs.
const char* instruction_set();

}  // namespace dembark::fields
