// A matrix, dense or sparse, and what every way of solving is judged by: the residual of z and the certificate that follows from it.
#pragma once

#include <cmath>
#include <limits>

#include "types.hpp"

namespace dembark::lcp {

using Eigen::Index;

/// A violation below this fraction of s_i = |q_i| + sum_j |M_ij z_j| is rounding: the residual of a backward stable solution.
inline double rounding_fraction(double tolerance) { return std::max(64.0 * std::numeric_limits<double>::epsilon(), 0.01 * tolerance); }

/// A symmetric matrix that lies elsewhere: all columns one after the other, or compressed ones of both triangles with ascending rows.
struct Matrix {
  Index n = 0;
  const double* value = nullptr;
  const double* diagonals = nullptr;
  const int* start = nullptr;  ///< n + 1; null: all entries are stored
  const int* row = nullptr;
  int first = 0;  ///< the number that rows begin with

  bool dense() const { return !start; }
  double diagonal(Index i) const { return diagonals[dense() ? i * (n + 1) : i]; }

  /// Calls visit(row, value) for the entries of column j.
  template <class Visit>
  void each(Index j, Visit visit) const {
    if (dense())
      for (Index i = 0; i < n; ++i) visit(i, value[j * n + i]);
    else
      for (int p = start[j]; p < start[j + 1]; ++p) visit(Index(row[p] - first), value[p]);
  }

  /// out += x times column j.
  void add_column(Index j, double x, double* out) const {
    each(j, [x, out](Index i, double entry) { out[i] += x * entry; });
  }
};

inline Matrix dense_matrix(const double* values, Index n) { return {n, values, values}; }

/// w = q + M z of some rows, with what has been added up in each.
struct Residual {
  Eigen::ArrayXd z, w, s;
  Eigen::ArrayXd unit;  ///< 1 / sqrt(M_ii): w_i unit_i and z_i / unit_i do not depend on the units of the row

  void resize(Index n) {
    for (Eigen::ArrayXd* x : {&z, &w, &s, &unit}) x->resize(n);
  }

  /// The largest number added up anywhere, scaled.
  double scale() const { return s.size() > 0 ? (s * unit).maxCoeff() : 0.0; }

  /// A scaled value of row i is zero to rounding up to this: the fraction of the row's own scale, and the last digit of the largest scale
  /// anywhere, which rounding carries around.
  double rounding(Index i, double fraction, double scale) const {
    return fraction * s[i] * unit[i] + std::numeric_limits<double>::epsilon() * scale;
  }

  LcpCertificate certificate() const {
    const double most = scale();
    if (!(most > 0.0)) return {};
    return {std::max(0.0, -(z / unit).minCoeff()) / most, std::max(0.0, -(w * unit).minCoeff()) / most,
            std::fabs((z * w).sum()) / (most * most)};
  }

  /// Whether z >= 0 fulfils all conditions to rounding.
  bool solved(double fraction) const {
    const double most = scale();
    for (Index i = 0; i < w.size(); ++i)
      if (!((z[i] > 0.0 ? std::fabs(w[i]) : -w[i]) * unit[i] <= rounding(i, fraction, most))) return false;
    return std::isfinite(most);
  }
};

/// Work space of one island.
struct Unknowns : Residual {
  Eigen::ArrayXd q;
  std::vector<char> active;

  void reset(const Matrix& m) {
    resize(m.n);
    q.resize(m.n);
    z.setZero();
    for (Index i = 0; i < m.n; ++i) unit[i] = 1.0 / std::sqrt(m.diagonal(i));
    active.assign(std::size_t(m.n), 0);
  }

  /// w and s of z.
  void measure(const Matrix& m) {
    w = q;
    s = q.abs();
    for (Index j = 0; j < m.n; ++j)
      if (z[j] != 0.0)
        m.each(j, [x = z[j], w_ = w.data(), s_ = s.data()](Index i, double value) {
          const double t = value * x;
          w_[i] += t;
          s_[i] += std::fabs(t);
        });
  }

  /// The set of the positive z.
  void take_set() {
    for (Index i = 0; i < z.size(); ++i) active[std::size_t(i)] = z[i] > 0.0;
  }

  /// Whether index i breaks its condition: w_i < 0 outside of the active set, z_i < 0 inside.
  bool violated(Index i, double fraction, double scale) const {
    return (active[std::size_t(i)] ? z[i] / unit[i] : w[i] * unit[i]) < -rounding(i, fraction, scale);
  }

  /// Largest |w_i| / s_i inside of the active set: what refinement has to bring down.
  double active_error() const {
    double worst = 0.0;
    for (Index i = 0; i < z.size(); ++i)
      if (active[std::size_t(i)] && s[i] > 0.0) worst = std::max(worst, std::fabs(w[i]) / s[i]);
    return worst;
  }
};

/// What the methods hand back about one island; z, w, s and the active set stand in its Unknowns.
struct Outcome {
  int pivots = 0, block_steps = 0;
  bool used_fallback = false, limit = false;
};

/// Where a method gives up by itself. Least index ends, but not for certain within our lifetime.
inline Index most_pivots(const LcpOptions& options, Index n) {
  return options.max_iterations > 0 ? options.max_iterations : 1000 * n + 1000;
}

}  // namespace dembark::lcp
