// Steps with many coupled contacts: which candidates are solved for, and by which way of solving.
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <vector>
#include "catch.hpp"

#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;
using Catch::WithinAbs;

namespace {

Settings two_materials(double dt, double theta, double mu, double contact_damping = 0.0) {
  Settings s;
  s.dt = dt;
  s.theta = theta;
  s.materials = {{1e7, 0.0}, {5e7, 0.0}};
  s.pairs.assign(4, PairLaw());
  for (PairLaw& p : s.pairs) {
    p.friction.static_friction = p.friction.kinetic_friction = mu;
    p.contact_damping = contact_damping;
  }
  return s;
}

/// A lattice of triangles whose neighbours overlap or miss each other by `gap`, at random.
std::vector<Body> lattice(int columns, int rows, double gap, bool tilted, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Body> bodies;
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j) {
      Body b;
      b.id = std::int64_t(bodies.size());
      b.radius = 0.05;
      b.mass = 20.0 + 10.0 * unit(random);
      b.inertia = cylinder_inertia(b.mass, b.radius);
      const double x = 0.1 * (i + 0.5 * (j % 2)) + gap * unit(random), y = 0.0866 * j + gap * unit(random);
      b.position = {tilted ? 0.8 * x : x, y, tilted ? 0.6 * x : 0.0};
      b.velocity = {0.5 * unit(random), 0.5 * unit(random), tilted ? 0.5 * unit(random) : 0.0};
      b.force = {0.0, -b.mass * g, 0.0};
      bodies.push_back(b);
    }
  return bodies;
}

std::unique_ptr<Scene> crowd_in_a_drum(double dt, double theta, double mu) {
  std::vector<Body> bodies = crowd(80);
  for (Body& b : bodies) b.material = 0;
  auto scene = std::make_unique<Scene>(two_materials(dt, theta, mu), bodies);
  Drum drum;
  drum.material = 1;
  drum.stiffness = 5e7;
  drum.omega = 3.0;
  scene->drums.push_back(drum);
  return scene;
}

/// The same step by two systems.
struct Both {
  StepReport report[2];
  std::vector<Vec3<double>> force[2], torque[2];
  Both(System& one, System& two, const std::vector<Body>& bodies, const std::vector<Contact>& contacts) {
    for (int k = 0; k < 2; ++k) {
      force[k].resize(bodies.size());
      torque[k].resize(bodies.size());
      report[k] = (k ? two : one).step(bodies, contacts, 0.0, 1.0, force[k], torque[k]);
    }
  }
};

/// Entries that the elimination of symmetric sets of neighbours adds, in the given order.
std::size_t fill_in(std::vector<std::set<int>> neighbours, const std::vector<int>& order) {
  std::size_t added = 0;
  for (const int i : order) {
    const std::set<int> around = neighbours[std::size_t(i)];
    for (const int j : around) {
      neighbours[std::size_t(j)].erase(i);
      for (const int k : around)
        if (k != j && neighbours[std::size_t(j)].insert(k).second) ++added;
    }
  }
  return added / 2;
}

std::vector<std::set<int>> neighbours_of(const std::vector<Row>& rows) {
  std::vector<std::set<int>> out(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const auto touches = [&](int body) { return body >= 0 && (rows[j].a == body || rows[j].b == body); };
      if (i != j && (touches(rows[i].a) || touches(rows[i].b))) out[i].insert(int(j));
    }
  return out;
}

std::vector<int> arranged(const std::vector<Row>& rows, std::size_t bodies) {
  std::vector<int> order(rows.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = int(i);
  EliminationOrder().arrange(rows, bodies, order);
  REQUIRE(std::set<int>(order.begin(), order.end()).size() == rows.size());
  REQUIRE(order.size() == rows.size());
  return order;
}

/// A problem of its own: the neighbours of a lattice, every gap by chance, the last body a wall.
struct Problem {
  std::vector<Row> rows;
  std::vector<BodyResponse> response;
  double scale;  ///< s^2
  Eigen::VectorXd q;
  const double share = lcp::rounding_share(1e-12);
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

TEST_CASE("relaxation and the exact solver find the same forces, in the plane and out of it") {
  for (const bool tilted : {false, true})
    for (const double mu : {0.0, 0.4}) {
      const std::vector<Body> bodies = lattice(8, 8, 2e-4, tilted, 3);
      std::vector<Contact> contacts;
      find_pairs(bodies, 1e-3, contacts);
      Settings settings = two_materials(2e-4, 0.5, mu, 300.0);
      System relaxing(settings);
      settings.lcp.method = LcpMethod::block;
      System exact(settings);
      const Both both(relaxing, exact, bodies, contacts);
      const StepReport &a = both.report[0], &b = both.report[1];
      CHECK(a.contacts > 100);
      CHECK(a.active > 30);
      CHECK(a.active == b.active);
      CHECK(a.block_steps == 0);  // so it was relaxed
      CHECK(b.block_steps > 0);
      CHECK(a.certificate < 1e-14);
      // Friction knows the normal forces between its sweeps to four digits.
      const double close = mu > 0.0 ? 1e-5 : 1e-11;
      REQUIRE(relaxing.contacts().size() == exact.contacts().size());
      for (std::size_t i = 0; i < exact.contacts().size(); ++i) {
        CHECK(std::fabs(relaxing.contacts()[i].normal_force - exact.contacts()[i].normal_force) < close * b.peak_force);
        if (mu == 0.0) CHECK(std::fabs(relaxing.contacts()[i].opening - exact.contacts()[i].opening) < 1e-15);
      }
      for (std::size_t i = 0; i < bodies.size(); ++i) CHECK(norm(both.force[0][i] - both.force[1][i]) < close * b.peak_force);
    }
}

TEST_CASE("strongly coupled contacts: elimination finds the forces of the block method") {
  for (const double dt : {6e-3, 2e-2})
    for (const bool tilted : {false, true}) {
      const std::vector<Body> bodies = lattice(12, 10, 1e-4, tilted, 5);
      std::vector<Contact> contacts;
      find_pairs(bodies, 2e-2, contacts);
      Settings settings = two_materials(dt, 1.0, 0.0, 300.0);
      System eliminating(settings);
      settings.lcp.method = LcpMethod::block;
      System exact(settings);
      const Both both(eliminating, exact, bodies, contacts);
      const StepReport &a = both.report[0], &b = both.report[1];
      CHECK(b.active > 60);
      CHECK(a.active == b.active);
      CHECK(a.certificate < 1e-14);
      for (std::size_t i = 0; i < bodies.size(); ++i) CHECK(norm(both.force[0][i] - both.force[1][i]) < 1e-10 * b.peak_force);
    }
}

TEST_CASE("elimination from any set finds the solution of the solver, or says that it has not") {
  std::mt19937 random(2);
  int solved = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const Problem p(6, 1e-4, trial % 2 == 1, unsigned(trial));
    std::vector<char> active(p.rows.size());
    for (std::size_t i = 0; i < active.size(); ++i)
      active[i] = trial % 3 == 0 ? 0 : trial % 3 == 1 ? p.q[Eigen::Index(i)] < 0.0 : random() % 2 != 0;
    Eigen::VectorXd z(p.q.size()), w(p.q.size());
    double certificate = 1.0;
    int steps = 0;
    if (!Elimination().solve(p.rows, p.response, p.scale, p.share, p.q, active, z, w, certificate, steps)) continue;
    ++solved;
    p.check(z, w, certificate);
    LcpSolver solver;
    const LcpResult& result = solver.solve(p.matrix(), p.q);
    CHECK((z - result.z).norm() <= 1e-10 * result.z.norm());
    CHECK((w - result.w).norm() <= 1e-10 * p.q.norm());
    for (Eigen::Index i = 0; i < z.size(); ++i) CHECK((z[i] > 0.0) == (result.z[i] > 0.0));
  }
  CHECK(solved > 25);
  // A matrix without compliance and with more contacts than the bodies can move is singular: refused, not solved wrongly.
  std::vector<Row> rows(3);
  for (Row& r : rows) r.normal = {1.0, 0.0, 0.0};
  std::vector<BodyResponse> response(1);
  response[0].inverse = 1.0;
  std::vector<char> active(3, 1);
  Eigen::VectorXd q = Eigen::VectorXd::Constant(3, -1.0), z(3), w(3);
  double certificate = 0.0;
  int steps = 0;
  CHECK_FALSE(Elimination().solve(rows, response, 1.0, 1e-14, q, active, z, w, certificate, steps));
}

TEST_CASE("sweeps and conjugate gradients find the solution of the solver, however strongly contacts are coupled") {
  int unaided = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const double scale = std::pow(10.0, trial / 5 - 4);  // (omega tau)^2 = scale / (mass compliance): 25 ... 2.5e8
    const Problem p(trial % 4 < 2 ? 6 : 12, scale, trial % 2 == 1, unsigned(trial));
    Eigen::VectorXd z = Eigen::VectorXd::Zero(p.q.size()), w(p.q.size());
    if (trial % 3 > 0) z = p.q.cwiseMax(0.0) * (trial % 3 == 1 ? 1e6 : 1e9);  // begins far off
    double certificate = 1.0;
    Relaxation relaxation;
    relaxation.prepare(p.rows, p.response, p.scale);
    const bool soon = relaxation.solve(p.q, p.share, z, w, certificate);
    unaided += soon;
    CAPTURE(trial, scale, soon);
    REQUIRE((soon || relaxation.finish(p.share, z, w, certificate)));
    p.check(z, w, certificate);
    // And the solver for any matrix, which goes the same way where block pivots stall, from dense and from sparse columns.
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
  CHECK(result.guarded);
  CHECK(result.pivots == 0);
  CHECK(result.certificate.worst() < 1e-14);
  options.method = LcpMethod::energy;
  const LcpResult& published = pivots.solve(full, p.q, options);
  CHECK(published.pivots > 100);
  CHECK((result.z - published.z).norm() <= 1e-9 * published.z.norm());
}

TEST_CASE("equal logs packed tightly and a long step, where pivots take turns without end") {
  const std::vector<Body> bodies = lattice(20, 20, 1e-6, false, 7);
  std::vector<Contact> contacts;
  find_pairs(bodies, 2e-2, contacts);
  for (const double dt : {0.05, 0.2, 1.0}) {
    System system(two_materials(dt, 1.0, 0.0));
    std::vector<Vec3<double>> force(bodies.size()), torque(bodies.size());
    const StepReport& report = system.step(bodies, contacts, 0.0, 1.0, force, torque);
    CHECK(report.active > 300);
    CHECK(report.certificate < 1e-14);
    CHECK(report.block_steps < 13);  // block pivots alone exchange the set a thousand times
    for (const ContactResult& c : system.contacts())
      CHECK((c.normal_force >= 0.0 && c.opening >= 0.0 && c.normal_force * c.opening == 0.0));
  }
}

TEST_CASE("the order of elimination: no fill on trees, not much more than minimum degree on a lattice") {
  std::mt19937 random(11);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Row> tree;
    for (int b = 1; b < 60; ++b) {
      Row r;
      r.a = int(random() % unsigned(b));
      r.b = b;
      tree.push_back(r);
      if (b % 5 == 0) {
        r.b = -1;
        tree.push_back(r);
      }
    }
    std::shuffle(tree.begin(), tree.end(), random);
    CHECK(fill_in(neighbours_of(tree), arranged(tree, 60)) == 0);
  }
  std::vector<Contact> contacts;
  const std::vector<Body> bodies = lattice(14, 14, 0.0, false, 1);
  find_pairs(bodies, 1e-3, contacts);
  std::vector<Row> rows;
  for (const Contact& c : contacts) {
    if (random() % 3 == 0) continue;
    Row r;
    r.a = c.a, r.b = c.b;
    rows.push_back(r);
  }
  const std::vector<std::set<int>> neighbours = neighbours_of(rows);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    entries.emplace_back(int(i), int(i), 1.0);
    for (const int j : neighbours[i]) entries.emplace_back(int(i), j, 1.0);
  }
  Eigen::SparseMatrix<double> pattern(Eigen::Index(rows.size()), Eigen::Index(rows.size()));
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> amd;
  Eigen::AMDOrdering<int>()(pattern, amd);
  const std::vector<int> general(amd.indices().data(), amd.indices().data() + rows.size());
  CHECK(double(fill_in(neighbours, arranged(rows, bodies.size()))) < 1.3 * double(fill_in(neighbours, general)));
}

TEST_CASE("candidates beyond those that can close change nothing") {
  for (const double dt : {2e-4, 5e-3}) {
    const auto few_owner = crowd_in_a_drum(dt, 1.0, 0.4), all_owner = crowd_in_a_drum(dt, 1.0, 0.4);
    Scene &few = *few_owner, &all = *all_owner;
    all.reach = 3.0;
    for (int i = 0; i < 300; ++i) {
      few.forces();
      all.forces();
      REQUIRE(all.system().report().contacts >= 80 * 79 / 2);
      REQUIRE(few.system().report().contacts < all.system().report().contacts);
      REQUIRE(few.system().contacts().size() == all.system().contacts().size());
      REQUIRE(same_bits(few.system().state(), all.system().state()));
      few.advance();
      all.advance();
    }
  }
}

TEST_CASE("no pair closes unseen, however large the step") {
  for (const double dt : {1e-3, 2e-2}) {
    const auto owner = crowd_in_a_drum(dt, 1.0, 0.3);
    Scene& scene = *owner;
    int seen = 0;
    double closest = 0.0;
    for (int i = 0; i < 200; ++i) {
      scene.forces();
      std::set<std::pair<int, int>> rows;
      for (const ContactResult& c : scene.system().contacts()) rows.insert({c.a, c.b});
      std::vector<Vec3<double>> normals;
      std::vector<double> gaps;
      std::vector<std::pair<int, int>> left_out;
      const std::vector<Body> before = scene.bodies();
      for (std::size_t a = 0; a < before.size(); ++a)
        for (std::size_t b = a + 1; b < before.size(); ++b) {
          if (rows.count({int(a), int(b)})) continue;
          const Vec3<double> apart = before[a].position - before[b].position;
          left_out.emplace_back(int(a), int(b));
          normals.push_back(apart * (1.0 / norm(apart)));
          gaps.push_back(norm(apart) - before[a].radius - before[b].radius);
        }
      seen += scene.system().report().active;
      scene.advance();
      const std::vector<Body>& after = scene.bodies();
      for (std::size_t k = 0; k < left_out.size(); ++k) {
        const auto [a, b] = left_out[k];
        const Vec3<double> gain = after[std::size_t(a)].position - before[std::size_t(a)].position -
                                  (after[std::size_t(b)].position - before[std::size_t(b)].position);
        closest = std::min(closest, gaps[k] + dot(gain, normals[k]));
      }
    }
    CHECK(closest > -1e-12);
    CHECK(seen > 1000);
  }
}

TEST_CASE("a body that is knocked on reaches the next one within the step") {
  Settings s;
  s.dt = 1e-2;
  std::vector<Body> logs(3);
  const double at[3] = {0.0, 0.21, 0.43};
  for (int i = 0; i < 3; ++i) {
    logs[std::size_t(i)].id = i;
    logs[std::size_t(i)].mass = i == 0 ? 1000.0 : 10.0;
    logs[std::size_t(i)].radius = 0.1;
    logs[std::size_t(i)].position = {at[i], 0, 0};
  }
  logs[0].velocity = {5.0, 0, 0};
  Scene scene(s, logs);
  scene.reach = 0.1;
  scene.forces();
  REQUIRE(scene.system().contacts().size() == 2);
  CHECK(scene.system().contacts()[1].normal_force > 0.0);
  CHECK(scene.system().report().certificate < 1e-14);
  const double pushed = scene.system().contacts()[1].normal_force / 5e6;  // what the springs give
  scene.advance();
  CHECK_THAT(scene.bodies()[2].position.x - scene.bodies()[1].position.x, WithinAbs(0.2 - pushed, 1e-12));

  // The same pair listed twice is found out only then; the step leaves no trace.
  System system(s);
  std::vector<Contact> contacts;
  find_pairs(logs, 0.1, contacts);
  REQUIRE(contacts.size() == 2);
  std::vector<Vec3<double>> force(3), torque(3);
  std::vector<Body> still = logs;
  still[0].velocity = {};
  system.step(still, contacts, 0.0, 1.0, force, torque);
  const std::vector<double> before = system.state();
  contacts.push_back(contacts[1]);
  CHECK_THROWS_WITH(system.step(logs, contacts, 1e-2, 1.0, force, torque), Catch::Contains("twice"));
  CHECK(same_bits(system.state(), before));
  CHECK_THROWS_WITH(system.step(logs, contacts, 0.0, 1.0, force, torque), Catch::Contains("twice"));
  CHECK(same_bits(system.state(), before));
}

TEST_CASE("bodies that fly apart are searched for what lies beyond the first reach") {
  Settings s;
  s.dt = 1e-2;
  std::vector<Body> logs(3);
  const double at[3] = {0.0, 0.18, 0.385};  // the first two overlap by 20 mm; nothing moves yet, so the search begins with 1 mm
  for (int i = 0; i < 3; ++i) {
    logs[std::size_t(i)].id = i;
    logs[std::size_t(i)].mass = 10.0;
    logs[std::size_t(i)].radius = 0.1;
    logs[std::size_t(i)].position = {at[i], 0, 0};
  }
  REQUIRE(default_reach(logs, s.dt) < 2e-3);
  Scene scene(s, logs);
  scene.forces();
  REQUIRE(scene.system().contacts().size() == 2);
  const ContactResult beyond = scene.system().contacts()[1];
  CHECK(beyond.normal_force > 0.0);
  scene.advance();
  CHECK_THAT(scene.bodies()[2].position.x - scene.bodies()[1].position.x, WithinAbs(0.2 - beyond.normal_force / 5e6, 1e-12));
}
