// Checks of what the solver is given: one line that names the entry. Indices count from 0.
#pragma once

#include <sstream>
#include <stdexcept>

#include "factors.hpp"

namespace dembark::lcp {

/// Entries M_ij and M_ji may differ by this fraction of sqrt(M_ii M_jj): rounding of a product such as G^T W G.
constexpr double symmetry_fraction = 1e-12;

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

/// Below it, entries of a matrix have lost digits to the end of the range of numbers, or their products will.
constexpr double least_diagonal = 1e-290;

inline void check_diagonal(Index i, double value) {
  if (!(value > 0.0)) fail("M is not positive definite: M[", i, ",", i, "] = ", value, " must be > 0");
  if (value < least_diagonal) fail("M[", i, ",", i, "] = ", value, " must be at least ", least_diagonal, "; multiply M and q by a factor");
}

[[noreturn]] inline void fail_symmetry(Index i, Index j, double a, double b) {
  if (i > j) std::swap(i, j), std::swap(a, b);
  fail("M is not symmetric: M[", i, ",", j, "] = ", a, " but M[", j, ",", i, "] = ", b, "; the method needs M = M^T");
}

[[noreturn]] inline void fail_definite(Index i, const NotDefinite& what) {
  fail("M is not positive definite: its Cholesky pivot in row ", i, " is ", what.pivot, " with M[", i, ",", i, "] = ", what.diagonal,
       "; it must be > 0 beyond rounding");
}

inline void check_entry(Index i, Index j, double value) {
  if (!std::isfinite(value)) fail("M[", i, ",", j, "] is ", value, "; every entry must be a finite number");
}

/// Finite, symmetric, diagonal > 0. Compressed columns with ascending rows; `outer` has n + 1 entries.
inline void check_sparse(const int* outer, const int* inner, const double* value, Index n) {
  std::vector<double> root(std::size_t(n), 0.0);
  for (Index j = 0; j < n; ++j)
    for (int p = outer[j]; p < outer[j + 1]; ++p) {
      check_entry(inner[p], j, value[p]);
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
      const double allowed = symmetry_fraction * root[std::size_t(i)] * root[std::size_t(j)];
      if (!(std::fabs(value[p] - partner) <= allowed)) fail_symmetry(i, j, value[p], partner);
    }
}

/// The same for a column-major array. Tile by tile, so that both triangles come from the cache.
inline void check_dense(const double* m, Index n) {
  constexpr Index tile = 32;
  const Eigen::Map<const Eigen::ArrayXXd> matrix(m, n, n);
  const Eigen::ArrayXd root = matrix.matrix().diagonal().array().sqrt();
  bool good = (root >= std::sqrt(least_diagonal)).all();
  for (Index a = 0; a < n && good; a += tile)
    for (Index b = 0; b <= a && good; b += tile) {
      const Index rows = std::min(tile, n - a), columns = std::min(tile, n - b);
      const auto allowed = symmetry_fraction * (root.segment(a, rows).matrix() * root.segment(b, columns).matrix().transpose()).array();
      good = ((matrix.block(a, b, rows, columns) - matrix.block(b, a, columns, rows).transpose()).abs() <= allowed).all();
    }
  if (good) return;
  const Eigen::SparseMatrix<double> entries = matrix.matrix().sparseView(0.0, 0.0);  // to name the one that is wrong
  check_sparse(entries.outerIndexPtr(), entries.innerIndexPtr(), entries.valuePtr(), n);
}

}  // namespace dembark::lcp
