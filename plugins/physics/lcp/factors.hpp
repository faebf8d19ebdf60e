// Cholesky factors of the active block, made anew for every active set: what the block method solves with.
#pragma once

#include "cholesky.hpp"

namespace dembark::lcp {

/// M_AA = L L^T, dense.
class DenseFactor {
 public:
  void compute(const DenseBlock& m, const std::vector<char>& active) {
    index_.clear();
    for (Index i = 0; i < m.n; ++i)
      if (active[std::size_t(i)]) index_.push_back(i);
    const Index k = Index(index_.size());
    if (work_.cols() < k) work_.resize(m.n + 8 - m.n % 8 + 8, m.n);  // no stride of a power of two
    for (Index c = 0; c < k; ++c) {
      const double* column = m.column(index_[std::size_t(c)]);
      double* out = work_.data() + c * work_.rows();
      for (Index r = c; r < k; ++r) out[r] = column[index_[std::size_t(r)]];
    }
    const Index failed = cholesky(work_.data(), work_.rows(), k);
    const double least = definite_share(m.n);
    for (Index c = 0; c < (failed < 0 ? k : failed); ++c) {
      const double diagonal = m.diagonal(index_[std::size_t(c)]), pivot = work_(c, c) * work_(c, c);
      if (!(pivot > least * diagonal)) throw NotDefinite{index_[std::size_t(c)], pivot, diagonal};
    }
    if (failed >= 0) {
      const double diagonal = m.diagonal(index_[std::size_t(failed)]);
      throw NotDefinite{index_[std::size_t(failed)], diagonal - work_.row(failed).head(failed).squaredNorm(), diagonal};
    }
  }

  /// z_A += M_AA^{-1} right_A; arrays of full length.
  void add_solution(const double* right, double* z) {
    const Index k = Index(index_.size());
    x_.resize(k);
    for (Index c = 0; c < k; ++c) x_[c] = right[index_[std::size_t(c)]];
    const auto l = work_.topLeftCorner(k, k);
    l.triangularView<Eigen::Lower>().solveInPlace(x_);
    l.triangularView<Eigen::Lower>().transpose().solveInPlace(x_);
    for (Index c = 0; c < k; ++c) z[index_[std::size_t(c)]] += x_[c];
  }

 private:
  Eigen::MatrixXd work_;
  Eigen::VectorXd x_;
  std::vector<Index> index_;
};

/// M_AA = L D L^T, sparse, in the order of the block (made fill reducing once for the whole pattern): rows and columns outside of the
/// active set are passed over, so no pattern of the active block is ever built or ordered. Up-looking, with the elimination tree
/// of the active block (T. A. Davis, Direct Methods for Sparse Linear Systems, SIAM 2006, chapter 4).
class SparseFactor {
 public:
  /// shift: of the matrix less this share of its diagonal.
  void compute(const SparseBlock& m, const std::vector<char>& active, double shift = 0.0) {
    n_ = int(m.n);
    least_pivot_ = 1.0;
    resize(m.n);
    active_ = active.data();
    symbolic(m);
    const double least = definite_share(m.n);
    for (int k = 0; k < n_; ++k) {
      if (!active_[k]) continue;
      int top = n_;
      flag_[std::size_t(k)] = k;
      double d = 0.0;
      for (int p = m.start[k]; p < m.start[k + 1]; ++p) {
        int i = m.row[p];
        if (i > k) break;
        if (!active_[i]) continue;
        y_[std::size_t(i)] = m.value[p];
        int length = 0;
        for (; flag_[std::size_t(i)] != k; i = parent_[std::size_t(i)]) {
          pattern_[std::size_t(length++)] = i;
          flag_[std::size_t(i)] = k;
        }
        while (length > 0) pattern_[std::size_t(--top)] = pattern_[std::size_t(--length)];
      }
      d = (1.0 - shift) * y_[std::size_t(k)];
      y_[std::size_t(k)] = 0.0;
      for (; top < n_; ++top) {
        const int i = pattern_[std::size_t(top)];
        const double yi = y_[std::size_t(i)];
        y_[std::size_t(i)] = 0.0;
        const int begin = begin_[std::size_t(i)], end = begin + filled_[std::size_t(i)];
        for (int p = begin; p < end; ++p) y_[std::size_t(row_[std::size_t(p)])] -= l_[std::size_t(p)] * yi;
        const double l = yi * inverse_[std::size_t(i)];
        d -= l * yi;
        row_[std::size_t(end)] = k;
        l_[std::size_t(end)] = l;
        ++filled_[std::size_t(i)];
      }
      if (!(d > least * m.diagonal(k))) throw NotDefinite{k, d, m.diagonal(k)};
      least_pivot_ = std::min(least_pivot_, d / m.diagonal(k));
      inverse_[std::size_t(k)] = 1.0 / d;
    }
  }

  /// Of the last factor, in units of the diagonal.
  double least_pivot() const { return least_pivot_; }

  void add_solution(const double* right, double* z) {
    for (int i = 0; i < n_; ++i) y_[std::size_t(i)] = active_[i] ? right[i] : 0.0;
    for (int i = 0; i < n_; ++i) {
      const double x = y_[std::size_t(i)];
      if (x == 0.0) continue;
      for (int p = begin_[std::size_t(i)], end = p + filled_[std::size_t(i)]; p < end; ++p)
        y_[std::size_t(row_[std::size_t(p)])] -= l_[std::size_t(p)] * x;
    }
    for (int i = n_ - 1; i >= 0; --i) {
      if (!active_[i]) continue;
      double x = y_[std::size_t(i)] * inverse_[std::size_t(i)];
      for (int p = begin_[std::size_t(i)], end = p + filled_[std::size_t(i)]; p < end; ++p)
        x -= l_[std::size_t(p)] * y_[std::size_t(row_[std::size_t(p)])];
      y_[std::size_t(i)] = x;
      z[i] += x;
    }
    std::fill(y_.begin(), y_.end(), 0.0);
  }

 private:
  void resize(Index n) {
    const std::size_t size = std::size_t(n);
    parent_.resize(size), flag_.assign(size, -1), filled_.assign(size, 0), pattern_.resize(size), begin_.resize(size + 1);
    inverse_.assign(size, 0.0), y_.assign(size, 0.0);
  }

  /// Elimination tree and lengths of the columns of L.
  void symbolic(const SparseBlock& m) {
    for (int k = 0; k < n_; ++k) {
      parent_[std::size_t(k)] = -1;
      if (!active_[k]) continue;
      flag_[std::size_t(k)] = k;
      for (int p = m.start[k]; p < m.start[k + 1]; ++p) {
        int i = m.row[p];
        if (i >= k) break;
        if (!active_[i]) continue;
        for (; flag_[std::size_t(i)] != k; i = parent_[std::size_t(i)]) {
          if (parent_[std::size_t(i)] < 0) parent_[std::size_t(i)] = k;
          ++filled_[std::size_t(i)];
          flag_[std::size_t(i)] = k;
        }
      }
    }
    int total = 0;
    for (int k = 0; k < n_; ++k) {
      begin_[std::size_t(k)] = total;
      total += filled_[std::size_t(k)];
      filled_[std::size_t(k)] = 0;
      flag_[std::size_t(k)] = -1;
    }
    begin_[std::size_t(n_)] = total;
    row_.resize(std::size_t(total));
    l_.resize(std::size_t(total));
  }

  int n_ = 0;
  double least_pivot_ = 1.0;
  const char* active_ = nullptr;
  std::vector<int> parent_, flag_, filled_, pattern_, begin_, row_;
  std::vector<double> inverse_, y_, l_;
};

}  // namespace dembark::lcp
