// Cholesky factors of the active block, made anew for every active set: Eigen's.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <type_traits>

#include "matrices.hpp"

namespace dembark::lcp {

/// A Cholesky pivot that is not above this fraction of M_ii has lost all its digits: M is singular to working accuracy.
inline double definite_fraction(Index n) { return 8.0 * std::numeric_limits<double>::epsilon() * std::sqrt(double(n)); }

/// Thrown with the local index of the row whose pivot failed; the solver turns it into a message with the row's own number.
struct NotDefinite {
  Index row;
  double pivot, diagonal;
};

/// L L^T by the function below Eigen::LLT, which tells where it failed and makes no norm.
class DenseCholesky {
 public:
  /// Pivots, up to the first that fails. The diagonal is taken `scale` times.
  Eigen::ArrayXd compute(const DenseBlock& m, const std::vector<Index>& index, double scale) {
    const Index n = Index(index.size());
    lower_.resize(n, n);
    for (Index k = 0; k < n; ++k) {
      const double* column = m.values + index[std::size_t(k)] * m.n;
      for (Index r = k; r < n; ++r) lower_(r, k) = column[index[std::size_t(r)]];
    }
    lower_.diagonal() *= scale;
    const Index failed = Eigen::internal::llt_inplace<double, Eigen::Lower>::blocked(lower_);
    if (failed < 0) return lower_.diagonal().array().square();
    Eigen::ArrayXd pivots = lower_.diagonal().head(failed + 1).array().square();
    pivots[failed] = scale * m.diagonal(index[std::size_t(failed)]) - lower_.row(failed).head(failed).squaredNorm();
    return pivots;
  }

  void solve(Eigen::VectorXd& x) const {
    lower_.triangularView<Eigen::Lower>().solveInPlace(x);
    lower_.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  }

 private:
  Eigen::MatrixXd lower_;
};

/// L D L^T, in the order of the block, which is made fill-reducing once for the whole pattern.
class SparseCholesky {
 public:
  Eigen::ArrayXd compute(const SparseBlock& m, const std::vector<Index>& index, double scale) {
    const Index n = Index(index.size());
    if (n == 0) return {};
    place_.assign(std::size_t(m.n), -1);
    for (Index k = 0; k < n; ++k) place_[std::size_t(index[std::size_t(k)])] = int(k);
    upper_.resize(n, n);
    upper_.reserve(m.start[m.n] - m.start[0]);
    for (Index k = 0; k < n; ++k) {
      upper_.startVec(k);
      m.each(index[std::size_t(k)], [this, k, scale](Index row, double value) {
        const int i = place_[std::size_t(row)];
        if (i >= 0 && i <= k) upper_.insertBackByOuterInner(k, i) = i < k ? value : scale * value;
      });
    }
    upper_.finalize();
    factor_.compute_natural(upper_);
    return factor_.vectorD().array();
  }

  void solve(Eigen::VectorXd& x) const {
    if (x.size() > 0) x = factor_.solve(x);
  }

 private:
  struct Ldlt : Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>> {
    /// compute() of Eigen 3.4 copies the matrix in order to put it into the order that it has.
    void compute_natural(const Eigen::SparseMatrix<double>& upper) {
      analyzePattern_preordered(upper, true);
      factorize_preordered<true>(upper);
    }
  };

  std::vector<int> place_;
  Eigen::SparseMatrix<double> upper_;
  Ldlt factor_;
};

template <class Matrix>
class Factor {
 public:
  /// Of the block of the active set, less `shift` of its diagonal. Throws NotDefinite.
  void compute(const Matrix& m, const std::vector<char>& active, double shift = 0.0) {
    index_.clear();
    for (Index i = 0; i < m.n; ++i)
      if (active[std::size_t(i)]) index_.push_back(i);
    const Eigen::ArrayXd pivots = cholesky_.compute(m, index_, 1.0 - shift);
    least_pivot_ = 1.0;
    for (Index k = 0; k < pivots.size(); ++k) {
      const Index i = index_[std::size_t(k)];
      const double diagonal = m.diagonal(i);
      if (!(pivots[k] > definite_fraction(m.n) * diagonal)) throw NotDefinite{i, pivots[k], diagonal};
      least_pivot_ = std::min(least_pivot_, pivots[k] / diagonal);
    }
  }

  /// Of the last factor, in units of the diagonal.
  double least_pivot() const { return least_pivot_; }

  /// z_A += M_AA^-1 right_A; arrays of full length.
  void add_solution(const Eigen::ArrayXd& right, Eigen::ArrayXd& z) {
    x_ = right(index_);
    cholesky_.solve(x_);
    z(index_) += x_.array();
  }

 private:
  std::conditional_t<std::is_same_v<Matrix, DenseBlock>, DenseCholesky, SparseCholesky> cholesky_;
  std::vector<Index> index_;
  Eigen::VectorXd x_;
  double least_pivot_ = 1.0;
};

}  // namespace dembark::lcp
