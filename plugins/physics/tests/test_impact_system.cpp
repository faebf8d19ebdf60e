// Systems of logs: rest, energy in the plane, order, saving, doing a step again, records, bad input.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <vector>
#include "catch.hpp"

#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

Settings three_materials(double dt, double theta, double mu, double damping = 0.0, double contact_damping = 0.0) {
  Settings s;
  s.dt = dt;
  s.theta = theta;
  s.materials = {{1e7, damping}, {2e7, damping}, {1e7, 0.0}};
  s.pairs.assign(9, ImpactPairLaw());
  for (ImpactPairLaw& p : s.pairs) {
    p.friction.static_friction = mu;
    p.friction.kinetic_friction = 0.8 * mu;
    p.friction.critical_slip_distance = 1e-4;
    p.contact_damping = contact_damping;
  }
  return s;
}

Drum shell(double omega) {
  Drum d;
  d.material = 2;
  d.stiffness = 5e7;
  d.omega = omega;
  return d;
}

Contact closest(const std::vector<Contact>& contacts) {
  return *std::min_element(contacts.begin(), contacts.end(), [](const Contact& a, const Contact& b) { return a.gap < b.gap; });
}

}  // namespace

TEST_CASE("a stack at rest: every contact carries the weight above it") {
  const int n = 6;
  std::vector<Body> logs;
  double y = 0.0;
  for (int i = 0; i < n; ++i) {
    Body b;
    b.id = i;
    b.mass = 20.0 + 10.0 * i;
    b.radius = 0.05 + 0.01 * i;
    b.inertia = cylinder_inertia(b.mass, b.radius);
    y += b.radius;
    b.position = {0, y, 0};
    y += b.radius;
    b.force = {0, -b.mass * g, 0};
    logs.push_back(b);
  }
  for (const double wt : {0.2, 3.0}) {
    Settings s;
    s.dt = wt / std::sqrt(1e7 / 40.0);
    Scene scene(s, logs);
    Plane floor;
    floor.stiffness = 3e7;
    scene.around.planes.push_back(floor);
    scene.run(60000);
    double above = 0.0;
    REQUIRE(scene.system().contacts().size() == std::size_t(n));
    for (int i = n - 1; i >= 0; --i) {
      above += logs[i].mass * g;
      for (const ContactResult& c : scene.system().contacts())
        if (i == 0 ? c.b < 0 : c.key_a == i - 1 && c.key_b == i) CHECK_THAT(c.normal_force, WithinRel(above, 1e-9));
    }
  }
}

TEST_CASE("curved bodies in a box: with theta = 1 energy never grows, with weight and both dampings too") {
  for (const double wt : {0.1, 1.0, 5.0})
    for (const double damping : {0.0, 2e3}) {
      const std::vector<Body> bodies = crowd(80);
      Settings s = three_materials(wt * 1e-3, 1.0, 0.0, damping, damping);
      Scene scene(s, bodies);
      for (int k = 0; k < 4; ++k) {
        Plane p;
        p.id = wall_key(k);
        p.material = 2;
        p.normal = {double(k == 0) - double(k == 1), double(k == 2) - double(k == 3), 0};
        p.point = -p.normal;
        scene.around.planes.push_back(p);
      }
      double last = INFINITY, first = 0.0;
      for (int i = 0; i < 2000; ++i) {
        const StepReport& r = scene.forces();
        const std::vector<Body> before = scene.bodies();
        scene.advance();
        // Of the half step after the forces; the potential energy at its end bounds it, the one at its middle balances.
        double energy = scene.kinetic_energy_of_half_step() + r.elastic_energy, balance = energy + r.dissipated_energy;
        for (std::size_t b = 0; b < bodies.size(); ++b) {
          energy -= dot(bodies[b].force, scene.bodies()[b].position);
          balance -= 0.5 * dot(bodies[b].force, before[b].position + scene.bodies()[b].position);
        }
        REQUIRE(energy <= last + 1e-12 * std::abs(last));
        last = energy;
        if (i == 0) first = balance;
        // A gap is not linear in the motion: what the bodies do to the springs is, and that is what is counted.
        REQUIRE_THAT(balance, WithinRel(first, 1e-10));
      }
      CHECK(scene.system().report().impacts_begun > 10);
    }
}

TEST_CASE("results do not depend on the order of bodies, to the last bit") {
  std::vector<Body> bodies = crowd(80), shuffled = bodies;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(3));
  Scene one(three_materials(1e-4, 1.0, 0.4, 100.0, 50.0), bodies), two(three_materials(1e-4, 1.0, 0.4, 100.0, 50.0), shuffled);
  for (Scene* s : {&one, &two}) {
    s->around.drums.push_back(shell(2.0));
    s->run(4000);
  }
  REQUIRE(one.system().report().impacts_begun > 20);
  for (const Body& b : one.bodies())
    for (const Body& c : two.bodies())
      if (b.id == c.id) {
        CHECK(std::memcmp(&b.position, &c.position, sizeof b.position) == 0);
        CHECK(std::memcmp(&b.spin, &c.spin, sizeof b.spin) == 0);
      }
  CHECK(same_bits(one.system().state(), two.system().state()));
}

TEST_CASE("contacts in any order and either way round") {
  const std::vector<Body> bodies = crowd(80);
  std::vector<Contact> contacts;
  find_pairs(bodies, 0.1, contacts);
  for (Contact& c : contacts) c.gap -= 0.02;
  System one(three_materials(1e-4, 1.0, 0.4)), two(three_materials(1e-4, 1.0, 0.4));
  std::vector<Vec3<double>> f1(bodies.size()), t1(bodies.size()), f2 = f1, t2 = f1;
  for (int time = 0; time < 3; ++time) {
    step(one, bodies, contacts, time, 1.0, f1, t1);
    std::shuffle(contacts.begin(), contacts.end(), std::mt19937(unsigned(time)));
    for (std::size_t i = 0; i < contacts.size(); i += 2) {
      std::swap(contacts[i].a, contacts[i].b);
      std::swap(contacts[i].key_a, contacts[i].key_b);
      contacts[i].normal = -contacts[i].normal;
    }
    step(two, bodies, contacts, time, 1.0, f2, t2);
  }
  REQUIRE(one.report().active > 5);
  CHECK(std::memcmp(f1.data(), f2.data(), f1.size() * sizeof f1[0]) == 0);
  CHECK(std::memcmp(t1.data(), t2.data(), t1.size() * sizeof t1[0]) == 0);
  contacts.push_back(closest(contacts));
  CHECK_THROWS_WITH(step(one, bodies, contacts, 9, 1.0, f1, t1), Catch::Contains("the same two keys come twice"));
}

TEST_CASE("a step that is refused leaves no trace, be it a new one or one done again") {
  const std::vector<Body> bodies = crowd(80);
  std::vector<Contact> contacts;
  find_pairs(bodies, 0.1, contacts);
  for (Contact& c : contacts) c.gap -= 0.02;
  std::vector<Contact> twice = contacts, skew = contacts;
  twice.push_back(closest(contacts));
  skew.back().normal.x += 0.5;
  std::vector<Body> lost = bodies;
  lost.back().position.x = NAN;
  System one(three_materials(1e-4, 1.0, 0.4, 100.0, 50.0)), two(three_materials(1e-4, 1.0, 0.4, 100.0, 50.0));
  std::vector<Vec3<double>> f1(bodies.size()), t1(bodies.size()), f2 = f1, t2 = f1;
  const auto refuse = [&](double time) {
    CHECK_THROWS_AS(step(one, bodies, twice, time, 0.5, f1, t1), std::invalid_argument);
    CHECK_THROWS_AS(step(one, bodies, skew, time, 0.5, f1, t1), std::invalid_argument);
    CHECK_THROWS_AS(step(one, lost, contacts, time, 0.5, f1, t1), std::invalid_argument);
    CHECK(same_bits(one.state(), two.state()));
  };
  for (const double time : {0.0, 0.0, 1.0, 1.0, 2.0}) {
    refuse(time);
    step(one, bodies, contacts, time, 1.0, f1, t1);
    step(two, bodies, contacts, time, 1.0, f2, t2);
    refuse(time);
  }
  REQUIRE(one.report().active > 5);
  CHECK(same_bits(one.state(), two.state()));
  CHECK(std::memcmp(f1.data(), f2.data(), f1.size() * sizeof f1[0]) == 0);
}

TEST_CASE("saved and restored, it goes on bit for bit") {
  const Settings s = three_materials(1e-4, 0.7, 0.4, 100.0, 50.0);
  const std::vector<Body> bodies = crowd(80);
  Scene one(s, bodies), two(s, bodies);
  one.around.drums.push_back(shell(3.0));
  two.around.drums.push_back(shell(3.0));
  one.run(6000);
  REQUIRE(one.system().report().active > 5);
  two.restore(one.state());
  one.run(1000);
  two.run(1000);
  CHECK(same_bits(one.state(), two.state()));
  CHECK(one.system().report().dissipated_energy == two.system().report().dissipated_energy);
  const auto a = one.system().take_finished(), b = two.system().take_finished();
  REQUIRE(a.size() == b.size());
  REQUIRE(a.size() > 10);
  CHECK(a.back().impulse == b.back().impulse);
  std::vector<double> broken = one.system().state();
  broken.pop_back();
  CHECK_THROWS_AS(two.system().restore(broken), std::invalid_argument);
  broken = one.system().state();
  broken[0] = 9.0;
  CHECK_THROWS_WITH(two.system().restore(broken), Catch::Contains("version"));
}

TEST_CASE("a step done again, with the velocity of the full step and half a kick, gives the same forces and counts once") {
  for (const double theta : {1.0, 0.6}) {
    Scene scene(three_materials(1e-4, theta, 0.4, 100.0, 50.0), crowd(80));
    scene.around.drums.push_back(shell(3.0));
    scene.run(6000);
    const StepReport first = scene.system().report();
    const std::vector<ContactResult> before = scene.system().contacts();
    REQUIRE(first.active > 5);
    std::vector<Body> bodies = scene.bodies();
    for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i].velocity = scene.velocity()[i], bodies[i].spin = scene.spin()[i];
    std::vector<Contact> contacts;
    for (const ContactResult& c : before) {
      Contact d;
      d.a = c.a, d.b = c.b, d.key_a = c.key_a, d.key_b = c.key_b, d.gap = c.gap, d.normal = c.normal;
      d.wall_material = 2, d.wall_stiffness = 5e7;
      if (c.b < 0) d.point_velocity = 3.0 * cross(Vec3<double>{0, 0, 1}, -c.normal);
      contacts.push_back(d);
    }
    std::vector<Vec3<double>> force(bodies.size()), torque(bodies.size());
    const StepReport again = step(scene.system(), bodies, contacts, scene.time(), 0.5, force, torque);
    CHECK(again.impacts_begun == first.impacts_begun);
    // Counted twice, it would be more by the impulse of a step.
    CHECK_THAT(again.impulse_sum, WithinAbs(first.impulse_sum, 1e-6 * first.peak_force * 1e-4));
    CHECK_THAT(again.dissipated_energy, WithinRel(first.dissipated_energy, 1e-4));
    for (std::size_t i = 0; i < before.size(); ++i) {
      CHECK_THAT(scene.system().contacts()[i].normal_force, WithinAbs(before[i].normal_force, 2e-3 * first.peak_force));
      CHECK(norm(scene.system().contacts()[i].tangential - before[i].tangential) < 2e-3 * first.peak_force);
    }
  }
}

TEST_CASE("records: duration, impulse and peak are those of the forces") {
  Scene scene(three_materials(1e-4, 1.0, 0.3), crowd(80));
  scene.around.drums.push_back(shell(3.0));
  struct Sum {
    double impulse = 0.0, peak = 0.0;
    int steps = 0;
  };
  std::map<std::pair<std::int64_t, std::int64_t>, Sum> sums;
  int ended = 0;
  for (int i = 0; i < 6000; ++i) {
    scene.forces();
    for (const Impact& f : scene.system().take_finished()) {
      const Sum& s = sums[{f.a, f.b}];
      CHECK_THAT(f.impulse, WithinRel(s.impulse, 1e-12));
      CHECK(f.peak_force == s.peak);
      CHECK_THAT(f.duration, WithinRel(s.steps * 1e-4, 1e-9));
      CHECK(f.dissipated > 0.0);
      sums.erase({f.a, f.b});
      ++ended;
    }
    for (const ContactResult& c : scene.system().contacts())
      if (c.normal_force > 0.0) {
        Sum& s = sums[{c.key_a, c.key_b}];
        s.impulse += c.normal_force * 1e-4;
        s.peak = std::max(s.peak, c.normal_force);
        ++s.steps;
      }
    scene.advance();
  }
  CHECK(ended > 50);
}

TEST_CASE("bad input: one line that says what is wrong") {
  Settings s;
  s.theta = 0.4;
  CHECK_THROWS_WITH(System(s), Catch::Contains("theta"));
  s = Settings();
  s.materials[0].stiffness = 0.0;
  CHECK_THROWS_WITH(System(s), Catch::Contains("material 0: stiffness must be > 0"));
  s = Settings();
  s.materials.resize(2);
  CHECK_THROWS_WITH(System(s), Catch::Contains("4 pair laws"));
  System system{Settings()};
  std::vector<Body> bodies(1);
  std::vector<Vec3<double>> force(1), torque(1);
  bodies[0].velocity.x = NAN;
  CHECK_THROWS_WITH(step(system, bodies, {}, 0, 1, force, torque), Catch::Contains("body 0: position, velocity"));
  bodies[0].velocity.x = 0;
  Contact c;
  c.normal = {0, 2, 0};
  CHECK_THROWS_WITH(step(system, bodies, {c}, 0, 1, force, torque), Catch::Contains("unit vector"));
  CHECK_THROWS_WITH(step(system, bodies, {}, 0, 0, force, torque), Catch::Contains("kick"));
}
