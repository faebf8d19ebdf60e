// The LCP solver: published examples, conditions on random problems of all kinds, factors, refusals.
#include "catch.hpp"

#include "lcp_problems.hpp"

using namespace dembark;
using namespace lcp_problems;

TEST_CASE("published examples of the energy criterion, with their number of pivots") {
  Matrix M(4, 4);
  Vector q(4), z(4), w(4);
  LcpSolver solver;
  for (const LcpMethod method : {LcpMethod::automatic, LcpMethod::energy}) {
    LcpOptions options;
    options.method = method;
    M << 4, -1, 0, 0, -1, 4, -1, 0, 0, -1, 4, -1, 0, 0, -1, 4;
    q << -4, 3, -4, 2;
    const LcpResult& r = solver.solve(M, q, options);
    z << 1, 0, 1, 0;
    w << 0, 1, 0, 1;
    CHECK((r.z - z).norm() < 1e-15);
    CHECK((r.w - w).norm() < 1e-15);
    CHECK(r.pivots == 2);

    M << 100, -2, -3, -4, -2, 50, -6, -7, -3, -6, 100, -11, -4, -7, -11, 200;  // p_2 = p_4: a tie
    q << 1, -2, 3, -4;
    solver.solve(sparse(M), q, options);
    z << 0, 0.043011, 0, 0.021505;
    w << 0.827957, 0, 2.505376, 0;
    CHECK((r.z - z).norm() < 1e-6);
    CHECK((r.w - w).norm() < 1e-6);
    CHECK(r.pivots == 2);

    M << 4, -1, 2, 0, -1, 4, -1, 0, 2, -1, 4, -1, 0, 0, -1, 4;
    q << -4, 1, -2, 0;
    solver.solve(M, q, options);
    CHECK((r.z - Vector::Unit(4, 0)).norm() < 1e-15);
    CHECK(r.w.norm() == 0.0);  // degenerate
    CHECK(r.pivots == 1);
    CHECK_FALSE(r.used_fallback);
  }
}

TEST_CASE("every method fulfils the conditions, dense and sparse, cold and from any start") {
  Problems p;
  LcpSolver solver;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + int(p.random() % (trial % 10 == 0 ? 90 : 12));
    Matrix M = p.definite(n, std::pow(10.0, -double(p.random() % 10)));
    Vector q = p.vector(n);
    if (trial % 4 == 0) q = (2.0 * q).array().round();  // ties and degenerate rows
    if (trial % 3 == 0) {                               // rows in very different units
      Vector units(n);
      for (int i = 0; i < n; ++i) units[i] = std::pow(10.0, double(p.random() % 12) - 6.0);
      M = (units.asDiagonal() * M * units.asDiagonal()).eval();
      q = units.asDiagonal() * q;
    }
    for (const LcpMethod method : exact) {
      LcpOptions options;
      options.method = method;
      const std::vector<char> start = p.flags(n);
      for (const std::vector<char>* from : {static_cast<const std::vector<char>*>(nullptr), &start}) {
        const LcpResult dense = solver.solve(M, q, options, from), columns = solver.solve(sparse(M), q, options, from);
        for (const LcpResult* r : {&dense, &columns}) {
          CHECK(violation(M, q, *r) < 1e-13);
          CHECK(r->certificate.worst() < 1e-13);
          CHECK(r->status == LcpStatus::solved);
        }
      }
    }
  }
}

TEST_CASE("sparse islands: all methods agree, the order is used again, a warm start at the answer needs no step") {
  Problems p;
  const int n = 150;
  Matrix M = Matrix::Zero(n + 61, n + 61);
  M.topLeftCorner(n, n) = band(n, 4, p);
  M.bottomRightCorner(61, 61) = band(61, 2, p);
  const Vector q = p.vector(n + 61);
  LcpSolver solver;
  const Vector z = solver.solve(sparse(M), q).z;
  for (const LcpMethod method : {LcpMethod::automatic, LcpMethod::energy, LcpMethod::block, LcpMethod::murty, LcpMethod::pgs}) {
    LcpOptions options;
    options.method = method;
    for (const double factor : {1.0, 2.0}) {
      const LcpResult& r = solver.solve(sparse(factor * M), factor * q, options);
      CHECK(r.islands == 2);
      CHECK(violation(factor * M, factor * q, r) < 1e-12);
      CHECK((r.z - z).cwiseAbs().maxCoeff() < 1e-10);
    }
    std::vector<char> start(std::size_t(z.size()));
    for (Eigen::Index i = 0; i < z.size(); ++i) start[std::size_t(i)] = z[i] > 0.0;
    if (method == LcpMethod::pgs) continue;
    CHECK(solver.solve(sparse(M), q, options, &start).pivots + solver.solve(sparse(M), q, options, &start).block_steps == 0);
    for (int i = 0; i < 5; ++i) start[p.random() % start.size()] ^= 1;
    CHECK((solver.solve(sparse(M), q, options, &start).z - z).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("rows of the active factor follow inserts and removals like the transformed system itself") {
  Problems p;
  const int n = 20;
  const Matrix M = p.definite(n, 0.1);
  const Vector q = p.vector(n);
  const lcp::Matrix block = lcp::dense_matrix(M.data(), n);
  lcp::ActiveFactor factor;
  factor.clear(block, q.data());
  std::vector<char> active(n, 0);
  for (int step = 0; step < 200; ++step) {
    const int i = int(p.random() % n);
    if (active[std::size_t(i)]) factor.remove(i);
    else factor.insert(block, i);
    active[std::size_t(i)] ^= 1;
    Matrix T = M;  // identity rows and columns outside of the set leave M_AA^{-1} inside
    Vector right = -q;
    for (int a = 0; a < n; ++a)
      if (!active[std::size_t(a)]) T.row(a) = T.col(a) = Vector::Unit(n, a), right[a] = 0.0;
    const Matrix inverse = T.inverse();
    const Vector z = inverse * right, w = M * z + q;
    for (int a = 0; a < n; ++a) {
      Vector column = M.col(a);
      for (int b = 0; b < n; ++b)
        if (!active[std::size_t(b)]) column[b] = 0.0;
      const bool in = active[std::size_t(a)];
      CHECK(factor.value(a) == Approx(in ? z[a] : w[a]).margin(1e-11));
      CHECK(factor.diagonal(a) == Approx(in ? inverse(a, a) : M(a, a) - column.dot(inverse * column)).epsilon(1e-10));
    }
  }
}

TEST_CASE("factors of an active set solve its equations and leave the rest alone") {
  Problems p;
  const int n = 80;
  const Matrix M = band(n, 5, p);
  const Eigen::SparseMatrix<double> S = sparse(M);
  const Vector diagonal = M.diagonal();
  const lcp::Matrix columns{n, S.valuePtr(), diagonal.data(), S.outerIndexPtr(), S.innerIndexPtr()};
  lcp::Factor dense;
  lcp::Factor factor;
  for (int trial = 0; trial < 30; ++trial) {
    const std::vector<char> active = trial == 0 ? std::vector<char>(n, 0) : p.flags(n);
    dense.compute(lcp::dense_matrix(M.data(), n), active);
    factor.compute(columns, active);
    const Eigen::ArrayXd right = p.vector(n).array();
    Eigen::ArrayXd a = Eigen::ArrayXd::Zero(n), b = a;
    dense.add_solution(right, a);
    factor.add_solution(right, b);
    CHECK((a - b).abs().maxCoeff() < 1e-12);
    double residual = 0.0;
    const Vector product = M * b.matrix();
    for (int i = 0; i < n; ++i) residual = std::max(residual, active[std::size_t(i)] ? std::fabs(product[i] - right[i]) : std::fabs(b[i]));
    CHECK(residual < 1e-13);
  }
}

TEST_CASE("block steps that go round begin elsewhere, then give way to single pivots, and say so") {
  Matrix M(5, 5);
  M << 79, 6, 38, -5, 28, 6, 118, 11, 83, -82, 38, 11, 66, -3, 4, -5, 83, -3, 88, -37, 28, -82, 4, -37, 99;
  Vector q(5);
  q << -1, -2, -1, 0, 2;
  const std::vector<char> start{1, 0, 0, 0, 1};
  LcpOptions options;
  options.method = LcpMethod::block;
  LcpSolver solver;
  const LcpResult& r = solver.solve(M, q, options, &start);
  CHECK(r.used_fallback);
  CHECK(violation(M, q, r) < 1e-14);

  CHECK(r.pivots == 0);
  CHECK(r.block_steps > 4);

  // Single pivots, where there is no other place to begin from.
  const Eigen::SparseMatrix<double> S = sparse(M);
  const Vector diagonal = M.diagonal();
  const lcp::Matrix block{5, S.valuePtr(), diagonal.data(), S.outerIndexPtr(), S.innerIndexPtr()};
  lcp::Unknowns u;
  u.reset(block);
  u.q = q;
  u.active = start;
  lcp::ActiveSet steps;
  const lcp::Outcome outcome = steps.run(block, u, options, nullptr);
  CHECK(outcome.used_fallback);
  CHECK(outcome.pivots > 0);
  for (Eigen::Index i = 0; i < 5; ++i) CHECK(u.z[i] == Approx(r.z[i]).margin(1e-15));
}

TEST_CASE("limits of iterations are reported, projected Gauss-Seidel stops at its tolerance") {
  Problems p;
  const Matrix M = p.definite(60, 0.1);
  const Vector q = p.vector(60);
  LcpSolver solver;
  LcpOptions options;
  for (const LcpMethod method : {LcpMethod::energy, LcpMethod::murty, LcpMethod::pgs}) {
    options.method = method;
    options.max_iterations = 2;
    const LcpResult& r = solver.solve(M, q, options);
    CHECK(r.status == LcpStatus::iteration_limit);
    CHECK(r.pivots == 2);
    options.max_iterations = 0;
    CHECK(solver.solve(M, q, options).status == LcpStatus::solved);
    CHECK(r.certificate.worst() < 1e-12);
  }
  options.tolerance = 1e-3;
  const int few = solver.solve(M, q, options).pivots;
  options.tolerance = 1e-12;
  CHECK(few < solver.solve(M, q, options).pivots);
}

TEST_CASE("bad input is refused with one line that names the entry") {
  using Catch::Contains;
  LcpSolver solver;
  const Vector q = Vector::Constant(2, -1.0);
  Matrix M(2, 2);
  const auto refuses = [&](double a, double b, double c, double d, const std::string& line) {
    M << a, b, c, d;
    for (const LcpMethod method : {LcpMethod::automatic, LcpMethod::energy, LcpMethod::block, LcpMethod::murty, LcpMethod::pgs}) {
      LcpOptions options;
      options.method = method;
      CHECK_THROWS_WITH(solver.solve(M, q, options), Contains(line) && !Contains("\n"));
      CHECK_THROWS_WITH(solver.solve(sparse(M), q, options), Contains(line) && !Contains("\n"));
    }
  };
  refuses(2, 1, 0.5, 2, "M is not symmetric: M[0,1] = 1 but M[1,0] = 0.5");
  refuses(2, 0, 0.5, 2, "M is not symmetric: M[0,1] = 0 but M[1,0] = 0.5");
  refuses(1, 2, 2, 1, "M is not positive definite: its Cholesky pivot in row 1 is -3 with M[1,1] = 1");
  refuses(1, 1, 1, 1, "M is not positive definite: its Cholesky pivot in row 1 is 0 with M[1,1] = 1");
  refuses(1, 0, 0, -2, "M is not positive definite: M[1,1] = -2 must be > 0");
  refuses(1, 0, 0, std::nan(""), "M[1,1] is nan");
  refuses(1, INFINITY, INFINITY, 1, "is inf; every entry must be a finite number");
  M = Matrix::Identity(2, 2);
  CHECK_THROWS_WITH(solver.solve(M, Vector::Zero(3)), Contains("q must have one entry per row of M, 2, not 3"));
  CHECK_THROWS_WITH(solver.solve(Matrix(2, 3), q), Contains("M must be square, not 2 x 3"));
  CHECK_THROWS_WITH(solver.solve(M, Vector::Constant(2, std::nan(""))), Contains("q[0] is nan"));
  const std::vector<char> start(3);
  CHECK_THROWS_WITH(solver.solve(M, q, {}, &start), Contains("start must have one flag per unknown, 2, not 3"));
  LcpOptions options;
  options.tolerance = 0.0;
  CHECK_THROWS_WITH(solver.solve(M, q, options), Contains("tolerance must be between 0 and 1, not 0"));
  CHECK(solver.solve(M, q).z.isApprox(Vector::Ones(2)));  // and the solver still works

  // Definiteness is asked of the whole matrix, not of the block that the answer needs.
  for (const bool large : {false, true}) {
    const int n = large ? 200 : 4;
    Matrix B = Matrix::Identity(n, n) * 2.0;
    for (int i = 0; i + 1 < n; ++i) B(i, i + 1) = B(i + 1, i) = i == 2 ? 2.5 : 0.5;
    CHECK_THROWS_WITH(solver.solve(sparse(B), Vector::Ones(n)), Contains("not positive definite"));
    CHECK_THROWS_WITH(solver.solve(B, Vector::Ones(n)), Contains("not positive definite"));
    LcpOptions trusting;
    trusting.check_input = false;
    CHECK(solver.solve(B, Vector::Ones(n), trusting).z.norm() == 0.0);
  }
}

TEST_CASE("a factor on M, on q or on both changes neither the steps nor a digit of the answer, or it is refused") {
  Problems p;
  for (const int n : {1, 2, 12, 60}) {
    const Matrix M = n == 60 ? band(n, 3, p) : p.definite(n, 0.1);
    const Vector q = p.vector(n);
    for (const LcpMethod method : {LcpMethod::automatic, LcpMethod::energy, LcpMethod::block, LcpMethod::murty, LcpMethod::pgs}) {
      LcpOptions options;
      options.method = method;
      LcpSolver solver;
      const LcpResult plain = solver.solve(M, q, options);
      // All such powers that leave numbers with all their digits.
      for (const int on_m : {-940, -600, 0, 600, 980})
        for (const int on_q : {-1000, -600, -20, 0, 600, 1000}) {
          if (std::abs(on_q - on_m) > 1000) continue;
          const LcpResult r = solver.solve(M * std::ldexp(1.0, on_m), q * std::ldexp(1.0, on_q), options);
          CAPTURE(n, int(method), on_m, on_q);
          CHECK(r.z * std::ldexp(1.0, on_m - on_q) == plain.z);
          CHECK(r.w * std::ldexp(1.0, -on_q) == plain.w);
          CHECK(r.pivots == plain.pivots);
          CHECK(r.certificate.worst() == plain.certificate.worst());
          CHECK(r.certificate.worst() < 1e-11);
        }
    }
  }
  using Catch::Contains;
  LcpSolver solver;
  const Matrix one = Matrix::Identity(2, 2);
  const Vector q = Vector::Constant(2, -1.0);
  CHECK_THROWS_WITH(solver.solve(1e-300 * one, q), Contains("M[0,0] = 1e-300") && Contains("must be at least 1e-290"));
  CHECK_THROWS_WITH(solver.solve(1e-280 * one, 1e100 * q), Contains("z[0]") && Contains("beyond"));
}

TEST_CASE("no unknowns and one") {
  LcpSolver solver;
  for (const LcpMethod method : exact) {
    LcpOptions options;
    options.method = method;
    CHECK(solver.solve(Matrix(0, 0), Vector(0), options).islands == 0);
    CHECK(solver.solve(Eigen::SparseMatrix<double>(0, 0), Vector(0), options).z.size() == 0);
    CHECK(solver.solve(Matrix::Constant(1, 1, 2.0), Vector::Constant(1, -3.0), options).z[0] == 1.5);
    CHECK(solver.solve(Matrix::Constant(1, 1, 2.0), Vector::Constant(1, 3.0), options).w[0] == 3.0);
  }
}
