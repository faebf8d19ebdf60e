// A way on where block pivots stall: sweeps of projected Gauss-Seidel find a face, conjugate gradients its least energy, in turn, until
// the face stays (J. L. Morales, J. Nocedal & M. Smelyanskiy, Numerische Mathematik 111 (2008) 251). The energy z^T M z / 2 + q^T z
// falls with each, so no face comes back for good; single pivots would exchange one index at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "blocks.hpp"

namespace dembark::lcp {

/// Projected Gauss-Seidel from z >= 0, one sweep, in place. It never raises the energy.
template <class Matrix>
inline void gauss_seidel_sweep(const Matrix& m, const std::vector<double>& q, std::vector<double>& z) {
  for (Index i = 0; i < m.n; ++i) {
    double& x = z[std::size_t(i)];
    const double next = x - (q[std::size_t(i)] + m.column_times(i, z.data())) / m.diagonal(i);
    x = next > 0.0 ? next : 0.0;
  }
}

template <class Matrix>
class Descent {
 public:
  /// Leaves in u.active the set that was found, from the positive entries of u.z: a guess that block pivots have to prove.
  void run(const Matrix& m, Unknowns& u) {
    for (double& z : u.z) z = std::max(z, 0.0);
    for (Index face = 0; face < m.n + least_faces; ++face) {
      for (int sweep = 0; sweep < 3; ++sweep) gauss_seidel_sweep(m, u.q, u.z);
      const bool same = take(u);
      const double before = energy(m, u);
      const bool reached = minimise(m, u, same ? close : fall);
      begin_ = u.z;
      const bool cut = apply(u, 1.0);
      if (same && reached && !cut) return;
      for (double part = 0.5; cut && part > 1e-3 && !(energy(m, u) < before); part *= 0.5) apply(u, part);
    }
  }

 private:
  static constexpr Index least_faces = 300;          ///< so many and as many as unknowns are looked at
  static constexpr double fall = 0.2, close = 1e-8;  ///< of the residual: while the face changes, and after that

  /// The face of the positive entries; whether it is the last one.
  bool take(Unknowns& u) {
    last_.swap(u.active);
    u.active.resize(u.z.size());
    face_.clear();
    for (std::size_t i = 0; i < u.z.size(); ++i) {
      u.active[i] = u.z[i] > 0.0;
      if (u.active[i]) face_.push_back(Index(i));
    }
    return u.active == last_;
  }

  /// Leaves w = q + M z.
  double energy(const Matrix& m, Unknowns& u) const {
    m.multiply(u.q.data(), u.z.data(), u.w.data(), u.s.data());
    double sum = 0.0;
    for (std::size_t i = 0; i < u.z.size(); ++i) sum += u.z[i] * (u.q[i] + u.w[i]);
    return 0.5 * sum;
  }

  /// The step on the face that brings its residual down to `goal` of what it is, by conjugate gradients scaled with the diagonal. False
  /// where it is less, for it clearly leads below 0.
  bool minimise(const Matrix& m, const Unknowns& u, double goal) {
    const std::size_t n = u.z.size();
    step_.assign(n, 0.0), direction_.assign(n, 0.0), residual_.assign(n, 0.0), image_.resize(n);
    double square = 0.0, share = 0.0;
    for (const Index i : face_) {
      const double r = residual_[std::size_t(i)] = -u.w[std::size_t(i)];
      square += r * r / m.diagonal(i);
    }
    const double enough = goal * goal * square;
    for (std::size_t turn = 0; turn < 10 * n && square > enough; ++turn) {
      for (const Index i : face_) {
        const std::size_t k = std::size_t(i);
        direction_[k] = residual_[k] / m.diagonal(i) + share * direction_[k];
      }
      double product = 0.0;
      for (const Index i : face_) {
        image_[std::size_t(i)] = m.column_times(i, direction_.data());
        product += direction_[std::size_t(i)] * image_[std::size_t(i)];
      }
      const double length = square / product;
      double next = 0.0;
      for (const Index i : face_) {
        const std::size_t k = std::size_t(i);
        step_[k] += length * direction_[k];
        residual_[k] -= length * image_[k];
        next += residual_[k] * residual_[k] / m.diagonal(i);
      }
      share = next / square;
      square = next;
      if (turn % 8 == 7 && lowest(u) < -2.0 * std::sqrt(square)) return false;
    }
    return square <= enough;
  }

  /// The least unknown after the step, in units of the residual.
  double lowest(const Unknowns& u) const {
    double least = 0.0;
    for (const Index i : face_) {
      const std::size_t k = std::size_t(i);
      least = std::min(least, (u.z[k] + step_[k]) * u.root[k]);
    }
    return least;
  }

  /// Goes `part` of the step; what would turn negative is 0. Whether anything did.
  bool apply(Unknowns& u, double part) const {
    bool cut = false;
    for (const Index i : face_) {
      const std::size_t k = std::size_t(i);
      u.z[k] = begin_[k] + part * step_[k];
      cut |= u.z[k] < 0.0;
      u.z[k] = std::max(u.z[k], 0.0);
    }
    return cut;
  }

  std::vector<Index> face_;
  std::vector<char> last_;
  std::vector<double> step_, direction_, residual_, image_, begin_;
};

}  // namespace dembark::lcp
