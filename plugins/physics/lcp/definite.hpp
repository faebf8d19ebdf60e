// That a matrix is positive definite is shown by a factor of the whole of it, or for less where that is possible. What is cheap never
// changes an answer: where it is silent, the factor decides.
//
// Sparse matrices of a sequence: B = D^-1/2 M0 D^-1/2, D the diagonal of M0. A factor of M0 - sigma D shows that the least eigenvalue of B
// is at least sigma. Then every symmetric M with |D^-1/2 (M - M0) D^-1/2| < sigma in the largest absolute row sum, which is no less than
// the spectral norm, is positive definite (Weyl's inequality). That costs one look at each entry. With the diagonal of M in the place of D
// the bound is sigma / (1 + sigma).
//
// Dense matrices of moderate condition: B less a shift c on its diagonal is factorised in single precision. When all pivots are positive,
// L L^T = B - c I + E, where E is rounding: |E| <= gamma |L| |L^T| entry by entry (N. J. Higham, Accuracy and Stability of Numerical
// Algorithms, SIAM 2002, theorem 10.3), so the norm of E is at most gamma/(1 - gamma) times the trace, n. A shift of twice that leaves the
// least eigenvalue of B above gamma n: no pivot of a factor in double precision can come near to its limit. When a pivot fails nothing is
// known.
#pragma once

#include "factors.hpp"

namespace dembark::lcp {

/// The matrix of a sequence that is known to be definite, and by how much.
struct DefiniteMargin {
  double sigma = 0.0;   ///< shown, or to be tried; 0: no matrix yet
  Eigen::ArrayXd base;  ///< values of the matrix; empty: none is shown
};

class DefiniteProof {
 public:
  /// Throws NotDefinite unless m is positive definite beyond rounding.
  void check(const Matrix& m, DefiniteMargin& margin) {
    if (near(m, margin) || holds(m)) return;
    margin.base.resize(0);
    const std::vector<char> all(std::size_t(m.n), 1);
    if (margin.sigma > least_sigma) {  // a second matrix of this pattern: more will come
      try {
        factor_.compute(m, all, margin.sigma);
        margin.base = values(m);
        return;
      } catch (const NotDefinite&) {
        margin.sigma *= 0.1;
      }
    }
    factor_.compute(m, all);
    if (margin.sigma == 0.0) margin.sigma = 0.25 * factor_.least_pivot();
  }

#if !defined(__x86_64__) || !defined(__GNUC__)
  static bool holds(const Matrix&) { return false; }
#else
  /// Whether single precision shows it, for a dense matrix. The diagonal must be positive; the lower triangle is read.
  bool holds(const Matrix& m) {
    const double shift = shift_of(m.n);
    if (!m.dense() || m.n < 32 || shift > 0.1 || !__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return false;
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
  void load(const Matrix& m, float shift) {
    const Index n = m.n, count = (n + rows - 1) / rows;
    Eigen::ArrayXd inverse = Eigen::ArrayXd::Zero(rows * count);
    for (Index i = 0; i < n; ++i) inverse[i] = 1.0 / std::sqrt(m.diagonal(i));
    tiles_.resize(std::size_t(rows * rows * (count * (count + 1) / 2)));
    for (Index i = 0; i < count; ++i) {
      const Index first = i * rows, height = std::min(rows, n - first);
      Eigen::Map<Eigen::ArrayXXf> panel(tile(i, 0), rows, first + rows);
      if (height < rows) panel.setZero();
      for (Index j = 0; j < first + height; ++j)
        panel.col(j).head(height) =
            (Eigen::Map<const Eigen::ArrayXd>(m.value + j * n + first, height) * inverse.segment(first, height) * inverse[j]).cast<float>();
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

 private:
  /// Below this the matrices of a sequence are hardly ever as near to each other.
  static constexpr double least_sigma = 1e-6;

  static Eigen::Map<const Eigen::ArrayXd> values(const Matrix& m) {
    if (m.dense()) return {m.value, m.n * m.n};
    return {m.value + m.start[0], m.start[m.n] - m.start[0]};
  }

  static bool near(const Matrix& m, const DefiniteMargin& margin) {
    if (margin.base.size() != values(m).size()) return false;
    const double n = double(m.n), most = 0.75 * margin.sigma - n * n * std::numeric_limits<double>::epsilon();
    Eigen::ArrayXd inverse(m.n);
    for (Index i = 0; i < m.n; ++i) inverse[i] = 1.0 / std::sqrt(m.diagonal(i));
    const double* base = margin.base.data();
    for (Index j = 0; j < m.n; ++j) {
      double sum = 0.0;
      m.each(j, [&](Index i, double value) { sum += std::fabs(value - *base++) * inverse[i]; });
      if (!(sum * inverse[j] < most)) return false;
    }
    return true;
  }

  Factor factor_;
};

}  // namespace dembark::lcp
