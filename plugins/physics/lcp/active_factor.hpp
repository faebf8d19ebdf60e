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

#include <Eigen/Jacobi>

#include "factors.hpp"

namespace dembark::lcp {

class ActiveFactor {
 public:
  Index size() const { return Index(order_.size()); }
  double value(Index i) const { return value_[i]; }        ///< w_i outside, z_i inside
  double diagonal(Index i) const { return diagonal_[i]; }  ///< transformed diagonal, > 0

  /// The empty active set: value = q, diagonal = M_ii.
  void clear(const Matrix& m, const double* q) {
    const Index n = m.n;
    value_ = Eigen::Map<const Row>(q, n);
    sign_.setConstant(n, -1.0);
    diagonal_.resize(n);
    for (Index i = 0; i < n; ++i) diagonal_[i] = m.diagonal(i);
    rows_.resize(n, n);
    lower_.resize(n, n);
    y_.resize(n);
    order_.clear();
    rotated_ = false;
  }

  /// Whether indices have left since the factor was made: then its last digits are those of the rotations.
  bool rotated() const { return rotated_; }

  /// Throws NotDefinite.
  void insert(const Matrix& m, Index p) {
    const Index k = size();
    auto row = rows_.row(k);
    row.setZero();
    m.each(p, [&row](Index i, double value) { row[i] = value; });
    for (const Index a : order_) row[a] = 0.0;
    const Eigen::RowVectorXd l = rows_.col(p).head(k).transpose();
    const double square = m.diagonal(p) - l.squaredNorm();
    if (!(square > definite_fraction(m.n) * m.diagonal(p))) throw NotDefinite{p, square, m.diagonal(p)};
    row[p] = 1.0;
    rows_.col(p).head(k).setZero();
    subtract_rows(l, row);
    const double pivot = std::sqrt(square);
    lower_.row(k).head(k) = l;
    lower_(k, k) = pivot;
    y_[k] = -value_[p] / pivot;
    row *= 1.0 / pivot;
    order_.push_back(p);
    change_side(p, 1.0);
    value_ += y_[k] * row.array();
    diagonal_ += sign_ * row.array().square();
  }

  void remove(Index p) {
    const Index k = size() - 1, j = std::find(order_.begin(), order_.end(), p) - order_.begin();
    // Outside of the set the column of p is L^{-1} M_Ap, which is p's own row of L.
    rows_.col(p).head(k + 1).setZero();
    rows_.col(p).head(j + 1) = lower_.row(j).head(j + 1).transpose();
    for (Index c = 0; c <= k; ++c) std::rotate(&lower_(j, c), &lower_(j, c) + 1, &lower_(0, c) + k + 1);
    for (Index r = j; r < k; ++r) {
      const double length = std::hypot(lower_(r, r), lower_(r, r + 1));
      const Eigen::JacobiRotation<double> turn(lower_(r, r) / length, lower_(r, r + 1) / length);
      lower_.middleRows(r, k - r).applyOnTheRight(r, r + 1, turn.transpose());
      rows_.applyOnTheLeft(r, r + 1, turn);
      y_.applyOnTheLeft(r, r + 1, turn);
    }
    order_.erase(order_.begin() + j);
    rotated_ = true;
    change_side(p, -1.0);
    value_ -= y_[k] * rows_.row(k).array();
    diagonal_ -= sign_ * rows_.row(k).array().square();
  }

  /// z_A += M_AA^{-1} right_A; arrays of full length: a step of iterative refinement.
  void add_solution(const Eigen::ArrayXd& right, Eigen::ArrayXd& z) const {
    for (Index r = 0; r < size(); ++r) {
      double sum = 0.0;
      for (const Index a : order_) sum += rows_(r, a) * right[a];
      for (const Index a : order_) z[a] += rows_(r, a) * sum;
    }
  }

  /// Replace the values by ones that were computed afresh.
  void set_values(const Unknowns& u) {
    for (Index i = 0; i < value_.size(); ++i) value_[i] = u.active[std::size_t(i)] ? u.z[i] : u.w[i];
    for (Index r = 0; r < size(); ++r) {  // y = L^T z_A
      y_[r] = 0.0;
      for (Index below = r; below < size(); ++below) y_[r] += lower_(below, r) * u.z[order_[std::size_t(below)]];
    }
  }

 private:
  using Row = Eigen::Array<double, 1, Eigen::Dynamic>;

  /// row -= l rows, a few rows at a time: their memory is what this costs, and those that l has no part of are passed over.
  template <class Target>
  void subtract_rows(const Eigen::RowVectorXd& l, Target& row) const {
    constexpr Index most = 4;
    for (Index r = 0; r < l.size(); r += most) {
      const Index count = std::min(most, l.size() - r);
      if (!l.segment(r, count).isZero(0.0)) row.noalias() -= l.segment(r, count) * rows_.middleRows(r, count);
    }
  }

  void change_side(Index p, double sign) {
    sign_[p] = sign;
    value_[p] = diagonal_[p] = 0.0;
  }

  bool rotated_ = false;
  std::vector<Index> order_;  ///< active indices in the order of the rows
  Row value_, diagonal_, sign_;
  Eigen::VectorXd y_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows_;  ///< V and U, one row per active index
  Eigen::MatrixXd lower_;                                                        ///< L
};

}  // namespace dembark::lcp
