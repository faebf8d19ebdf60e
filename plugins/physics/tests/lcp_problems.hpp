// Problems and conditions that the tests of the LCP solver share.
#pragma once

#include <random>

#include "dembark/energy_lcp.hpp"

namespace lcp_problems {

using namespace dembark;

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

const LcpMethod exact[] = {LcpMethod::automatic, LcpMethod::energy, LcpMethod::block, LcpMethod::murty};

/// Largest violation of the conditions, scaled to a unit diagonal and by what is added up; own arithmetic, not the solver's.
inline double violation(const Matrix& M, const Vector& q, const LcpResult& r) {
  const Vector root = M.diagonal().cwiseSqrt();
  const Vector w = M * r.z + q;
  const double most = ((q.cwiseAbs() + M.cwiseAbs() * r.z).array() / root.array()).maxCoeff();
  if (most == 0.0) return 0.0;
  const double worst =
      std::max({0.0, -r.z.minCoeff(), -(w.array() / root.array()).minCoeff() / most, std::fabs(r.z.dot(w)) / (most * most)});
  return std::max(worst, ((w - r.w).array() / root.array()).abs().maxCoeff() / most);
}

struct Problems {
  std::mt19937 random{7};
  std::normal_distribution<double> normal;

  Matrix definite(int n, double shift) {
    Matrix G(n, n);
    for (int i = 0; i < n * n; ++i) G.data()[i] = normal(random);
    Matrix M = G * G.transpose() / n;
    M.diagonal().array() += shift;
    return M;
  }
  Vector vector(int n) {
    Vector q(n);
    for (int i = 0; i < n; ++i) q[i] = normal(random);
    return q;
  }
  std::vector<char> flags(int n) {
    std::vector<char> f(static_cast<std::size_t>(n));
    for (char& x : f) x = char(random() % 2);
    return f;
  }
};

inline Eigen::SparseMatrix<double> sparse(const Matrix& M) { return Eigen::SparseMatrix<double>(M.sparseView()); }

/// A band of the given width with a little randomness: one island that is sparse.
inline Matrix band(int n, int width, Problems& p) {
  Matrix M = Matrix::Zero(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = std::max(0, i - width); j < i; ++j) M(i, j) = M(j, i) = 0.3 * p.normal(p.random);
  for (int i = 0; i < n; ++i) M(i, i) = 0.1 + M.row(i).cwiseAbs().sum();
  return M;
}

}  // namespace lcp_problems
