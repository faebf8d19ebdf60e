// Cholesky factors of the active block, made anew for every active set: Eigen's.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>

#include "matrices.hpp"

namespace dembark::lcp {

/// A Cholesky pivot that is not above this fraction of M_ii has lost all its digits: M is singular to working accuracy.
inline double definite_fraction(Index n) { return 8.0 * std::numeric_limits<double>::epsilon() * std::sqrt(double(n)); }

/// Thrown with the local index of the row whose pivot failed; the solver turns it into a message with the row's own number.
struct NotDefinite {
  Index row;
  double pivot, diagonal;
};

class Factor {
 public:
  /// Of the block of the active set, less `shift` of its diagonal. Throws NotDefinite.
  void compute(const Matrix& m, const std::vector<char>& active, double shift = 0.0) {
    index_.clear();
    for (Index i = 0; i < m.n; ++i)
      if (active[std::size_t(i)]) index_.push_back(i);
    least_pivot_ = 1.0;
    if (index_.empty()) return;
    dense_ = m.dense();
    if (dense_) factorise_dense(m, 1.0 - shift);
    else factorise_sparse(m, 1.0 - shift);
    for (Index k = 0; k < pivots_.size(); ++k) {
      const Index i = index_[std::size_t(k)];
      const double diagonal = m.diagonal(i);
      if (!(pivots_[k] > definite_fraction(m.n) * diagonal)) throw NotDefinite{i, pivots_[k], diagonal};
      least_pivot_ = std::min(least_pivot_, pivots_[k] / diagonal);
    }
  }

  /// Of the last factor, in units of the diagonal.
  double least_pivot() const { return least_pivot_; }

  /// z_A += M_AA^-1 right_A; arrays of full length.
  void add_solution(const Eigen::ArrayXd& right, Eigen::ArrayXd& z) {
    if (index_.empty()) return;
    x_ = right(index_);
    if (dense_) {
      lower_.triangularView<Eigen::Lower>().solveInPlace(x_);
      lower_.triangularView<Eigen::Lower>().transpose().solveInPlace(x_);
    } else {
      x_ = sparse_.solve(x_);
    }
    z(index_) += x_.array();
  }

 private:
  /// L L^T by the function below Eigen::LLT, which tells where it failed and makes no norm. Pivots up to the first that fails.
  void factorise_dense(const Matrix& m, double scale) {
    const Index n = Index(index_.size());
    lower_.resize(n, n);
    for (Index k = 0; k < n; ++k) {
      const double* column = m.value + index_[std::size_t(k)] * m.n;
      for (Index r = k; r < n; ++r) lower_(r, k) = column[index_[std::size_t(r)]];
    }
    lower_.diagonal() *= scale;
    const Index failed = Eigen::internal::llt_inplace<double, Eigen::Lower>::blocked(lower_);
    pivots_ = lower_.diagonal().head(failed < 0 ? n : failed + 1).array().square();
    if (failed >= 0) pivots_[failed] = scale * m.diagonal(index_[std::size_t(failed)]) - lower_.row(failed).head(failed).squaredNorm();
  }

  /// L D L^T, in the order of the block, which is made fill-reducing once for the whole pattern.
  void factorise_sparse(const Matrix& m, double scale) {
    const Index n = Index(index_.size());
    place_.assign(std::size_t(m.n), -1);
    for (Index k = 0; k < n; ++k) place_[std::size_t(index_[std::size_t(k)])] = int(k);
    upper_.resize(n, n);
    upper_.reserve(m.start[m.n] - m.start[0]);
    for (Index k = 0; k < n; ++k) {
      upper_.startVec(k);
      m.each(index_[std::size_t(k)], [this, k, scale](Index row, double value) {
        const int i = place_[std::size_t(row)];
        if (i >= 0 && i <= k) upper_.insertBackByOuterInner(k, i) = i < k ? value : scale * value;
      });
    }
    upper_.finalize();
    sparse_.compute_natural(upper_);
    pivots_ = sparse_.vectorD();
  }

  struct Ldlt : Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>> {
    /// compute() of Eigen 3.4 copies the matrix in order to put it into the order that it has.
    void compute_natural(const Eigen::SparseMatrix<double>& upper) {
      analyzePattern_preordered(upper, true);
      factorize_preordered<true>(upper);
    }
  };

  bool dense_ = false;
  std::vector<Index> index_;
  Eigen::ArrayXd pivots_;
  double least_pivot_ = 1.0;
  Eigen::VectorXd x_;
  Eigen::MatrixXd lower_;
  std::vector<int> place_;
  Eigen::SparseMatrix<double> upper_;
  Ldlt sparse_;
};

}  // namespace dembark::lcp
