// The chain of solvers on contacts between bodies: without a matrix, and with the one that they stand for.
#include <cmath>
#include <random>
#include <utility>
#include <vector>
#include "catch.hpp"

#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;

namespace {

constexpr Lines<4>::Component all_axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};

/// A problem of its own: the neighbours of a lattice, every gap by chance, the last body a wall.
struct Problem {
  std::vector<Row> rows;
  std::vector<BodyResponse> response;
  double scale;  ///< s^2
  Eigen::VectorXd q;
  const double fraction = lcp::rounding_fraction(1e-12);
  static constexpr double compliance = 2e-7;

  Problem(int side, double scale_, bool tilted, unsigned seed) : scale(scale_) {
    const std::vector<Body> bodies = lattice(side, side, 1e-4, tilted, seed);
    response.resize(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) response[b].inverse = 1.0 / bodies[b].mass;
    std::vector<Contact> contacts;
    find_pairs(bodies, 1e-3, contacts);
    for (const Contact& c : contacts) {
      Row r;
      r.a = c.a, r.b = c.b == int(bodies.size()) - 1 ? -1 : c.b, r.normal = c.normal, r.compliance = compliance;
      rows.push_back(r);
    }
    std::mt19937 random(seed + 1000);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    q.resize(Eigen::Index(rows.size()));
    for (double& gap : q) gap = 1e-4 * (unit(random) - 0.5);
  }

  Eigen::MatrixXd matrix() const {
    Eigen::MatrixXd m = compliance * Eigen::MatrixXd::Identity(q.size(), q.size());
    for (Eigen::Index i = 0; i < q.size(); ++i)
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const Row &r = rows[std::size_t(i)], &o = rows[std::size_t(j)];
        for (const auto& [one, sign_one] : {std::pair(r.a, 1.0), std::pair(r.b, -1.0)})
          for (const auto& [two, sign_two] : {std::pair(o.a, 1.0), std::pair(o.b, -1.0)})
            if (one >= 0 && one == two)
              m(i, j) += scale * response[std::size_t(one)].inverse * sign_one * sign_two * dot(r.normal, o.normal);
      }
    return m;
  }

  /// The conditions of the problem, which has one solution.
  void check(const Eigen::VectorXd& z, const Eigen::VectorXd& w, double certificate) const {
    CHECK(certificate < 1e-14);
    CHECK(z.minCoeff() >= 0.0);
    CHECK(w.minCoeff() >= 0.0);
    CHECK(z.cwiseProduct(w).cwiseAbs().maxCoeff() == 0.0);
    CHECK((matrix() * z + q - w).norm() <= 1e-12 * q.norm());
  }
};

}  // namespace

TEST_CASE("the exact active set from any set is the solution") {
  std::mt19937 random(2);
  for (int trial = 0; trial < 30; ++trial) {
    const Problem p(6, 1e-4, trial % 2 == 1, unsigned(trial));
    std::vector<char> active(p.rows.size());
    for (std::size_t i = 0; i < active.size(); ++i)
      active[i] = trial % 3 == 0 ? 0 : trial % 3 == 1 ? p.q[Eigen::Index(i)] < 0.0 : random() % 2 != 0;
    const Eigen::MatrixXd m = p.matrix();
    const Eigen::SparseMatrix<double> columns = m.sparseView();
    LcpOptions options;
    options.method = LcpMethod::block;
    LcpSolver exact, solver;
    const LcpResult& found = exact.solve(columns, p.q, options, &active);
    p.check(found.z, found.w, found.certificate.worst());
    const LcpResult& result = solver.solve(m, p.q);
    CHECK((found.z - result.z).norm() <= 1e-10 * result.z.norm());
    CHECK((found.w - result.w).norm() <= 1e-10 * p.q.norm());
    for (Eigen::Index i = 0; i < found.z.size(); ++i) CHECK((found.z[i] > 0.0) == (result.z[i] > 0.0));
  }
  // A matrix without compliance and with more contacts than the bodies can move is singular: refused, not solved wrongly.
  const std::vector<char> active(3, 1);
  LcpOptions trusting;
  trusting.method = LcpMethod::block;
  trusting.check_input = false;
  const Eigen::MatrixXd singular = Eigen::MatrixXd::Ones(3, 3);
  CHECK_THROWS_WITH(LcpSolver().solve(singular, Eigen::VectorXd::Constant(3, -1.0), trusting, &active),
                    Catch::Contains("not positive definite"));
}

TEST_CASE("sweeps and conjugate gradients find the solution of the solver, however strongly contacts are coupled") {
  int unaided = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const double scale = std::pow(10.0, trial / 5 - 4);  // (omega tau)^2 = scale / (mass compliance): 25 ... 2.5e8
    const Problem p(trial % 4 < 2 ? 6 : 12, scale, trial % 2 == 1, unsigned(trial));
    Eigen::VectorXd z = Eigen::VectorXd::Zero(p.q.size()), w(p.q.size());
    if (trial % 3 > 0) z = p.q.cwiseMax(0.0) * (trial % 3 == 1 ? 1e6 : 1e9);  // begins far off
    lcp::Relaxation<Lines<4>> relaxation;
    relaxation.rows.prepare(p.rows, p.response, p.scale, all_axes);
    relaxation.rows.start(p.q, p.fraction, z);
    const bool soon = relaxation.solve(p.fraction);
    unaided += soon;
    CAPTURE(trial, scale, soon);
    REQUIRE((soon || relaxation.finish(p.fraction)));
    relaxation.rows.store(z);
    relaxation.rows.store_gaps(relaxation.residual(), w);
    p.check(z, w, relaxation.residual().certificate().worst());
    // And the solver for any matrix, which goes the same way, from dense and from sparse columns.
    const Eigen::MatrixXd m = p.matrix();
    const Eigen::SparseMatrix<double> sparse = m.sparseView();
    for (const bool dense : {true, false}) {
      LcpSolver solver;
      LcpOptions options;
      options.method = trial % 2 ? LcpMethod::block : LcpMethod::automatic;
      const LcpResult& result = dense ? solver.solve(m, p.q, options) : solver.solve(sparse, p.q, options);
      CHECK(result.status == LcpStatus::solved);
      CHECK(result.pivots + result.block_steps < 100);
      CHECK((z - result.z).norm() <= 1e-10 * result.z.norm());
      for (Eigen::Index i = 0; i < z.size(); ++i) CHECK((z[i] > 0.0) == (result.z[i] > 0.0));
    }
  }
  CHECK(unaided > 10);
}

TEST_CASE("descent where block pivots stall: a dense island, solved as the published rule solves it") {
  const Problem p(12, 10.0, false, 26);
  const Eigen::MatrixXd m = p.matrix();
  const Eigen::MatrixXd full = m + 1e-9 * Eigen::MatrixXd::Ones(m.rows(), m.cols());  // no zeros: taken as dense
  LcpSolver solver, pivots;
  LcpOptions options;
  options.method = LcpMethod::block;
  const LcpResult& result = solver.solve(full, p.q, options);
  CHECK(result.used_fallback);
  CHECK(result.pivots == 0);
  CHECK(result.certificate.worst() < 1e-14);
  options.method = LcpMethod::energy;
  const LcpResult& published = pivots.solve(full, p.q, options);
  CHECK(published.pivots > 100);
  CHECK((result.z - published.z).norm() <= 1e-9 * published.z.norm());
}

TEST_CASE("a step whose forces are not found ends with one line and leaves no trace") {
  const std::vector<Body> bodies = lattice(6, 6, 2e-4, false, 3);
  std::vector<Contact> contacts;
  find_pairs(bodies, 1e-3, contacts);
  Settings settings;
  settings.dt = 2e-2;
  std::vector<Vec3<double>> force(bodies.size()), torque(bodies.size());
  for (const LcpMethod method : {LcpMethod::energy, LcpMethod::murty, LcpMethod::pgs, LcpMethod::block}) {
    settings.lcp.method = method;
    settings.lcp.max_iterations = 0;
    System whole(settings);
    CHECK(step(whole, bodies, contacts, 0.0, 1.0, force, torque).active > 10);
    settings.lcp.max_iterations = 1;
    System limited(settings);
    const std::vector<double> before = limited.state();
    force.assign(bodies.size(), {});
    CHECK_THROWS_AS(step(limited, bodies, contacts, 0.0, 1.0, force, torque), UnsolvedStep);
    CHECK_THROWS_WITH(step(limited, bodies, contacts, 0.0, 1.0, force, torque),
                      Catch::Contains("contacts were not found: the LCP solver stopped at its limit of iterations (1), certificate") &&
                          !Catch::Contains("\n"));
    CHECK(same_bits(limited.state(), before));
    for (const Vec3<double>& f : force) CHECK(norm(f) == 0.0);
  }
}
