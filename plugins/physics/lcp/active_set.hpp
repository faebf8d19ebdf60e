// The last link of the chain: the exact active set by block principal pivots, on a factor. All violated indices change sides at once
// (J. J. Judice & F. M. Pires, Computers & Operations Research 21 (1994) 587), with a fallback that makes it end.
#pragma once

#include "factors.hpp"
#include "relaxation.hpp"

namespace dembark::lcp {

class ActiveSet {
 public:
  using Descent = Relaxation<MatrixRows>;

  /// Pivots from u.active; leaves z, w, s and the set in u. When the number of violations has reached no new least value for `patience`
  /// steps, the set that `descent` finds from the best z takes over (null: not at all); it goes on at the next stall until it is at its
  /// end. After that single pivots by least index (K. G. Murty, Opsearch 11 (1974) 138) are made until the number does fall: it cannot
  /// fall for ever, and least index alone ends, so the whole does.
  Outcome run(const Matrix& m, Unknowns& u, const LcpOptions& options, Descent* descent) {
    const double fraction = rounding_fraction(options.tolerance);
    Outcome outcome;
    std::size_t least = std::numeric_limits<std::size_t>::max();
    int stalled = 0, descents = 0;
    bool single = false;
    for (;;) {
      evaluate(m, u, fraction);
      if (violations_.empty()) break;
      if (outcome.pivots + outcome.block_steps >= most_pivots(options, m.n)) {
        outcome.limit = true;
        break;
      }
      if (violations_.size() < least) {
        least = violations_.size();
        best_ = u.z;
        stalled = 0;
        single = false;
      } else if (!single && ++stalled > patience) {
        outcome.used_fallback = true;
        if (descent) {
          if (descents == 0) {
            u.z = best_.max(0.0);
            descent->rows.start(m, u, fraction);
          }
          const bool finished = descent->finish(fraction);
          descent->rows.store(u);
          if (finished || ++descents == most_descents) descent = nullptr;
          stalled = 0;
          continue;
        }
        single = true;
      }
      if (single) violations_.resize(1);
      for (const Index i : violations_) u.active[std::size_t(i)] ^= 1;
      ++(single ? outcome.pivots : outcome.block_steps);
    }
    return outcome;
  }

 private:
  static constexpr int patience = 4, most_descents = 10;

  /// z, w, s of the active set and the list of violated indices; refined when it looks like the end.
  void evaluate(const Matrix& m, Unknowns& u, double fraction) {
    factor_.compute(m, u.active);
    u.z.setZero();
    u.w = u.q;
    for (int pass = 0; pass < 4; ++pass) {
      factor_.add_solution(-u.w, u.z);
      u.measure(m);
      violations_.clear();
      const double scale = u.scale(), error = u.active_error();
      for (Index i = 0; i < m.n; ++i)
        if (u.violated(i, fraction, scale)) violations_.push_back(i);
      if (violations_.empty() ? error <= 0.05 * fraction : pass > 0 || error < 1e-8) break;
    }
  }

  Factor factor_;
  Eigen::ArrayXd best_;  ///< z with the fewest violations
  std::vector<Index> violations_;
};

/// Projected Gauss-Seidel to the tolerance, checked every few sweeps. Outcome.pivots counts sweeps.
inline Outcome gauss_seidel(const Matrix& m, Unknowns& u, const LcpOptions& options, MatrixRows& rows) {
  Outcome outcome;
  const int limit = options.max_iterations > 0 ? options.max_iterations : 100000;
  rows.start(m, u, rounding_fraction(options.tolerance));
  for (;; rows.gather()) {
    rows.measure(u);
    if (u.certificate().worst() <= 0.5 * options.tolerance) break;
    if (outcome.pivots >= limit) {
      outcome.limit = true;
      break;
    }
    for (int sweep = 0; sweep < 5 && outcome.pivots < limit; ++sweep, ++outcome.pivots) rows.template relax<false>();
  }
  u.take_set();
  return outcome;
}

}  // namespace dembark::lcp
