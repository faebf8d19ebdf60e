// Methods that exchange one pair w_i <-> z_i at a time: the energy criterion and Murty's least index.
#pragma once

#include <cstdint>
#include <unordered_set>

#include "active_factor.hpp"

namespace dembark::lcp {

/// A number per index whose xor names a set; fixed, so that runs repeat.
inline std::uint64_t set_key(Index i) {
  std::uint64_t x = std::uint64_t(i) + 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Energies closer than this share count as tied; the lower index goes first, whatever rounding does.
constexpr double tie_share = 1e-10;

/// Where a method gives up by itself. Least index ends, but not for certain within our lifetime.
inline Index most_pivots(Index n) { return 1000 * n + 1000; }

class SinglePivots {
 public:
  /// Pivot until no condition is violated. Starts at u.active; leaves z, w, s and active in u.
  ///
  /// least_index: Murty's rule, which ends for every P matrix (K. G. Murty, Opsearch 11 (1974) 138), instead of the energy
  /// criterion: the index with the most negative p_i = -value_i^2 / diagonal_i of the transformed system, that is, the exchange
  /// that releases the most energy (G. N. Kolesnikov, Resources and Technology 10 (2013)). That rule has no proof of an end:
  /// when it comes back to a set that it left, or goes on for 50 n pivots, least index takes over.
  template <class Matrix>
  Outcome run(const Matrix& m, Unknowns& u, bool least_index, const LcpOptions& options) {
    const Index n = m.n;
    const double share = rounding_share(options.tolerance);
    Outcome outcome;
    rest_ = peak_ = 0.0;
    for (std::size_t i = 0; i < u.q.size(); ++i) rest_ = std::max(rest_, std::fabs(u.q[i]) / u.root[i]);
    rebuild(m, u);
    std::unordered_set<std::uint64_t> seen;
    std::uint64_t key = 0;
    for (Index i = 0; i < n; ++i)
      if (u.active[std::size_t(i)]) key ^= set_key(i);
    if (!least_index) seen.insert(key);
    bool fresh = false;
    for (Index checks = 0;;) {
      const Index p = choose(m, u, share, least_index, fresh);
      if (p < 0) {
        // The conditions hold in the running values; they must hold in values from M and q, with their own scales, as well.
        if (fresh || refresh(m, u, share)) break;
        fresh = true;
        if (++checks > n + 50) {
          outcome.limit = true;
          break;
        }
        continue;
      }
      fresh = false;
      if (options.max_iterations > 0 ? outcome.pivots >= options.max_iterations : outcome.pivots >= most_pivots(n)) {
        outcome.limit = true;
        refresh(m, u, share);
        break;
      }
      exchange(m, u, p);
      ++outcome.pivots;
      key ^= set_key(p);
      if (!least_index && (!seen.insert(key).second || outcome.pivots > 50 * n)) {
        least_index = outcome.guarded = true;
        refresh(m, u, share);
      }
    }
    return outcome;
  }

 private:
  template <class Matrix>
  void rebuild(const Matrix& m, Unknowns& u) {
    factor_.clear(m, u.q.data());
    for (Index i = 0; i < m.n; ++i)
      if (u.active[std::size_t(i)]) factor_.insert(m, i);
    weigh(m, u);
  }

  template <class Matrix>
  void exchange(const Matrix& m, Unknowns& u, Index p) {
    char& flag = u.active[std::size_t(p)];
    if (flag) {
      factor_.remove(p);
    } else {
      try {
        factor_.insert(m, p);
      } catch (const NotDefinite&) {
        if (!factor_.rotated()) throw;
        rebuild(m, u);  // perhaps only the rotations have used the digits up
        factor_.insert(m, p);
      }
    }
    flag = !flag;
    weigh(m, u);
  }

  template <class Matrix>
  void weigh(const Matrix& m, const Unknowns& u) {
    load_ = 0.0;
    for (Index i = 0; i < m.n; ++i)
      if (u.active[std::size_t(i)]) load_ += u.root[std::size_t(i)] * std::fabs(factor_.value(i));
    peak_ = std::max(peak_, load_ + rest_);
  }

  /// The next index, or -1. |M_ij| <= sqrt(M_ii M_jj) turns the sum of sqrt(M_jj) |z_j| into a bound of s_i without a product.
  template <class Matrix>
  Index choose(const Matrix& m, const Unknowns& u, double share, bool least_index, bool fresh) const {
    constexpr double last_digit = std::numeric_limits<double>::epsilon();
    Index best = -1;
    double most = 0.0;
    for (Index i = 0; i < m.n; ++i) {
      const std::size_t k = std::size_t(i);
      const double value = factor_.value(i);
      if (value >= 0.0) continue;
      const double limit = fresh ? u.limit[k] : share * (std::fabs(u.q[k]) + u.root[k] * load_) + 8.0 * last_digit * u.root[k] * peak_;
      if (!((u.active[k] ? -value * m.diagonal(i) : -value) > limit)) continue;
      if (least_index) return i;
      // Rounding may leave a diagonal of an almost singular matrix at or below zero: its energy then is as large as it can be.
      const double floor = last_digit * (u.active[k] ? 1.0 / m.diagonal(i) : m.diagonal(i));
      const double energy = value * value / std::max(factor_.diagonal(i), floor);
      if (energy > most * (1.0 + tie_share)) most = energy, best = i;
    }
    return best;
  }

  /// z with iterative refinement, w and s from M and q; true when all conditions hold.
  template <class Matrix>
  bool refresh(const Matrix& m, Unknowns& u, double share) {
    const std::size_t n = std::size_t(m.n);
    for (std::size_t i = 0; i < n; ++i) u.z[i] = u.active[i] ? factor_.value(Index(i)) : 0.0;
    right_.resize(n);
    for (int pass = 0;; ++pass) {
      m.multiply(u.q.data(), u.z.data(), u.w.data(), u.s.data());
      double worst = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        right_[i] = u.active[i] ? -u.w[i] : 0.0;
        if (u.active[i] && u.s[i] > 0.0) worst = std::max(worst, std::fabs(u.w[i]) / u.s[i]);
      }
      if (pass == 3 || worst <= 0.05 * share) break;
      factor_.add_solution(right_.data(), u.z.data());
    }
    factor_.set_values(u);
    peak_ = 0.0;
    weigh(m, u);
    u.set_limits(share);
    for (std::size_t i = 0; i < n; ++i)
      if (u.violated(i)) return false;
    return true;
  }

  ActiveFactor factor_;
  std::vector<double> right_;
  double load_ = 0.0;  ///< sum of sqrt(M_jj) |z_j|
  double rest_ = 0.0;  ///< most of |q_j| / sqrt(M_jj)
  double peak_ = 0.0;  ///< most of load_ + rest_ since values were computed afresh: the running values carry its rounding
};

}  // namespace dembark::lcp
