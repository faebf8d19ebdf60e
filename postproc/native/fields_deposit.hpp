// Spreads lines over a grid on several threads, with the same bits for any number of them.
#pragma once

#include "fields_sources.hpp"

namespace dembark::fields {

// Adds what `source` gives for the lines and all their periodic images to `out` (nx, ny, source.columns, nz).
template <class Source>
void deposit(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Source& source, int threads, double* out);

// "avx512", "avx2" or "baseline": what the processor runs.
const char* instruction_set();

}  // namespace dembark::fields
