// Checks of what the solver is given: one line that names the entry. Indices count from 0.
#pragma once

#include <sstream>
#include <stdexcept>

#include "cholesky.hpp"

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

constexpr Index tile = 32;

#ifdef DEMBARK_LCP_AVX2
/// 4 x 4 entries at a time: see tiles_mirror.
__attribute__((target("avx2"))) inline bool tiles_mirror_avx2(const double* lower, const double* upper, Index stride,
                                                              const double* row_root, const double* column_root) {
  const __m256d sign = _mm256_set1_pd(-0.0);
  __m256d good = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
  for (Index j = 0; j < tile; j += 4)
    for (Index i = 0; i < tile; i += 4) {
      const double* up = upper + i * stride + j;
      const __m256d a = _mm256_loadu_pd(up), b = _mm256_loadu_pd(up + stride);
      const __m256d c = _mm256_loadu_pd(up + 2 * stride), d = _mm256_loadu_pd(up + 3 * stride);
      const __m256d ab = _mm256_unpacklo_pd(a, b), cd = _mm256_unpacklo_pd(c, d);
      const __m256d ba = _mm256_unpackhi_pd(a, b), dc = _mm256_unpackhi_pd(c, d);
      const __m256d turned[] = {_mm256_permute2f128_pd(ab, cd, 0x20), _mm256_permute2f128_pd(ba, dc, 0x20),
                                _mm256_permute2f128_pd(ab, cd, 0x31), _mm256_permute2f128_pd(ba, dc, 0x31)};
      const __m256d allowed = _mm256_mul_pd(_mm256_loadu_pd(row_root + i), _mm256_set1_pd(symmetry_share));
      for (int k = 0; k < 4; ++k) {
        const __m256d gap = _mm256_sub_pd(_mm256_loadu_pd(lower + (j + k) * stride + i), turned[k]);
        const __m256d most = _mm256_mul_pd(allowed, _mm256_broadcast_sd(column_root + j + k));
        good = _mm256_and_pd(good, _mm256_cmp_pd(_mm256_andnot_pd(sign, gap), most, _CMP_LE_OQ));
      }
    }
  return _mm256_movemask_pd(good) == 15;
}
#endif

/// Whether a tile and its mirror image agree and are finite; false also where that is not known.
inline bool tiles_mirror(const double* lower, const double* upper, Index stride, const double* row_root, const double* column_root) {
#ifdef DEMBARK_LCP_AVX2
  if (has_avx2()) return tiles_mirror_avx2(lower, upper, stride, row_root, column_root);
#endif
  (void)lower, (void)upper, (void)stride, (void)row_root, (void)column_root;
  return false;
}

/// Finite, symmetric, diagonal > 0. Tile by tile, so that both triangles come from the cache.
inline void check_dense(const double* m, Index n) {
  std::vector<double> root(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    const double d = m[i * n + i];
    if (!std::isfinite(d)) fail("M[", i, ",", i, "] is ", d, "; every entry must be a finite number");
    check_diagonal(i, d);
    root[std::size_t(i)] = std::sqrt(d);
  }
  const double* scale = root.data();
  for (Index a = 0; a < n; a += tile)
    for (Index b = 0; b <= a; b += tile) {
      if (b < a && a + tile <= n && tiles_mirror(m + b * n + a, m + a * n + b, n, scale + a, scale + b)) continue;
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
