// The passes of a step on several processes: each has images of the others' particles, and all is as on one.
#include <cmath>
#include <random>
#include <vector>

#include "catch.hpp"

#include "dembark/sph/passes.hpp"

using namespace dembark::sph;
using Catch::WithinAbs;

namespace {

/// What processes send to each other, by the numbers of the particles in the scene of one process.
struct Sent {
  std::vector<std::vector<double>> densities, corrections;  // of the fluid, each time that they are sent
  std::vector<double> wall_density, wall_pressure;
  std::vector<Vector> met;
};

struct Recorder {
  Sent* sent;
  void send_densities(Scene& scene) const {
    sent->densities.push_back(scene.fluid.density);
    sent->corrections.push_back(scene.fluid.correction);
    sent->wall_density = scene.solids[0].density;
  }
  void send_walls(Scene& scene) const {
    sent->wall_pressure = scene.solids[0].pressure;
    sent->met = scene.solids[0].met;
  }
  const std::vector<double>& box_pressures(const Scene& scene) const { return scene.solids[0].pressure; }
};

/// A process: its particles and then those of others, by their numbers in the scene of one process.
struct Process {
  Scene scene;
  std::vector<int> fluid, solids[2];
};

struct Receiver {
  const Sent* sent;
  const Process* own;
  mutable std::size_t times = 0;
  void send_densities(Scene& scene) const {
    if (scene.settings.corrects()) receive(sent->corrections[times], own->fluid, scene.fluid.size(), scene.fluid.correction);
    receive(sent->densities[times++], own->fluid, scene.fluid.size(), scene.fluid.density);
    receive(sent->wall_density, own->solids[0], scene.solids[0].size(), scene.solids[0].density);
  }
  void send_walls(Scene& scene) const {
    receive(sent->wall_pressure, own->solids[0], scene.solids[0].size(), scene.solids[0].pressure);
    receive(sent->met, own->solids[0], scene.solids[0].size(), scene.solids[0].met);
  }
  const std::vector<double>& box_pressures(const Scene& scene) const { return scene.solids[0].pressure; }

 private:
  template <class T>
  static void receive(const std::vector<T>& from, const std::vector<int>& numbers, int own_size, std::vector<T>& to) {
    for (std::size_t k = std::size_t(own_size); k < numbers.size(); ++k) to[k] = from[std::size_t(numbers[k])];
  }
};

/// Row k: those of `others` from `first(k)` to `last` near points[k].
template <class First>
Rows rows_of(const std::vector<Vector>& points, int own, const std::vector<Vector>& others, const First& first, int last, double reach) {
  Rows rows;
  rows.clear(0, own);
  for (int k = 0; k < own; ++k) {
    for (int j = first(k); j < last; ++j)
      if (norm(points[std::size_t(k)] - others[std::size_t(j)]) < reach) rows.neighbour.push_back(j);
    rows.end_row(int(others.size()));
  }
  return rows;
}

/// Those of `all` that a process has, and then the others; own(x): whether it has a particle at x.
template <class Own>
int take(const std::vector<Vector>& all, const Own& own, std::vector<int>& numbers) {
  for (const bool mine : {true, false})
    for (std::size_t k = 0; k < all.size(); ++k)
      if (own(all[k]) == mine) numbers.push_back(int(k));
  int count = 0;
  for (const Vector& x : all) count += own(x);
  return count;
}

template <class T>
std::vector<T> picked(const std::vector<T>& all, const std::vector<int>& numbers) {
  std::vector<T> some;
  for (const int k : numbers) some.push_back(all[std::size_t(k)]);
  return some;
}

/// Of a scene that one process has, with lists of neighbours of its own.
template <class Own>
Process process(const Scene& whole, const Own& own) {
  Process p;
  Scene& scene = p.scene;
  scene.settings = whole.settings;
  scene.bodies = whole.bodies;
  FluidParticles& fluid = scene.fluid;
  const int n = take(whole.fluid.position, own, p.fluid);
  fluid.position = picked(whole.fluid.position, p.fluid);
  fluid.velocity = picked(whole.fluid.velocity, p.fluid);
  fluid.density = picked(whole.fluid.density, p.fluid);
  fluid.pressure = fluid.density;
  fluid.id.assign(p.fluid.begin(), p.fluid.begin() + n);
  fluid.shift.resize(std::size_t(n));
  const double reach = support * scene.settings.h();
  fluid.pairs = {rows_of(fluid.position, n, fluid.position, [](int k) { return k + 1; }, n, reach)};
  fluid.border = rows_of(fluid.position, n, fluid.position, [n](int) { return n; }, fluid.with_images(), reach);
  const auto from_first = [](int) { return 0; };
  for (int s = 0; s < 2; ++s) {
    Solids& set = scene.solids[std::size_t(s)];
    const Solids& all = whole.solids[std::size_t(s)];
    const int size = take(all.position, own, p.solids[s]);
    set.position = picked(all.position, p.solids[s]);
    set.velocity = picked(all.velocity, p.solids[s]);
    set.density = picked(all.density, p.solids[s]);
    set.body = picked(all.body, {p.solids[s].begin(), p.solids[s].begin() + size});
    set.of_fluid = {rows_of(fluid.position, n, set.position, from_first, set.with_images(), reach)};
    set.near_fluid = {rows_of(set.position, size, fluid.position, from_first, fluid.with_images(), reach)};
  }
  scene.resize({1e3, 0.0, 0.0});
  return p;
}

/// Water in a plane tank with a moving block in it.
Scene tank(const Settings& s) {
  Scene scene;
  scene.settings = s;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-0.1, 0.1);
  scene.bodies.resize(2);
  Body& block = scene.bodies[1];
  block.free = true;
  block.position = {5.0 * s.spacing, 4.0 * s.spacing, 0.0};
  block.velocity = {0.3, -0.2, 0.0};
  block.spin = {0.0, 0.0, 2.0};
  block.acceleration = {1.0, -3.0, 0.0};
  for (int i = -3; i < 13; ++i)
    for (int j = -3; j < 10; ++j) {
      const Vector x{(i + 0.5) * s.spacing, (j + 0.5) * s.spacing, 0.0};
      const bool wall = i < 0 || i > 9 || j < 0, in_block = i >= 4 && i < 6 && j >= 3 && j < 5;
      if (wall || in_block) {
        Solids& set = scene.solids[in_block && s.contact.on() ? 1 : 0];
        set.add(in_block ? 1 : 0, x - scene.bodies[in_block].position, s.state.density * (1.0 + 0.01 * u(random)));
        continue;
      }
      scene.fluid.position.push_back(x + s.spacing * Vector{u(random), u(random), 0.0});
      scene.fluid.velocity.push_back({u(random), u(random), 0.0});
      scene.fluid.density.push_back(s.state.density * (1.0 + 0.02 * u(random)));
    }
  for (Solids& set : scene.solids) set.follow(scene.bodies);
  return scene;
}

}  // namespace

TEST_CASE("SPH passes: two processes that share the particles get what one gets", "[sph]") {
  for (const Boundary boundary : {Boundary::extrapolated, Boundary::dynamic})
    for (const bool potential : {false, true}) {
      Settings s;
      s.dimension = 2;
      s.spacing = 0.1;
      s.state.sound_speed = 20.0;
      s.state.tension = true;
      s.gravity = {0.0, -9.81, 0.0};
      s.boundary = boundary;
      s.no_slip = true;
      s.shifting = {2.0};
      s.xsph = {0.5};
      s.shepard = 1;
      if (potential) s.contact = {1e5, 2};
      else s.moment = Moment::particles;
      const Scene scene = tank(s);
      const double dt = 0.5 * s.longest_step(), cut = 0.43;
      Process one = process(scene, [](const Vector&) { return true; });
      Passes passes(s, portable_loops());
      passes.pressures(one.scene);
      Sent sent;
      one.scene.step = 1;
      passes.compute(one.scene, dt, Recorder{&sent});
      CHECK(sent.densities.size() == 2);
      Energies lost;
      Vector force{}, torque{};
      for (const bool left : {true, false}) {
        Process half = process(scene, [&](const Vector& x) { return (x.x < cut) == left; });
        REQUIRE(half.scene.fluid.size() < one.scene.fluid.size());
        passes.pressures(half.scene);
        half.scene.step = 1;
        passes.compute(half.scene, dt, Receiver{&sent, &half});
        const FluidParticles &found = half.scene.fluid, &due = one.scene.fluid;
        for (int k = 0; k < found.size(); ++k) {
          const std::size_t i = std::size_t(half.fluid[std::size_t(k)]), own = std::size_t(k);
          CHECK_THAT(found.density[own], WithinAbs(due.density[i], 1e-10));
          CHECK_THAT(found.pressure[own], WithinAbs(due.pressure[i], 1e-7));
          CHECK(norm(found.shift[own] - due.shift[i]) < 1e-14);
          CHECK(std::hypot(found.sum[own].x - due.sum[i].x, found.sum[own].y - due.sum[i].y) < 1e-9);
        }
        lost.viscous += half.scene.lost.viscous;
        lost.diffusive += half.scene.lost.diffusive;
        lost.boundary += half.scene.lost.boundary;
        lost.contact += half.scene.lost.contact;
        force += half.scene.bodies[1].force;
        torque += half.scene.bodies[1].torque;
      }
      const Body& block = one.scene.bodies[1];
      const Energies& due = one.scene.lost;
      CHECK(norm(force) > 1.0);
      CHECK(norm(force - block.force) < 1e-9 * norm(block.force));
      CHECK(norm(torque - block.torque) < 1e-9 * norm(block.force));
      CHECK(due.viscous > 0.0);
      for (const auto sum : {&Energies::viscous, &Energies::diffusive, &Energies::boundary, &Energies::contact})
        CHECK(std::abs(lost.*sum - due.*sum) <= 1e-9 * std::abs(due.*sum));
      CHECK((due.contact > 0.0) == potential);
    }
}
