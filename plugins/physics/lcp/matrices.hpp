// The rows of a matrix as relaxation.hpp sees them.
#pragma once

#include "residual.hpp"

namespace dembark::lcp {

/// The rows of a matrix for Relaxation: a force acts on all rows through its column.
class MatrixRows {
 public:
  static constexpr double worth_steps = 80.0;

  /// Begins with the forces u.z.
  void start(const Matrix& m, const Unknowns& u, double fraction) {
    m_ = m;
    u_ = u;
    const double largest = std::max(0.0, -(u.q * u.unit).minCoeff());
    base_ = u.q.abs() * u.unit.square() + std::numeric_limits<double>::epsilon() / fraction * largest * u.unit;
    gather();
  }

  Index near() const { return m_.n; }
  bool widen() const { return false; }
  double force(Index i) const { return u_.z[i]; }
  void set_force(Index i, double z) { u_.z[i] = z; }
  double unit(Index i) const { return u_.unit[i]; }
  double gap(Index i) const { return u_.w[i]; }
  void gather() { u_.measure(m_); }
  double energy() const { return 0.5 * (u_.z * (u_.q + u_.w)).sum(); }
  void measure(Residual& r) const { r = u_; }
  void store(Unknowns& u) const {
    u.z = u_.z;
    u.take_set();
  }

  template <bool Measured>
  double relax() {
    double most = 0.0;
    for (Index i = 0; i < m_.n; ++i) {
      const double next = std::max(u_.z[i] - u_.w[i] * u_.unit[i] * u_.unit[i], 0.0), step = next - u_.z[i];
      if (step == 0.0) continue;
      m_.add_column(i, step, u_.w.data());
      u_.z[i] = next;
      if (Measured) most = std::max(most, std::fabs(step) / (base_[i] + next));
    }
    return most;
  }

  /// What the forces of a face, scaled to a unit diagonal, add up to.
  class Face {
   public:
    struct Sums {
      Matrix m;
      const double* unit;
      const Index* face;
      double* sum;
      double pulled(Index k) const { return sum[face[k]] * unit[face[k]]; }
      void push(Index k, double force) const { m.add_column(face[k], force * unit[face[k]], sum); }
    };

    void load(const MatrixRows& rows, const std::vector<Index>& face) {
      sum_.resize(rows.m_.n);
      sums_ = {rows.m_, rows.u_.unit.data(), face.data(), sum_.data()};
    }
    void clear() { sum_.setZero(); }
    const Sums& sums() const { return sums_; }

   private:
    Eigen::ArrayXd sum_;
    Sums sums_{};
  };

 private:
  Matrix m_;
  Unknowns u_;           ///< w is kept up to date with the forces
  Eigen::ArrayXd base_;  ///< what steps of z are compared with, but for z
};

}  // namespace dembark::lcp
