// Dense Cholesky factor in place. The compiler's default instructions are those of the oldest x86-64; processors with AVX2 and FMA, which
// is asked at run time, factorise some three times as fast. Others take Eigen's.
#pragma once

#include <Eigen/Cholesky>

#include "blocks.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#define DEMBARK_LCP_AVX2 1
#include <immintrin.h>
#endif

namespace dembark::lcp {

#ifdef DEMBARK_LCP_AVX2

inline bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return has;
}

/// c -= a b^T with a rows x depth, b columns x depth, c rows x columns, all with the same column stride. What stays of the rows and
/// columns beside the 8 x 4 tiles goes entry by entry.
__attribute__((target("avx2,fma"))) inline void subtract_product(const double* a, const double* b, double* c, Index stride, Index rows,
                                                                 Index columns, Index depth) {
  constexpr Index slice = 128;  // of the depth: the rows of a tile then stay in the nearest cache
  const Index whole_rows = rows - rows % 8, whole_columns = columns - columns % 4;
  for (Index from = 0; from < depth; from += slice) {
    const Index count = std::min(slice, depth - from);
    const double *as = a + from * stride, *bs = b + from * stride;
    for (Index j = 0; j < whole_columns; j += 4)
      for (Index i = 0; i < whole_rows; i += 8) {
        double* out = c + i + j * stride;
        __m256d t0 = _mm256_setzero_pd(), t1 = t0, t2 = t0, t3 = t0, u0 = t0, u1 = t0, u2 = t0, u3 = t0;
        const double *pa = as + i, *pb = bs + j;
        for (Index k = 0; k < count; ++k, pa += stride, pb += stride) {
          const __m256d upper = _mm256_loadu_pd(pa), lower = _mm256_loadu_pd(pa + 4);
          __m256d x = _mm256_broadcast_sd(pb);
          t0 = _mm256_fmadd_pd(upper, x, t0), u0 = _mm256_fmadd_pd(lower, x, u0);
          x = _mm256_broadcast_sd(pb + 1);
          t1 = _mm256_fmadd_pd(upper, x, t1), u1 = _mm256_fmadd_pd(lower, x, u1);
          x = _mm256_broadcast_sd(pb + 2);
          t2 = _mm256_fmadd_pd(upper, x, t2), u2 = _mm256_fmadd_pd(lower, x, u2);
          x = _mm256_broadcast_sd(pb + 3);
          t3 = _mm256_fmadd_pd(upper, x, t3), u3 = _mm256_fmadd_pd(lower, x, u3);
        }
        const __m256d tops[] = {t0, t1, t2, t3}, bottoms[] = {u0, u1, u2, u3};
        for (int q = 0; q < 4; ++q, out += stride) {
          _mm256_storeu_pd(out, _mm256_sub_pd(_mm256_loadu_pd(out), tops[q]));
          _mm256_storeu_pd(out + 4, _mm256_sub_pd(_mm256_loadu_pd(out + 4), bottoms[q]));
        }
      }
  }
  for (Index j = 0; j < columns; ++j)
    for (Index k = 0; k < depth; ++k) {
      const double x = b[j + k * stride];
      for (Index i = j < whole_columns ? whole_rows : 0; i < rows; ++i) c[i + j * stride] -= a[i + k * stride] * x;
    }
}

/// The factor of `columns` columns of height `rows` whose top is the diagonal; -1 or the first column without a positive pivot.
__attribute__((target("avx2,fma"))) inline Index factor_panel(double* a, Index stride, Index rows, Index columns) {
  for (Index k = 0; k < columns; ++k) {
    double* column = a + k * stride;
    if (!(column[k] > 0.0)) return k;
    const double pivot = std::sqrt(column[k]), inverse = 1.0 / pivot;
    column[k] = pivot;
    for (Index i = k + 1; i < rows; ++i) column[i] *= inverse;
    for (Index j = k + 1; j < columns; ++j) {
      double* other = a + j * stride;
      const double x = column[j];
      for (Index i = j; i < rows; ++i) other[i] -= column[i] * x;
    }
  }
  return -1;
}

#endif

/// Lower triangle of a (n x n, column-major) to L with a = L L^T; what stands above the diagonal is lost. Returns -1, or the first column
/// without a positive pivot; the columns before it are those of L then, and the later ones hold no meaning.
inline Index cholesky(double* a, Index stride, Index n) {
#ifdef DEMBARK_LCP_AVX2
  if (n >= 16 && has_avx2()) {
    constexpr Index outer = 64, inner = 8;
    for (Index from = 0; from < n; from += outer) {
      const Index end = std::min(from + outer, n);
      subtract_product(a + from, a + from, a + from + from * stride, stride, n - from, end - from, from);
      for (Index k = from; k < end; k += inner) {
        const Index width = std::min(inner, end - k);
        subtract_product(a + k + from * stride, a + k + from * stride, a + k + k * stride, stride, n - k, width, k - from);
        const Index failed = factor_panel(a + k + k * stride, stride, n - k, width);
        if (failed >= 0) return k + failed;
      }
    }
    return -1;
  }
#endif
  Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>> matrix(a, n, n, Eigen::OuterStride<>(stride));
  return Eigen::internal::llt_inplace<double, Eigen::Lower>::blocked(matrix);
}

}  // namespace dembark::lcp
