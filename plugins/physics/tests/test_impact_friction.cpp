// Friction on top of the normal forces, against the mechanics of rigid bodies.
#include <cmath>
#include <vector>
#include "catch.hpp"

#include "dembark/impact/scene.hpp"
#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using Catch::WithinAbs;
using Catch::WithinRel;
using impact_scenes::g;

namespace {

constexpr double m = 40.0, r = 0.1;

Settings settings(double dt, double mu, double kinetic = -1.0, double theta = 1.0) {
  Settings s;
  s.dt = dt;
  s.theta = theta;
  s.materials = {{1e7, 0.0}};
  s.pairs[0].contact_damping = 1e4;  // so that a contact that sticks stops swinging in its friction spring
  s.pairs[0].friction.static_friction = mu;
  s.pairs[0].friction.kinetic_friction = kinetic < 0.0 ? mu : kinetic;
  return s;
}

Body log_at(int id, double x, double y, double slope = 0.0, double inertia = cylinder_inertia(m, r)) {
  Body b;
  b.id = id;
  b.mass = m;
  b.inertia = inertia;
  b.radius = r;
  b.position = {x, y, 0};
  b.force = {m * g * std::sin(slope), -m * g * std::cos(slope), 0};
  return b;
}

Plane floor_plane() {
  Plane p;
  p.stiffness = 1e7;
  return p;
}

/// A log that lies on a plane of this slope, with the overlap that carries it.
struct Incline {
  Scene scene;
  Incline(double slope, double mu, double inertia, double dt = 2e-5)
      : scene(settings(dt, mu), {log_at(0, 0, r - m * g * std::cos(slope) / 5e6, slope, inertia)}) {
    scene.around.planes.push_back(floor_plane());
  }
};

}  // namespace

TEST_CASE("a block on a slope sticks below the angle of friction and slides above it") {
  const double mu = 0.4;
  Incline below(std::atan(0.95 * mu), mu, INFINITY), above(std::atan(1.05 * mu), mu, INFINITY);
  below.scene.run(25000);
  above.scene.run(12500);
  const double early = above.scene.velocity()[0].x;
  above.scene.run(12500);
  CHECK(std::abs(below.scene.velocity()[0].x) < 1e-8);
  CHECK_THAT(norm(below.scene.system().contacts()[0].tangential), WithinRel(m * g * std::sin(std::atan(0.95 * mu)), 1e-6));
  const double slope = std::atan(1.05 * mu), a = g * (std::sin(slope) - mu * std::cos(slope));
  CHECK_THAT(above.scene.velocity()[0].x - early, WithinRel(a * 0.25, 1e-3));
  CHECK_THAT(norm(above.scene.system().contacts()[0].tangential), WithinRel(mu * m * g * std::cos(slope), 1e-3));
}

TEST_CASE("a solid cylinder rolls without slip while tan(slope) < 3 mu") {
  const double mu = 0.1, inertia = cylinder_inertia(m, r);
  for (const double ratio : {0.9, 1.1}) {
    const double slope = std::atan(3.0 * mu * ratio), t = 0.5;
    Incline run(slope, mu, inertia);
    run.scene.run(25000);
    const double v = run.scene.velocity()[0].x, spin = -run.scene.spin()[0].z;
    if (ratio < 1.0) {
      CHECK_THAT(v, WithinRel(2.0 / 3.0 * g * std::sin(slope) * t, 1e-3));
      CHECK_THAT(spin * r, WithinRel(v, 1e-3));  // the lever arm is shorter by the overlap
    } else {
      CHECK_THAT(v, WithinRel(g * (std::sin(slope) - mu * std::cos(slope)) * t, 5e-3));
      CHECK_THAT(spin, WithinRel(2.0 * mu * g * std::cos(slope) / r * t, 1e-2));
    }
  }
}

TEST_CASE("a spinning log on a floor comes to roll with a third of its surface speed") {
  Body b = log_at(0, 0, r - m * g / 5e6);
  b.spin = {0, 0, -30.0};
  const double mu = 0.3, slip_time = 30.0 * r / (3.0 * mu * g);
  Scene scene(settings(2e-5, mu), {b});
  scene.around.planes.push_back(floor_plane());
  scene.run(std::int64_t(0.9 * slip_time / 2e-5));
  CHECK_THAT(scene.velocity()[0].x, WithinRel(0.9 * 30.0 * r / 3.0, 1e-3));
  scene.run(std::int64_t(0.3 * slip_time / 2e-5));
  CHECK_THAT(scene.velocity()[0].x, WithinRel(30.0 * r / 3.0, 2e-3));
  CHECK_THAT(-scene.spin()[0].z * r, WithinRel(30.0 * r / 3.0, 2e-3));
  // Two thirds of the energy of the spin have gone.
  const double energy = 0.5 * cylinder_inertia(m, r) * 900.0;
  CHECK_THAT(scene.system().report().dissipated_energy, WithinRel(2.0 / 3.0 * energy, 5e-3));
}

TEST_CASE("friction that falls with slip: the kinetic coefficient holds a sliding block") {
  Body b = log_at(0, 0, r - m * g / 5e6, 0.0, INFINITY);
  b.velocity = {2.0, 0, 0};
  Settings s = settings(2e-5, 0.5, 0.2);
  s.pairs[0].friction.critical_slip_distance = 1e-4;
  Scene scene(s, {b});
  scene.around.planes.push_back(floor_plane());
  scene.run(20000);
  CHECK_THAT(scene.velocity()[0].x, WithinRel(2.0 - 0.2 * g * 0.4, 2e-3));
}

TEST_CASE("the exponential curve before sliding holds a block too, and leads to the same sliding force") {
  Settings s = settings(2e-5, 0.4);
  s.pairs[0].friction.presliding = Presliding::exponential;
  for (const double push : {0.5, 1.2}) {  // of the limit
    Body b = log_at(0, 0, r - m * g / 5e6, 0.0, INFINITY);
    Scene scene(s, {b});
    scene.around.planes.push_back(floor_plane());
    scene.run(2000);
    b = scene.bodies()[0];
    b.force.x = push * 0.4 * m * g;
    Scene pushed(s, {b});
    pushed.around.planes.push_back(floor_plane());
    pushed.run(10000);
    const double early = pushed.velocity()[0].x;
    pushed.run(10000);
    const double gain = pushed.velocity()[0].x - early;
    if (push < 1.0) CHECK(std::abs(pushed.velocity()[0].x) < 1e-3);
    else CHECK_THAT(gain, WithinRel(0.2 * 0.4 * g * 0.2, 2e-3));
  }
}

TEST_CASE("more sweeps change nothing about what is at rest") {
  double first[4] = {};
  for (const int sweeps : {1, 2, 8}) {
    Settings s = settings(1e-3, 0.6);
    s.friction_sweeps = sweeps;
    std::vector<Body> logs{log_at(0, -0.12, 0.0999), log_at(1, 0.12, 0.0999), log_at(2, 0.0, 0.26)};
    Scene scene(s, logs);
    scene.around.planes.push_back(floor_plane());
    scene.run(20000);
    const auto& c = scene.system().contacts();
    REQUIRE(scene.system().report().active == 4);
    for (int i = 0; i < 4; ++i) {
      const double n = c[std::size_t(i)].normal_force;
      if (sweeps == 1) first[i] = n;
      CHECK_THAT(n, WithinRel(first[i], 0.02));  // how far the friction springs wound up on the way is theirs
      CHECK(norm(c[std::size_t(i)].tangential) <= 0.6 * n * (1 + 1e-9));
    }
    CHECK(norm(scene.velocity()[2]) < 1e-6);
  }
}

TEST_CASE("the interface carries no more than its shear strength") {
  Body b = log_at(0, 0, r - m * g / 5e6, 0.0, INFINITY);
  b.velocity = {2.0, 0, 0};
  Settings s = settings(2e-5, 0.5);
  s.pairs[0].friction.interface_shear_strength = 1e5;
  s.pairs[0].contact_area = 1e-4;
  Scene scene(s, {b});
  scene.around.planes.push_back(floor_plane());
  scene.run(2000);
  const double strength = 1e5 * 1e-4;
  CHECK_THAT(norm(scene.system().contacts()[0].tangential), WithinRel(strength * (1 - std::exp(-0.5 * m * g / strength)), 1e-4));
}

TEST_CASE("oblique impact: linear and angular momentum, and the loss by friction") {
  const double inertia = cylinder_inertia(m, r);
  Body a = log_at(0, -0.2, 0.0), b = log_at(1, 0.0, 0.05);
  a.force = b.force = {};
  a.velocity = {3.0, 0.4, 0};
  a.spin = {0, 0, -30.0};
  b.spin = {0, 0, -5.0};
  b.mass = 25.0;
  Settings s = settings(1e-6, 0.25);
  s.pairs[0].contact_damping = 0.0;
  Scene scene(s, {a, b});
  const auto linear = [&] { return m * scene.velocity()[0] + 25.0 * scene.velocity()[1]; };
  const auto angular = [&] {
    return m * cross(scene.bodies()[0].position, scene.velocity()[0]).z + 25.0 * cross(scene.bodies()[1].position, scene.velocity()[1]).z +
           inertia * (scene.spin()[0].z + scene.spin()[1].z);
  };
  scene.forces();
  const Vec3<double> p = linear();
  const double l = angular(), energy = scene.kinetic_energy_of_half_step();
  scene.run(20000);
  REQUIRE(scene.system().report().impacts_begun == 1);
  CHECK(norm(linear() - p) < 1e-10 * norm(p));
  CHECK_THAT(angular(), WithinRel(l, 1e-9));
  CHECK_THAT(scene.kinetic_energy_of_half_step() + scene.system().report().dissipated_energy, WithinRel(energy, 1e-10));
  CHECK(scene.kinetic_energy_of_half_step() < 0.99 * energy);
}

TEST_CASE("an impact knows its loss by friction, its normal, and how far the logs have turned before") {
  const double spin = 7.0, fall = 0.01, mu = 0.05;  // slides
  for (const int along : {0, 1, 2}) {               // the axis of the logs
    const auto place = [along](double across, double up) {
      return along == 0 ? Vec3<double>{0, across, up} : along == 1 ? Vec3<double>{up, 0, across} : Vec3<double>{across, up, 0};
    };
    const auto tangential = [&](const Vec3<double>& v, double w) {
      return 0.5 * m * std::pow(dot(v, place(1, 0)), 2) + 0.5 * cylinder_inertia(m, r) * w * w;
    };
    // What impulse and loss are above those of a hard log that slides from the beginning, over these: the friction spring has to wind up
    // first, and the overlap shortens the lever arm. A hundred times the stiffness leaves a tenth of both.
    double excess[2][2];
    for (const bool stiff : {false, true}) {
      Body b = log_at(3, 0, 0), fixed = log_at(4, 0, 0);
      b.force = fixed.force = {};
      b.position = place(0, 2.0 * r + fall);
      b.velocity = place(0.0, -1.0);
      fixed.mass = fixed.inertia = INFINITY;
      (along == 0 ? b.spin.x : along == 1 ? b.spin.y : b.spin.z) = spin;
      (along == 0 ? fixed.spin.x : along == 1 ? fixed.spin.y : fixed.spin.z) = -2.0;
      Settings s = settings(1e-6, mu);
      if (stiff)
        for (auto& material : s.materials) material.stiffness *= 100.0;
      Scene scene(s, {b, fixed});
      scene.run(30000);
      const std::vector<Impact> ended = scene.system().take_finished();
      REQUIRE(ended.size() == 1);
      const Impact& one = ended[0];
      CHECK(norm(one.normal - place(0, 1)) < 1e-6);
      CHECK_THAT(one.turn_a, WithinRel(spin * fall, 1e-3));
      CHECK_THAT(one.turn_b, WithinRel(-2.0 * fall, 1e-3));
      // The log that is moved turns against the friction on it, or with it.
      const Vec3<double> v = scene.velocity()[0], w = scene.spin()[0];
      const double turned = along == 0 ? w.x : along == 1 ? w.y : w.z, impulse = m * std::abs(dot(v, place(1, 0)));
      excess[stiff][0] = impulse / (mu * one.impulse) - 1.0;
      excess[stiff][1] = one.friction_loss / (tangential({}, spin) - tangential(v, turned) - impulse * 2.0 * r) - 1.0;
      CHECK(one.friction_loss < one.dissipated);
    }
    for (const int k : {0, 1}) {
      CHECK(std::abs(excess[0][k]) < 1e-2);
      CHECK(std::abs(excess[1][k]) < 0.2 * std::abs(excess[0][k]));
    }
  }
}

TEST_CASE("bodies keep how far they have turned when others come and go, and in another order") {
  std::vector<Body> bodies(3);
  for (int i = 0; i < 3; ++i) bodies[std::size_t(i)].id = 10 + i, bodies[std::size_t(i)].spin = {0, double(1 + i), 0};
  Turns turns;
  turns.turn(bodies, 0.5);
  std::swap(bodies[0], bodies[2]);
  bodies[1].id = 7;
  turns.turn(bodies, 0.25);
  CHECK((turns[0] == 3 * 0.75 && turns[1] == 2 * 0.25 && turns[2] == 0.75));
  Turns again;
  from_numbers(to_numbers(turns), again);
  again.turn(bodies, 0.25);
  CHECK((again[0] == 3.0 && again[1] == 1.0 && again[2] == 1.0));
}

TEST_CASE("logs in a groove come to rest at any step, however stiff they are") {
  for (const double wt : {0.05, 1.0, 5.0})
    for (const double theta : {1.0, 0.75}) {
      Settings s = settings(wt / std::sqrt(1e7 / m), 0.4, 0.3, theta);
      std::vector<Body> logs;
      for (int i = 0; i < 3; ++i) logs.push_back(log_at(i, 0.201 * i - 0.201, 0.11));
      for (int i = 0; i < 2; ++i) logs.push_back(log_at(3 + i, 0.201 * i - 0.1, 0.29));
      Scene scene(s, logs);
      scene.around.planes.push_back(floor_plane());
      for (const double side : {1.0, -1.0}) {
        Plane p = floor_plane();
        p.id = wall_key(side > 0 ? 1 : 2);
        p.normal = {side * std::sqrt(0.5), std::sqrt(0.5), 0};
        p.point = {-side * 0.36, 0, 0};
        scene.around.planes.push_back(p);
      }
      scene.run(std::int64_t(5.0 / s.dt));
      double weight = 0.0, carried = 0.0, speed = 0.0;  // a log that rolls on the floor goes on: only what is vertical must be over
      for (std::size_t i = 0; i < logs.size(); ++i) weight += m * g, speed = std::max(speed, std::abs(scene.velocity()[i].y));
      for (const ContactResult& c : scene.system().contacts())
        if (c.b < 0) carried += (c.normal_force * c.normal + c.tangential).y;
      INFO(wt << " " << theta << " " << speed);
      CHECK_THAT(carried, WithinRel(weight, 1e-6));
      CHECK(speed < 1e-6);
    }
}

TEST_CASE("a turning drum carries logs up") {
  // A body that cannot roll is carried to the angle of friction and slides there.
  const double R = 1.0, mu = 0.35;
  Drum drum;
  drum.radius = R;
  drum.stiffness = 1e7;
  drum.omega = 0.02;  // slow: it swings about that angle with the drum's speed
  Scene scene(settings(2e-4, mu), {log_at(0, 0, -R + r, 0.0, INFINITY)});
  scene.around.drums.push_back(drum);
  scene.run(120000);
  const Vec3<double> x = scene.bodies()[0].position;
  CHECK_THAT(std::atan2(x.x, -x.y), WithinAbs(std::atan(mu), 0.01));
  // Above the critical speed, with enough friction, it goes round with the drum.
  Body fast = log_at(0, 0, -R + r, 0.0, INFINITY);
  const double omega = 1.5 * std::sqrt(g / (R - r));
  fast.velocity = {omega * (R - r), 0, 0};
  Scene round(settings(5e-5, 2.0), {fast});
  drum.omega = omega;
  round.around.drums.push_back(drum);
  double highest = -R;
  for (int i = 0; i < 400; ++i) {
    round.run(100);
    highest = std::max(highest, round.bodies()[0].position.y);
    REQUIRE(norm(round.bodies()[0].position) > 0.85);
  }
  CHECK(highest > 0.88);
}
