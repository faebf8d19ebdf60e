// Proof that the matrices of a sequence are positive definite, without a factor for each.
//
// B = D^-1/2 M0 D^-1/2, D the diagonal of M0. A factor of M0 - sigma D shows that the least eigenvalue of B is at least sigma. Then every
// symmetric M with |D^-1/2 (M - M0) D^-1/2| < sigma in the largest absolute row sum, which is no less than the spectral norm, is
// positive definite (Weyl's inequality). That costs one look at each entry.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "checks.hpp"
#include "factors.hpp"

namespace dembark::lcp {

class SparseProof {
 public:
  /// A new pattern, with so many islands, unknowns and entries.
  void forget(int islands, Index unknowns, std::size_t entries) {
    margin_.assign(std::size_t(islands), Margin());
    inverse_.resize(std::size_t(unknowns));
    base_.resize(entries);
  }

  /// Throws NotDefinite unless m, which is island number t and begins at unknown `first`, is positive definite beyond rounding.
  void check(int t, Index first, const SparseBlock& m) {
    Margin& margin = margin_[std::size_t(t)];
    if (margin.proven && near(margin.sigma, first, m)) return;
    if (dominant(m)) return;
    margin.proven = false;
    const std::vector<char> all(std::size_t(m.n), 1);
    if (margin.sigma > least_sigma) {  // a second matrix of this pattern: more will come
      try {
        factor_.compute(m, all, margin.sigma);
        remember(first, m);
        margin.proven = true;
        return;
      } catch (const NotDefinite&) {
        margin.sigma *= 0.1;
      }
    }
    factor_.compute(m, all);
    if (margin.sigma < 0.0) margin.sigma = 0.25 * factor_.least_pivot();
  }

 private:
  /// Below this the matrices of a sequence are hardly ever as near to each other.
  static constexpr double least_sigma = 1e-6;

  struct Margin {
    double sigma = -1.0;  ///< to try, or proven; negative: no matrix yet
    bool proven = false;
  };

  void remember(Index first, const SparseBlock& m) {
    for (Index i = 0; i < m.n; ++i) inverse_[std::size_t(first + i)] = 1.0 / std::sqrt(m.diagonals[i]);
    std::copy(m.value + m.start[0], m.value + m.start[m.n], base_.begin() + m.start[0]);
  }

  bool near(double sigma, Index first, const SparseBlock& m) const {
    const double n = double(m.n), most = 0.9 * sigma - n * n * std::numeric_limits<double>::epsilon();
    const double* inverse = inverse_.data() + first;
    for (Index j = 0; j < m.n; ++j) {
      double sum = 0.0;
      for (int p = m.start[j]; p < m.start[j + 1]; ++p) sum += std::fabs(m.value[p] - base_[std::size_t(p)]) * inverse[m.row[p]];
      if (!(sum * inverse[j] < most)) return false;
    }
    return true;
  }

  SparseFactor factor_;
  std::vector<Margin> margin_;
  std::vector<double> inverse_, base_;
};

}  // namespace dembark::lcp
