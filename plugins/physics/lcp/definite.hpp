// Cheap proof that a dense symmetric matrix is positive definite, for matrices whose condition is moderate.
//
// B = D^-1/2 M D^-1/2, D the diagonal of M, less a shift c on its diagonal, is factorised in single precision. When all pivots are
// positive, L L^T = B - c I + E, where E is rounding: |E| <= gamma |L| |L^T| entry by entry (N. J. Higham, Accuracy and Stability of
// Numerical Algorithms, SIAM 2002, theorem 10.3), so the norm of E is at most gamma/(1 - gamma) times the trace, n. A shift of twice that
// leaves the least eigenvalue of B above gamma n: no pivot of a factor in double precision can come near to its limit. When a pivot
// fails nothing is known.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "cholesky.hpp"

namespace dembark::lcp {

/// The factor lies in panels of 16 rows, each column-major and as long as its diagonal needs: both operands of every product are read in
/// the order of the memory.
class DefiniteProof {
 public:
  /// True: m is positive definite beyond rounding. False: not known. The diagonal must be positive; the lower triangle is read.
  bool holds(const DenseBlock& m) {
#ifdef DEMBARK_LCP_AVX2
    if (m.n < 32 || !has_avx2()) return false;
    const double shift = shift_of(m.n);
    if (shift > 0.1) return false;  // hardly a matrix would pass
    load(m, float(shift));
    return factorise((m.n + rows - 1) / rows);
#else
    (void)m;
    return false;
#endif
  }

 private:
#ifdef DEMBARK_LCP_AVX2
  static constexpr Index rows = 16, slice = 64;

  /// Roundings on the way of one product into an entry: a slice of the sum, the slices, the solution with the diagonal tile.
  static double shift_of(Index n) {
    constexpr double unit = 0.5 * double(std::numeric_limits<float>::epsilon());
    const double count = double(slice) + double(n) / double(slice) + 2.0 * double(rows) + 4.0, gamma = count * unit / (1.0 - count * unit);
    return double(n) * (2.0 * gamma / (1.0 - gamma) + unit) + 1e-6;
  }

  float* panel(Index i) { return tiles_.data() + rows * rows * (i * (i + 1) / 2); }

  /// The scaled and shifted lower triangle; rows beyond n continue the identity.
  void load(const DenseBlock& m, float shift) {
    const Index n = m.n, count = (n + rows - 1) / rows, padded = rows * count;
    inverse_.assign(std::size_t(padded), 0.0);
    for (Index i = 0; i < n; ++i) inverse_[std::size_t(i)] = 1.0 / std::sqrt(m.diagonal(i));
    tiles_.resize(std::size_t(rows * rows * (count * (count + 1) / 2)));
    for (Index i = 0; i < count; ++i) {
      float* out = panel(i);
      const Index first = i * rows, height = std::min(rows, n - first);
      const double* scale = inverse_.data() + first;
      for (Index j = 0; j < first + rows; ++j, out += rows) {
        const double s = inverse_[std::size_t(j)];
        if (height == rows) {
          const double* column = m.column(j) + first;
          for (Index r = 0; r < rows; ++r) out[r] = float(column[r] * scale[r] * s);
        } else {
          for (Index r = 0; r < rows; ++r) out[r] = r < height && j < n ? float(m.column(j)[first + r] * scale[r] * s) : 0.0f;
        }
        if (j >= first) out[j - first] = 1.0f - shift;
      }
    }
  }

  /// t -= a b^T for one tile; a and b are panels, read up to `depth`.
  __attribute__((target("avx2,fma"))) static void subtract(const float* a, const float* b, float* t, Index depth) {
    for (Index from = 0; from < depth; from += slice) {
      const Index end = std::min(from + slice, depth);
      for (Index c = 0; c < rows; c += 4) {
        __m256 s0 = _mm256_setzero_ps(), s1 = s0, s2 = s0, s3 = s0, u0 = s0, u1 = s0, u2 = s0, u3 = s0;
        const float *pa = a + from * rows, *pb = b + from * rows + c;
        for (Index k = from; k < end; ++k, pa += rows, pb += rows) {
          const __m256 upper = _mm256_loadu_ps(pa), lower = _mm256_loadu_ps(pa + 8);
          __m256 x = _mm256_broadcast_ss(pb);
          s0 = _mm256_fmadd_ps(upper, x, s0), u0 = _mm256_fmadd_ps(lower, x, u0);
          x = _mm256_broadcast_ss(pb + 1);
          s1 = _mm256_fmadd_ps(upper, x, s1), u1 = _mm256_fmadd_ps(lower, x, u1);
          x = _mm256_broadcast_ss(pb + 2);
          s2 = _mm256_fmadd_ps(upper, x, s2), u2 = _mm256_fmadd_ps(lower, x, u2);
          x = _mm256_broadcast_ss(pb + 3);
          s3 = _mm256_fmadd_ps(upper, x, s3), u3 = _mm256_fmadd_ps(lower, x, u3);
        }
        const __m256 tops[] = {s0, s1, s2, s3}, bottoms[] = {u0, u1, u2, u3};
        float* out = t + c * rows;
        for (int q = 0; q < 4; ++q, out += rows) {
          _mm256_storeu_ps(out, _mm256_sub_ps(_mm256_loadu_ps(out), tops[q]));
          _mm256_storeu_ps(out + 8, _mm256_sub_ps(_mm256_loadu_ps(out + 8), bottoms[q]));
        }
      }
    }
  }

  /// t <- t d^-T, d the lower triangular tile on the diagonal with the inverses of its pivots on the diagonal.
  __attribute__((target("avx2,fma"))) static void solve(const float* d, float* t) {
    for (Index c = 0; c < rows; ++c) {
      __m256 upper = _mm256_loadu_ps(t + c * rows), lower = _mm256_loadu_ps(t + c * rows + 8);
      for (Index k = 0; k < c; ++k) {
        const __m256 x = _mm256_broadcast_ss(d + k * rows + c);
        upper = _mm256_fnmadd_ps(_mm256_loadu_ps(t + k * rows), x, upper);
        lower = _mm256_fnmadd_ps(_mm256_loadu_ps(t + k * rows + 8), x, lower);
      }
      const __m256 x = _mm256_broadcast_ss(d + c * rows + c);
      _mm256_storeu_ps(t + c * rows, _mm256_mul_ps(upper, x));
      _mm256_storeu_ps(t + c * rows + 8, _mm256_mul_ps(lower, x));
    }
  }

  /// The tile on the diagonal; 1 / pivot takes the place of the pivot.
  static bool factorise_tile(float* t) {
    for (Index c = 0; c < rows; ++c) {
      float* column = t + c * rows;
      if (!(column[c] > 0.0f)) return false;
      const float inverse = 1.0f / std::sqrt(column[c]);
      for (Index r = c + 1; r < rows; ++r) column[r] *= inverse;
      column[c] = inverse;
      for (Index k = c + 1; k < rows; ++k)
        for (Index r = k; r < rows; ++r) t[k * rows + r] -= column[r] * column[k];
    }
    return true;
  }

  bool factorise(Index count) {
    for (Index i = 0; i < count; ++i) {
      float* own = panel(i);
      for (Index j = 0; j <= i; ++j) {
        float* t = own + j * rows * rows;
        const float* other = panel(j);
        subtract(own, other, t, j * rows);
        if (j < i) solve(other + j * rows * rows, t);
        else if (!factorise_tile(t)) return false;
      }
    }
    return true;
  }

  std::vector<float> tiles_;
  std::vector<double> inverse_;
#endif
};

}  // namespace dembark::lcp
