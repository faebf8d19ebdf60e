// Methods that exchange one pair w_i <-> z_i at a time: the energy criterion and Murty's least index.
#pragma once

#include "active_factor.hpp"

namespace dembark::lcp {

/// Energies closer than this fraction count as tied; the lower index goes first, whatever rounding does.
constexpr double tie_fraction = 1e-10;

class SinglePivots {
 public:
  /// Pivot until no condition is violated. Starts at u.active; leaves z, w, s and active in u.
  ///
  /// least_index: Murty's rule, which ends for every P matrix (K. G. Murty, Opsearch 11 (1974) 138), instead of the energy
  /// criterion: the index with the most negative p_i = -value_i^2 / diagonal_i of the transformed system, that is, the exchange
  /// that releases the most energy (G. N. Kolesnikov, Resources and Technology 10 (2013)). That rule has no proof of an end:
  /// when it comes back to a set that it left, or goes on for 50 n pivots, least index takes over.
  Outcome run(const Matrix& m, Unknowns& u, bool least_index, const LcpOptions& options) {
    const Index n = m.n;
    const double fraction = rounding_fraction(options.tolerance);
    Outcome outcome;
    peak_ = 0.0;
    rest_ = (u.q * u.unit).abs().maxCoeff();
    rebuild(m, u);
    std::vector<char> landmark = u.active;  // a set that comes back meets it: R. P. Brent, BIT 20 (1980) 176
    int next_landmark = 1;
    bool fresh = false;
    for (Index checks = 0;;) {
      const Index p = choose(m, u, fraction, least_index, fresh);
      if (p < 0) {
        // The conditions hold in the running values; they must hold in values from M and q, with their own scales, as well.
        if (fresh || refresh(m, u, fraction)) break;
        fresh = true;
        outcome.limit = ++checks > n + 50;
        if (outcome.limit) break;
        continue;
      }
      fresh = false;
      outcome.limit = outcome.pivots >= most_pivots(options, n);
      if (outcome.limit) {
        refresh(m, u, fraction);
        break;
      }
      exchange(m, u, p);
      ++outcome.pivots;
      if (!least_index && (u.active == landmark || outcome.pivots > 50 * n)) {
        least_index = outcome.used_fallback = true;
        refresh(m, u, fraction);
      }
      if (outcome.pivots == next_landmark) {
        landmark = u.active;
        next_landmark *= 2;
      }
    }
    return outcome;
  }

 private:
  void rebuild(const Matrix& m, Unknowns& u) {
    factor_.clear(m, u.q.data());
    for (Index i = 0; i < m.n; ++i)
      if (u.active[std::size_t(i)]) factor_.insert(m, i);
    weigh(u);
  }

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
    weigh(u);
  }

  void weigh(const Unknowns& u) {
    load_ = 0.0;
    for (Index i = 0; i < u.z.size(); ++i)
      if (u.active[std::size_t(i)]) load_ += std::fabs(factor_.value(i)) / u.unit[i];
    peak_ = std::max(peak_, load_ + rest_);
  }

  /// The next index, or -1. |M_ij| <= sqrt(M_ii M_jj) turns the sum of sqrt(M_jj) |z_j| into a bound of s_i without a product.
  Index choose(const Matrix& m, const Unknowns& u, double fraction, bool least_index, bool fresh) const {
    constexpr double last_digit = std::numeric_limits<double>::epsilon();
    const double scale = fresh ? u.scale() : 0.0;
    Index best = -1;
    double most = 0.0;
    for (Index i = 0; i < m.n; ++i) {
      const double value = factor_.value(i);
      if (value >= 0.0) continue;
      const bool active = u.active[std::size_t(i)];
      const double rounding =
          fresh ? u.rounding(i, fraction, scale) : fraction * (std::fabs(u.q[i]) * u.unit[i] + load_) + 8.0 * last_digit * peak_;
      if (!((active ? -value / u.unit[i] : -value * u.unit[i]) > rounding)) continue;
      if (least_index) return i;
      // Rounding may leave a diagonal of an almost singular matrix at or below zero: its energy then is as large as it can be.
      const double floor = last_digit * (active ? 1.0 / m.diagonal(i) : m.diagonal(i));
      const double energy = value * value / std::max(factor_.diagonal(i), floor);
      if (energy > most * (1.0 + tie_fraction)) most = energy, best = i;
    }
    return best;
  }

  /// z with iterative refinement, w and s from M and q; true when all conditions hold.
  bool refresh(const Matrix& m, Unknowns& u, double fraction) {
    for (Index i = 0; i < m.n; ++i) u.z[i] = u.active[std::size_t(i)] ? factor_.value(i) : 0.0;
    for (int pass = 0;; ++pass) {
      u.measure(m);
      if (pass == 3 || u.active_error() <= 0.05 * fraction) break;
      factor_.add_solution(-u.w, u.z);
    }
    factor_.set_values(u);
    peak_ = 0.0;
    weigh(u);
    const double scale = u.scale();
    for (Index i = 0; i < m.n; ++i)
      if (u.violated(i, fraction, scale)) return false;
    return true;
  }

  ActiveFactor factor_;
  double load_ = 0.0;  ///< sum of sqrt(M_jj) |z_j|
  double rest_ = 0.0;  ///< most of |q_j| / sqrt(M_jj)
  double peak_ = 0.0;  ///< most of load_ + rest_ since values were computed afresh: the running values carry its rounding
};

}  // namespace dembark::lcp
