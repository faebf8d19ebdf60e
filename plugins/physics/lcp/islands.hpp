// The islands of a sparse matrix: connected components of its graph, each with compressed columns of its own.
#pragma once

#include <Eigen/OrderingMethods>
#include <numeric>

#include "matrices.hpp"

namespace dembark::lcp {

/// Made once per pattern and kept: a sequence of matrices with the same pattern pays for the gathering of values only.
class Islands {
 public:
  /// Takes a matrix over; returns whether its pattern is another than that of the last. fill_reducing: islands of more than `natural`
  /// unknowns get a minimum degree order, the others keep the order of the unknowns.
  bool take(const int* outer, const int* inner, const double* value, Index n, bool fill_reducing, Index natural) {
    const bool other = !(n == n_ && fill_reducing == fill_reducing_ && std::equal(outer_.begin(), outer_.end(), outer) &&
                         std::equal(inner_.begin(), inner_.end(), inner));
    if (other) {
      n_ = n;
      fill_reducing_ = fill_reducing;
      outer_.assign(outer, outer + n + 1);
      inner_.assign(inner, inner + outer[n]);
      arrange(natural);
      permute();
    }
    for (std::size_t p = 0; p < source_.size(); ++p) value_[p] = value[source_[p]];
    for (std::size_t k = 0; k < diagonal_.size(); ++k)
      for (int p = start_[k]; p < start_[k + 1]; ++p)
        if (row_[std::size_t(p)] == int(k)) diagonal_[k] = value_[std::size_t(p)];
    return other;
  }

  int count() const { return int(first_.size()) - 1; }
  Index entries(int t) const { return start_[std::size_t(first_[std::size_t(t) + 1])] - start_[std::size_t(first_[std::size_t(t)])]; }
  /// Where the unknowns of an island begin.
  int first(int t) const { return first_[std::size_t(t)]; }
  /// The unknowns, island after island.
  const std::vector<int>& order() const { return order_; }
  Matrix block(int t) const { return columns(first(t), first(t + 1)); }
  Matrix whole() const { return columns(0, int(n_)); }

 private:
  Matrix columns(int from, int to) const {
    return {to - from, value_.data(), diagonal_.data() + from, start_.data() + from, row_.data(), from};
  }

  /// Number of the island of every unknown; islands count in the order of their first unknowns.
  std::vector<int> components() {
    std::vector<int> root(static_cast<std::size_t>(n_));
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](int i) {
      while (root[std::size_t(i)] != i) i = root[std::size_t(i)] = root[std::size_t(root[std::size_t(i)])];
      return i;
    };
    for (int j = 0; j < int(n_); ++j)
      for (int p = outer_[std::size_t(j)]; p < outer_[std::size_t(j) + 1]; ++p) {
        const int a = find(j), b = find(inner_[std::size_t(p)]);
        root[std::size_t(std::max(a, b))] = std::min(a, b);
      }
    std::vector<int> island(static_cast<std::size_t>(n_));
    first_.assign(1, 0);
    for (int i = 0; i < int(n_); ++i) {
      const int r = find(i);
      if (r == i) first_.push_back(0);
      island[std::size_t(i)] = r == i ? count() - 1 : island[std::size_t(r)];
      ++first_[std::size_t(island[std::size_t(i)]) + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    return island;
  }

  void arrange(Index natural) {
    const std::vector<int> island = components();
    const auto large = [&](int i) { return first(island[std::size_t(i)] + 1) - first(island[std::size_t(i)]) > natural; };
    std::vector<int> natural_order(static_cast<std::size_t>(n_));
    std::iota(natural_order.begin(), natural_order.end(), 0);
    std::vector<int> by_degree = natural_order;
    if (fill_reducing_ && std::any_of(by_degree.begin(), by_degree.end(), large)) {
      const std::vector<double> ones(inner_.size(), 1.0);
      const Eigen::Map<const Eigen::SparseMatrix<double>> pattern(n_, n_, Index(inner_.size()), outer_.data(), inner_.data(), ones.data());
      Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
      Eigen::AMDOrdering<int>()(pattern.selfadjointView<Eigen::Upper>(), permutation);
      by_degree.assign(permutation.indices().data(), permutation.indices().data() + n_);
    }
    order_.resize(std::size_t(n_));
    std::vector<int> next(first_.begin(), first_.end() - 1);
    for (const int i : natural_order)
      if (!large(i)) order_[std::size_t(next[std::size_t(island[std::size_t(i)])]++)] = i;
    for (const int i : by_degree)
      if (large(i)) order_[std::size_t(next[std::size_t(island[std::size_t(i)])]++)] = i;
  }

  /// Visiting the columns in the new order and appending to the rows' lists sorts every list; rows are columns by symmetry.
  void permute() {
    std::vector<int> position(static_cast<std::size_t>(n_));
    for (int k = 0; k < int(n_); ++k) position[std::size_t(order_[std::size_t(k)])] = k;
    start_.assign(std::size_t(n_) + 1, 0);
    for (const int i : inner_) ++start_[std::size_t(position[std::size_t(i)]) + 1];
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    row_.resize(inner_.size());
    source_.resize(inner_.size());
    value_.resize(inner_.size());
    diagonal_.assign(std::size_t(n_), 0.0);
    std::vector<int> fill(start_.begin(), start_.end() - 1);
    for (int k = 0; k < int(n_); ++k) {
      const int j = order_[std::size_t(k)];
      for (int p = outer_[std::size_t(j)]; p < outer_[std::size_t(j) + 1]; ++p) {
        const int at = fill[std::size_t(position[std::size_t(inner_[std::size_t(p)])])]++;
        row_[std::size_t(at)] = k;
        source_[std::size_t(at)] = p;
      }
    }
  }

  bool fill_reducing_ = false;
  Index n_ = -1;
  std::vector<int> outer_, inner_;         ///< the pattern as it came
  std::vector<int> first_, order_;         ///< islands one after the other
  std::vector<int> start_, row_, source_;  ///< columns in that order
  std::vector<double> value_, diagonal_;
};

}  // namespace dembark::lcp
