// The islands of a sparse matrix: connected components of its graph, each with compressed columns of its own.
#pragma once

#include <Eigen/OrderingMethods>
#include <numeric>

#include "matrices.hpp"

namespace dembark::lcp {

/// Made once per pattern and kept: a sequence of matrices with the same pattern pays for the gathering of values only.
class Islands {
 public:
  /// Whether the analysis is that of this pattern (and of this kind of order).
  bool fits(const int* outer, const int* inner, Index n, bool fill_reducing) const {
    return valid_ && n == n_ && fill_reducing == fill_reducing_ && std::equal(outer, outer + n + 1, outer_.begin()) &&
           std::size_t(outer[n]) == inner_.size() && std::equal(inner, inner + outer[n], inner_.begin());
  }

  /// fill_reducing: islands of more than `natural` unknowns get a minimum degree order, the others keep the order of the unknowns.
  void analyse(const int* outer, const int* inner, Index n, bool fill_reducing, Index natural) {
    valid_ = false;
    n_ = n;
    fill_reducing_ = fill_reducing;
    outer_.assign(outer, outer + n + 1);
    inner_.assign(inner, inner + outer[n]);
    const std::vector<int> island = components();
    std::vector<int> size(std::size_t(count_), 0);
    for (const int i : island) ++size[std::size_t(i)];
    const Index largest = size.empty() ? 0 : *std::max_element(size.begin(), size.end());
    std::vector<int> by_degree;
    if (fill_reducing && largest > natural) by_degree = minimum_degree();

    first_.assign(std::size_t(count_) + 1, 0);
    for (int t = 0; t < count_; ++t) first_[std::size_t(t) + 1] = first_[std::size_t(t)] + size[std::size_t(t)];
    order_.resize(std::size_t(n));
    std::vector<int> next(first_.begin(), first_.end() - 1), local(static_cast<std::size_t>(n));
    for (const bool large : {false, true})
      for (Index k = 0; k < n; ++k) {
        const int i = large && !by_degree.empty() ? by_degree[std::size_t(k)] : int(k), t = island[std::size_t(i)];
        if ((size[std::size_t(t)] > natural) != large) continue;
        local[std::size_t(i)] = next[std::size_t(t)] - first_[std::size_t(t)];
        order_[std::size_t(next[std::size_t(t)]++)] = i;
      }

    // Visiting the columns in the new order and appending to the rows' lists sorts every list; rows are columns by symmetry.
    start_.assign(std::size_t(n) + 1, 0);
    std::vector<int> position(static_cast<std::size_t>(n));
    for (Index k = 0; k < n; ++k) position[std::size_t(order_[std::size_t(k)])] = int(k);
    for (const int i : inner_) ++start_[std::size_t(position[std::size_t(i)]) + 1];
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    row_.resize(inner_.size());
    source_.resize(inner_.size());
    std::vector<int> fill(start_.begin(), start_.end() - 1);
    for (Index k = 0; k < n; ++k) {
      const int j = order_[std::size_t(k)];
      for (int p = outer_[std::size_t(j)]; p < outer_[std::size_t(j) + 1]; ++p) {
        const int at = fill[std::size_t(position[std::size_t(inner_[std::size_t(p)])])]++;
        row_[std::size_t(at)] = local[std::size_t(j)];
        source_[std::size_t(at)] = p;
      }
    }
    value_.resize(inner_.size());
    diagonal_.assign(std::size_t(n), 0.0);
    valid_ = true;
  }

  /// Take the values over.
  void gather(const double* value) {
    for (std::size_t p = 0; p < source_.size(); ++p) value_[p] = value[source_[p]];
    for (int t = 0; t < count_; ++t)
      for (int k = first_[std::size_t(t)]; k < first_[std::size_t(t) + 1]; ++k)
        for (int p = start_[std::size_t(k)]; p < start_[std::size_t(k) + 1]; ++p)
          if (row_[std::size_t(p)] == k - first_[std::size_t(t)]) diagonal_[std::size_t(k)] = value_[std::size_t(p)];
  }

  /// The diagonal of the whole matrix, in the order of its unknowns.
  void scatter_diagonal(double* out) const {
    for (std::size_t k = 0; k < order_.size(); ++k) out[order_[k]] = diagonal_[k];
  }

  int count() const { return count_; }
  /// Where the unknowns of an island begin among those of all islands.
  Index first(int t) const { return first_[std::size_t(t)]; }
  Index size(int t) const { return first_[std::size_t(t) + 1] - first_[std::size_t(t)]; }
  Index entries(int t) const { return start_[std::size_t(first_[std::size_t(t) + 1])] - start_[std::size_t(first_[std::size_t(t)])]; }
  /// The unknowns of an island in its own order.
  const int* order(int t) const { return order_.data() + first_[std::size_t(t)]; }
  SparseBlock block(int t) const {
    const std::size_t first = std::size_t(first_[std::size_t(t)]);
    return {size(t), start_.data() + first, row_.data(), value_.data(), diagonal_.data() + first};
  }

 private:
  /// Number of the island of every unknown; islands count in the order of their first unknowns.
  std::vector<int> components() {
    std::vector<int> root(static_cast<std::size_t>(n_));
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](int i) {
      while (root[std::size_t(i)] != i) i = root[std::size_t(i)] = root[std::size_t(root[std::size_t(i)])];
      return i;
    };
    for (Index j = 0; j < n_; ++j)
      for (int p = outer_[std::size_t(j)]; p < outer_[std::size_t(j) + 1]; ++p) {
        const int a = find(int(j)), b = find(inner_[std::size_t(p)]);
        if (a != b) root[std::size_t(std::max(a, b))] = std::min(a, b);
      }
    std::vector<int> label(static_cast<std::size_t>(n_));
    count_ = 0;
    for (int i = 0; i < int(n_); ++i) {
      const int r = find(i);
      label[std::size_t(i)] = r == i ? count_++ : label[std::size_t(r)];
    }
    return label;
  }

  std::vector<int> minimum_degree() const {
    const std::vector<double> ones(inner_.size(), 1.0);
    const Eigen::Map<const Eigen::SparseMatrix<double>> pattern(n_, n_, Index(inner_.size()), outer_.data(), inner_.data(), ones.data());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(Eigen::SparseMatrix<double>(pattern), permutation);
    return std::vector<int>(permutation.indices().data(), permutation.indices().data() + n_);
  }

  bool valid_ = false, fill_reducing_ = false;
  Index n_ = 0;
  int count_ = 0;
  std::vector<int> outer_, inner_;         ///< the pattern as it came
  std::vector<int> first_, order_;         ///< islands one after the other
  std::vector<int> start_, row_, source_;  ///< columns in that order; rows are local to the island
  std::vector<double> value_, diagonal_;
};

}  // namespace dembark::lcp
