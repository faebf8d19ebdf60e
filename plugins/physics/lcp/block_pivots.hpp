// Block principal pivoting: all violated indices change sides at once (J. J. Judice & F. M. Pires, Computers & Operations
// Research 21 (1994) 587), with a guard that makes it end.
#pragma once

#include "descent.hpp"
#include "single_pivots.hpp"
#include "updated_factor.hpp"

namespace dembark::lcp {

/// WayOn: gives u.active another set to begin from, where block pivots stall.
template <class Matrix, class Factor, class WayOn = Descent<Matrix>>
class BlockPivots {
 public:
  /// Pivot from u.active. When the number of violations has not reached a new least value for `patience` steps, they begin again
  /// elsewhere, once. After that single pivots are made until it does: by the energy criterion, and by least index when that returns to
  /// a set that it left or takes too long. The least value falls with every return to block steps and least index alone ends, so the
  /// whole does.
  /// hand_over: return instead of single pivots (outcome.guarded says so), for a caller with a cheaper way of single pivots.
  Outcome run(const Matrix& m, Unknowns& u, const LcpOptions& options, bool hand_over) {
    constexpr int patience = 4;
    const double share = rounding_share(options.tolerance);
    Outcome outcome;
    Index least = std::numeric_limits<Index>::max();
    int stalled = 0;
    bool elsewhere = false;
    Index singles = 0;  // 0: block steps; otherwise single pivots since the stall
    std::unordered_set<std::uint64_t> seen;
    std::uint64_t key = 0;
    for (bool fresh = true;; fresh = false) {
      evaluate(m, u, share, fresh);
      if (violations_.empty()) break;
      const Index count = Index(violations_.size());
      const Index done = outcome.pivots + outcome.block_steps;
      if (options.max_iterations > 0 ? done >= options.max_iterations : done >= most_pivots(m.n)) {
        outcome.limit = true;
        break;
      }
      if (count < least) {
        least = count;
        stalled = 0;
        singles = 0;
      } else if (singles == 0 && ++stalled > patience) {
        outcome.guarded = true;
        if (!elsewhere) {
          elsewhere = true;
          way_on_.run(m, u);
          stalled = 0;
          continue;
        }
        if (hand_over) break;
        singles = 1;
        seen = {key = 0};
      }
      if (singles == 0) {
        for (const Index i : violations_) u.active[std::size_t(i)] ^= 1;
        ++outcome.block_steps;
        continue;
      }
      const bool least_index = singles > 2 * least + 20;
      const Index i = least_index ? violations_.front() : by_energy(m, u);
      u.active[std::size_t(i)] ^= 1;
      ++outcome.pivots;
      ++singles;
      if (least_index) continue;
      key ^= set_key(i);
      if (!seen.insert(key).second) singles = 2 * least + 21;
    }
    return outcome;
  }

 private:
  /// z, w, s of the active set and the list of violated indices; refined when it looks like the end.
  void evaluate(const Matrix& m, Unknowns& u, double share, bool fresh) {
    const std::size_t n = std::size_t(m.n);
    factor_.compute(m, u.active, fresh);
    right_.resize(n);
    for (std::size_t i = 0; i < n; ++i) right_[i] = -u.q[i], u.z[i] = 0.0;
    for (int pass = 0; pass < 4; ++pass) {
      factor_.add_solution(right_.data(), u.z.data());
      m.multiply(u.q.data(), u.z.data(), u.w.data(), u.s.data());
      violations_.clear();
      u.set_limits(share);
      for (std::size_t i = 0; i < n; ++i)
        if (u.violated(i)) violations_.push_back(Index(i));
      if (!violations_.empty() && pass > 0) break;
      double worst = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        right_[i] = u.active[i] ? -u.w[i] : 0.0;
        if (u.active[i] && u.s[i] > 0.0) worst = std::max(worst, std::fabs(u.w[i]) / u.s[i]);
      }
      if (worst <= 0.05 * share || (!violations_.empty() && worst < 1e-8)) break;
    }
  }

  /// The violated index whose exchange releases most energy. The transformed diagonal costs a solution with the factor each, so only
  /// the candidates with the largest w^2 / M_ii or z^2 M_ii are asked.
  Index by_energy(const Matrix& m, const Unknowns& u) {
    constexpr std::size_t candidates = 16;
    const auto guess = [&](Index i) {
      const std::size_t k = std::size_t(i);
      return u.active[k] ? u.z[k] * u.z[k] * m.diagonal(i) : u.w[k] * u.w[k] / m.diagonal(i);
    };
    std::vector<Index> list = violations_;
    if (list.size() > candidates) {
      std::nth_element(list.begin(), list.begin() + candidates, list.end(), [&](Index a, Index b) {
        const double x = guess(a), y = guess(b);
        return x != y ? x > y : a < b;
      });
      list.resize(candidates);
      std::sort(list.begin(), list.end());
    }
    Index best = list.front();
    double most = 0.0;
    std::vector<double> column(static_cast<std::size_t>(m.n)), x(column.size());
    for (const Index i : list) {
      const std::size_t k = std::size_t(i);
      std::fill(x.begin(), x.end(), 0.0);
      double energy;
      if (u.active[k]) {
        std::fill(column.begin(), column.end(), 0.0);
        column[k] = 1.0;
        factor_.add_solution(column.data(), x.data());
        energy = u.z[k] * u.z[k] / x[k];
      } else {
        m.copy_column(i, column.data());
        factor_.add_solution(column.data(), x.data());
        double diagonal = m.diagonal(i);
        for (std::size_t a = 0; a < x.size(); ++a) diagonal -= column[a] * x[a];
        energy = u.w[k] * u.w[k] / std::max(diagonal, std::numeric_limits<double>::epsilon() * m.diagonal(i));
      }
      if (energy > most * (1.0 + tie_share)) most = energy, best = i;
    }
    return best;
  }

  WayOn way_on_;
  UpdatedFactor<Factor> factor_;
  std::vector<double> right_;
  std::vector<Index> violations_;
};

/// Projected Gauss-Seidel to the tolerance, checked every few sweeps; the active set is {z > 0}. Outcome.pivots counts sweeps.
template <class Matrix>
inline Outcome gauss_seidel(const Matrix& m, Unknowns& u, const LcpOptions& options) {
  Outcome outcome;
  const int limit = options.max_iterations > 0 ? options.max_iterations : 100000;
  double worst = 1.0;
  for (;;) {
    m.multiply(u.q.data(), u.z.data(), u.w.data(), u.s.data());
    double most = 0.0, product = 0.0, low = 0.0;
    for (std::size_t i = 0; i < u.q.size(); ++i) {
      most = std::max(most, u.s[i] / u.root[i]);
      low = std::max(low, -u.w[i] / u.root[i]);
      product += u.z[i] * u.w[i];
    }
    worst = most > 0.0 ? std::max(low / most, std::fabs(product) / (most * most)) : 0.0;
    if (worst <= 0.5 * options.tolerance) break;
    if (outcome.pivots >= limit) {
      outcome.limit = true;
      break;
    }
    for (int sweep = 0; sweep < 5 && outcome.pivots < limit; ++sweep, ++outcome.pivots) gauss_seidel_sweep(m, u.q, u.z);
  }
  for (std::size_t i = 0; i < u.z.size(); ++i) u.active[i] = u.z[i] > 0.0;
  return outcome;
}

}  // namespace dembark::lcp
