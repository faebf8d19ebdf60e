// The matrix of one island, dense or sparse, with the few products that the methods need, and its rows as relaxation.hpp sees them.
#pragma once

#include "residual.hpp"

namespace dembark::lcp {

/// Column-major symmetric matrix that lies elsewhere.
struct DenseBlock {
  const double* values = nullptr;
  Index n = 0;

  using Column = Eigen::Map<const Eigen::ArrayXd>;
  Column column(Index j) const { return {values + j * n, n}; }
  double diagonal(Index i) const { return values[i * n + i]; }

  /// out += x times column j.
  void add_column(Index j, double x, double* out) const { Eigen::Map<Eigen::ArrayXd>(out, n) += x * column(j); }

  /// w = q + M z, s = |q| + |M| |z|.
  void multiply(const double* q, const double* z, double* w, double* s) const {
    for (Index i = 0; i < n; ++i) w[i] = q[i], s[i] = std::fabs(q[i]);
    for (Index j = 0; j < n; ++j) {
      if (z[j] == 0.0) continue;
      const double* m = values + j * n;
      for (Index i = 0; i < n; ++i) {
        const double t = m[i] * z[j];
        w[i] += t;
        s[i] += std::fabs(t);
      }
    }
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

  void add_column(Index j, double x, double* out) const {
    for (int p = start[j]; p < start[j + 1]; ++p) out[row[p]] += x * value[p];
  }

  void multiply(const double* q, const double* z, double* w, double* s) const {
    for (Index i = 0; i < n; ++i) w[i] = q[i], s[i] = std::fabs(q[i]);
    for (Index j = 0; j < n; ++j) {
      if (z[j] == 0.0) continue;
      for (int p = start[j]; p < start[j + 1]; ++p) {
        const double t = value[p] * z[j];
        w[row[p]] += t;
        s[row[p]] += std::fabs(t);
      }
    }
  }
};

/// The rows of a matrix for Relaxation: a force acts on all rows through its column.
template <class Matrix>
class MatrixRows {
 public:
  static constexpr double worth_steps = 80.0;

  /// Begins with the forces u.z.
  void start(const Matrix& m, const Unknowns& u, double fraction) {
    m_ = m;
    q_ = u.q;
    z_ = u.z;
    unit_ = u.unit;
    inverse_ = unit_.square();
    const double largest = std::max(0.0, -(q_ * unit_).minCoeff());
    base_ = q_.abs() * inverse_ + std::numeric_limits<double>::epsilon() / fraction * largest * unit_;
    gather();
  }

  Index near() const { return m_.n; }
  bool widen() const { return false; }
  double force(Index i) const { return z_[i]; }
  void set_force(Index i, double z) { z_[i] = z; }
  double unit(Index i) const { return unit_[i]; }
  double gap(Index i) const { return q_[i] + image_[i]; }
  const Eigen::ArrayXd& forces() const { return z_; }

  void gather() {
    image_.setZero(m_.n);
    for (Index i = 0; i < m_.n; ++i)
      if (z_[i] != 0.0) m_.add_column(i, z_[i], image_.data());
  }

  double energy() const { return 0.5 * (z_ * (2.0 * q_ + image_)).sum(); }

  template <bool Measured>
  double relax() {
    double most = 0.0;
    for (Index i = 0; i < m_.n; ++i) {
      const double next = std::max(z_[i] - gap(i) * inverse_[i], 0.0), step = next - z_[i];
      if (step == 0.0) continue;
      m_.add_column(i, step, image_.data());
      z_[i] = next;
      if (Measured) most = std::max(most, std::fabs(step) / (base_[i] + next));
    }
    return most;
  }

  void measure(Residual& r) const {
    r.resize(m_.n);
    r.z = z_;
    r.unit = unit_;
    m_.multiply(q_.data(), z_.data(), r.w.data(), r.s.data());
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
      sums_ = {rows.m_, rows.unit_.data(), face.data(), sum_.data()};
    }
    void clear() { sum_.setZero(); }
    const Sums& sums() const { return sums_; }

   private:
    Eigen::ArrayXd sum_;
    Sums sums_{};
  };

 private:
  Matrix m_;
  Eigen::ArrayXd q_, z_, unit_, inverse_, base_, image_;  ///< base: what steps of z are compared with, but for z; image: M z
};

}  // namespace dembark::lcp
