// Films in slits: Laplace's pressure on faces that rest, the water that an opening film lacks, action and reaction.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "catch.hpp"

#include "dembark/sph/slits.hpp"

using namespace dembark::sph;

namespace {

constexpr int n = 6;
constexpr double dx = 0.02, edge = n * dx, rho = 1000.0;

/// Boxes of n^3 particles, one on the other, the lowest `gap` (m) above the plane z = 0; pressures are a function of the place.
struct Stack {
  std::vector<Body> bodies;
  Slits slits;
  std::vector<double> pressure;
  Vector gravity{};

  template <class Pressure>
  Stack(int count, double gap, bool plane, const Pressure& of) {
    if (plane) slits.planes.push_back({{}, {0.0, 0.0, 1.0}});
    for (int k = 0; k < count; ++k) {
      Body body;
      body.free = true;
      body.position = {0.0, 0.0, 0.5 * edge + (k + 1) * gap + k * edge};
      bodies.push_back(body);
      slits.boxes.push_back({k, k * n * n * n, 0.5 * Vector{edge, edge, edge}, {n, n, n}});
      for (int i = 0; i < n * n * n; ++i) {
        const Vector arm = dx * Vector{i / (n * n) + 0.5 - 0.5 * n, (i / n) % n + 0.5 - 0.5 * n, i % n + 0.5 - 0.5 * n};
        pressure.push_back(of(body.position + arm));
      }
    }
  }
  Vector film(std::size_t k = 0, double share = 1.0) {
    slits.push(share, dx, rho, gravity, pressure, bodies);
    return bodies[k].film;
  }
};

const auto uniform = [](const Vector&) { return 2000.0; };

/// Of a face of which each element has the pressure p less rho/2 (V d/s)^2, in no case less than none; d: to the nearest edge. V is
/// rate - spin x, x from the middle of the face. Force, and torque about y.
std::pair<double, double> of_opening(double p, double rate, double spin, double gap) {
  double force = 0.0, torque = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double x = dx * (i + 0.5 - 0.5 * n), way = dx * (0.5 + std::min({i, n - 1 - i, j, n - 1 - j}));
      const double speed = std::max(rate - spin * x, 0.0) * way / gap, here = dx * dx * std::max(p - 0.5 * rho * speed * speed, 0.0);
      force += here;
      torque -= x * here;
    }
  return {force, torque};
}
double force_of_opening(double p, double rate, double gap) { return of_opening(p, rate, 0.0, gap).first; }

}  // namespace

TEST_CASE("a film at rest has the pressure of its rim, and one that is linear along the face", "[sph]") {
  Stack flat(1, 0.001, true, uniform);
  CHECK(norm(flat.film() - Vector{0.0, 0.0, 2000.0 * edge * edge}) < 1e-9 * 2000.0 * edge * edge);
  CHECK(norm(flat.bodies[0].film_torque) < 1e-9);
  CHECK(flat.film(0, 0.25).z == Approx(0.25 * 2000.0 * edge * edge));
  CHECK(norm(flat.film(0, 0.0)) == 0.0);
  // p = a + b x: the force is a A, the torque about y is -integral b x^2 dA less what the rim's particles, half a spacing inside, lack.
  Stack linear(1, 0.001, true, [](const Vector& x) { return 2000.0 + 10000.0 * x.x; });
  CHECK(linear.film().z == Approx(2000.0 * edge * edge).epsilon(1e-6));
  const double torque = linear.bodies[0].film_torque.y, due = -10000.0 * edge * edge * edge * edge / 12.0;
  CHECK(torque / due == Approx(1.0 - 1.0 / n).margin(0.05));
  // In still water the rim's pressure is carried down to the face.
  Stack still(1, 0.001, true, [](const Vector& x) { return rho * 9.81 * (0.5 - x.z); });
  still.gravity = {0.0, 0.0, -9.81};
  CHECK(still.film().z == Approx(rho * 9.81 * 0.499 * edge * edge).epsilon(1e-9).margin(1e-9));
}

TEST_CASE("a film that opens lacks what its water's speed takes, and nothing when it closes", "[sph]") {
  const double full = 2000.0 * edge * edge;
  for (const double gap : {0.001, 0.004}) {
    Stack stack(1, gap, true, uniform);
    for (const double rate : {0.01, 0.05, 0.2}) {
      stack.bodies[0].velocity = {0.3, -0.1, rate};
      CHECK(stack.film().z == Approx(force_of_opening(2000.0, rate, gap)).epsilon(1e-9).margin(1e-9));
      CHECK(stack.bodies[0].film.z < full);
      stack.bodies[0].velocity.z = -rate;
      CHECK(stack.film().z == Approx(full));
    }
    stack.bodies[0].velocity = {0.0, 0.0, 10.0};
    CHECK(norm(stack.film()) == 0.0);
  }
  // Thinner than spacing/50, it counts as that; so does a box that has sunk into the plane.
  for (const double gap : {1e-5, -0.002}) {
    Stack stack(1, gap, true, uniform);
    stack.bodies[0].velocity.z = 0.004;
    CHECK(stack.film().z == Approx(force_of_opening(2000.0, 0.004, dx / 50.0)).epsilon(1e-9).margin(1e-9));
  }
  // Half of the spacing away particles come in, and there is none.
  Stack far(1, 0.51 * dx, true, uniform);
  CHECK(norm(far.film()) == 0.0);
}

TEST_CASE("a box that tips opens its film on one side", "[sph]") {
  Stack stack(1, 0.002, true, uniform);
  stack.bodies[0].spin = {0.0, 4.0, 0.0};  // +x goes down, -x up
  const auto [force, torque] = of_opening(2000.0, 0.0, 4.0, 0.002);
  CHECK(stack.film().z == Approx(force).epsilon(1e-9).margin(1e-9));
  CHECK(stack.bodies[0].film_torque.y == Approx(torque).epsilon(1e-9).margin(1e-9));
  CHECK(force < 0.95 * 2000.0 * edge * edge);
  CHECK(torque < -0.05 * force * 0.5 * edge);
}

TEST_CASE("films between two boxes push both alike and do not change when both move together", "[sph]") {
  Stack stack(2, 0.003, false, uniform);
  const double full = 2000.0 * edge * edge;
  CHECK(stack.film(1).z == Approx(full));
  CHECK(norm(stack.bodies[0].film + stack.bodies[1].film) < 1e-12 * full);
  stack.bodies[0].velocity = stack.bodies[1].velocity = {0.1, 0.2, 3.0};
  CHECK(stack.film(1).z == Approx(full));
  // Their rate of opening counts: the lower one falls.
  stack.bodies[0].velocity.z = 3.0 - 0.1;
  CHECK(stack.film(1).z == Approx(force_of_opening(2000.0, 0.1, 0.003)).epsilon(1e-9).margin(1e-9));
  CHECK(norm(stack.bodies[0].film + stack.bodies[1].film) < 1e-12 * full);
  // Torques balance about any point.
  Vector all{};
  for (const Body& b : stack.bodies) all += b.film_torque + cross(b.position, b.film);
  CHECK(norm(all) < 1e-12 * full);
}

TEST_CASE("where a neighbour covers the rim, the way to it is longer", "[sph]") {
  // A box and the plane, and a box beside it that stands on the plane, too.
  Stack stack(1, 0.002, true, uniform);
  Body beside;
  beside.position = {edge, 0.0, 0.5 * edge};
  stack.bodies.push_back(beside);
  stack.slits.boxes.push_back({1, 0, 0.5 * Vector{edge, edge, edge}, {n, n, n}});
  stack.bodies[0].velocity.z = stack.bodies[1].velocity.z = 0.05;
  const double alone = force_of_opening(2000.0, 0.05, 0.002);
  CHECK(stack.film().z < 0.999 * alone);
  CHECK(stack.bodies[0].film.z > 0.3 * alone);
}
