// Checks of what the solver is given: one line that names the entry. Indices count from 0.
#pragma once

#include <sstream>
#include <stdexcept>

#include "blocks.hpp"

namespace dembark::lcp {

/// Entries M_ij and M_ji may differ by this share of sqrt(M_ii M_jj): rounding of a product such as G^T W G.
constexpr double symmetry_share = 1e-12;

template <class... Parts>
[[noreturn]] inline void fail(const Parts&... parts) {
  std::ostringstream line;
  line.precision(15);
  line << "LCP: ";
  (line << ... << parts);
  throw std::invalid_argument(line.str());
}

inline void check_shapes(Index rows, Index columns, Index length, const std::vector<char>* start) {
  if (rows != columns) fail("M must be square, not ", rows, " x ", columns);
  if (rows != length) fail("q must have one entry per row of M, ", rows, ", not ", length);
  if (start && Index(start->size()) != length) fail("start must have one flag per unknown, ", length, ", not ", start->size());
}

inline void check_options(const LcpOptions& options) {
  if (!(options.tolerance > 0.0) || !(options.tolerance < 1.0)) fail("tolerance must be between 0 and 1, not ", options.tolerance);
  if (options.max_iterations < 0) fail("max_iterations must be >= 0 (0: own choice), not ", options.max_iterations);
}

inline void check_finite(const double* q, Index n) {
  for (Index i = 0; i < n; ++i)
    if (!std::isfinite(q[i])) fail("q[", i, "] is ", q[i], "; every entry must be a finite number");
}

inline void check_diagonal(Index i, double value) {
  if (!(value > 0.0)) fail("M is not positive definite: M[", i, ",", i, "] = ", value, " must be > 0");
}

[[noreturn]] inline void fail_symmetry(Index i, Index j, double a, double b) {
  if (i > j) std::swap(i, j), std::swap(a, b);
  fail("M is not symmetric: M[", i, ",", j, "] = ", a, " but M[", j, ",", i, "] = ", b, "; the method needs M = M^T");
}

[[noreturn]] inline void fail_definite(Index i, const NotDefinite& what) {
  fail("M is not positive definite: its Cholesky pivot in row ", i, " is ", what.pivot, " with M[", i, ",", i, "] = ", what.diagonal,
       "; it must be > 0 beyond rounding");
}

/// Finite, symmetric, diagonal > 0. Tile by tile, so that both triangles come from the cache.
inline void check_dense(const double* m, Index n) {
  constexpr Index tile = 32;
  std::vector<double> root(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    const double d = m[i * n + i];
    if (!std::isfinite(d)) fail("M[", i, ",", i, "] is ", d, "; every entry must be a finite number");
    check_diagonal(i, d);
    root[std::size_t(i)] = std::sqrt(d);
  }
  for (Index a = 0; a < n; a += tile)
    for (Index b = 0; b <= a; b += tile)
      for (Index j = b; j < std::min(b + tile, n); ++j) {
        const Index begin = std::max(a, j + 1), end = std::min(a + tile, n);
        bool good = true;
        for (Index i = begin; i < end; ++i)
          good &= std::fabs(m[j * n + i] - m[i * n + j]) <= symmetry_share * root[std::size_t(i)] * root[std::size_t(j)];
        if (good) continue;
        for (Index i = begin; i < end; ++i) {
          const double x = m[j * n + i], y = m[i * n + j];
          if (!std::isfinite(x)) fail("M[", i, ",", j, "] is ", x, "; every entry must be a finite number");
          if (!std::isfinite(y)) fail("M[", j, ",", i, "] is ", y, "; every entry must be a finite number");
          if (!(std::fabs(x - y) <= symmetry_share * root[std::size_t(i)] * root[std::size_t(j)])) fail_symmetry(i, j, x, y);
        }
      }
}

/// The same for compressed columns with ascending rows. `outer` has n + 1 entries.
inline void check_sparse(const int* outer, const int* inner, const double* value, Index n) {
  std::vector<double> root(std::size_t(n), 0.0);
  for (Index j = 0; j < n; ++j)
    for (int p = outer[j]; p < outer[j + 1]; ++p) {
      if (!std::isfinite(value[p])) fail("M[", inner[p], ",", j, "] is ", value[p], "; every entry must be a finite number");
      if (inner[p] == j) root[std::size_t(j)] = value[p];
    }
  for (Index i = 0; i < n; ++i) {
    check_diagonal(i, root[std::size_t(i)]);
    root[std::size_t(i)] = std::sqrt(root[std::size_t(i)]);
  }
  std::vector<int> cursor(outer, outer + n);  // of column i: its entries come up in the order of the columns that are visited
  for (Index j = 0; j < n; ++j)
    for (int p = outer[j]; p < outer[j + 1]; ++p) {
      const Index i = inner[p];
      int& c = cursor[std::size_t(i)];
      // An entry that is passed over has no partner: its own visit, as (j, i) of column i, finds that.
      while (c < outer[i + 1] && inner[c] < j) ++c;
      const double partner = c < outer[i + 1] && inner[c] == j ? value[c] : 0.0;
      const double allowed = symmetry_share * root[std::size_t(i)] * root[std::size_t(j)];
      if (!(std::fabs(value[p] - partner) <= allowed)) fail_symmetry(i, j, value[p], partner);
    }
}

/// Strict diagonal dominance after scaling to a unit diagonal proves definiteness without a factor; true where it holds.
inline bool dominant(const SparseBlock& m) {
  std::vector<double> inverse(static_cast<std::size_t>(m.n));
  for (Index i = 0; i < m.n; ++i) inverse[std::size_t(i)] = 1.0 / std::sqrt(m.diagonals[i]);
  for (Index j = 0; j < m.n; ++j) {
    double sum = 0.0;
    for (int p = m.start[j]; p < m.start[j + 1]; ++p) sum += std::fabs(m.value[p]) * inverse[std::size_t(m.row[p])];
    if (!(sum * inverse[std::size_t(j)] < 2.0 - 1e-10)) return false;
  }
  return true;
}

}  // namespace dembark::lcp
