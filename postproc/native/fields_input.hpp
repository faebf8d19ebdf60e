// What must be known of grains and contacts before they are spread.
#pragma once

#include <cstdint>

namespace dembark::fields {

// Whether all of `values` (count,) are finite.
bool all_finite(const double* values, std::int64_t count, int threads);

// Grains with rising `ids` (n,) and `radii` (n,); contacts of the grains `wanted` (m, 2) with `branch` (m, 3).
struct Links {
  std::int64_t grains, contacts;
  const std::int64_t *ids, *wanted;
  const double *radii, *branch;
  double slack;  // branch over the sum of the radii up to which grains touch
};

// Rows (m, 2) of the grains of each contact, whether they touch (m,), and how many each grain touches (n,). Returns the place in `wanted`
// of the first grain that is not there, or -1.
std::int64_t link(const Links& links, int threads, std::int64_t* rows, bool* touching, double* touches);

}  // namespace dembark::fields
