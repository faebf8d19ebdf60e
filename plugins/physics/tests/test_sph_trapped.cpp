// What blew the fluid up: particles that a cube traps on a floor, and spray that loses its density.
#include <algorithm>
#include <cmath>
#include <vector>

#include "catch.hpp"

#include "dembark/sph/solver.hpp"

using namespace dembark::sph;

namespace {

std::vector<Vector> box(const Vector& low, int nx, int ny, int nz, double dx) {
  std::vector<Vector> points;
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k) points.push_back(low + dx * Vector{i + 0.5, j + 0.5, k + 0.5});
  return points;
}

}  // namespace

TEST_CASE("a cube of 2.7 kg that lands on nine particles of 2 g does not shoot them out", "[sph]") {
  const double dx = 0.0125, edge = 0.15, mass = 2.7;
  Settings s;
  s.spacing = dx;
  s.state.sound_speed = 40.0;
  s.gravity = {0.0, 0.0, -9.81};
  std::vector<Vector> water;
  for (int k = 0; k < 9; ++k) water.push_back({0.06 - dx * (k % 3), 0.01 + dx * int(k / 3), 0.5 * dx});
  Solver solver(s, water, std::vector<double>(9, 1000.0), std::vector<Vector>(9));
  solver.add({}, box({-16 * dx, -16 * dx, -3 * dx}, 32, 32, 3, dx));
  Body cube;
  cube.free = true;
  cube.mass = mass;
  cube.inertia = (mass * edge * edge / 6.0) * Vector{1.0, 1.0, 1.0};
  cube.position = {0.0, 0.0, dx + 0.5 * edge};
  cube.velocity = {0.0, 0.0, -1.0};
  const int number = solver.add(cube, box({-0.5 * edge, -0.5 * edge, -0.5 * edge}, 12, 12, 12, dx));
  const double before = solver.energies().stored(), dt = 0.36 * s.h() / s.state.sound_speed;
  double fastest = 0.0, densest = 0.0, most = before;
  for (int k = 0; k < 200; ++k) {
    solver.step(dt);
    for (const Vector& v : solver.scene().fluid.velocity) fastest = std::max(fastest, norm(v));
    for (const double rho : solver.scene().fluid.density) densest = std::max(densest, s.state.pressure(rho));
    most = std::max(most, solver.energies().stored());
  }
  // A film of water under the cube would run out at the speed of its pressure, no more than that of the water hammer at c/10.
  CHECK(densest <= 0.1 * 1000.0 * 40.0 * 40.0 * (1.0 + 1e-12));
  CHECK(fastest < 0.45 * s.state.sound_speed);
  // Walls may give a little: a tenth of what falls, where a third of it came from nothing.
  CHECK(most < before + 0.15 * 0.5 * mass);
  CHECK(norm(solver.scene().bodies[std::size_t(number)].spin) < 8.0);
}

TEST_CASE("beyond the hammer of c/10 the pressure stays, and the energy is its integral", "[sph]") {
  for (const double gamma : {1.0, 7.0}) {
    const Tait state{1000.0, 40.0, gamma, false};
    const double most = 0.1 * 1000.0 * 1600.0, edge = state.density_at(most);
    CHECK(state.pressure(1.5 * edge) == most);
    CHECK(std::abs(state.pressure(0.999 * edge) / most - 1.0) < 0.02);
    double sum = 0.0;
    const int n = 20000;
    const double step = (1.4 * edge - 1000.0) / n;
    for (int k = 0; k < n; ++k) {
      const double rho = 1000.0 + (k + 0.5) * step;
      sum += state.pressure(rho) / (rho * rho) * step;
    }
    CHECK(std::abs(state.energy(1.4 * edge) / sum - 1.0) < 1e-5);
  }
}

TEST_CASE("spray is as thin as on its way to a surface, no thinner", "[sph]") {
  // Each particle has the density of rest and flies away from all others: but for what it gives itself, all of it would be lost.
  Settings s;
  s.spacing = 0.02;
  s.state.sound_speed = 40.0;
  const std::vector<Vector> points = box({}, 4, 4, 4, s.spacing);
  std::vector<Vector> velocities;
  for (const Vector& p : points) velocities.push_back(100.0 * (p - Vector{0.04, 0.04, 0.04}));
  Solver solver(s, points, std::vector<double>(points.size(), 1000.0), velocities);
  for (int k = 0; k < 200; ++k) solver.step(0.3 * s.h() / s.state.sound_speed);
  double thinnest = 1000.0;
  for (const double rho : solver.scene().fluid.density) thinnest = std::min(thinnest, rho);
  CHECK(thinnest >= 500.0);
  CHECK(thinnest < 700.0);
}

TEST_CASE("a film of one particle does not sink into a floor", "[sph]") {
  // As thin as it gets on its way: its density is that of spray, though it lies on the floor.
  Settings s;
  s.spacing = 0.02;
  s.state.sound_speed = 40.0;
  s.gravity = {0.0, 0.0, -9.81};
  std::vector<Vector> film;
  for (int k = 0; k < 5; ++k) film.push_back({0.12 * k + 0.0025 * k, 0.0025 * k, 0.01});
  Solver solver(s, film, std::vector<double>(5, 600.0), std::vector<Vector>(5, {0.3, 0.0, -0.3}));
  solver.add({}, box({-0.2, -0.2, -0.06}, 45, 20, 3, s.spacing));
  // Not only at the end: without the guard they come out of the floor again.
  double lowest = film[0].z;
  for (int k = 0; k < 400; ++k) {
    solver.step(0.36 * s.h() / s.state.sound_speed);
    for (const Vector& p : solver.scene().fluid.position) lowest = std::min(lowest, p.z);
  }
  CHECK(lowest > 0.0);
}

TEST_CASE("between four particles of a wall the guard alone stops c/16", "[sph]") {
  Settings s;
  s.spacing = 0.02;
  s.state.sound_speed = 40.0;
  const PairCoefficients pair = loop_numbers(s).pair;
  const WendlandC2 kernel(s.dimension, s.h());
  // The work of the four on a unit of mass, along the line that comes from afar and ends in their middle.
  constexpr int steps = 2000;
  double work = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double z = s.spacing * (k + 0.5) / steps, r = std::sqrt(z * z + 0.5 * s.spacing * s.spacing);
    work += 4.0 * acceleration_factor(pair.mass * kernel.slope(r), guard_stress(pair, r)) * z * s.spacing / steps;
  }
  CHECK(std::sqrt(2.0 * work) > s.state.sound_speed / 16.0);
  CHECK(std::sqrt(2.0 * work) < s.state.sound_speed / 10.0);
}
