// The solver of hard grains between each other: collisions, periodic directions, accounts, states.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "catch.hpp"
#include "dembark/constants.hpp"
#include "dembark/events/solver.hpp"
#include "hard_grains.hpp"

namespace {

using namespace dembark;
using namespace dembark::events;
using hard_grains::refusal;

Settings periodic(double length, double low = 0.0) {
  Settings s;
  s.periods.fill({low, low + length});
  return s;
}

/// n^3 spheres of diameters 0.8 ... 1 on a lattice in the periodic box, with random velocities and spins, of total momentum zero.
std::vector<Grain> gas(int n, double length, unsigned seed, double low = 0.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> size(0.4, 0.5);
  std::vector<Grain> grains;
  Vector momentum;
  double mass = 0.0;
  for (int i = 0; i < n * n * n; ++i) {
    Grain g;
    g.radius = size(random);
    g.mass = 8.0 * g.radius * g.radius * g.radius;
    const double step = length / n;
    g.position = {low + (i % n + 0.5) * step, low + (i / n % n + 0.5) * step, low + (i / (n * n) + 0.5) * step};
    g.velocity = {normal(random), normal(random), normal(random)};
    g.spin = {normal(random), normal(random), normal(random)};
    momentum += g.mass * g.velocity;
    mass += g.mass;
    grains.push_back(g);
  }
  for (Grain& g : grains) g.velocity -= (1.0 / mass) * momentum;
  return grains;
}

Vector momentum(const Solver& solver) {
  Vector sum;
  for (int i = 0; i < solver.size(); ++i) sum += solver.grain(i).mass * solver.grain(i).velocity;
  return sum;
}

double balance(const Solver& solver) {
  const std::array<double, 3> e = solver.energies();
  double work = 0.0;
  for (const WallAccount& wall : solver.account().walls) work += wall.work;
  return e[0] + e[1] + e[2] + solver.account().normal_loss + solver.account().friction_loss - work;
}

Grain sphere(double mass, double radius, Vector position, Vector velocity = {}, Vector spin = {}) {
  return {mass, radius, position, velocity, spin};
}

double distance(const Vector& a, const Vector& b) { return norm(a - b); }

}  // namespace

TEST_CASE("Two spheres that meet head on part with e times their speed, at the exact time", "[events]") {
  Settings s;
  s.law.restitution = 0.6;
  Solver solver(s, {sphere(2.0, 0.5, {0, 0, 0}, {3, 0, 0}), sphere(1.0, 0.25, {2, 0, 0}, {-1, 0, 0})});
  const double meet = 1.25 / 4.0, centre = 5.0 / 3.0;
  solver.run(0.5 * meet);
  CHECK(solver.account().collisions == 0.0);
  solver.run(1.0);
  CHECK(solver.account().collisions == 1.0);
  // Of the centre of mass, and 0.6 times 4 m/s apart.
  CHECK(solver.grain(0).velocity.x == Approx(centre - 0.6 * 4.0 / 3.0).epsilon(1e-14));
  CHECK(solver.grain(1).velocity.x == Approx(centre + 0.6 * 8.0 / 3.0).epsilon(1e-14));
  CHECK(solver.grain(1).position.x == Approx(2.0 - meet + (1.0 - meet) * (centre + 0.6 * 8.0 / 3.0)).epsilon(1e-14));
  CHECK(solver.account().normal_loss == Approx(0.5 * (2.0 / 3.0) * 16.0 * (1.0 - 0.36)).epsilon(1e-14));
}

TEST_CASE("Walton's tangential impulse sticks or slides, with the energy that it loses", "[events]") {
  const Vector normal{1, 0, 0};
  CollisionLaw law{0.8, 0.0, 0.75, 0.3, 0.4};
  // Slip 0.1 m/s at 2 m/s of approach sticks: (1 + beta) m / (1 + 1/q) u.
  Collision c = collide(law, normal, {-2.0, 0.1, 0.0}, 3.0, 0.4, false, 0.0);
  CHECK(c.normal == Approx(3.0 * 1.8 * 2.0));
  CHECK(c.impulse.y == Approx(-3.0 * (2.0 / 7.0) * 1.4 * 0.1));
  CHECK(c.friction_loss == Approx(0.5 * 3.0 * (2.0 / 7.0) * 0.01 * (1.0 - 0.16)));
  // Slip 10 m/s slides.
  c = collide(law, normal, {-2.0, 0.0, 10.0}, 3.0, 0.4, false, 0.0);
  CHECK(c.impulse.z == Approx(-0.3 * 3.0 * 1.8 * 2.0));
  const double left = 10.0 - 0.3 * 1.8 * 2.0 * 3.5;
  CHECK(c.friction_loss == Approx(0.5 * 3.0 * (2.0 / 7.0) * (100.0 - left * left)));
  // Elastic within the duration of a contact.
  CHECK(collide(law, normal, {-2.0, 0.0, 0.0}, 3.0, 0.4, true, 0.0).normal == Approx(12.0));
  // e(v) = 1 - (1 - e0) (v / v0)^p up to v0.
  law.restitution_speed = 16.0;
  CHECK(law.at(1.0) == Approx(1.0 - 0.2 / 8.0));
  CHECK(law.at(20.0) == Approx(0.8));
}

TEST_CASE("An oblique collision of rough spheres keeps momentum, angular momentum and the account of energy", "[events]") {
  Settings s;
  s.law = {0.7, 0.0, 0.75, 0.2, 0.5};
  const std::vector<Grain> start{sphere(2.0, 0.5, {0, 0, 0}, {3, 0.2, 0.1}, {1, 2, 3}),
                                 sphere(1.0, 0.25, {2, 0.4, -0.2}, {-1, 0, 0}, {-4, 1, 0.5})};
  const auto turning = [](const std::vector<Grain>& grains) {
    Vector sum;
    for (const Grain& g : grains) sum += g.mass * cross(g.position, g.velocity) + (0.4 * g.mass * g.radius * g.radius) * g.spin;
    return sum;
  };
  Solver solver(s, start);
  const double before = balance(solver);
  const Vector pushed = momentum(solver);
  solver.run(2.0);
  REQUIRE(solver.account().collisions == 1.0);
  CHECK(solver.account().friction_loss > 1e-3);
  CHECK(balance(solver) == Approx(before).epsilon(1e-14));
  CHECK(distance(momentum(solver), pushed) < 1e-14);
  CHECK(distance(turning({solver.grain(0), solver.grain(1)}), turning(start)) < 1e-14);
}

TEST_CASE("An elastic gas keeps energy and momentum to rounding, and no overlap is larger", "[events]") {
  const bool rough = GENERATE(false, true);
  const double length = 6.2;
  Settings s = periodic(length);
  if (rough) {
    s.law.friction = never;
    s.law.tangential_restitution = 1.0;
  }
  Solver solver(s, gas(5, length, 1));
  const double before = balance(solver);
  double largest = -1.0;
  for (int k = 1; k <= 50; ++k) {
    solver.run(0.2 * k);
    largest = std::max(largest, solver.overlap());
  }
  CHECK(solver.account().collisions > 2000.0);
  CHECK(std::fabs(solver.energies()[0] + solver.energies()[1] - before) < 1e-11 * before);
  CHECK(balance(solver) == Approx(before).epsilon(1e-12));
  CHECK(norm(momentum(solver)) < 1e-12 * before);
  CHECK(largest < 1e-13);
}

TEST_CASE("A short run with reversed velocities returns to its start", "[events]") {
  const double length = 4.2;
  Solver solver(periodic(length), gas(3, length, 2));
  solver.run(1.0);
  REQUIRE(solver.account().collisions > 20.0);
  std::vector<Vector> velocities, spins;
  for (int i = 0; i < solver.size(); ++i) {
    velocities.push_back(-solver.grain(i).velocity);
    spins.push_back(-solver.grain(i).spin);
  }
  CHECK_THROWS_WITH(solver.set_velocities(velocities, {}), "there must be one velocity and one spin a grain");
  solver.set_velocities(velocities, spins);
  solver.run(2.0);
  const std::vector<Grain> start = gas(3, length, 2);
  for (int i = 0; i < solver.size(); ++i) {
    CHECK(distance(solver.grain(i).position, start[i].position) < 1e-8);
    CHECK(distance(solver.grain(i).velocity, -start[i].velocity) < 1e-8);
  }
}

TEST_CASE("The sequence of collisions is that of a search of all pairs and all their images", "[events]") {
  // A box of hardly more than three diameters: each grain meets the images of others on both sides.
  const double length = 3.05, low = GENERATE(0.0, -7.3);
  std::vector<Grain> grains = gas(3, length, 5, low);
  for (Grain& g : grains) g.spin = {};
  Settings s = periodic(length, low);
  s.law.restitution = 0.9;
  Solver solver(s, grains);
  double now = 0.0;
  for (int collision = 1; collision <= 60; ++collision) {
    double first = never;
    std::size_t a = 0, b = 0;
    Vector image;
    for (std::size_t i = 0; i < grains.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (int k = 0; k < 125; ++k) {
          const Vector to = length * Vector{double(k % 5 - 2), double(k / 5 % 5 - 2), double(k / 25 - 2)};
          const Vector x = grains[i].position - grains[j].position - to, v = grains[i].velocity - grains[j].velocity;
          const double reach = grains[i].radius + grains[j].radius, half = dot(x, v), square = dot(v, v);
          const double discriminant = half * half - square * (dot(x, x) - reach * reach);
          if (half >= 0.0 || discriminant <= 0.0) continue;
          const double t = (-half - std::sqrt(discriminant)) / square;
          if (t < first) first = t, a = i, b = j, image = to;
        }
    now += first;
    for (Grain& g : grains) g.position += first * g.velocity;
    const Vector n = (1.0 / (grains[a].radius + grains[b].radius)) * (grains[a].position - grains[b].position - image);
    const double together = 1.0 / grains[a].mass + 1.0 / grains[b].mass;
    const Vector impulse = (-1.9 * dot(n, grains[a].velocity - grains[b].velocity) / together) * n;
    grains[a].velocity += (1.0 / grains[a].mass) * impulse;
    grains[b].velocity -= (1.0 / grains[b].mass) * impulse;
    solver.run(now + 1e-9);
    REQUIRE(solver.account().collisions == double(collision));
    double off = 0.0;
    for (std::size_t i = 0; i < grains.size(); ++i)
      off = std::max({off, distance(solver.grain(int(i)).velocity, grains[i].velocity),
                      distance(solver.grain(int(i)).position, grains[i].position + 1e-9 * grains[i].velocity)});
    REQUIRE(off < 1e-6);
  }
}

TEST_CASE("Discs in a plane stay there, and turn about its normal", "[events]") {
  Settings s;
  s.dimension = 2;
  s.shape = 0.5;
  s.periods[0] = s.periods[1] = {0.0, 8.0};
  s.law = {0.9, 0.0, 0.75, 0.4, 0.2};
  std::vector<Grain> grains;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 36; ++i)
    grains.push_back(sphere(1, 0.5, {1.3 * (i % 6) + 0.6, 1.3 * (i / 6) + 0.6, 0}, {normal(random), normal(random), 0}));
  Solver solver(s, grains);
  const double before = balance(solver);
  const Vector pushed = momentum(solver);
  solver.run(20.0);
  CHECK(solver.account().collisions > 200.0);
  CHECK(balance(solver) == Approx(before).epsilon(1e-12));
  CHECK(distance(momentum(solver), pushed) < 1e-12);
  for (int i = 0; i < 36; ++i) {
    const Grain g = solver.grain(i);
    CHECK((g.position.z == 0.0 && g.velocity.z == 0.0 && g.spin.x == 0.0 && g.spin.y == 0.0 && g.spin.z != 0.0));
  }
}

TEST_CASE("A run is the same bits in one piece, in many, and from a saved state", "[events]") {
  const double length = 5.0;
  Settings s = periodic(length);
  s.law = {0.95, 0.0, 0.75, 0.3, 0.1};
  s.gravity = {0, 0, -1};
  Solver once(s, gas(4, length, 4)), pieces(s, gas(4, length, 4)), restored(s, gas(4, length, 9));
  CHECK_THROWS_WITH(restored.restore(pieces.state()), Catch::Contains("other grains"));
  restored = Solver(s, gas(4, length, 4));
  restored.run(0.3);
  once.run(3.0);
  for (int k = 1; k <= 100; ++k) {
    pieces.run(0.015 * k);
    pieces.overlap();
  }
  restored.restore(pieces.state());
  CHECK(restored.time() == pieces.time());
  pieces.run(3.0);
  while (!restored.run(3.0, 7)) {
  }
  CHECK(once.account().collisions > 200.0);
  CHECK(pieces.state() == once.state());
  CHECK(restored.state() == once.state());
}

TEST_CASE("Damaged states of hard grains are refused, and no number in one leads out of its lists", "[events]") {
  const double length = 4.0;
  Settings s = periodic(length);
  Solver solver(s, gas(2, length, 6));
  solver.run(1.0);
  const std::vector<double> good = solver.state();
  std::vector<double> wrong = good;
  wrong.pop_back();
  CHECK_THROWS_AS(solver.restore(wrong), std::invalid_argument);
  int refused = 0;
  for (std::size_t k = 0; k < good.size(); ++k)
    for (const double number : {-3.0, 1e6, std::nan("")}) {
      wrong = good;
      wrong[k] = number;
      Solver other(solver);
      try {
        other.restore(wrong);
        other.run(other.time() + 0.1, 50);
      } catch (const std::exception&) {
        ++refused;
      }
    }
  CHECK(refused > int(good.size()));
}

TEST_CASE("Rounding ends the collapse of a row, and contacts that have a duration pass it", "[events]") {
  // Three in a row collapse for e < 7 - 4 sqrt(3) = 0.072 (S. McNamara, W. R. Young, Phys. Fluids A 4 (1992) 496).
  Settings s;
  s.law.restitution = 0.05;
  const std::vector<Grain> row{sphere(1, 0.5, {0, 0, 0}, {1, 0, 0}), sphere(1, 0.5, {1.5, 0, 0}),
                               sphere(1, 0.5, {3.0, 0, 0}, {-0.9, 0, 0})};
  Solver collapsing(s, row);
  const double before = balance(collapsing);
  collapsing.run(10.0);
  CHECK(collapsing.account().collisions > 30.0);
  CHECK(std::fabs(collapsing.grain(0).velocity.x - collapsing.grain(2).velocity.x) < 1e-12);
  CHECK(balance(collapsing) == Approx(before).epsilon(1e-13));
  CHECK(collapsing.overlap() < 1e-13);
  s.contact_duration = 1e-3;
  Solver passing(s, row);
  passing.run(10.0);
  CHECK(passing.account().elastic > 0.0);
  CHECK(passing.account().collisions < 30.0);
  CHECK(balance(passing) == Approx(before).epsilon(1e-13));
  CHECK(passing.overlap() < 1e-14);
}

TEST_CASE("Hard grains that cannot be are refused in one line", "[events]") {
  const Grain one = sphere(1, 0.5, {0, 0, 0});
  Settings s;
  CHECK(refusal(s, {one}) == "accepted");
  CHECK(refusal(s, {}) == "there are no grains");
  CHECK(refusal(s, {one, sphere(1, 0.5, {5, 0, 0}), sphere(1, 0.5, {0, 0, 0.9})}) == "grains 0 and 2 overlap by 0.1 m at the start");
  CHECK(refusal(s, {sphere(1, 0.5, {0, std::nan(""), 0})}) == "grain 0: position, velocity and spin must be finite numbers");
  CHECK(refusal(s, {sphere(0, 0.5, {})}) == "grain 0: mass must be > 0 kg and finite, not 0");
  CHECK(refusal(s, {sphere(1, -1, {})}) == "grain 0: radius must be > 0 m and finite, not -1");
  s.periods[2] = {0.0, 2.9};
  CHECK(refusal(s, {one}) == "the period along z, 2.9 m, must be longer than three of the largest diameters, 3 m");
  s = {};
  s.law.restitution = 1.5;
  CHECK(refusal(s, {one}) == "restitution must be between 0 and 1, not 1.5");
  s.law.restitution = std::nan("");
  CHECK(refusal(s, {one}) == "restitution must be between 0 and 1, not nan");
  s = {};
  s.dimension = 2;
  CHECK(refusal(s, {sphere(1, 0.5, {0, 0, 1})}) ==
        "grain 0: in two dimensions positions and velocities have no z component, and spins no other");
  s = {};
  s.contact_duration = -1.0;
  CHECK(refusal(s, {one}) == "contact_duration must be >= 0 s and finite, not -1");
}
