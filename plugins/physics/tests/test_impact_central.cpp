// Central impacts: the scheme against closed solutions, and what it must conserve.
#include <cmath>
#include <vector>
#include "catch.hpp"

#include "dembark/constants.hpp"
#include "dembark/impact/scene.hpp"

using namespace dembark;
using namespace dembark::impact;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

Body body(int id, double mass, double x, double v, int material = 0) {
  Body b;
  b.id = id;
  b.mass = mass;
  b.radius = 0.0;
  b.position = {x, 0, 0};
  b.velocity = {v, 0, 0};
  b.material = material;
  return b;
}

Settings settings(double dt, double theta, std::vector<double> stiffness = {1e7}, double damping = 0.0, double contact_damping = 0.0) {
  Settings s;
  s.dt = dt;
  s.theta = theta;
  s.materials.clear();
  for (const double k : stiffness) s.materials.push_back({k, damping});
  s.pairs.assign(stiffness.size() * stiffness.size(), ImpactPairLaw());
  for (ImpactPairLaw& p : s.pairs) p.contact_damping = contact_damping;
  return s;
}

/// Two bodies of 50 kg (one stiffness 1e7) that close with 1 m/s; the velocity of the centre is `drift`.
struct Pair {
  double m = 25.0, k = 5e6, omega = std::sqrt(k / m);
  Impact record;
  double restitution = 0.0, end_speed = 0.0;
  Pair(double omega_tau, double theta, double damping = 0.0, double contact_damping = 0.0, double drift = 0.0, double phase = 0.3) {
    const double dt = omega_tau / omega;
    Scene scene(settings(dt, theta, {1e7}, damping, contact_damping),
                {body(0, 50, 0, drift + 0.5), body(1, 50, (1.0 + phase) * dt, drift - 0.5)});
    scene.row = true;
    scene.run(std::int64_t(4.0 * pi / omega_tau) + 4);
    const auto impacts = scene.system().take_finished();
    REQUIRE(impacts.size() == 1);
    record = impacts[0];
    restitution = scene.velocity()[1].x - scene.velocity()[0].x;
    end_speed = 0.5 * (scene.velocity()[1].x + scene.velocity()[0].x);
  }
};

}  // namespace

TEST_CASE("two logs part with the restitution of the scheme, exp(-pi (2 theta - 1) omega tau / 2)") {
  for (const double theta : {1.0, 0.8, 0.6})
    for (const double wt : {0.01, 0.003}) {
      const Pair p(wt, theta);
      CHECK_THAT(p.restitution, WithinRel(std::exp(-pi * (2 * theta - 1) * wt / 2), 0.2 * wt));
    }
  const Pair p(0.01, 1.0);
  CHECK_THAT(p.restitution, WithinAbs(0.9844, 1e-4));
  CHECK_THAT(p.record.peak_force / std::sqrt(p.k * p.m), WithinAbs(0.9922, 1e-4));
  CHECK_THAT(p.record.duration, WithinRel(pi / p.omega, 0.01));
  CHECK_THAT(p.record.impulse, WithinRel(p.m * (1.0 + p.restitution), 1e-12));
  CHECK_THAT(p.record.relative_speed, WithinRel(1.0, 1e-12));
  CHECK_THAT(p.record.dissipated, WithinRel(0.5 * p.m * (1.0 - p.restitution * p.restitution), 1e-9));
}

TEST_CASE("theta = 1/2 loses nothing to first order") {
  // The error depends on where in the step the contact begins: the worst of several phases falls as (omega tau)^2.
  const auto worst = [](double wt) {
    double loss = 0.0;
    for (double phase = 0.05; phase < 1.0; phase += 0.1)
      loss = std::max(loss, std::abs(1.0 - std::pow(Pair(wt, 0.5, 0, 0, 0, phase).restitution, 2)));
    return loss;
  };
  const double coarse = worst(0.04), fine = worst(0.01);
  INFO(coarse << " " << fine);
  CHECK(fine < 1e-3);
  CHECK(coarse < 0.3 * 0.04 * 0.04);
  CHECK(fine < 0.3 * 0.01 * 0.01);
}

TEST_CASE("the unequal pair: published numbers") {
  const double k = 1e7 * 3e7 / 4e7, m = 16.0, dt = 1e-3 / std::sqrt(k / m);
  Scene scene(settings(dt, 1.0, {1e7, 3e7}), {body(0, 20, 0, 1.5), body(1, 80, 1e-5, 0, 1)});
  scene.row = true;
  scene.run(4000);
  CHECK_THAT(scene.system().report().peak_force_so_far, WithinAbs(16418.8, 0.05));
  CHECK_THAT(1.5 * std::sqrt(k * m), WithinAbs(16431.7, 0.05));
  CHECK_THAT(scene.velocity()[0].x, WithinAbs(-0.898, 5e-4));
  CHECK_THAT(scene.velocity()[1].x, WithinAbs(0.5995, 5e-5));
}

TEST_CASE("a row without logs touches no plane") {
  Scene scene(settings(1e-6, 1.0, {2e7}), std::vector<Body>());
  scene.row = true;
  scene.around.planes.push_back({});
  scene.run(2);
  CHECK(scene.velocity().empty());
}

TEST_CASE("five logs in a row, and their momentum") {
  std::vector<Body> logs;
  for (int i = 0; i < 5; ++i) logs.push_back(body(i, 50, 0.1 * i, i == 0 ? 1.0 : 0.0));
  for (Body& b : logs) b.radius = 0.05;
  Scene scene(settings(1e-6, 1.0, {2e7}), logs);
  scene.row = true;
  scene.run(20000);
  const double expected[] = {-0.132, -0.075, -0.031, 0.296, 0.941};
  double momentum = 0.0;
  for (int i = 0; i < 5; ++i) {
    CHECK_THAT(scene.velocity()[i].x, WithinAbs(expected[i], 6e-4));
    momentum += 50 * scene.velocity()[i].x;
  }
  CHECK_THAT(momentum, WithinAbs(50.0, 1e-10));
  CHECK(scene.system().report().worst_certificate < 1e-12);
}

TEST_CASE("a wall of its own stiffness sends a log back") {
  const double sw = 4e7, k = 1e7 * sw / (1e7 + sw), omega = std::sqrt(k / 50), dt = 1e-3 / omega;
  for (const double speed : {0.0, 0.7}) {  // a wall that comes along is a wall at rest in its own frame
    Scene scene(settings(dt, 1.0), {body(0, 50, 1e-4, speed - 2.0)});
    Plane wall;
    wall.stiffness = sw;
    wall.normal = {1, 0, 0};
    wall.velocity = {speed, 0, 0};
    scene.around.planes.push_back(wall);
    scene.run(8000);
    CHECK_THAT(scene.velocity()[0].x - speed, WithinRel(2.0 * std::exp(-pi * 1e-3 / 2), 1e-5));
    const auto impacts = scene.system().take_finished();
    REQUIRE(impacts.size() == 1);
    CHECK(impacts[0].b == -1);
    CHECK_THAT(impacts[0].peak_force, WithinRel(2.0 * std::sqrt(k * 50), 2e-3));
    CHECK_THAT(impacts[0].duration, WithinRel(pi / omega, 2e-3));
  }
}

TEST_CASE("body damping: the damped oscillator, and the drag on the absolute velocity") {
  const double omega = std::sqrt(5e6 / 25.0), zeta = 0.02, lambda = 2.0 * zeta * omega * 50.0;
  const Pair p(1e-3, 0.5, lambda), fast(1e-3, 0.5, lambda, 0.0, 10.0);
  const double damped = std::sqrt(1 - zeta * zeta), e = std::exp(-zeta * pi / damped);
  CHECK_THAT(p.restitution, WithinRel(e, 1e-4));
  CHECK_THAT(p.record.duration, WithinRel(pi / (omega * damped), 1e-3));
  // The drag slows both logs down alike while they touch: not Galilean invariant.
  CHECK_THAT(fast.end_speed, WithinRel(10.0 * std::exp(-lambda / 50.0 * pi / (omega * damped)), 1e-4));
}

TEST_CASE("contact damping: Kelvin-Voigt without tension, the same in every frame") {
  const double m = 25.0, omega = std::sqrt(5e6 / m);
  for (const double zeta : {0.05, 0.3, 0.8}) {
    const double c = 2.0 * zeta * omega * m, root = std::sqrt(1 - zeta * zeta);
    // It lets go when s delta + c ddelta/dt = 0, before the spring is straight: omega_d t = 2 acos(zeta).
    const double e = std::exp(-2.0 * zeta / root * std::acos(zeta));
    for (const double theta : {1.0, 0.5}) {
      double error[2];
      int i = 0;
      for (const double wt : {2e-3, 5e-4}) error[i++] = std::abs(Pair(wt, theta, 0.0, c).restitution - e);
      INFO(zeta << " " << theta << " " << error[0] << " " << error[1]);
      CHECK(error[0] < 2.5 * 2e-3);
      CHECK(error[1] < 0.4 * error[0]);
    }
    CHECK(e > std::exp(-zeta * pi / root));  // of the spring that could pull
    const Pair rest(1e-3, 1.0, 0.0, c), fast(1e-3, 1.0, 0.0, c, 10.0);
    CHECK_THAT(fast.restitution, WithinAbs(rest.restitution, 1e-10));
    CHECK_THAT(fast.end_speed, WithinAbs(10.0, 1e-12));
    CHECK_THAT(rest.record.dissipated, WithinRel(0.5 * m * (1 - rest.restitution * rest.restitution), 0.01));
  }
}

TEST_CASE("logs that overlap from the beginning part with no more than the energy of that overlap") {
  const double overlap = 1e-3, k = 5e6, stored = 0.5 * k * overlap * overlap;
  for (const double c : {0.0, 2e3, 2e5}) {
    Scene scene(settings(1e-5, 1.0, {1e7}, 0.0, c), {body(0, 50, 0, 0), body(1, 50, -overlap, 0)});
    scene.row = true;
    scene.run(1);
    CHECK(scene.system().report().peak_force <= k * overlap * (1 + 1e-12));
    CHECK(scene.system().report().dissipated_energy >= 0.0);
    scene.run(4000);
    const double speed = scene.velocity()[1].x - scene.velocity()[0].x, kinetic = 0.5 * 25.0 * speed * speed;
    CHECK(scene.system().report().active == 0);
    CHECK(kinetic <= stored);
    if (c == 0.0) CHECK_THAT(kinetic, WithinRel(stored, 0.01));
    CHECK_THAT(kinetic + scene.system().report().dissipated_energy + scene.system().report().elastic_energy, WithinRel(stored, 1e-9));
  }
}

TEST_CASE("energy never grows with theta = 1, and the ledger closes") {
  std::vector<Body> logs;
  for (int i = 0; i < 8; ++i) logs.push_back(body(i, 10.0 + 7 * (i % 3), 0.101 * i, 1.5 * std::cos(3.0 * i)));
  for (Body& b : logs) b.radius = 0.05;
  for (const double contact_damping : {0.0, 2e4})
    for (const double damping : {0.0, 500.0})
      for (const double wt : {0.01, 0.3, 5.0}) {
        Scene scene(settings(wt * 1e-3, 1.0, {2e7}, damping, contact_damping), logs);
        scene.row = true;
        const double all = scene.kinetic_energy_of_half_step();
        double last = all;
        int impacts = 0;
        for (int i = 0; i < 3000; ++i) {
          const StepReport& r = scene.forces();
          scene.advance();
          const double energy = scene.kinetic_energy_of_half_step() + r.elastic_energy;
          REQUIRE(energy <= last * (1 + 1e-14));
          REQUIRE_THAT(energy + r.dissipated_energy, WithinRel(all, 1e-11));
          last = energy;
          impacts = int(r.impacts_begun);
        }
        CHECK(impacts > 5);
        CHECK(last < all);
      }
}
