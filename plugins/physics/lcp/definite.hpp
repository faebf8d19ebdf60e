// Cheap proof that a dense symmetric matrix is positive definite, for matrices whose condition is moderate. What it says never changes an
// answer: where it is silent, a factor of the whole matrix decides.
//
// B = D^-1/2 M D^-1/2, D the diagonal of M, less a shift c on its diagonal, is factorised in single precision. When all pivots are
// positive, L L^T = B - c I + E, where E is rounding: |E| <= gamma |L| |L^T| entry by entry (N. J. Higham, Accuracy and Stability of
// Numerical Algorithms, SIAM 2002, theorem 10.3), so the norm of E is at most gamma/(1 - gamma) times the trace, n. A shift of twice that
// leaves the least eigenvalue of B above gamma n: no pivot of a factor in double precision can come near to its limit. When a pivot
// fails nothing is known.
#pragma once

#include "matrices.hpp"

namespace dembark::lcp {

class DefiniteProof {
 public:
  /// True: m is positive definite beyond rounding. False: not known. The diagonal must be positive; the lower triangle is read.
  static bool holds(const SparseBlock&) { return false; }

#if !defined(__x86_64__) || !defined(__GNUC__)
  static bool holds(const DenseBlock&) { return false; }
#else
  bool holds(const DenseBlock& m) {
    const double shift = shift_of(m.n);
    if (m.n < 32 || shift > 0.1 || !__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return false;
    load(m, float(shift));
    for (Index i = 0; i * rows < m.n; ++i)
      for (Index j = 0; j <= i; ++j)
        if (!factorise(tile(i, 0), tile(j, 0), j, i == j)) return false;
    return true;
  }

 private:
  static constexpr Index rows = 16, slice = 64;
  using Lane = float __attribute__((vector_size(32), aligned(4), may_alias));
  static Lane& lane(float* at) { return *reinterpret_cast<Lane*>(at); }
  static const Lane& lane(const float* at) { return *reinterpret_cast<const Lane*>(at); }

  /// Roundings on the way of one product into an entry: a slice of the sum, the slices, the solution with the diagonal tile.
  static double shift_of(Index n) {
    constexpr double unit = 0.5 * double(std::numeric_limits<float>::epsilon());
    const double count = double(slice) + double(n) / double(slice) + 2.0 * double(rows) + 4.0, gamma = count * unit / (1.0 - count * unit);
    return double(n) * (2.0 * gamma / (1.0 - gamma) + unit) + 1e-6;
  }

  /// The matrix lies in panels of 16 rows, each column-major and as long as its diagonal needs: all is read in the order of the memory.
  float* tile(Index i, Index j) { return tiles_.data() + rows * rows * (i * (i + 1) / 2 + j); }

  /// The scaled and shifted lower triangle; rows beyond n continue the identity.
  void load(const DenseBlock& m, float shift) {
    const Index n = m.n, count = (n + rows - 1) / rows;
    Eigen::ArrayXd inverse = Eigen::ArrayXd::Zero(rows * count);
    for (Index i = 0; i < n; ++i) inverse[i] = 1.0 / std::sqrt(m.diagonal(i));
    tiles_.resize(std::size_t(rows * rows * (count * (count + 1) / 2)));
    for (Index i = 0; i < count; ++i) {
      const Index first = i * rows, height = std::min(rows, n - first);
      Eigen::Map<Eigen::ArrayXXf> panel(tile(i, 0), rows, first + rows);
      if (height < rows) panel.setZero();
      for (Index j = 0; j < first + height; ++j)
        panel.col(j).head(height) = (m.column(j).segment(first, height) * inverse.segment(first, height) * inverse[j]).cast<float>();
      for (Index r = 0; r < rows; ++r) panel(r, first + r) = 1.0f - shift;
    }
  }

  /// Tile number j of the panel a, with the panel b whose diagonal tile is number j; whether all pivots are positive.
  __attribute__((target("avx2,fma"))) static bool factorise(float* a, const float* b, Index j, bool diagonal) {
    float* t = a + rows * rows * j;
    for (Index from = 0; from < j * rows; from += slice)
      for (Index c = 0; c < rows; c += 4) subtract(a, b + c, t + c * rows, from, std::min(from + slice, j * rows));
    const float* d = b + rows * rows * j;
    for (Index c = 0; c < rows; ++c) {
      float* column = t + c * rows;
      Lane upper = lane(column), lower = lane(column + 8);
      for (Index k = 0; k < c; ++k) {
        upper -= lane(t + k * rows) * d[k * rows + c];
        lower -= lane(t + k * rows + 8) * d[k * rows + c];
      }
      const float pivot = c < 8 ? upper[c] : lower[c - 8];
      if (diagonal && !(pivot > 0.0f)) return false;
      const float inverse = diagonal ? 1.0f / std::sqrt(pivot) : d[c * rows + c];
      lane(column) = upper * inverse;
      lane(column + 8) = lower * inverse;
      if (diagonal) column[c] = inverse;  // takes the place of the pivot
    }
    return true;
  }

  /// Four columns of t -= a b^T over some of the depth.
  __attribute__((target("avx2,fma"))) static void subtract(const float* a, const float* b, float* t, Index from, Index end) {
    Lane sum[4][2] = {};
    for (Index k = from * rows; k < end * rows; k += rows)
      for (int q = 0; q < 4; ++q) {
        sum[q][0] += lane(a + k) * b[k + q];
        sum[q][1] += lane(a + k + 8) * b[k + q];
      }
    for (int q = 0; q < 4; ++q) {
      lane(t + q * rows) -= sum[q][0];
      lane(t + q * rows + 8) -= sum[q][1];
    }
  }

  std::vector<float> tiles_;
#endif
};

}  // namespace dembark::lcp
