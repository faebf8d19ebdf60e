// What the LCP solver proves of its matrices, one by one and in sequences.
#include "catch.hpp"

#include "lcp_problems.hpp"

using namespace dembark;
using namespace lcp_problems;

TEST_CASE("the cheap proof of definiteness never holds for a matrix that is not, and holds for a well conditioned one") {
  Problems p;
  lcp::DefiniteProof proof;
  for (const int n : {32, 45, 64, 130}) {
    const Matrix M = p.definite(n, 1.0);
    const lcp::Matrix block = lcp::dense_matrix(M.data(), n);
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) CHECK(proof.holds(block));
#endif
    // Less than nothing in one direction, on top of a spectrum from 1 up.
    for (const double least : {-1.0, -1e-3, -1e-6, -1e-12, 0.0}) {
      Eigen::SelfAdjointEigenSolver<Matrix> eigen(M);
      Vector values = eigen.eigenvalues();
      values[0] = least;
      Matrix bad = eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
      bad = 0.5 * (bad + bad.transpose()).eval();
      CHECK_FALSE(proof.holds(lcp::dense_matrix(bad.data(), n)));
    }
  }
}

TEST_CASE("a sequence of sparse matrices: what is near to a proven one is taken, what is not definite is refused at any place of it") {
  Problems p;
  const int n = 120;
  Matrix M = Matrix::Zero(n, n);  // definite, but not dominant
  for (int i = 0; i < n; ++i) {
    M(i, i) = 1.0;
    for (int j : {i - 2, i - 1})
      if (j >= 0) M(i, j) = M(j, i) = 0.3;
  }
  const Vector q = p.vector(n);
  LcpSolver solver;
  for (int step = 0; step < 6; ++step) {
    const Matrix near = M * (1.0 + 1e-4 * step);
    CHECK(violation(near, q, solver.solve(sparse(near), q)) < 1e-14);
    Matrix bad = near;
    bad(60, 61) = bad(61, 60) = 1.0;
    CHECK_THROWS_AS(solver.solve(sparse(bad), q), std::invalid_argument);
    bad(60, 61) = bad(61, 60) = std::nan("");
    CHECK_THROWS_AS(solver.solve(sparse(bad), q), std::invalid_argument);
  }
}

TEST_CASE("a sequence that goes over to a matrix that is not definite is refused from there on, however small its steps") {
  Problems p;
  const int n = 90;
  const Matrix M = band(n, 2, p);
  const double least = Eigen::SelfAdjointEigenSolver<Matrix>(M).eigenvalues()[0];
  const Vector q = p.vector(n);
  for (const double step : {0.3, 0.03, 0.003}) {
    LcpSolver solver;
    for (int k = 0; k * step < 1.5; ++k) {
      Matrix moved = M;
      moved.diagonal().array() -= k * step * least;
      CAPTURE(step, k);
      if (k * step < 0.999) CHECK(violation(moved, q, solver.solve(sparse(moved), q)) < 1e-13);
      if (k * step > 1.001) CHECK_THROWS_WITH(solver.solve(sparse(moved), q), Catch::Contains("not positive definite"));
    }
  }
}

TEST_CASE("matrices near to a proven one need no factor, others get one of their own") {
  Problems p;
  const int n = 60;
  Eigen::SparseMatrix<double> S = sparse(band(n, 2, p));
  const Vector diagonal = Matrix(S).diagonal();
  const lcp::Matrix columns{n, S.valuePtr(), diagonal.data(), S.outerIndexPtr(), S.innerIndexPtr()};
  lcp::DefiniteProof proof;
  lcp::DefiniteMargin margin;
  proof.check(columns, margin);
  CHECK(margin.base.size() == 0);  // one matrix is no sequence
  proof.check(columns, margin);
  REQUIRE(margin.base.size() == S.nonZeros());
  const Eigen::ArrayXd first = margin.base;
  S.coeffRef(1, 0) *= 1.0 + 1e-6, S.coeffRef(0, 1) *= 1.0 + 1e-6;
  proof.check(columns, margin);
  CHECK((margin.base == first).all());
  for (int i = 0; i < n; ++i)
    for (int j : {i - 1, i + 1})
      if (j >= 0 && j < n) S.coeffRef(i, j) = 0.0;
  proof.check(columns, margin);
  CHECK_FALSE((margin.base == first).all());
}
