// The principal pivots of a symmetric positive definite matrix on a Cholesky factor of the active block.
//
// With A the active set, M_AA = L L^T, one row per active index is kept of
//     V = L^{-1} M_A. (columns outside of A),   U = L^{-1} (columns inside of A),   y = -L^{-1} q_A,
// which is all that the tableau of principal pivots would show that the rules look at:
//     outside   w = q + V^T y,     diagonal (Schur complement)  M_ii - |V_i|^2,
//     inside    z = U^T y,         diagonal (of the inverse)    |U_i|^2.
// An index that enters adds one row; one that leaves turns the rows below it by Givens rotations and drops the last. Both cost
// O(k n) with k active indices instead of the O(n^2) of a tableau, and only orthogonal steps follow each other.
#pragma once

#include <utility>

#include "blocks.hpp"

namespace dembark::lcp {

class ActiveFactor {
 public:
  Index size() const { return Index(order_.size()); }
  double value(Index i) const { return value_[std::size_t(i)]; }        ///< w_i outside, z_i inside
  double diagonal(Index i) const { return diagonal_[std::size_t(i)]; }  ///< transformed diagonal, > 0

  /// The empty active set: value = q, diagonal = M_ii.
  template <class Matrix>
  void clear(const Matrix& m, const double* q) {
    n_ = m.n;
    value_.assign(q, q + n_);
    sign_.assign(std::size_t(n_), -1.0);
    diagonal_.resize(std::size_t(n_));
    for (Index i = 0; i < n_; ++i) diagonal_[std::size_t(i)] = m.diagonal(i);
    order_.clear();
    y_.clear();
    used_ = 0;
    removed_ = false;
  }

  /// Whether indices have left since the factor was made: then its last digits are those of the rotations.
  bool rotated() const { return removed_; }

  template <class Matrix>
  void insert(const Matrix& m, Index p) {
    const Index k = size();
    reserve(k + 1);
    double* fresh = rows_[std::size_t(k)].data();
    double* l = lower_[std::size_t(k)].data();
    m.copy_column(p, fresh);
    for (const Index a : order_) fresh[a] = 0.0;
    double square = m.diagonal(p);
    for (Index r = 0; r < k; ++r) {
      l[r] = rows_[std::size_t(r)][std::size_t(p)];
      square -= l[r] * l[r];
    }
    if (!(square > definite_share(n_) * m.diagonal(p))) throw NotDefinite{p, square, m.diagonal(p)};
    fresh[p] = 1.0;
    for (Index r = 0; r < k; ++r) rows_[std::size_t(r)][std::size_t(p)] = 0.0;
    subtract_rows(l, k, fresh);
    const double pivot = std::sqrt(square), y = -value_[std::size_t(p)] / pivot, inverse = 1.0 / pivot;
    l[k] = pivot;
    sign_[std::size_t(p)] = 1.0;
    value_[std::size_t(p)] = diagonal_[std::size_t(p)] = 0.0;
    double *value = value_.data(), *diagonal = diagonal_.data();
    const double* sign = sign_.data();
    for (Index i = 0; i < n_; ++i) {
      const double v = fresh[i] * inverse;
      fresh[i] = v;
      value[i] += y * v;
      diagonal[i] += sign[i] * v * v;
    }
    order_.push_back(p);
    y_.push_back(y);
    used_ = k + 1;
  }

  void remove(Index p) {
    const Index k = size();
    Index j = 0;
    while (order_[std::size_t(j)] != p) ++j;
    // Outside of the set the column of p is L^{-1} M_Ap, which is p's own row of L.
    for (Index r = 0; r < k; ++r) rows_[std::size_t(r)][std::size_t(p)] = r <= j ? lower_[std::size_t(j)][std::size_t(r)] : 0.0;
    for (Index r = j; r + 1 < k; ++r) std::swap(lower_[std::size_t(r)], lower_[std::size_t(r + 1)]);
    for (Index r = j; r + 1 < k; ++r) {
      const double* l = lower_[std::size_t(r)].data();
      const double length = std::hypot(l[r], l[r + 1]), c = l[r] / length, s = l[r + 1] / length;
      for (Index below = r; below + 1 < k; ++below) {
        double* t = lower_[std::size_t(below)].data();
        const double a = t[r], b = t[r + 1];
        t[r] = c * a + s * b;
        t[r + 1] = c * b - s * a;
      }
      double *upper = rows_[std::size_t(r)].data(), *under = rows_[std::size_t(r + 1)].data();
      for (Index i = 0; i < n_; ++i) {
        const double a = upper[i], b = under[i];
        upper[i] = c * a + s * b;
        under[i] = c * b - s * a;
      }
      const double a = y_[std::size_t(r)], b = y_[std::size_t(r + 1)];
      y_[std::size_t(r)] = c * a + s * b;
      y_[std::size_t(r + 1)] = c * b - s * a;
    }
    sign_[std::size_t(p)] = -1.0;
    value_[std::size_t(p)] = diagonal_[std::size_t(p)] = 0.0;
    const double* last = rows_[std::size_t(k - 1)].data();
    const double y = y_.back();
    for (Index i = 0; i < n_; ++i) {
      const double v = last[i];
      value_[std::size_t(i)] -= y * v;
      diagonal_[std::size_t(i)] -= sign_[std::size_t(i)] * v * v;
    }
    order_.erase(order_.begin() + j);
    y_.pop_back();
    used_ = k - 1;
    removed_ = true;
  }

  /// z_A += M_AA^{-1} right (right given by full-length array, entries of A used): a step of iterative refinement.
  void add_solution(const double* right, double* z) {
    for (Index r = 0; r < size(); ++r) {
      const double* row = rows_[std::size_t(r)].data();
      double sum = 0.0;
      for (const Index a : order_) sum += row[a] * right[a];
      for (const Index a : order_) z[a] += row[a] * sum;
    }
  }

  /// Replace the values by ones that were computed afresh.
  void set_values(const Unknowns& u) {
    for (Index i = 0; i < n_; ++i) value_[std::size_t(i)] = u.active[std::size_t(i)] ? u.z[std::size_t(i)] : u.w[std::size_t(i)];
    for (Index r = 0; r < size(); ++r) {  // y = L^T z_A
      double sum = 0.0;
      for (Index below = r; below < size(); ++below) {
        const Index a = order_[std::size_t(below)];
        sum += lower_[std::size_t(below)][std::size_t(r)] * u.z[std::size_t(a)];
      }
      y_[std::size_t(r)] = sum;
    }
  }

 private:
  void reserve(Index k) {
    if (Index(rows_.size()) < k) rows_.resize(std::size_t(k)), lower_.resize(std::size_t(k));
    rows_[std::size_t(k - 1)].resize(std::size_t(n_));
    for (Index r = 0; r < k; ++r)
      if (Index(lower_[std::size_t(r)].size()) < n_ + 1) lower_[std::size_t(r)].resize(std::size_t(n_) + 1);
  }

  /// fresh -= sum_r l_r rows_r, four rows at a time: the memory of the rows is what this costs.
  void subtract_rows(const double* l, Index k, double* __restrict__ fresh) const {
    Index r = 0;
    for (; r + 4 <= k; r += 4) {
      const double a = l[r], b = l[r + 1], c = l[r + 2], d = l[r + 3];
      if (a == 0.0 && b == 0.0 && c == 0.0 && d == 0.0) continue;
      const double *ra = rows_[std::size_t(r)].data(), *rb = rows_[std::size_t(r + 1)].data();
      const double *rc = rows_[std::size_t(r + 2)].data(), *rd = rows_[std::size_t(r + 3)].data();
      for (Index i = 0; i < n_; ++i) fresh[i] -= (a * ra[i] + b * rb[i]) + (c * rc[i] + d * rd[i]);
    }
    for (; r < k; ++r) {
      const double a = l[r];
      if (a == 0.0) continue;
      const double* row = rows_[std::size_t(r)].data();
      for (Index i = 0; i < n_; ++i) fresh[i] -= a * row[i];
    }
  }

  Index n_ = 0, used_ = 0;
  bool removed_ = false;
  std::vector<Index> order_;  ///< active indices in the order of the rows
  std::vector<double> value_, diagonal_, sign_, y_;
  std::vector<std::vector<double>> rows_;   ///< V and U, one row of length n per active index
  std::vector<std::vector<double>> lower_;  ///< L
};

}  // namespace dembark::lcp
