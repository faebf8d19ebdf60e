#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"

#include "dembark/sph/solver.hpp"

using namespace dembark;
using namespace dembark::sph;
using Catch::Contains;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

/// Points of a lattice in a box of so many, from the origin.
std::vector<Vector> lattice(int nx, int ny, int nz, double dx) {
  std::vector<Vector> x;
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < std::max(nz, 1); ++k) x.push_back({(i + 0.5) * dx, (j + 0.5) * dx, nz > 0 ? (k + 0.5) * dx : 0.0});
  return x;
}

/// Three layers around and under a plane tank of nx times ny.
std::vector<Vector> tank_walls(int nx, int ny, double dx) {
  std::vector<Vector> x;
  for (int i = -3; i < nx + 3; ++i)
    for (int j = -3; j < ny + 4; ++j)
      if (i < 0 || i >= nx || j < 0) x.push_back({(i + 0.5) * dx, (j + 0.5) * dx, 0.0});
  return x;
}

Settings plane_settings(double dx, double sound_speed) {
  Settings s;
  s.dimension = 2;
  s.spacing = dx;
  s.state.sound_speed = sound_speed;
  return s;
}

std::vector<Vector> random_velocities(std::size_t n, bool plane, double size) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-size, size);
  std::vector<Vector> v(n);
  for (Vector& each : v) each = {u(random), u(random), plane ? 0.0 : u(random)};
  return v;
}

/// A tank of still water, H = 0.2 m.
Solver tank(Settings s) {
  s.gravity = {0.0, -9.81, 0.0};
  const int nx = 16, ny = 10;
  std::vector<double> rho;
  const std::vector<Vector> x = lattice(nx, ny, 0, s.spacing);
  for (const Vector& p : x) rho.push_back(s.state.density_at(9810.0 * (ny * s.spacing - p.y)));
  Solver solver(s, x, rho, std::vector<Vector>(x.size()));
  solver.add(Body{}, tank_walls(nx, ny, s.spacing));
  return solver;
}

struct Momenta {
  Vector linear{}, angular{};
  double size = 0.0, angular_size = 0.0;
};

Momenta momenta(const Solver& solver) {
  Momenta m;
  const FluidParticles& fluid = solver.scene().fluid;
  for (int i = 0; i < fluid.size(); ++i) {
    const Vector p = solver.scene().settings.mass() * fluid.velocity[i], l = cross(fluid.position[i], p);
    m.linear += p, m.angular += l, m.size += norm(p), m.angular_size += norm(l);
  }
  for (const Body& b : solver.scene().bodies)
    if (b.free) {
      m.linear += b.mass * b.velocity;
      const Vector s = b.orientation.inverse()(b.spin);
      m.angular += cross(b.position, b.mass * b.velocity) + b.orientation({b.inertia.x * s.x, b.inertia.y * s.y, b.inertia.z * s.z});
    }
  return m;
}

}  // namespace

TEST_CASE("SPH cells: rows hold all pairs within the reach, once", "[sph]") {
  for (const bool plane : {true, false}) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    Scene scene;
    FluidParticles& fluid = scene.fluid;
    Solids& solids = scene.solids[0];
    const int n = 600, images = 150, solid = 300, solid_images = 80;
    for (int i = 0; i < n + images; ++i) {
      // Images are all around, as those of other processes are.
      const double from = i < n ? 0.0 : -0.3, length = i < n ? 1.0 : 1.6;
      fluid.position.push_back({3.0 * (from + length * u(random)), from + length * u(random), plane ? 0.0 : 0.7 * u(random)});
      if (i < n) fluid.id.push_back(i);
    }
    const std::vector<Vector> given = fluid.position;
    fluid.velocity = fluid.position;
    fluid.density.resize(given.size()), fluid.pressure.resize(given.size());
    for (int k = 0; k < solid + solid_images; ++k) {
      const Vector p{4.0 * u(random) - 0.5, 2.0 * u(random) - 0.5, plane ? 0.0 : u(random)};
      if (k < solid) solids.add(0, {}, 1.0);
      else solids.position.emplace_back();
      solids.position.back() = p;
    }
    Neighbours neighbours;
    const double reach = 0.21;
    neighbours.build(scene, reach);
    for (int i = 0; i < n + images; ++i) {
      const std::size_t before = std::size_t(i < n ? fluid.id[i] : i);
      CHECK(norm(fluid.position[i] - given[before]) + norm(fluid.velocity[i] - given[before]) == 0.0);
    }
    typedef std::set<std::pair<int, int>> Pairs;
    const auto found = [](const std::vector<Rows>& rows, int none) {
      Pairs pairs;
      for (const Rows& each : rows) each.each(none, [&](int i, int j) { CHECK(pairs.insert({i, j}).second); });
      return pairs;
    };
    const auto due = [&](const std::vector<Vector>& ones, int one_end, const std::vector<Vector>& others, int begin, int end) {
      Pairs pairs;
      for (int i = 0; i < one_end; ++i)
        for (int j = begin; j < end; ++j)
          if (const Vector d = ones[i] - others[j]; dot(d, d) < reach * reach) pairs.insert({i, j});
      return pairs;
    };
    const int all = fluid.with_images(), all_solids = solids.with_images();
    Pairs once;
    for (const auto& [i, j] : due(fluid.position, n, fluid.position, 0, n))
      if (i < j) once.insert({i, j});
    CHECK(found(fluid.pairs, all) == once);
    CHECK(found({fluid.border}, all) == due(fluid.position, n, fluid.position, n, all));
    CHECK(found(solids.of_fluid, all_solids) == due(fluid.position, n, solids.position, 0, all_solids));
    CHECK(found(solids.near_fluid, all) == due(solids.position, solid, fluid.position, 0, all));
  }
}

TEST_CASE("SPH cells: a process without fluid has no pairs", "[sph]") {
  Scene scene;
  scene.solids[0].add(0, {}, 1.0);
  scene.solids[0].position.back() = {5.0, 5.0, 5.0};
  Neighbours().build(scene, 0.1);
  CHECK(scene.fluid.border.neighbour.empty());
  for (const Rows& rows : scene.fluid.pairs) CHECK(rows.neighbour.empty());
  for (const Rows& rows : scene.solids[0].near_fluid) CHECK(rows.neighbour.empty());
}

TEST_CASE("SPH solver: momentum and angular momentum are conserved, with a free body", "[sph]") {
  for (const bool plane : {true, false})
    for (const bool potential : {false, true}) {
      Settings s = plane_settings(0.1, 20.0);
      s.dimension = plane ? 2 : 3;
      s.alpha = 0.1;
      s.no_slip = true;
      if (potential) s.contact = {plane ? 1e5 : 1e7, 2};
      else s.moment = Moment::particles;
      std::vector<Vector> x, solid;
      for (const Vector& p : plane ? lattice(10, 8, 0, 0.1) : lattice(6, 6, 6, 0.1))
        (p.x > 0.2 && p.x < 0.4 && p.y > 0.2 && p.y < 0.4 ? solid : x).push_back(p);
      Solver solver(s, x, std::vector<double>(x.size(), 1004.0), random_velocities(x.size(), plane, 1.0));
      Body b;
      b.free = true;
      b.mass = 50.0;
      b.inertia = {2.0, 1.0, 0.5};
      b.position = {0.3, 0.3, plane ? 0.0 : 0.3};
      b.spin = {plane ? 0.0 : 0.3, 0.0, 1.0};
      for (Vector& p : solid) p -= b.position;
      solver.add(b, solid);
      solver.prepare();
      const Momenta before = momenta(solver);
      double spin_error = 0.0;
      for (int k = 0; k < 40; ++k) solver.step(1e-3);
      const Momenta after = momenta(solver);
      spin_error = norm(after.angular - before.angular) / before.angular_size;
      CHECK(norm(after.linear - before.linear) / before.size < 1e-12);
      CHECK(norm(solver.scene().bodies[0].velocity) > 1e-4);
      // Central forces: exact in the plane. In space the body's own turning is of second order in the step.
      CHECK(spin_error < (plane ? 1e-10 : 1e-6));
    }
}

TEST_CASE("SPH solver: fluid alone conserves angular momentum in space", "[sph]") {
  Settings s = plane_settings(0.1, 20.0);
  s.dimension = 3;
  s.alpha = 0.2;
  const std::vector<Vector> x = lattice(6, 5, 7, 0.1);
  for (const KernelName kernel : {KernelName::wendland_c2, KernelName::cubic_spline}) {
    s.kernel = kernel;
    s.moment = kernel == KernelName::wendland_c2 ? Moment::lattice : Moment::particles;
    Solver solver(s, x, std::vector<double>(x.size(), 1004.0), random_velocities(x.size(), false, 1.0));
    solver.prepare();
    const Momenta before = momenta(solver);
    for (int k = 0; k < 40; ++k) solver.step(1e-3);
    const Momenta after = momenta(solver);
    CHECK(norm(after.linear - before.linear) / before.size < 1e-12);
    CHECK(norm(after.angular - before.angular) / before.angular_size < 1e-10);
  }
}

TEST_CASE("SPH solver: sound gains no energy without viscosity and diffusion, at the longest step", "[sph]") {
  Settings s = plane_settings(0.1, 20.0);
  s.alpha = s.delta = 0.0;
  s.state.tension = true;
  const std::vector<Vector> x = lattice(12, 12, 0, 0.1);
  // Small: linear.
  Solver solver(s, x, std::vector<double>(x.size(), 1000.0), random_velocities(x.size(), true, 1e-6));
  const double before = solver.energies().stored();
  double most = 0.0;
  for (int k = 0; k < 2000; ++k) {
    solver.step(s.longest_step());
    most = std::max(most, solver.energies().stored());
  }
  // The energy that leapfrog keeps is another one: 1/(1 - (omega dt)^2/4) apart at most.
  CHECK(most < 2.0 * before);
}

TEST_CASE("SPH solver: the ledger balances, the better the shorter the step", "[sph]") {
  const auto error = [](double dt, Moment moment) {
    Settings s = plane_settings(0.02, 28.0);
    s.moment = moment;
    s.alpha = 0.1;
    s.gravity = {0.0, -9.81, 0.0};
    s.no_slip = true;
    const std::vector<Vector> x = lattice(8, 10, 0, 0.02);
    Solver solver(s, x, std::vector<double>(x.size(), 1000.0), std::vector<Vector>(x.size()));
    solver.add(Body{}, tank_walls(14, 10, 0.02));
    solver.prepare();
    const double before = solver.energies().stored();
    while (solver.time() < 0.1) solver.step(dt);
    const Energies e = solver.energies();
    CHECK(e.viscous > 0.0);
    CHECK(e.work == 0.0);
    return std::abs(e.stored() + e.viscous + e.diffusive + e.boundary - before) / e.kinetic;
  };
  for (const Moment moment : {Moment::lattice, Moment::particles}) {
    const double coarse = error(4e-4, moment), fine = error(1e-4, moment);
    CHECK(coarse < 0.02);
    CHECK(fine < 0.5 * coarse);
  }
}

TEST_CASE("SPH solver: by their own moment, particles in disorder are compressed at the rate of the flow", "[sph]") {
  // v = -a x compresses the density at the rate a d rho.
  for (const int dimension : {2, 3})
    for (const Moment moment : {Moment::lattice, Moment::particles}) {
      Settings s = plane_settings(0.1, 20.0);
      s.dimension = dimension;
      s.alpha = s.delta = 0.0;
      s.moment = moment;
      const double a = 0.01, dt = 1e-3, rho = 980.0;
      const int n = 12;
      std::vector<Vector> x = lattice(n, n, dimension == 3 ? n : 0, 0.1), v;
      std::mt19937 random(4);
      std::uniform_real_distribution<double> u(-0.02, 0.02);
      for (Vector& p : x) {
        p += Vector{u(random), u(random), dimension == 3 ? u(random) : 0.0};
        v.push_back(-a * p);
      }
      Solver solver(s, x, std::vector<double>(x.size(), rho), v);
      solver.step(dt);
      const FluidParticles& fluid = solver.scene().fluid;
      const double due = a / (1.0 - a * dt) * dimension * rho, edge = 0.3;
      double most = 0.0;
      int inside = 0;
      for (int i = 0; i < fluid.size(); ++i) {
        const Vector& p = fluid.position[i];
        const auto within = [&](double place) { return place > edge && place < 0.1 * n - edge; };
        if (!within(p.x) || !within(p.y) || (dimension == 3 && !within(p.z))) continue;
        // Elsewhere than in sparse places, which are not corrected.
        if (moment == Moment::particles && fluid.correction[i] == 1.0) continue;
        ++inside;
        most = std::max(most, std::abs(fluid.rate[i] / due - 1.0));
      }
      CHECK(inside > 10);
      if (moment == Moment::particles) CHECK(most < 1e-10);
      else CHECK(most > 0.05);
    }
}

TEST_CASE("SPH solver: water at rest stays at rest, and its walls carry it", "[sph]") {
  for (const Boundary boundary : {Boundary::extrapolated, Boundary::dynamic}) {
    Settings s = plane_settings(0.02, 28.0);
    s.alpha = 0.1;
    s.boundary = boundary;
    Solver solver = tank(s);
    Vector force{};
    for (int k = 0; k < 800; ++k) {
      solver.step(3.5e-4);
      if (k >= 400) force += (1.0 / 400.0) * solver.scene().bodies[0].force;
    }
    const double weight = 9.81 * solver.scene().settings.mass() * solver.scene().fluid.size();
    CHECK_THAT(force.y, WithinRel(-weight, 0.01));
    CHECK_THAT(force.x, WithinAbs(0.0, 0.01 * weight));
    if (boundary == Boundary::dynamic) continue;
    double squares = 0.0;
    const FluidParticles& fluid = solver.scene().fluid;
    for (int i = 0; i < fluid.size(); ++i) squares += std::pow(fluid.pressure[i] / (9810.0 * 0.2) - 1.0 + fluid.position[i].y / 0.2, 2);
    CHECK(std::sqrt(squares / fluid.size()) < 0.02);  // 10 particles deep
  }
}

TEST_CASE("SPH solver: a state goes on bit for bit, on any number of threads", "[sph]") {
  Settings s = plane_settings(0.02, 28.0);
  s.shifting.coefficient = 2.0;
  s.moment = Moment::particles;
  Solver one = tank(s), again = tank(s);
  s.threads = 3;
  Solver three = tank(s);
  for (int k = 0; k < 60; ++k) one.step(4e-4), three.step(4e-4);
  CHECK(one.state() == three.state());
  again.restore(one.state());
  CHECK(again.time() == one.time());
  for (int k = 0; k < 60; ++k) one.step(4e-4), again.step(4e-4);
  CHECK(one.state() == again.state());
  CHECK(one.searches() > 1);
}

namespace {

/// In the order in which it was given, of each particle of the fluid.
template <class T>
std::vector<T> in_order(const FluidParticles& fluid, const std::vector<T>& values) {
  std::vector<T> out(fluid.id.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[std::size_t(fluid.id[i])] = values[i];
  return out;
}

/// Fluid without walls, gravity and pressure, which moves at random.
Solver cloud(int dimension, double epsilon, int shepard) {
  Settings s = plane_settings(0.1, 20.0);
  s.dimension = dimension;
  s.kernel = KernelName::cubic_spline;
  s.smoothing = 1.5;
  s.alpha = s.delta = 0.0;
  s.xsph = {epsilon};
  s.shepard = shepard;
  const std::vector<Vector> x = lattice(7, 6, dimension == 3 ? 5 : 0, 0.1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(900.0, 950.0);
  std::vector<double> rho(x.size());
  for (double& each : rho) each = u(random);
  return Solver(s, x, rho, random_velocities(x.size(), dimension == 2, 1.0));
}

}  // namespace

TEST_CASE("SPH solver: XSPH is its sum, and moves the centre of mass as the momentum does", "[sph]") {
  for (const int dimension : {2, 3}) {
    const double dt = 1e-3, epsilon = 0.5;
    Solver with = cloud(dimension, epsilon, 0), without = cloud(dimension, 0.0, 0);
    with.step(dt), without.step(dt);
    const FluidParticles& fluid = without.scene().fluid;
    const CubicSpline kernel(dimension, 0.15);
    const std::vector<Vector> x = in_order(fluid, fluid.position), v = in_order(fluid, fluid.velocity);
    const std::vector<double> rho = in_order(fluid, fluid.density);
    std::vector<Vector> due = x;
    for (std::size_t i = 0; i < x.size(); ++i) {
      due[i] += dt * v[i];
      for (std::size_t j = 0; j < x.size(); ++j)
        due[i] +=
            dt * epsilon * without.scene().settings.mass() / (0.5 * (rho[i] + rho[j])) * kernel.value(norm(x[i] - x[j])) * (v[j] - v[i]);
    }
    with.step(dt);
    const FluidParticles& after = with.scene().fluid;
    const std::vector<Vector> found = in_order(after, after.position), speed = in_order(after, after.velocity);
    Vector middle{}, momentum{};
    for (std::size_t i = 0; i < x.size(); ++i) {
      CHECK(norm(found[i] - due[i]) < 1e-13);
      CHECK(norm(speed[i] - v[i]) < 1e-13);
      middle += found[i] - x[i];
      momentum += v[i];
    }
    CHECK(norm(middle - dt * momentum) < 1e-13 * double(x.size()));
  }
}

TEST_CASE("SPH solver: Shepard's filter is its mean, in the steps in which it is due", "[sph]") {
  for (const int dimension : {2, 3}) {
    const double dt = 1e-3;
    Solver with = cloud(dimension, 0.0, 2), without = cloud(dimension, 0.0, 0);
    with.step(dt), without.step(dt);
    CHECK(with.state() == without.state());
    with.step(dt), without.step(dt);
    const FluidParticles &fluid = without.scene().fluid, &filtered = with.scene().fluid;
    const CubicSpline kernel(dimension, 0.15);
    double changed = 0.0;
    for (int i = 0; i < fluid.size(); ++i) {
      double weight = 0.0, volume = 0.0;
      for (int j = 0; j < fluid.size(); ++j) {
        const double w = kernel.value(norm(fluid.position[i] - fluid.position[j]));
        weight += w, volume += w / fluid.density[j];
      }
      CHECK_THAT(filtered.density[i], WithinRel(weight / volume, 1e-12));
      changed = std::max(changed, std::abs(filtered.density[i] - fluid.density[i]));
    }
    CHECK(changed > 1.0);
  }
}

TEST_CASE("SPH solver: what Shepard's filter takes of the compression is in the ledger", "[sph]") {
  Settings s = plane_settings(0.02, 28.0);
  s.gravity = {0.0, -9.81, 0.0};
  s.alpha = 0.1;
  s.delta = 0.0;
  s.shepard = 20;
  s.kernel = KernelName::cubic_spline;
  const std::vector<Vector> x = lattice(8, 10, 0, 0.02);
  Solver solver(s, x, std::vector<double>(x.size(), 1000.0), std::vector<Vector>(x.size()));
  solver.add(Body{}, tank_walls(14, 10, 0.02));
  solver.prepare();
  const double before = solver.energies().stored();
  while (solver.time() < 0.1) solver.step(1e-4);
  const Energies e = solver.energies();
  CHECK(e.diffusive > 0.0);
  CHECK(std::abs(e.stored() + e.viscous + e.diffusive + e.boundary - before) < 0.01 * e.kinetic);
}

TEST_CASE("SPH solver: a body of unequal moments, XSPH and filter go on from a state bit for bit, on any number of threads", "[sph]") {
  const auto made = [](int threads) {
    Settings s;
    s.spacing = 0.1;
    s.state.sound_speed = 20.0;
    s.xsph = {0.5};
    s.shepard = 7;
    s.moment = Moment::particles;
    s.threads = threads;
    std::vector<Vector> x, solid;
    for (const Vector& p : lattice(7, 6, 6, 0.1)) (norm(p - Vector{0.3, 0.3, 0.3}) < 0.15 ? solid : x).push_back(p);
    Solver solver(s, x, std::vector<double>(x.size(), 1002.0), random_velocities(x.size(), false, 1.0));
    Body b;
    b.free = true;
    b.mass = 5.0;
    b.inertia = {0.02, 0.03, 0.05};
    b.position = {0.3, 0.3, 0.3};
    b.spin = {0.1, 6.0, 0.2};
    for (Vector& p : solid) p -= b.position;
    solver.add(b, solid);
    return solver;
  };
  Solver one = made(1), again = made(1), three = made(3);
  for (int k = 0; k < 40; ++k) one.step(1e-3), three.step(1e-3);
  CHECK(one.state() == three.state());
  again.restore(one.state());
  for (int k = 0; k < 40; ++k) one.step(1e-3), again.step(1e-3);
  CHECK(one.state() == again.state());
  const Body& b = one.scene().bodies[0];
  CHECK(norm(b.orientation({1.0, 0.0, 0.0}) - Vector{1.0, 0.0, 0.0}) > 0.1);
}

TEST_CASE("SPH bodies: free fall, a torque-free top, points that turn", "[sph]") {
  Body top;
  top.free = true;
  top.mass = 2.0;
  top.inertia = {1.0, 2.0, 3.0};
  top.spin = {0.1, 2.0, 0.1};
  const Vector gravity{0.0, 0.0, -9.81};
  const auto angular = [&] {
    const Vector w = top.orientation.inverse()(top.spin);
    return top.orientation({top.inertia.x * w.x, top.inertia.y * w.y, top.inertia.z * w.z});
  };
  const Vector before = angular();
  const double energy = top.kinetic_energy(), dt = 1e-4;
  top.accelerate(gravity);
  for (int k = 0; k < 10000; ++k) {
    top.kick(0.5 * dt);
    top.drift(dt);
    top.accelerate(gravity);
    top.kick(0.5 * dt);
  }
  CHECK_THAT(top.position.z, WithinRel(-0.5 * 9.81, 1e-9));
  CHECK(norm(angular() - before) < 1e-3 * norm(before));
  CHECK_THAT(top.kinetic_energy() - top.mass * 9.81 * 9.81 / 2.0, WithinRel(energy, 1e-3));
  const Vector turned = Rotation{}.turned({0.0, 0.0, 0.5 * pi})({1.0, 0.0, 0.0});
  CHECK_THAT(turned.y, WithinAbs(1.0, 1e-15));
  Body wheel;
  wheel.spin = {0.0, 0.0, 3.0};
  CHECK_THAT(wheel.velocity_at({0.5, 0.0, 0.0}).y, WithinRel(1.5, 1e-15));
  CHECK_THAT(wheel.acceleration_at({0.5, 0.0, 0.0}).x, WithinRel(-4.5, 1e-15));
}

namespace {

/// A free body, under a torque that turns with it and one that stands in space.
struct Gyroscope {
  Body body;
  Vector own{}, fixed{};  // N m

  explicit Gyroscope(const Vector& inertia) {
    body.free = true;
    body.mass = 0.2;
    body.inertia = inertia;
    body.spin = {std::isinf(inertia.x) ? 0.0 : 0.01, 20.0, std::isinf(inertia.z) ? 0.0 : 0.02};
  }
  void push() {
    body.load_torque = fixed + body.orientation(own);
    body.accelerate({});
  }
  void run(double time, double dt) {
    push();
    for (long k = std::lround(time / dt); k > 0; --k) {
      body.kick(0.5 * dt);
      body.drift(dt);
      push();
      body.kick(0.5 * dt);
    }
  }
  Vector angular_momentum() const {
    const Vector w = body.orientation.inverse()(body.spin);
    return body.orientation({body.inertia.x * w.x, body.inertia.y * w.y, body.inertia.z * w.z});
  }
};

}  // namespace

TEST_CASE("SPH bodies turn to second order in the step, with and without torques", "[sph]") {
  // Unequal moments about the middle axis, which flips; a symmetric top; and a body that an axis is held of.
  for (const Vector& inertia : {Vector{1e-4, 2e-4, 3e-4}, Vector{3e-4, 1e-4, 2e-4}, Vector{2e-4, 2e-4, 1e-4}, Vector{INFINITY, 2e-4, 3e-4}})
    for (const double torque : {0.0, 1e-3}) {
      const auto after = [&](double dt) {
        Gyroscope g(inertia);
        g.own = {0.3 * torque, torque, -0.5 * torque};
        g.fixed = {torque, 0.2 * torque, torque};
        g.run(0.8, dt);
        return g;
      };
      const Gyroscope exact = after(1e-5);  // its error is a 400th of the fine one
      const auto error = [&](double dt) {
        const Gyroscope g = after(dt);
        return norm(g.body.spin - exact.body.spin) +
               20.0 * norm(g.body.orientation({1.0, 0.0, 0.0}) - exact.body.orientation({1.0, 0.0, 0.0}));
      };
      const double coarse = error(4e-4), fine = error(2e-4);
      CAPTURE(inertia.x, inertia.y, torque, coarse, fine);
      CHECK((coarse < 1e-9 || (coarse / fine > 3.3 && coarse / fine < 4.7)));
    }
}

TEST_CASE("SPH bodies: a torque-free spin keeps its angular momentum, and its energy over many flips", "[sph]") {
  for (const double dt : {8e-4, 4e-4}) {
    Gyroscope g({1e-4, 2e-4, 3e-4});
    const Vector before = g.angular_momentum();
    const double energy = g.body.kinetic_energy();
    double most = 0.0;
    for (int part = 0; part < 200; ++part) {
      g.run(0.1, dt);
      most = std::max(most, std::abs(g.body.kinetic_energy() / energy - 1.0));
    }
    CHECK(norm(g.angular_momentum() - before) < 1e-10 * norm(before));
    CHECK(most < (dt > 5e-4 ? 4e-5 : 1e-5));
  }
}

TEST_CASE("SPH solver: bad input gets one line", "[sph]") {
  const std::vector<Vector> x{{0.0, 0.0, 0.0}};
  const auto with = [&](auto change) {
    Settings s = plane_settings(0.1, 20.0);
    change(s);
    return Solver(s, x, {1000.0}, std::vector<Vector>(1));
  };
  CHECK_THROWS_WITH(with([](Settings& s) { s.spacing = 0.0; }), "spacing must be a number > 0 (m)");
  CHECK_THROWS_WITH(with([](Settings& s) { s.state.sound_speed = NAN; }), "sound_speed must be a number > 0 (m/s)");
  CHECK_THROWS_WITH(with([](Settings& s) { s.alpha = -1.0; }), "alpha must be between 0 and 1");
  CHECK_THROWS_WITH(with([](Settings& s) { s.gravity.z = 1.0; }), "gravity must have no z in the plane");
  Solver solver = with([](Settings&) {});
  CHECK_THROWS_WITH(solver.step(1.0), Contains("at most 0.6 h/sound_speed = 3.9"));
  solver.step(1e-3);
  CHECK_THROWS_WITH(solver.add(Body{}, x), "walls and bodies must be added before the first step");
  CHECK_THROWS_WITH(solver.restore({1.0}), Contains("not of this fluid"));
  Solver fast(plane_settings(0.1, 20.0), x, {1000.0}, {{30.0, 0.0, 0.0}});
  CHECK_THROWS_WITH(fast.step(1e-3), Contains("faster than sound"));
}

namespace {

/// Fluid with a plate in it, `wide` particles square, off the lattice by (a, b) spacings. room: spacings from the plate's particles, within
/// which fluid is left out; < 0: nowhere.
Solver with_plate(const Settings& s, int wide, double a, double b, double room) {
  const Vector low = s.spacing * Vector{2.5 + a, 2.5 + b, 0.0};
  std::vector<Vector> plate = lattice(wide, wide, 0, s.spacing), x;
  for (Vector& p : plate) p += low - s.spacing * Vector{0.5, 0.5, 0.0};
  const double from = -room * s.spacing, to = (wide - 1 + room) * s.spacing;
  for (const Vector& p : lattice(8, 8, 0, s.spacing)) {
    const Vector d = p - low;
    if (room < 0.0 || d.x < from || d.y < from || d.x > to || d.y > to) x.push_back(p);
  }
  Solver solver(s, x, std::vector<double>(x.size(), 1000.0), std::vector<Vector>(x.size()));
  solver.add({}, tank_walls(8, 8, s.spacing));
  Body body;
  body.driven = true;
  solver.add(body, plate);
  return solver;
}

}  // namespace

TEST_CASE("SPH solver: what overlaps at the beginning is told", "[sph]") {
  for (const KernelName kernel : {KernelName::wendland_c2, KernelName::cubic_spline})
    for (const double h : {0.8, 1.0, 1.3, 2.0, 3.0}) {
      Settings s = plane_settings(0.02, 20.0);
      s.smoothing = h;
      s.kernel = kernel;
      const int wide = h > 2.5 ? 4 : h > 1.5 ? 3 : 2;
      for (const double a : {0.0, 0.25, 0.5})
        for (const double b : {0.0, 0.5}) {
          INFO("h = " << h << " dx, off by " << a << ", " << b);
          CHECK_THROWS_WITH(with_plate(s, wide, a, b, -1.0).prepare(),
                            Contains("the particle of fluid at (0.") && Contains(") m overlaps "));
          // Fluid up to half a spacing from the body, and a whole one.
          for (const double room : {0.499, 0.999}) CHECK_NOTHROW(with_plate(s, wide, a, b, room).prepare());
        }
    }
  // In space, a cube of two particles an edge.
  Settings s;
  s.spacing = 0.02;
  s.state.sound_speed = 20.0;
  const std::vector<Vector> x = lattice(6, 6, 6, s.spacing);
  Solver solver(s, x, std::vector<double>(x.size(), 1000.0), std::vector<Vector>(x.size()));
  std::vector<Vector> cube = lattice(2, 2, 2, s.spacing);
  for (Vector& p : cube) p += s.spacing * Vector{1.5, 1.5, 1.5};
  solver.add({}, cube);
  CHECK_THROWS_WITH(solver.prepare(), Contains("overlaps others: there are 1."));
}

TEST_CASE("SPH solver: two particles in one place are told at any h, displaced ones are none", "[sph]") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-0.2, 0.2);
  for (const int dimension : {2, 3})
    for (const double h : {0.8, 1.0, 1.3, 3.0}) {
      Settings s;
      s.dimension = dimension;
      s.spacing = 0.02;
      s.smoothing = h;
      s.state.sound_speed = 20.0;
      std::vector<Vector> x = lattice(10, 10, dimension == 3 ? 10 : 0, s.spacing);
      for (Vector& p : x) p += s.spacing * Vector{u(random), u(random), dimension == 3 ? u(random) : 0.0};
      const auto prepare = [&] { Solver(s, x, std::vector<double>(x.size(), 1000.0), std::vector<Vector>(x.size())).prepare(); };
      INFO("h = " << h << " dx");
      CHECK_NOTHROW(prepare());
      x.push_back(x[40] + Vector{0.39 * s.spacing, 0.0, 0.0});
      CHECK_THROWS_WITH(prepare(), Contains("overlaps another: it is 0.") && Contains(" spacings away from it; leave out fluid"));
    }
}

TEST_CASE("SPH solver: a state takes the place of what was given, and a body can be moved out of the way", "[sph]") {
  const Settings s = plane_settings(0.02, 20.0);
  const auto moved = [&](double y) {
    Solver solver = with_plate(s, 4, 0.0, 0.0, -1.0);
    solver.body(1).position.y = y;
    return solver;
  };
  Solver first = moved(0.3), again = moved(0.0), foreign = moved(0.0), corrected = moved(0.0);
  const std::vector<double> state = first.state();
  CHECK_NOTHROW(again.restore(state));
  CHECK(again.state() == state);
  CHECK_THROWS_WITH(foreign.restore({1.0}), Contains("not of this fluid"));
  CHECK_THROWS_WITH(foreign.step(1e-4), Contains("overlaps another"));
  CHECK_THROWS_WITH(corrected.prepare(), Contains("overlaps another"));
  corrected.body(1).position.y = 0.3;
  CHECK_NOTHROW(corrected.prepare());
  CHECK(corrected.state() == state);
}
