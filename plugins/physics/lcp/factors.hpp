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

/// The indices of an active set, and the way between it and all unknowns.
class ActiveIndices {
 public:
  std::vector<Index> index;

  Index size() const { return Index(index.size()); }
  Index operator[](Index k) const { return index[std::size_t(k)]; }

  void take(const std::vector<char>& active) {
    index.clear();
    for (std::size_t i = 0; i < active.size(); ++i)
      if (active[i]) index.push_back(Index(i));
  }

  /// z_A += solve(right_A); arrays of full length.
  template <class Solve>
  void add_solution(const Eigen::ArrayXd& right, Eigen::ArrayXd& z, Solve solve) {
    x_.resize(size());
    for (Index k = 0; k < size(); ++k) x_[k] = right[(*this)[k]];
    solve(x_);
    for (Index k = 0; k < size(); ++k) z[(*this)[k]] += x_[k];
  }

 private:
  Eigen::VectorXd x_;
};

/// Dense, L L^T. By the function below Eigen::LLT, which tells where it failed and makes no norm.
class DenseFactor {
 public:
  /// Throws NotDefinite.
  void compute(const DenseBlock& m, const std::vector<char>& active) {
    active_.take(active);
    const Index n = active_.size();
    lower_.resize(n, n);
    for (Index k = 0; k < n; ++k) {
      const auto column = m.column(active_[k]);
      for (Index r = k; r < n; ++r) lower_(r, k) = column[active_[r]];
    }
    const Index failed = Eigen::internal::llt_inplace<double, Eigen::Lower>::blocked(lower_);
    const double least = definite_fraction(m.n);
    for (Index k = 0; k < (failed < 0 ? n : failed); ++k) check(m, k, lower_(k, k) * lower_(k, k), least);
    if (failed >= 0) check(m, failed, m.diagonal(active_[failed]) - lower_.row(failed).head(failed).squaredNorm(), least);
  }

  void add_solution(const Eigen::ArrayXd& right, Eigen::ArrayXd& z) {
    active_.add_solution(right, z, [this](Eigen::VectorXd& x) {
      lower_.triangularView<Eigen::Lower>().solveInPlace(x);
      lower_.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
    });
  }

 private:
  void check(const DenseBlock& m, Index k, double pivot, double least) const {
    const double diagonal = m.diagonal(active_[k]);
    if (!(pivot > least * diagonal)) throw NotDefinite{active_[k], pivot, diagonal};
  }

  ActiveIndices active_;
  Eigen::MatrixXd lower_;
};

/// Sparse, L D L^T, in the order of the block, which is made fill-reducing once for the whole pattern.
class SparseFactor {
 public:
  /// Throws NotDefinite.
  void compute(const SparseBlock& m, const std::vector<char>& active) {
    active_.take(active);
    const Index n = active_.size();
    if (n == 0) return;
    place_.assign(active.size(), -1);
    for (Index k = 0; k < n; ++k) place_[std::size_t(active_[k])] = int(k);
    upper_.resize(n, n);
    upper_.reserve(m.start[m.n] - m.start[0]);
    for (Index k = 0; k < n; ++k) {
      const Index j = active_[k];
      upper_.startVec(k);
      for (int p = m.start[j]; p < m.start[j + 1] && m.row[p] <= j; ++p)
        if (const int i = place_[std::size_t(m.row[p])]; i >= 0) upper_.insertBack(i, k) = m.value[p];
    }
    upper_.finalize();
    factor_.compute(upper_);
    const double least = definite_fraction(m.n);
    const auto pivots = factor_.vectorD();
    for (Index k = 0; k < n; ++k) {
      const Index i = active_[k];
      if (!(pivots[k] > least * m.diagonal(i))) throw NotDefinite{i, pivots[k], m.diagonal(i)};
    }
  }

  void add_solution(const Eigen::ArrayXd& right, Eigen::ArrayXd& z) {
    if (active_.size() > 0) active_.add_solution(right, z, [this](Eigen::VectorXd& x) { x = factor_.solve(x); });
  }

 private:
  ActiveIndices active_;
  std::vector<int> place_;
  Eigen::SparseMatrix<double> upper_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>> factor_;
};

}  // namespace dembark::lcp
