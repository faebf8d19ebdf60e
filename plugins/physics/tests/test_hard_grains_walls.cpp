// Hard grains and walls: flights, moving walls against an independent integration, the search that misses no contact.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <fstream>
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

constexpr double g = 9.81;

Wall floor_with(const std::string& motion, const CollisionLaw& law = {}) {
  Wall wall;
  if (!motion.empty()) wall.motion = PrescribedMotion(motion);
  wall.law = law;
  return wall;
}

Settings above(const Wall& wall) {
  Settings s;
  s.gravity = {0, 0, -g};
  s.walls = {wall};
  return s;
}

Grain ball(double height, Vector velocity = {}) { return {2.0, 0.1, {0, 0, 0.1 + height}, velocity, {}}; }

double balance(const Solver& solver) {
  const std::array<double, 3> e = solver.energies();
  double work = 0.0;
  for (const WallAccount& wall : solver.account().walls) work += wall.work;
  return e[0] + e[1] + e[2] + solver.account().normal_loss + solver.account().friction_loss - work;
}

/// A ball of radius 0 above the plate A sin(w t): its impacts by bisection between close samples, in extended precision.
struct Bouncing {
  long double A, w, e, t, x, v;
  long double work = 0.0L;

  long double gap(long double s) const { return x + v * s - 0.5L * g * s * s - A * std::sin(w * (t + s)); }
  /// To the next impact, which is the first sample below the plate after one above.
  void next() {
    const long double step = 1e-5L;
    long double from = step;
    while (gap(from) <= 0.0L) from += step;
    while (gap(from + step) > 0.0L) from += step;
    long double to = from + step;
    for (int k = 0; k < 200; ++k) {
      const long double middle = 0.5L * (from + to);
      (gap(middle) > 0.0L ? from : to) = middle;
    }
    x += v * from - 0.5L * g * from * from;
    v -= g * from;
    t += from;
    const long double plate = A * w * std::cos(w * t), change = -(1.0L + e) * (v - plate);
    work += 2.0L * change * plate;
    v += change;
  }
};

}  // namespace

TEST_CASE("A ball falls in parabolas, and leaves the floor with e times its speed", "[events]") {
  CollisionLaw law;
  law.restitution = 0.5;
  Solver solver(above(floor_with("", law)), {ball(1.0, {3.0, 0, 0})});
  const double first = std::sqrt(2.0 / g), second = first + 2.0 * 0.5 * first;
  solver.run(0.5 * (first + second));
  CHECK(solver.grain(0).position.z == Approx(0.1 + 0.25).epsilon(1e-13));
  CHECK(solver.grain(0).position.x == Approx(1.5 * (first + second)).epsilon(1e-13));
  CHECK(std::fabs(solver.grain(0).velocity.z) < 1e-13);
  CHECK(solver.account().normal_loss == Approx(0.75 * 2.0 * g).epsilon(1e-13));
  solver.run(second + 1e-9);
  CHECK(solver.account().walls[0].collisions == 2.0);
  CHECK(solver.account().walls[0].impulse.z == Approx(2.0 * (1.5 + 0.75) * std::sqrt(2.0 * g)).epsilon(1e-13));
}

TEST_CASE("A plate gives a bouncing ball the work of an integration in extended precision", "[events]") {
  const double e = GENERATE(0.6, 1.0), amplitude = 2e-3, frequency = 12.0;
  CollisionLaw law;
  law.restitution = e;
  const double height = 0.01;
  Solver solver(above(floor_with("harmonic amplitude 0 0 0.002 frequency 12 ramp 0", law)), {ball(height)});
  Bouncing exact{amplitude, 2.0L * 3.14159265358979323846264338328L * frequency, e, 0.0L, height, 0.0L};
  for (int impact = 1; impact <= 12; ++impact) {
    exact.next();
    solver.run(double(exact.t) + 1e-8);
    REQUIRE(solver.account().walls[0].collisions == impact);
    CHECK(solver.account().walls[0].work == Approx(double(exact.work)).epsilon(1e-7).margin(1e-9));
    CHECK(solver.grain(0).velocity.z == Approx(double(exact.v) - 1e-8 * g).epsilon(1e-7).margin(1e-9));
  }
  CHECK(balance(solver) == Approx(2.0 * g * (0.1 + height)).epsilon(1e-12));
}

TEST_CASE("A wall at constant speed is a wall at rest seen from a moving frame", "[events]") {
  CollisionLaw law;
  law.restitution = 0.7;
  Solver moving(above(floor_with("uniform velocity 0.4 0 0.3", law)), {ball(0.5, {0.4, 0, 0.3})});
  Solver resting(above(floor_with("", law)), {ball(0.5)});
  moving.run(1.0);
  resting.run(1.0);
  REQUIRE(moving.account().walls[0].collisions == resting.account().walls[0].collisions);
  CHECK(moving.grain(0).position.z == Approx(resting.grain(0).position.z + 0.3).epsilon(1e-13));
  CHECK(moving.account().normal_loss == Approx(resting.account().normal_loss).epsilon(1e-13));
}

TEST_CASE("A rough belt drives a ball until it slips no more", "[events]") {
  const CollisionLaw law{1.0, 0.0, 0.75, 0.5, 0.0};
  Solver solver(above(floor_with("uniform velocity 1 0 0", law)), {ball(0.2)});
  solver.run(4.0);
  const Grain b = solver.grain(0);
  // Velocity and spin of the surface are those of the belt; the ball has taken 2/7 of its speed.
  CHECK(b.velocity.x == Approx(2.0 / 7.0).epsilon(1e-12));
  CHECK(b.velocity.x - b.radius * b.spin.y == Approx(1.0).epsilon(1e-12));
  CHECK(balance(solver) == Approx(2.0 * g * 0.3).epsilon(1e-13));
  CHECK(solver.account().walls[0].impulse.x == Approx(2.0 * b.velocity.x).epsilon(1e-13));
}

TEST_CASE("The search passes no contact of random flights above shaken plates", "[events]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int touched = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool falls = trial % 2 == 0, ramp = trial % 3 == 0;
    const double phase = 3.0 * uniform(random);
    const Wall wall =
        floor_with("harmonic amplitude 0.5e-3 0 2e-3 frequency 40 phase " + number_text(phase) + (ramp ? " ramp 1.5" : " ramp 0") +
                   (trial % 5 == 0 ? " uniform velocity 0 0 0.05 start 0.02 until 0.03" : ""));
    const Flight flight{0.0, {0, 0, 0.1 + 5e-3 * (1.0 + uniform(random))}, {1, 0, 0.2 * uniform(random)}, {0, 0, falls ? -g : 0.0}, 0.1};
    const motion::Bounds bounds = wall.motion.bounds(wall.normal);
    const WallContact found = wall_contact(flight, wall, bounds, 0.25);
    double least = never;
    const double end = std::min(found.time, 0.25);
    for (int k = 0; k <= 5000; ++k) least = std::min(least, flight.to(wall, end * k / 5000.0).gap);
    REQUIRE(least > -1e-15);
    if (!(found.touches && found.time <= 0.25)) continue;
    ++touched;
    const WallGap there = flight.to(wall, found.time);
    REQUIRE(std::fabs(there.gap) < 1e-15);
    REQUIRE(there.rate <= 0.0);
  }
  CHECK(touched > 150);
}

TEST_CASE("A plate that passes a ball by less than rounding from a tangent is hit, or missed, as it must be", "[events]") {
  // Without gravity, at rest at the height of the plate's crest, or a little above or below it.
  const Wall wall = floor_with("harmonic amplitude 0 0 2e-3 frequency 40 ramp 0");
  const motion::Bounds bounds = wall.motion.bounds(wall.normal);
  for (const double off : {1e-6, 1e-9, 1e-12, 1e-14}) {
    const Flight below{0.0, {0, 0, 0.1 + 2e-3 - off}, {}, {}, 0.1}, over{0.0, {0, 0, 0.1 + 2e-3 + off}, {}, {}, 0.1};
    const WallContact hit = wall_contact(below, wall, bounds, never), missed = wall_contact(over, wall, bounds, never);
    REQUIRE(hit.touches);
    // cos(w t) = off / A before the crest
    CHECK(0.25 / 40.0 - hit.time == Approx(std::sqrt(2.0 * off / 2e-3) / (two_pi * 40.0)).epsilon(1e-2));
    CHECK(missed.time == never);
  }
}

TEST_CASE("Bounds of a motion hold, and its jumps are found", "[events]") {
  const Vector along{0.0, 0.6, 0.8};
  const std::string name = "test_hard_grains_table.csv";
  std::ofstream(name) << "0 0 0 0\n0.4 0 1 2\n0.9 0 -1 1\n1.2 0 0.5 0\n2 0 0 0.3\n";
  for (const std::string words :
       {"harmonic amplitude 1 2 -1 frequency 3 phase 0.7 ramp 0", "harmonic amplitude 1 2 -1 frequency 3 ramp 1 until 2",
        "circular first 0 1 0 second 0 0 2 frequency 2 ramp 2", "uniform velocity 0 1 1 acceleration 0 0 3 start 0.5 until 1.5",
        "jolts shape half_sine acceleration 0 0 5 duration 0.2 interval 0.3 count 3", "table file test_hard_grains_table.csv"}) {
    const PrescribedMotion motion(words);
    const motion::Bounds bounds = motion.bounds(along);
    double far = 0.0, strong = 0.0;
    for (int k = 0; k <= 30000; ++k) {
      const WallState s = motion.at(1e-4 * k);
      far = std::max(far, std::fabs(dot(s.displacement, along)));
      strong = std::max(strong, std::fabs(dot(s.acceleration, along)));
    }
    CAPTURE(words);
    CHECK(far <= bounds.displacement * (1.0 + 1e-12));
    CHECK(strong <= bounds.acceleration * (1.0 + 1e-12));
    CHECK(bounds.acceleration < 2.0 * strong);
  }
  std::remove(name.c_str());
  const PrescribedMotion late("uniform velocity 0 1 1 start 0.5 until 1.5 harmonic amplitude 0 0 1 frequency 1 ramp 0 until 1");
  CHECK(late.next_jump(0.0) == 0.5);
  CHECK(late.next_jump(0.5) == 1.0);
  CHECK(late.next_jump(1.0) == 1.5);
  CHECK(late.next_jump(1.5) == never);
}

TEST_CASE("A ball comes to rest on floor and plate with contacts that have a duration, or collapses", "[events]") {
  CollisionLaw law;
  law.restitution = GENERATE(0.0, 0.5);
  Solver collapsing(above(floor_with("", law)), {ball(0.1)});
  CHECK_THROWS_WITH(collapsing.run(5.0), Catch::Contains("inelastic collapse") && Catch::Contains("grain 0"));
  Settings s = above(floor_with("", law));
  s.contact_duration = 1e-3;
  Solver resting(s, {ball(0.1)});
  resting.run(2.0);
  // A flight of that duration is g t^2 / 8 high.
  CHECK(resting.grain(0).position.z - 0.1 < g * 1e-6 / 8.0 * 1.01);
  CHECK(resting.grain(0).position.z - 0.1 > -1e-15);
  CHECK(resting.account().walls[0].collisions < 4100.0);
  CHECK(balance(resting) == Approx(2.0 * g * 0.2).epsilon(1e-12));
  // Mean force on the floor: the weight.
  const double before = resting.account().walls[0].impulse.z;
  resting.run(3.0);
  CHECK(resting.account().walls[0].impulse.z - before == Approx(2.0 * g).epsilon(2e-3));
  // Carried by a plate that accelerates less than gravity, from rest on it.
  s.walls = {floor_with("harmonic amplitude 0 0 1e-3 frequency 10 ramp 2", law)};
  Solver carried(s, {ball(0.0)});
  for (int k = 1; k <= 100; ++k) {
    carried.run(0.01 * k);
    const double plate = s.walls[0].motion.at(0.01 * k).displacement.z;
    CHECK(carried.grain(0).position.z - 0.1 - plate < 1e-5);
    CHECK(carried.grain(0).position.z - 0.1 - plate > -1e-15);
  }
}

TEST_CASE("A bed of grains on a shaken plate keeps its accounts and never overlaps", "[events]") {
  Settings s = above(floor_with("harmonic amplitude 0 0 2e-3 frequency 25 ramp 2", {0.8, 0.0, 0.75, 0.4, 0.1}));
  s.law = {0.8, 0.0, 0.75, 0.3, 0.2};
  s.periods[0] = s.periods[1] = {0.0, 0.02};
  s.contact_duration = 1e-4;
  std::vector<Grain> grains;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> size(2.2e-3, 2.5e-3), speed(-0.1, 0.1);
  double mass = 0.0;
  for (int i = 0; i < 48; ++i) {
    const double r = size(random);
    grains.push_back({r * r * r,
                      r,
                      {5e-3 * (i % 4) + 2.5e-3, 5e-3 * (i / 4 % 4) + 2.5e-3, 5.5e-3 * (i / 16) + 3e-3},
                      {speed(random), speed(random), speed(random)},
                      {}});
    mass += grains.back().mass;
  }
  Solver solver(s, grains);
  const double before = balance(solver);
  Vector pushed;
  for (const Grain& one : grains) pushed += one.mass * one.velocity;
  double largest = -1.0;
  for (int k = 1; k <= 40; ++k) {
    solver.run(0.01 * k);
    largest = std::max(largest, solver.overlap());
  }
  CHECK(largest < 1e-15);
  CHECK(solver.account().walls[0].work > 0.0);
  CHECK(std::fabs(balance(solver) - before) < 1e-12 * solver.account().walls[0].work);
  for (int i = 0; i < solver.size(); ++i) pushed -= solver.grain(i).mass * solver.grain(i).velocity;
  pushed += solver.account().walls[0].impulse + (0.4 * mass) * s.gravity;
  CHECK(norm(pushed) < 1e-12 * mass);
}

TEST_CASE("Walls of hard grains that cannot be are refused in one line", "[events]") {
  CHECK(refusal(above(floor_with("")), {ball(0.0)}) == "accepted");
  CHECK(refusal(above(floor_with("harmonic amplitude 0 0 2e-3 frequency 30")), {ball(1.0), ball(-1e-3)}) ==
        "grain 1 is 0.001 m inside wall 0 at the start");
  CHECK(refusal(above(floor_with("rotation point 0 0 0 axis 1 0 0 rate 1")), {ball(1.0)}) ==
        "wall 0: it must not turn: hard grains have walls that keep their direction");
  Settings s = above(floor_with("", {1.1, 0.0, 0.75, 0.0, 0.0}));
  CHECK(refusal(s, {ball(1.0)}) == "wall 0: restitution must be between 0 and 1, not 1.1");
  s = above(floor_with(""));
  s.walls[0].normal = {0, 0, 2};
  CHECK(refusal(s, {ball(1.0)}) == "wall 0: normal must be a unit vector");
  s = above(floor_with(""));
  s.periods[2] = {0.0, 2.0};
  CHECK(refusal(s, {ball(1.0)}) == "wall 0: its normal has a part along z, along which all repeats itself");
}
