// Boxes on planes and on each other: restitution, sliding and sticking, standing stacks, crossing edges, momentum and energy.
#include <cmath>
#include <vector>

#include "catch.hpp"
#include "dembark/sph/box_contacts.hpp"

using namespace dembark::sph;

namespace {

constexpr double edge = 0.15, mass = 2.7, g = 9.81;

Body cube(const Vector& at) {
  Body b;
  b.free = true;
  b.mass = mass;
  const double i = mass * edge * edge / 6.0;
  b.inertia = {i, i, i};
  b.position = at;
  return b;
}

/// Cubes that move by kick - drift - kick, as in the fluid.
struct World {
  std::vector<Body> bodies;
  BoxContacts contacts;
  Vector gravity{0.0, 0.0, -g};
  double dt = 1e-4;

  explicit World(std::vector<Body> all) : bodies(std::move(all)) {
    contacts.stiffness = 2e5;
    contacts.half.assign(bodies.size(), {0.5 * edge, 0.5 * edge, 0.5 * edge});
    contacts.between = Touch::of(0.6, 0.45);
  }
  void floor(double restitution, double friction, Vector normal = {0.0, 0.0, 1.0}) {
    contacts.planes.push_back({{}, normal, Touch::of(restitution, friction)});
  }
  void run(double duration) {
    std::vector<const Body*> all;
    for (const Body& b : bodies) all.push_back(&b);
    for (long k = std::lround(duration / dt); k > 0; --k) {
      for (Body& b : bodies) b.kick(0.5 * dt), b.drift(dt);
      const std::vector<ContactWrench>& wrenches = contacts.push(dt, all, true);
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        bodies[i].load = wrenches[i].force, bodies[i].load_torque = wrenches[i].torque;
        bodies[i].accelerate(gravity);
        bodies[i].kick(0.5 * dt);
      }
    }
  }
  double energy() const {
    double sum = contacts.stored;
    for (const Body& b : bodies) sum += b.kinetic_energy() - b.mass * dot(gravity, b.position);
    return sum;
  }
};

}  // namespace

TEST_CASE("springs turn with boxes that turn together, and stay where nothing turns", "[box_contacts]") {
  for (const bool pair : {true, false}) {
    World w(pair ? std::vector<Body>{cube({0.0, 0.0, 1.5 * edge - 2e-5}), cube({0.0, 0.0, 0.5 * edge})}
                 : std::vector<Body>{cube({0.0, 0.0, 0.5 * edge - 1e-5})});
    w.contacts.between = Touch::of(1.0, 100.0);
    if (!pair) w.floor(1.0, 100.0);
    std::vector<const Body*> all;
    for (const Body& b : w.bodies) all.push_back(&b);
    const auto sideways = [&](double step) {
      const ContactWrench& push = w.contacts.push(step, all, true)[0];
      return Vector{push.force.x, push.force.y, 0.0};
    };
    w.bodies[0].velocity = {0.1, 0.0, 0.0};
    const Vector first = sideways(1e-5);
    w.bodies[0].velocity = {};
    constexpr int steps = 1000;
    const double rate = 0.5 * 3.141592653589793 / (steps * 1e-5);
    Vector last{};
    for (int k = 0; k < steps; ++k) {
      for (Body& b : w.bodies) {
        b.spin = {0.0, 0.0, pair ? rate : 0.0};
        b.orientation = b.orientation.turned(1e-5 * b.spin);
      }
      last = sideways(1e-5);
    }
    REQUIRE(norm(first) > 0.0);
    const Vector expected = pair ? Vector{-first.y, first.x, 0.0} : first;
    CHECK(norm(last - expected) < 1e-2 * norm(first));
  }
}

TEST_CASE("a cube that lands flat comes back with the restitution it was given", "[box_contacts]") {
  for (const double e : {0.3, 0.7, 1.0}) {
    World w({cube({0.0, 0.0, 0.5 * edge + 1e-5})});
    w.gravity = {};
    w.floor(e, 0.4);
    w.bodies[0].velocity = {0.0, 0.0, -0.5};
    w.run(0.05);
    CHECK(w.bodies[0].velocity.z == Approx(0.5 * e).epsilon(0.04));
    CHECK(std::abs(w.bodies[0].spin.x) < 1e-12);
  }
}

TEST_CASE("on a slope a cube sticks below the angle of friction, and slides with g (sin - mu cos) above it", "[box_contacts]") {
  const double mu = 0.4;
  for (const double tangent : {0.36, 0.5}) {
    World w({cube({0.0, 0.0, 0.5 * edge})});
    w.floor(0.7, mu);
    const double c = 1.0 / std::sqrt(1.0 + tangent * tangent);
    w.gravity = {g * c * tangent, 0.0, -g * c};
    w.run(0.4);
    const double due = tangent > mu ? g * c * (tangent - mu) * 0.4 : 0.0;
    CHECK(w.bodies[0].velocity.x == Approx(due).margin(0.02 * g * 0.4));
    if (tangent < mu) CHECK(std::abs(w.bodies[0].position.x) < 5e-4);
  }
}

TEST_CASE("with a speed of friction a cube creeps down any slope, at v0 atanh(tan / mu) where it is not too steep", "[box_contacts]") {
  const double mu = 0.4, slow = 0.125, tangent = 0.2;
  World w({cube({0.0, 0.0, 0.5 * edge})});
  w.contacts.friction_speed = slow;
  w.floor(0.7, mu);
  const double c = 1.0 / std::sqrt(1.0 + tangent * tangent);
  w.gravity = {g * c * tangent, 0.0, -g * c};
  w.run(1.0);
  CHECK(w.bodies[0].velocity.x == Approx(slow * std::atanh(tangent / mu)).epsilon(1e-3));
  CHECK(norm(w.contacts.stretches[0]) == 0.0);
  // Fast, it is Coulomb's: deceleration mu g.
  w.gravity = {0.0, 0.0, -g};
  w.bodies[0].velocity = {2.0, 0.0, 0.0};
  w.run(0.1);
  CHECK((2.0 - w.bodies[0].velocity.x) / 0.1 == Approx(mu * g).epsilon(0.01));
}

TEST_CASE("three stacked cubes stand, and the lowest bears all", "[box_contacts]") {
  World w({cube({0.0, 0.0, 0.5 * edge}), cube({0.0, 0.0, 1.5 * edge}), cube({0.002, -0.001, 2.5 * edge})});
  w.floor(0.7, 0.4);
  w.run(1.0);
  for (const Body& b : w.bodies) {
    CHECK(norm(b.velocity) < 1e-3);
    CHECK(std::abs(b.position.x) < 0.0021);
  }
  CHECK(w.bodies[2].position.z == Approx(2.5 * edge).margin(4e-4));
  CHECK(w.contacts.deepest < 2e-4);
  // The lowest is pulled out of a stack: two thirds of the weight rub above it, all below it.
  w.bodies[0].velocity = {1.0, 0.0, 0.0};
  w.run(0.02);
  CHECK((1.0 - w.bodies[0].velocity.x) / 0.02 == Approx((3.0 * 0.4 + 2.0 * 0.45) * g).epsilon(0.15));
  CHECK(w.bodies[1].velocity.x / 0.02 == Approx(2.0 * 0.45 * g).epsilon(0.3));
}

TEST_CASE("edges that cross hold a cube that falls across another", "[box_contacts]") {
  // Both stand on an edge; no corner of one is near the other.
  World w({cube({0.0, 0.0, 0.0}), cube({0.0, 0.0, std::sqrt(2.0) * edge - 0.003})});
  w.gravity = {};
  const double quarter = 0.7853981633974483;
  w.bodies[0].orientation = Rotation{}.turned({quarter, 0.0, 0.0});
  w.bodies[1].orientation = Rotation{}.turned({0.0, quarter, 0.0});
  w.bodies[1].velocity = {0.0, 0.0, -0.5};
  w.run(0.05);
  CHECK(w.bodies[1].velocity.z - w.bodies[0].velocity.z > 0.25);
  CHECK(w.bodies[0].velocity.z + w.bodies[1].velocity.z == Approx(-0.5).epsilon(1e-9));
}

TEST_CASE("a heap of tumbling cubes keeps momentum between its pairs and gains no energy", "[box_contacts]") {
  World w({cube({0.0, 0.0, 0.2}), cube({0.03, 0.02, 0.47}), cube({-0.02, 0.03, 0.74})});
  w.floor(0.7, 0.4);
  for (std::size_t k = 0; k < 3; ++k) w.bodies[k].orientation = Rotation{}.turned({0.4 + 0.3 * double(k), 0.7, -0.2 * double(k)});
  double before = w.energy(), grown = 0.0;
  for (int k = 0; k < 300; ++k) {
    w.run(0.005);
    grown = std::max(grown, w.energy() - before);
    before = std::min(before, w.energy());
    CHECK(w.contacts.deepest < 0.008);
  }
  CHECK(grown < 0.01 * mass * g * edge);
  for (const Body& b : w.bodies) CHECK(b.position.z > 0.45 * edge);
  CHECK(norm(w.bodies[0].velocity) < 0.02);
}
