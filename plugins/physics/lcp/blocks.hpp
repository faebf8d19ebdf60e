// The matrix of one island, dense or sparse, with the few products that the methods need.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "types.hpp"

namespace dembark::lcp {

using Eigen::Index;

/// A violation below this share of s_i = |q_i| + sum_j |M_ij z_j| is rounding: the residual of a backward stable solution.
inline double rounding_share(double tolerance) { return std::max(64.0 * std::numeric_limits<double>::epsilon(), 0.01 * tolerance); }

/// A Cholesky pivot that is not above this share of M_ii has lost all its digits: M is singular to working accuracy.
inline double definite_share(Index n) { return 8.0 * std::numeric_limits<double>::epsilon() * std::sqrt(double(n)); }

/// Thrown with the local index of the row whose pivot failed; the solver turns it into a message with the row's own number.
struct NotDefinite {
  Index row;
  double pivot, diagonal;
};

/// Column-major symmetric matrix that lies elsewhere.
struct DenseBlock {
  const double* values = nullptr;
  Index stride = 0, n = 0;

  const double* column(Index j) const { return values + j * stride; }
  double diagonal(Index i) const { return values[i * stride + i]; }
  void copy_column(Index j, double* out) const { std::copy_n(column(j), n, out); }

  /// w = q + M z, s = |q| + |M| |z|.
  void multiply(const double* q, const double* z, double* w, double* s) const {
    for (Index i = 0; i < n; ++i) w[i] = q[i], s[i] = std::fabs(q[i]);
    for (Index j = 0; j < n; ++j) {
      const double x = z[j];
      if (x == 0.0) continue;
      const double* m = column(j);
      for (Index i = 0; i < n; ++i) {
        const double t = m[i] * x;
        w[i] += t;
        s[i] += std::fabs(t);
      }
    }
  }

  double column_times(Index j, const double* z) const {
    return Eigen::Map<const Eigen::VectorXd>(column(j), n).dot(Eigen::Map<const Eigen::VectorXd>(z, n));
  }
};

/// Compressed columns, both triangles, rows ascending.
struct SparseBlock {
  Index n = 0;
  const int* start = nullptr;  ///< n + 1
  const int* row = nullptr;
  const double* value = nullptr;
  const double* diagonals = nullptr;

  double diagonal(Index i) const { return diagonals[i]; }
  void copy_column(Index j, double* out) const {
    std::fill_n(out, n, 0.0);
    for (int p = start[j]; p < start[j + 1]; ++p) out[row[p]] = value[p];
  }

  void multiply(const double* q, const double* z, double* w, double* s) const {
    for (Index i = 0; i < n; ++i) w[i] = q[i], s[i] = std::fabs(q[i]);
    for (Index j = 0; j < n; ++j) {
      const double x = z[j];
      if (x == 0.0) continue;
      for (int p = start[j]; p < start[j + 1]; ++p) {
        const double t = value[p] * x;
        w[row[p]] += t;
        s[row[p]] += std::fabs(t);
      }
    }
  }

  double column_times(Index j, const double* z) const {
    double sum = 0.0;
    for (int p = start[j]; p < start[j + 1]; ++p) sum += value[p] * z[row[p]];
    return sum;
  }
};

/// What the methods hand back about one island; z, w, s and the active set stand in the arrays of the caller.
struct Outcome {
  int pivots = 0, block_steps = 0;
  bool guarded = false, limit = false;
};

/// Work space of one island: unknowns, their residuals and scales, flags of the active set.
struct Unknowns {
  std::vector<double> q, z, w, s;
  std::vector<double> root;   ///< sqrt(M_ii)
  std::vector<double> limit;  ///< below -limit a value breaks its condition by more than rounding, in units of w
  std::vector<char> active;

  void resize(Index n) {
    const std::size_t size = std::size_t(n);
    q.resize(size), z.assign(size, 0.0), w.resize(size), s.resize(size), root.resize(size), limit.resize(size), active.assign(size, 0);
  }

  /// From s: the share of the row's own scale, and the last digit of the largest scale anywhere, which rounding carries around.
  void set_limits(double share) {
    double largest = 0.0;
    for (std::size_t i = 0; i < s.size(); ++i) largest = std::max(largest, s[i] / root[i]);
    for (std::size_t i = 0; i < s.size(); ++i) limit[i] = share * s[i] + std::numeric_limits<double>::epsilon() * largest * root[i];
  }

  /// Whether index i breaks its condition: w_i < 0 outside of the active set, z_i < 0 inside (times M_ii, the most that it does to w_i).
  bool violated(std::size_t i) const { return active[i] ? z[i] * root[i] * root[i] < -limit[i] : w[i] < -limit[i]; }
};

}  // namespace dembark::lcp
