// Capsules: where they touch, how they are found, and that the rows of a step are those of their motion.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <vector>
#include "catch.hpp"

#include "dembark/impact/log_list.hpp"
#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

Body log_at(const Vec3<double>& position, const Vec3<double>& half_axis, double radius = 0.1, int id = 0) {
  Body b;
  b.id = id;
  b.radius = radius;
  b.position = position;
  b.half_axis = half_axis;
  b.mass = 40.0;
  const CapsuleInertia own = capsule_inertia(b.mass, radius, 2.0 * norm(half_axis));
  b.inertia = own.across;
  b.axial_inertia = own.axial;
  return b;
}

std::vector<Contact> touch(const Body& a, const Body& b, double reach = 0.01) {
  std::vector<Contact> first, second;
  capsule_contacts(a, 0, b, 1, reach, first, second);
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

std::vector<Body> logs(int n, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Body> bodies;
  for (int i = 0; i < n; ++i) {
    Vec3<double> u{normal(random), normal(random), normal(random)};
    u *= (i % 5 == 0 ? 0.0 : 0.6 * unit(random)) / norm(u);
    bodies.push_back(log_at(size * Vec3<double>{unit(random), unit(random), unit(random)}, u, 0.04 + 0.06 * unit(random), (i * 7) % n));
    bodies.back().velocity = {normal(random), normal(random), normal(random)};
    bodies.back().spin = {normal(random), normal(random), normal(random)};
  }
  return bodies;
}

}  // namespace

TEST_CASE("two segments come closest where no other two of their points are closer") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vec3<double>{normal(random), normal(random), normal(random)}; };
  for (int trial = 0; trial < 400; ++trial) {
    Vec3<double> u = vector(), v = trial % 4 == 0 ? u : trial % 4 == 1 ? u + 1e-7 * vector() : vector();
    u *= 1.0 / norm(u);
    v *= 1.0 / norm(v);
    const Vec3<double> d = vector();
    const double a = std::fabs(normal(random)), b = trial % 7 == 0 ? 0.0 : std::fabs(normal(random));
    const auto distance = [&](double s, double t) { return norm(d + s * u - t * v); };
    const ClosestPair found = closest_pair(a, u, b, v, d);
    CHECK(std::fabs(found.along_a) <= a);
    CHECK(std::fabs(found.along_b) <= b);
    const double least = distance(found.along_a, found.along_b);
    for (int i = 0; i <= 40; ++i)
      for (int k = 0; k <= 40; ++k) CHECK(distance(a * (i / 20.0 - 1.0), b * (k / 20.0 - 1.0)) >= least - 1e-12);
  }
}

TEST_CASE("sides that lie on each other touch at both ends of what they have in common, with half of the stiffness each") {
  const std::vector<Contact> c = touch(log_at({0, 0, 0.195}, {0.5, 0, 0}), log_at({0.7, 0, 0}, {-0.6, 0, 0}, 0.1, 3));
  REQUIRE(c.size() == 2);
  for (int k = 0; k < 2; ++k) {
    CHECK(c[k].lever);
    CHECK(c[k].share == 0.5);
    CHECK_THAT(c[k].gap, WithinAbs(-0.005, 1e-15));
    CHECK(norm(c[k].normal - Vec3<double>{0, 0, 1}) < 1e-15);
    CHECK(c[k].key_b == body_key(3, k));
    CHECK(shown_id(c[k].key_b) == 3);
    // The common segment is from x = 0.1 to 0.5.
    CHECK_THAT(c[k].offset_a.x, WithinAbs(k == 0 ? 0.1 : 0.5, 1e-15));
    CHECK_THAT(c[k].offset_b.x, WithinAbs(k == 0 ? -0.6 : -0.2, 1e-15));
  }
}

TEST_CASE("logs that cross, an end on a side, an end on an end") {
  const Body lower = log_at({0, 0, 0}, {0.5, 0, 0}, 0.1, 1);
  std::vector<Contact> c = touch(log_at({0.2, 0.1, 0.199}, {0, 0.4, 0}), lower);
  REQUIRE(c.size() == 1);
  CHECK(c[0].share == 1.0);
  CHECK_THAT(c[0].gap, WithinAbs(-0.001, 1e-15));
  CHECK(norm(c[0].offset_a - Vec3<double>{0, -0.1, 0}) < 1e-15);
  CHECK(norm(c[0].offset_b - Vec3<double>{0.2, 0, 0}) < 1e-15);
  // Ends: all of the stiffness, of an upright log, a tilted one, and on a cap.
  for (const Vec3<double> axis : {Vec3<double>{0, 0, 0.4}, Vec3<double>{0.1, 0, 0.4}, Vec3<double>{0, 0.3, 0.1}}) {
    c = touch(log_at(axis + Vec3<double>{0.2, 0, 0.2}, axis), lower);
    REQUIRE(c.size() == 1);
    CHECK(c[0].share == 1.0);
    CHECK_THAT(c[0].gap, WithinAbs(0.0, 1e-15));
    CHECK(norm(c[0].normal - Vec3<double>{0, 0, 1}) < 1e-12);
    CHECK(norm(c[0].offset_a + axis) < 1e-12);
  }
  c = touch(log_at({1.1, 0, 0}, {0.4, 0, 0}), lower);
  REQUIRE(c.size() == 1);
  CHECK(c[0].share == 1.0);
  CHECK_THAT(c[0].gap, WithinAbs(0.0, 1e-15));
  CHECK_THAT(c[0].normal.x, WithinAbs(1.0, 1e-15));
}

TEST_CASE("points of contact move without a jump as logs turn, and their shares make one") {
  const Body lower = log_at({0, 0, 0}, {0.5, 0, 0}, 0.1, 1);
  for (const int motion : {0, 1, 2}) {  // turned about the normal, tilted, drawn off along the axis
    Vec3<double> last[2];
    double shares[2] = {0.0, 0.0};
    for (int i = 0; i <= 20000; ++i) {
      const double angle = motion < 2 ? (i - 10000) * 1e-6 : 1e-4, x = motion < 2 ? 0.02 : 0.89 + i * 1e-6;
      const Vec3<double> u{0.4 * std::cos(angle), motion == 0 ? 0.4 * std::sin(angle) : 0.0, motion == 1 ? 0.4 * std::sin(angle) : 0.0};
      const std::vector<Contact> c = touch(log_at({x, 0.0, 0.2}, u), lower, 1.0);
      Vec3<double> now[2];
      double share[2] = {0.0, 0.0}, sum = 0.0;
      for (const Contact& one : c) {
        const int k = one.key_b != 1;
        now[k] = one.offset_a, share[k] = one.share, sum += one.share;
      }
      REQUIRE_THAT(sum, WithinAbs(1.0, 1e-15));
      for (int k = 0; k < 2; ++k) {
        if (i > 0 && share[k] > 0.0 && shares[k] > 0.0) REQUIRE(norm(now[k] - last[k]) < 1e-3);
        if (i > 0) REQUIRE(std::fabs(share[k] - shares[k]) < 1e-3);
        last[k] = now[k], shares[k] = share[k];
      }
    }
  }
}

TEST_CASE("capsules on a plane and in a drum touch with their caps") {
  Plane plane;
  std::vector<Contact> c;
  plane_contacts({log_at({0, 0.1, 0}, {0.5, 0, 0})}, plane, 0.01, c);
  REQUIRE(c.size() == 2);
  CHECK(c[0].key_b < c[1].key_b);
  for (const Contact& one : c) CHECK((one.share == 0.5 && one.gap == 0.0 && !one.concave && shown_id(one.key_b) == -1));
  CHECK(c[0].offset_a.x == 0.5);
  c.clear();
  plane_contacts({log_at({0, 0.6, 0}, {0, 0.5, 0})}, plane, 1.1, c);
  REQUIRE(c.size() == 1);
  CHECK((c[0].share == 1.0 && c[0].offset_a.y == -0.5));
  // In a drum, along it: as on a plane. Across it, both caps touch, each with all of its stiffness.
  Drum drum;
  c.clear();
  cylinder_contacts({log_at({0, -0.9, 3.0}, {0, 0, 0.5})}, drum, 1e-12, c);
  REQUIRE(c.size() == 2);
  for (const Contact& one : c) CHECK((one.share == 0.5 && one.concave && norm(one.normal - Vec3<double>{0, 1, 0}) < 1e-15));
  c.clear();
  cylinder_contacts({log_at({0, -std::sqrt(0.81 - 0.25), 0}, {0.5, 0, 0})}, drum, 1e-12, c);
  REQUIRE(c.size() == 2);
  for (const Contact& one : c) CHECK(one.share == 1.0);
  CHECK_THAT(norm(c[0].offset_a + c[1].offset_a), WithinAbs(0.0, 1e-15));
}

TEST_CASE("pairs of capsules are those of the double loop, sorted, also when they have moved and turned since the last search") {
  std::vector<Body> bodies = logs(300, 2.0, 5);
  PairFinder finder;
  std::mt19937 random(1);
  std::normal_distribution<double> step(0.0, 0.002);
  for (int round = 0; round < 20; ++round) {
    std::vector<Contact> contacts;
    finder.find(bodies, 0.01, contacts);
    std::size_t count = 0;
    for (const Body& a : bodies)
      for (const Body& b : bodies)
        if (a.id < b.id && segment_gap(a, b) <= 0.01) ++count;
    std::vector<Key> pairs;
    for (const Contact& c : contacts) {
      CHECK(c.key_a < shown_id(c.key_b));
      pairs.emplace_back(c.key_a, shown_id(c.key_b));
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    REQUIRE(pairs.size() == count);
    REQUIRE(count > 100);
    for (Body& b : bodies) {
      b.position += {step(random), step(random), step(random)};
      const double half = norm(b.half_axis);
      if (half == 0.0) continue;
      b.half_axis += Vec3<double>{step(random), step(random), step(random)};
      b.half_axis *= half / norm(b.half_axis);
    }
  }
}

TEST_CASE("rates of the gaps are those of the motion, whether logs cross or are nearly parallel") {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vec3<double>{normal(random), normal(random), normal(random)}; };
  const double dt = 1e-6;
  int crossing_seen = 0, parallel_seen = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const bool parallel = trial % 2 == 1;
    Vec3<double> u = vector(), v = parallel ? u + 1e-4 * vector() : vector(), d = vector();
    if (parallel) d -= (dot(d, u) / dot(u, u)) * u;
    std::vector<Body> now{log_at({0, 0, 0}, u * (0.5 / norm(u))), log_at(d * (0.21 / norm(d)), v * (0.4 / norm(v)), 0.1, 1)};
    for (Body& b : now) b.velocity = vector(), b.spin = vector();
    std::vector<Body> then = now;
    for (Body& b : then) {
      const double half = norm(b.half_axis);
      b.position += dt * b.velocity;
      b.half_axis += dt * cross(b.spin, b.half_axis);
      b.half_axis *= half / norm(b.half_axis);
    }
    Motion motion;
    motion.begin(now, 1e-4, 1.0);
    for (const Contact& c : touch(now[0], now[1], 0.3))
      for (const Contact& later : touch(then[0], then[1], 0.4)) {
        if (c.key_b != later.key_b || c.gap < -0.1) continue;  // so deep there is no direction
        CHECK_THAT((later.gap - c.gap) / dt, WithinAbs(motion.gap_rate(c), parallel ? 5e-3 : 1e-3));
        ++(parallel ? parallel_seen : crossing_seen);
      }
  }
  CHECK(crossing_seen > 500);
  CHECK(parallel_seen > 1500);
}

TEST_CASE("sweeps without a matrix solve what the matrix of capsules says") {
  const std::vector<Body> bodies = logs(60, 0.9, 11);
  std::vector<Contact> contacts;
  find_pairs(bodies, 0.02, contacts);
  Settings s;
  std::vector<std::vector<double>> forces;
  for (const LcpMethod method : {LcpMethod::automatic, LcpMethod::block}) {
    s.lcp.method = method;
    System system(s);
    std::vector<Vec3<double>> force(bodies.size()), torque(bodies.size());
    step(system, bodies, contacts, 0.0, 1.0, force, torque);
    CHECK(system.report().certificate < 1e-14);
    forces.emplace_back();
    for (const ContactResult& c : system.contacts()) forces.back().push_back(c.normal_force);
    // Action and reaction at one point: all torques about the origin cancel.
    Vec3<double> sum{}, moment{};
    double size = 0.0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      sum += force[b];
      moment += torque[b] + cross(bodies[b].position, force[b]);
      size += norm(force[b]);
    }
    CHECK(norm(sum) < 1e-12 * size);
    CHECK(norm(moment) < 1e-12 * size);
  }
  REQUIRE(forces[0].size() > 100);
  const double largest = *std::max_element(forces[0].begin(), forces[0].end());
  for (std::size_t i = 0; i < forces[0].size(); ++i) CHECK_THAT(forces[0][i], WithinAbs(forces[1][i], 1e-9 * largest));
}

TEST_CASE("bad capsules and contacts: one line that says what is wrong") {
  std::vector<Body> bodies{log_at({0, 0, 0}, {0.5, 0, 0}), log_at({0, 0.195, 0}, {0.5, 0, 0}, 0.1, 1)};
  std::vector<Contact> contacts;
  find_pairs(bodies, 0.01, contacts);
  REQUIRE(contacts.size() == 2);
  std::vector<Vec3<double>> force(2), torque(2);
  System system{Settings()};
  contacts[0].share = 0.0;
  CHECK_THROWS_WITH(step(system, bodies, contacts, 0, 1, force, torque), Catch::Contains("share of the stiffness must be > 0 and <= 1"));
  bodies[0].axial_inertia = 0.0;
  CHECK_THROWS_WITH(step(system, bodies, {}, 0, 1, force, torque), Catch::Contains("body 0: inertia about the axis must be > 0 kg m^2"));
}

TEST_CASE("the turn to an axis is the shortest one") {
  for (const Vec3<double> axis : {Vec3<double>{0, 0, 2}, Vec3<double>{0, 0, -3}, Vec3<double>{1, -2, 0.5}, Vec3<double>{1e-9, 0, -1}}) {
    const Quaternion q = rotation_to(axis);
    CHECK(norm(q.turned({0, 0, 1}) - axis * (1.0 / norm(axis))) < 1e-7);
    CHECK(q.z == 0.0);  // the axis of the turn lies across z
  }
}

TEST_CASE("the mean spin of a step turns a log as it turns freely, up to half a turn and beyond") {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vec3<double>{normal(random), normal(random), normal(random)}; };
  for (const double dt : {1e-9, 1e-3, 0.1, 1.0})
    for (int trial = 0; trial < 50; ++trial) {
      Body b = log_at({0, 0, 0}, 0.6 * vector());
      Attitude attitude{2.0 * norm(b.half_axis), rotation_to(b.half_axis), {}};
      b.spin = 5.0 * vector();
      attitude.begin(b);
      const Vec3<double> mean = attitude.mean_spin(b, dt);
      const Quaternion before = attitude.orientation;
      attitude.turn(b, dt);
      const Quaternion turned = rotation_by(dt * mean) * before, &free = attitude.orientation;
      const double same = turned.w * free.w + turned.x * free.x + turned.y * free.y + turned.z * free.z;
      CHECK_THAT(std::fabs(same), WithinAbs(1.0, 1e-15));
      CHECK(norm(turned.turned({1, 2, 3}) - free.turned({1, 2, 3})) < 1e-14);
      CHECK(dt * norm(mean) < 3.1416);
      if (dt < 1e-2) CHECK(norm(mean - b.spin) < 20.0 * dt * dot(b.spin, b.spin));
    }
  CHECK(norm(turn_of(Quaternion{})) == 0.0);
}

TEST_CASE("a log with an infinite mass has an infinite inertia and keeps its spin") {
  Body b = log_at({0, 0, 0}, {0.5, 0, 0});
  b.mass = INFINITY;
  b.spin = {0, 0, 2.0};
  Attitude attitude{1.0, rotation_to({1, 0, 0}), {}};
  attitude.shape(b);
  CHECK((std::isinf(b.inertia) && std::isinf(b.axial_inertia)));
  attitude.turn(b, 0.25);
  CHECK(norm(b.half_axis - 0.5 * Vec3<double>{std::cos(0.5), std::sin(0.5), 0}) < 1e-15);
  CHECK(b.spin.z == 2.0);
}

TEST_CASE("a list of logs is read line by line, or refused with the line that is wrong") {
  const std::string path = "list_of_logs.txt";
  const auto read = [&](const std::string& text) {
    std::ofstream(path) << text;
    return read_logs(path);
  };
  const auto found = read("# id length x y z\n7 1.5 0 0 -2  # upside down\n\n  3 0 1 1 0\n");
  REQUIRE(found.size() == 2);
  CHECK(found.at(7).length == 1.5);
  CHECK(norm(found.at(7).orientation.turned({0, 0, 1}) - Vec3<double>{0, 0, -1}) == 0.0);
  CHECK(found.at(3).length == 0.0);
  CHECK_THROWS_WITH(read("1 1 0 0 1\n2 -1 0 0 1"), Catch::Contains("line 2: the length (m) must be >= 0, not -1"));
  CHECK_THROWS_WITH(read("1 1 0 0 0"), Catch::Contains("line 1: the direction of the log must not be zero"));
  for (const char* const wrong : {"1 1 0 0", "1 1 0 0 1 2", "1 long 0 0 1", "1.5 1 0 0 1", "1 nan 0 0 1"})
    CHECK_THROWS_WITH(read(wrong), Catch::Contains("line 1: it must have five numbers"));
  CHECK_THROWS_WITH(read("1 1 0 0 1\n1 1 0 0 1"), Catch::Contains("line 2: atom 1 has a line already"));
  std::remove(path.c_str());
  CHECK_THROWS_WITH(read_logs(path), Catch::Contains("file list_of_logs.txt cannot be read"));
}
