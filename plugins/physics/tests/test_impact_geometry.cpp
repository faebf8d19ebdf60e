// Candidates: pairs against the double loop, walls against their definition, triangles against the surface they make up.
#include <cmath>
#include <random>
#include <vector>
#include "catch.hpp"

#include "dembark/impact/geometry.hpp"
#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using Catch::WithinAbs;
using impact_scenes::step;

namespace {

std::vector<Body> cloud(int n, double size, bool flat, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Body> bodies(n);
  for (int i = 0; i < n; ++i) {
    bodies[i].id = (i * 7) % n;
    bodies[i].radius = 0.05 + 0.1 * unit(random);
    bodies[i].position = {size * unit(random), size * unit(random), flat ? 0.0 : size * unit(random)};
  }
  return bodies;
}

/// Two triangles that make up the unit square in z = 0.
std::vector<Triangle> square() {
  std::vector<Triangle> t(2);
  const Vec3<double> p{0, 0, 0}, q{1, 0, 0}, r{1, 1, 0}, s{0, 1, 0};
  t[0].node[0] = p, t[0].node[1] = q, t[0].node[2] = r, t[0].id = 0;
  t[1].node[0] = p, t[1].node[1] = r, t[1].node[2] = s, t[1].id = 1;
  return t;
}

std::vector<Contact> on_mesh(const std::vector<Body>& bodies, const std::vector<Triangle>& triangles, double reach) {
  Mesh mesh;
  mesh.update(triangles);
  std::vector<Contact> contacts;
  TriangleFinder().find(bodies, mesh, reach, contacts);
  return contacts;
}

Body ball(double x, double y, double z, double radius = 0.1) {
  Body b;
  b.radius = radius;
  b.position = {x, y, z};
  return b;
}

}  // namespace

TEST_CASE("pairs are those of the double loop, sorted, also when bodies have moved since the last search") {
  for (const bool flat : {true, false}) {
    std::vector<Body> bodies = cloud(300, flat ? 4.0 : 1.5, flat, 5);
    PairFinder finder;
    std::mt19937 random(1);
    std::normal_distribution<double> step(0.0, 0.002);
    for (int round = 0; round < 20; ++round) {
      if (round == 10) bodies[3].position.x += 1e4;  // one that flies off
      std::vector<Contact> contacts;
      finder.find(bodies, 0.01, contacts);
      std::size_t count = 0;
      for (const Body& a : bodies)
        for (const Body& b : bodies)
          if (a.id < b.id && norm(a.position - b.position) - a.radius - b.radius <= 0.01) ++count;
      REQUIRE(contacts.size() == count);
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        const Contact& c = contacts[i];
        REQUIRE(c.key_a < c.key_b);
        if (i) REQUIRE(std::make_pair(contacts[i - 1].key_a, contacts[i - 1].key_b) < std::make_pair(c.key_a, c.key_b));
        REQUIRE(dot(c.normal, bodies[c.a].position - bodies[c.b].position) > 0.0);
      }
      for (Body& b : bodies) b.position += {step(random), step(random), flat ? 0.0 : step(random)};
    }
  }
}

TEST_CASE("one body far away adds no work to the search") {
  const auto visits = [](double far) {
    std::vector<Body> bodies = cloud(1000, 6.0, false, 3);
    bodies[0].position.x += far;
    PointGrid grid;
    grid.build(bodies.size(), [&](std::size_t i) { return bodies[i].position; }, 0.3);
    int count = 0;
    grid.pairs([&](int, int) { ++count; });
    return count;
  };
  CHECK(visits(1e4) <= visits(0.0) + 50);
  CHECK(visits(1e300) <= visits(0.0) + 50);
}

TEST_CASE("bodies may all go") {
  PairFinder finder;
  std::vector<Contact> contacts;
  finder.find(cloud(50, 100.0, false, 2), 0.1, contacts);
  contacts.clear();
  finder.find({}, 0.1, contacts);
  CHECK(contacts.empty());
}

TEST_CASE("a body without a place is named") {
  std::vector<Body> bodies = cloud(3, 1.0, false, 2);
  bodies[1].position.y = NAN;
  std::vector<Contact> contacts;
  PairFinder finder;
  CHECK_THROWS_WITH(finder.find(bodies, 0.1, contacts), "body " + std::to_string(bodies[1].id) + ": position is not a finite number");
}

TEST_CASE("a plane with two sides presses to the side of the centre, also one on the plane itself") {
  Plane plane;
  plane.point = {0, 1, 0};
  plane.two_sided = true;
  std::vector<Contact> c;
  plane_contacts({ball(0, 1.05, 0), ball(0, 0.95, 0), ball(0, 1.0, 0), ball(0, 0.5, 0)}, plane, 0.0, c);
  REQUIRE(c.size() == 3);
  for (int i = 0; i < 2; ++i) CHECK_THAT(c[std::size_t(i)].gap, WithinAbs(-0.05, 1e-15));
  CHECK((c[0].normal.y == 1.0 && c[1].normal.y == -1.0 && c[2].normal.y == 1.0));
  CHECK(c[2].gap == -0.1);
}

TEST_CASE("planes and the inside of a drum") {
  std::vector<Contact> c;
  Plane plane;
  plane.point = {0, 1, 0};
  plane_contacts({ball(0, 1.15, 0), ball(0, 1.5, 0)}, plane, 0.1, c);
  REQUIRE(c.size() == 1);
  CHECK_THAT(c[0].gap, WithinAbs(0.05, 1e-15));
  CHECK(c[0].normal.y == 1.0);
  c.clear();
  Drum drum;
  drum.point = {5, 0, 3};
  drum.radius = 2.0;
  drum.omega = 3.0;
  cylinder_contacts({ball(5, -1.85, 0), ball(5, 0, 0)}, drum, 0.1, c);
  REQUIRE(c.size() == 1);
  CHECK_THAT(c[0].gap, WithinAbs(0.05, 1e-15));
  CHECK_THAT(c[0].normal.y, WithinAbs(1.0, 1e-15));
  CHECK_THAT(c[0].point_velocity.x, WithinAbs(6.0, 1e-12));  // at the bottom of a drum that turns anticlockwise
}

TEST_CASE("two triangles are one square: one contact on the shared diagonal and beside it") {
  for (const double x : {0.2, 0.5, 0.7, 0.500001, 0.46}) {
    const std::vector<Contact> c = on_mesh({ball(x, 0.5, 0.09)}, square(), 0.01);
    REQUIRE(c.size() == 1);
    CHECK_THAT(c[0].gap, WithinAbs(-0.01, 1e-12));
    CHECK_THAT(c[0].normal.z, WithinAbs(1.0, 1e-12));
  }
  std::vector<Contact> c = on_mesh({ball(-0.05, -0.05, 0.0)}, square(), 0.05);  // the corner of both
  REQUIRE(c.size() == 1);
  CHECK_THAT(c[0].gap, WithinAbs(std::sqrt(0.005) - 0.1, 1e-12));
  c = on_mesh({ball(-0.05, 0.4, -0.02)}, square(), 0.05);  // an outer edge
  REQUIRE(c.size() == 1);
  CHECK_THAT(c[0].normal.x, WithinAbs(-0.05 / std::hypot(0.05, 0.02), 1e-12));
}

TEST_CASE("a concave corner gives two contacts, a convex one its edge") {
  std::vector<Triangle> t = square();
  Triangle wall;
  wall.node[0] = {0, 0, 0}, wall.node[1] = {0, 1, 0}, wall.node[2] = {0, 0.5, 1}, wall.id = 2;
  t.push_back(wall);
  std::vector<Contact> c = on_mesh({ball(0.09, 0.5, 0.08)}, t, 0.0);
  REQUIRE(c.size() == 2);
  CHECK_THAT(c[0].normal.x + c[1].normal.x, WithinAbs(1.0, 1e-12));
  CHECK_THAT(c[0].normal.z + c[1].normal.z, WithinAbs(1.0, 1e-12));
  t[2].node[2] = {0, 0.5, -1};
  c = on_mesh({ball(-0.06, 0.5, 0.06)}, t, 0.0);
  REQUIRE(c.size() == 1);
  CHECK_THAT(c[0].normal.z, WithinAbs(std::sqrt(0.5), 1e-12));
}

TEST_CASE("a moving mesh gives its velocity at the contact") {
  std::vector<Triangle> t = square();
  t[0].velocity[1] = {0, 0, 2};  // node (1, 0): the lower triangle tilts
  const std::vector<Contact> c = on_mesh({ball(0.75, 0.25, 0.1)}, t, 0.01);
  REQUIRE(c.size() == 1);
  CHECK_THAT(c[0].point_velocity.z, WithinAbs(1.0, 1e-12));
}

TEST_CASE("a contact keeps its friction when the body moves on to the next triangle") {
  Settings s;
  s.dt = 1e-4;
  s.pairs[0].friction.static_friction = s.pairs[0].friction.kinetic_friction = 0.5;
  System system(s);
  std::vector<Body> bodies{ball(0.5, 0.52, 0.0999)};
  bodies[0].mass = 10;
  bodies[0].inertia = INFINITY;
  bodies[0].velocity = {1.0, 0, 0};
  double last = 0.0;
  for (int i = 0; i < 800; ++i) {
    const std::vector<Contact> c = on_mesh(bodies, square(), 0.01);
    std::vector<Vec3<double>> force(1), torque(1);
    REQUIRE(c.size() == 1);
    step(system, bodies, c, i, 1.0, force, torque);
    if (i) REQUIRE(force[0].x <= last + 1e-9);
    last = force[0].x;
    bodies[0].position.x += 1e-4 * 0.5;  // driven over the diagonal: the spring builds up, then slides
  }
  CHECK(bodies[0].position.x > 0.53);
  CHECK(system.report().impacts_begun == 1);
}
