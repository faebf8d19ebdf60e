#include <cmath>
#include <initializer_list>
#include "catch.hpp"

#include "dembark/contact.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

constexpr double R = 2e-3, N = 3.0, k_t = 1e5, dt = 1e-6, inertia = 1e-6;

RollingResistance law(RollingModel model, double friction, double damping_ratio = 0.0) { return {model, friction, damping_ratio}; }

RollingContact contact(const Vec3<double>& spin, double load = N) { return {{0, 0, 1}, 0.0, R, inertia, load, k_t, spin}; }

/// A sphere on a plane that is tilted by `slope` (rad) about y, with rough surfaces, after `steps` of the whole contact law.
struct Roller {
  static constexpr double radius = 1e-3, mass = 1e-5, g = 9.81;
  ContactParameters p;
  ContactState state;
  ContactBodies b;
  double x = 0.0, slope = 0.0;

  Roller(const RollingResistance& rolling, double slope_, double speed) : slope(slope_) {
    p.elasticity = {2e6, 1e6, 0.3};
    p.friction.static_friction = p.friction.kinetic_friction = 2.0;
    p.rolling = rolling;
    b.radius_1 = radius;
    b.mass_1 = mass;
    // Hertz's overlap under the weight.
    const double overlap = std::pow(0.75 * mass * g * std::cos(slope) / (2e6 * std::sqrt(radius)), 2.0 / 3.0);
    b.separation = {0.0, 0.0, radius - overlap};
    b.velocity_1 = {speed, 0.0, 0.0};
    b.angular_velocity_1 = {0.0, speed / (radius - 0.5 * overlap), 0.0};
  }

  void run(int steps, double step) {
    for (int i = 0; i < steps; ++i) {
      const ContactForce f = contact_step(p, b, step, state);
      b.velocity_1 += step * ((1.0 / mass) * f.force + Vec3<double>{g * std::sin(slope), 0.0, -g * std::cos(slope)});
      b.angular_velocity_1 += (step / (0.4 * mass * radius * radius)) * f.torque_1;
      x += step * b.velocity_1.x;
      b.separation.z += step * b.velocity_1.z;
    }
  }
};

}  // namespace

TEST_CASE("a constant torque opposes rolling and does not ask how fast it is", "[rolling]") {
  const auto constant = law(RollingModel::constant_torque, 0.1);
  Vec3<double> angle{};
  for (const double rate : {1.0, 1e6})
    for (const double twisting : {0.0, 7.0 * rate}) {
      const auto couple = rolling_step(constant, contact({0.6 * rate, -0.8 * rate, twisting}), dt, angle);
      CHECK_THAT(couple.x, WithinRel(-0.6 * 0.1 * R * N, 1e-12));
      CHECK_THAT(couple.y, WithinRel(0.8 * 0.1 * R * N, 1e-12));
      CHECK(couple.z == 0.0);
    }
  CHECK(norm(rolling_step(constant, contact({}), dt, angle)) == 0.0);
  CHECK(norm(angle) == 0.0);
  // It stops a slow rotation within the step, and turns none round.
  const double slow = 1e-3 * 0.1 * R * N * dt / inertia;
  CHECK_THAT(rolling_step(constant, contact({slow, 0, 0}), dt, angle).x, WithinRel(-inertia * slow / dt, 1e-12));
  CHECK_THAT(rolling_step(constant, contact({slow, 0, 0}), 0.0, angle).x, WithinRel(-0.1 * R * N, 1e-12));
}

TEST_CASE("the spring resists in proportion to the angle up to its limit, and yields there", "[rolling]") {
  const auto spring = law(RollingModel::elastic_plastic, 0.1);
  Vec3<double> angle{};
  const double most = 0.1 * R * N, stiffness = rolling_stiffness(k_t, R), turn = 0.5 * most / stiffness;
  CHECK(stiffness == k_t * R * R);
  const Vec3<double> spin{0.0, turn / dt, 0.0};
  CHECK_THAT(rolling_step(spring, contact(spin), dt, angle).y, WithinRel(-0.5 * most, 1e-12));
  CHECK_THAT(rolling_step(spring, contact(-spin), dt, angle).y, WithinAbs(0.0, 1e-12 * most));
  for (int i = 0; i < 5; ++i) rolling_step(spring, contact(spin), dt, angle);
  CHECK_THAT(angle.y, WithinRel(2.0 * turn, 1e-12));
  // The way back starts at the limit: elastic.
  CHECK_THAT(rolling_step(spring, contact(-spin), dt, angle).y, WithinRel(-0.5 * most, 1e-12));
  // Half the load: the spring lets go. No load, or a pull: no couple, and the spring forgets.
  CHECK_THAT(norm(rolling_step(spring, contact({}, 0.25 * N), dt, angle)), WithinRel(0.25 * most, 1e-12));
  for (const double load : {0.0, -N}) {
    Vec3<double> held{0.5 * turn, 0.0, 0.0};
    CHECK(norm(rolling_step(law(RollingModel::elastic_plastic, 0.1, 0.5), contact(spin, load), dt, held)) == 0.0);
    CHECK(norm(held) == 0.0);
    CHECK(norm(rolling_step(law(RollingModel::constant_torque, 0.1), contact(spin, load), dt, held)) == 0.0);
  }
}

TEST_CASE("the dashpot damps rolling to and fro by its ratio, and keeps the limit", "[rolling]") {
  // With 7/2 of the inertia of the spin, as for a sphere that rolls without sliding: phi'' + 2 eta w phi' + w^2 phi = 0.
  const double stiffness = rolling_stiffness(k_t, R), turning = 3.5 * inertia, frequency = std::sqrt(stiffness / turning);
  for (const double ratio : {0.0, 0.1, 0.5, 1.0}) {
    Vec3<double> angle{1e-5, 0.0, 0.0};
    const double step = 1e-4 / frequency, time = 2.0 / frequency;
    double spin = 0.0;
    for (double t = 0.0; t < time; t += step)
      spin += step / turning * rolling_step(law(RollingModel::elastic_plastic, 1e6, ratio), contact({spin, 0, 0}), step, angle).x;
    const double damped = std::sqrt(std::abs(1.0 - ratio * ratio)), phase = 2.0 * damped;
    const double swing = ratio < 1.0 ? std::cos(phase) + ratio / damped * std::sin(phase) : 3.0;
    CHECK_THAT(angle.x / 1e-5, WithinAbs(std::exp(-2.0 * ratio) * swing, 1e-3));
  }
  // A spring at its limit that is rolled on is not damped, nor when the couple of the moment is asked for again; on the way back it is. A
  // fresh contact that spins fast has the limit, from the first step on; a dashpot takes energy whatever the directions are.
  const auto damped = law(RollingModel::elastic_plastic, 0.1, 5.0);
  const double most = 0.1 * R * N;
  Vec3<double> angle{1.0, 0.0, 0.0};
  const auto first = rolling_step(damped, contact({1e-3, 0, 0}), dt, angle);
  CHECK_THAT(first.x, WithinRel(-most, 1e-12));
  CHECK_THAT(rolling_step(damped, contact({1e-3, 0, 0}), 0.0, angle).x, WithinRel(first.x, 1e-9));
  CHECK(rolling_step(damped, contact({-1e-3, 0, 0}), 0.0, angle).x > -most);
  angle = {};
  CHECK_THAT(rolling_step(damped, contact({1e3, 0, 0}), dt, angle).x, WithinRel(-most, 1e-12));
  for (int k = 0; k < 100; ++k) {
    const double turn = 0.7 * k, size = 1e-6 * std::pow(10.0, k % 7);
    angle = {std::cos(2.3 * k) * (k % 5) / 4.0 * most / stiffness, std::sin(2.3 * k) * (k % 5) / 4.0 * most / stiffness, 0.0};
    const Vec3<double> spin{size * std::cos(turn), size * std::sin(turn), 0.0};
    const auto couple = rolling_step(damped, contact(spin), dt, angle);
    CHECK(norm(couple) < most * (1.0 + 1e-12));
    CHECK(dot(couple + stiffness * angle, spin) <= 1e-12 * most * size);
  }
}

TEST_CASE("a couple turns with the contact, and twisting has none", "[rolling]") {
  for (const RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic}) {
    Vec3<double> angle{};
    CHECK(norm(rolling_step(law(model, 0.1, 0.3), contact({0, 0, 50.0}), dt, angle)) == 0.0);
  }
  // A loaded spring in a pair that turns as a rigid body by 90 degrees about x, in small steps: its couple turns along.
  const double half = 1.5707963267948966, steps = 20000;
  Vec3<double> angle{0.0, 1e-6, 0.0};
  for (int i = 1; i <= steps; ++i) {
    RollingContact c = contact({});
    c.normal = {0.0, -std::sin(half * i / steps), std::cos(half * i / steps)};
    rolling_step(law(RollingModel::elastic_plastic, 1e6), c, dt, angle);
  }
  CHECK_THAT(angle.z, WithinRel(1e-6, 1e-9));
  CHECK_THAT(angle.y, WithinAbs(0.0, 1e-15));
}

TEST_CASE("a sphere that rolls on a plane stops after the distance that theory gives", "[rolling]") {
  // Rolling without sliding: 7/5 m dv/dt = -mu_r m g, so it stops after 7 v^2 / (10 mu_r g).
  const double friction = 0.05, speed = 0.02, distance = 0.7 * speed * speed / (friction * Roller::g), step = 1e-6;
  const int stop = int(1.4 * speed / (friction * Roller::g) / step);
  for (const RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic}) {
    Roller ball(law(model, friction, 0.3), 0.0, speed);
    ball.run(stop / 2, step);
    CHECK_THAT(ball.b.velocity_1.x, WithinRel(0.5 * speed, 2e-3));
    ball.run(stop, step);
    CHECK_THAT(ball.x, WithinRel(distance, 5e-3));
    CHECK(std::abs(ball.b.velocity_1.x) < 1e-4 * speed);
  }
  Roller free(law(RollingModel::elastic_plastic, 0.0), 0.0, speed);
  free.run(stop, step);
  CHECK_THAT(free.b.velocity_1.x, WithinRel(speed, 1e-9));
}

TEST_CASE("a sphere rests on a slope below arctan(mu_r) and rolls on a steeper one", "[rolling]") {
  const double friction = 0.2, step = 1e-6;
  const auto spring = law(RollingModel::elastic_plastic, friction, 0.3);
  Roller rests(spring, std::atan(0.9 * friction), 0.0);
  rests.run(100000, step);
  const double settled = rests.x;
  rests.run(100000, step);
  CHECK(std::abs(rests.x - settled) < 1e-9 * Roller::radius);
  Roller rolls(spring, std::atan(1.1 * friction), 0.0);
  rolls.run(100000, step);
  const double acceleration = 5.0 / 7.0 * Roller::g * (std::sin(rolls.slope) - friction * std::cos(rolls.slope));
  CHECK_THAT(rolls.b.velocity_1.x, WithinRel(acceleration * 0.1, 0.02));
  // A constant torque lets it creep: by no more than gravity adds in a few steps.
  Roller creeps(law(RollingModel::constant_torque, friction), std::atan(0.9 * friction), 0.0);
  creeps.run(200000, step);
  CHECK(creeps.x > 0.0);
  CHECK(std::abs(creeps.b.velocity_1.x) < 5.0 * Roller::g * step);
}

TEST_CASE("without friction the contact is the same to the bit as without the model", "[rolling]") {
  Roller none({}, 0.3, 0.01);
  none.run(1000, 1e-6);
  for (const RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic}) {
    Roller other(law(model, 0.0, 0.3), 0.3, 0.01);
    other.run(1000, 1e-6);
    CHECK(other.x == none.x);
    CHECK(other.b.angular_velocity_1.y == none.b.angular_velocity_1.y);
    Roller resists(law(model, 1e-6), 0.3, 0.01);
    resists.run(1000, 1e-6);
    CHECK(resists.x != none.x);
  }
}

TEST_CASE("a sphere that turns with a turning wall does not roll, and a contact that has ended is forgotten", "[rolling]") {
  Roller ball(law(RollingModel::elastic_plastic, 0.1), 0.0, 0.0);
  ball.b.angular_velocity_1 = ball.b.wall_spin = {30.0, -10.0, 5.0};
  CHECK(norm(contact_step(ball.p, ball.b, 1e-6, ball.state).rolling) == 0.0);
  ball.b.wall_spin = {};
  CHECK(norm(contact_step(ball.p, ball.b, 1e-6, ball.state).rolling) > 0.0);
  CHECK(norm(ball.state.rolling_angle) > 0.0);
  ball.b.separation.z = 1.1 * Roller::radius;
  CHECK(norm(contact_step(ball.p, ball.b, 1e-6, ball.state).torque_1) == 0.0);
  CHECK(norm(ball.state.rolling_angle) == 0.0);
}

TEST_CASE("the spin of a triangle is that of the rigid body that it belongs to", "[rolling]") {
  const Vec3<double> spin{1.0, -2.0, 3.0}, first{1.0, 0.2, 0.3}, second{-0.4, 0.8, 0.1};
  CHECK_THAT(norm(triangle_spin(first, second, cross(spin, first), cross(spin, second)) - spin), WithinAbs(0.0, 1e-14));
}
