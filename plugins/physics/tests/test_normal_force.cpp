#include <cmath>
#include "catch.hpp"

#include "dembark/contact.hpp"
#include "dembark/normal_force.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

constexpr double radius = 2.5e-3, density = 2500.0;
const double mass = density * 4.0 / 3.0 * pi * radius * radius * radius;

ContactParameters parameters(NormalLaw law, double restitution) {
  ContactParameters p;
  p.normal_law = law;
  p.elasticity = {effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), effective_shear_modulus(5e6, 0.3, 5e6, 0.3), restitution};
  return p;
}

struct Impact {
  double rebound = 0.0, peak = 0.0, duration = 0.0;
};

/// A head-on impact of two equal spheres at `speed`, integrated with `steps_per_contact` steps.
Impact head_on(const ContactParameters& p, double speed, double dt) {
  ContactState state;
  double x = 2.0 * radius + 1e-9, v = -speed;
  Impact out;
  for (int i = 0; i < 2000000; ++i) {
    x += dt * v;
    ContactBodies b;
    b.separation = {x, 0, 0};
    b.velocity_1 = {0.5 * v, 0, 0};
    b.velocity_2 = {-0.5 * v, 0, 0};
    b.radius_1 = b.radius_2 = radius;
    b.mass_1 = b.mass_2 = mass;
    const ContactForce f = contact_step(p, b, dt, state);
    if (f.interacting) out.duration += dt;
    else if (v > 0.0) break;
    out.peak = std::max(out.peak, f.force.x);
    v += dt * f.force.x / (0.5 * mass);
  }
  out.rebound = v / speed;
  return out;
}

}  // namespace

TEST_CASE("elastic Hertz impact: peak force, duration and energy of the analytic solution") {
  const ContactParameters p = parameters(NormalLaw::hertz, 1.0);
  const double speed = 0.1, effective_mass = 0.5 * mass, effective_radius = 0.5 * radius;
  const Impact impact = head_on(p, speed, 2e-8);
  const double stiffness = 4.0 / 3.0 * p.elasticity.effective_youngs_modulus * std::sqrt(effective_radius);
  const double depth = std::pow(1.25 * effective_mass * speed * speed / stiffness, 0.4);
  CHECK_THAT(impact.peak, WithinRel(stiffness * std::pow(depth, 1.5), 1e-5));
  CHECK_THAT(impact.duration, WithinRel(2.943275 * depth / speed, 1e-3));
  CHECK_THAT(impact.rebound, WithinRel(1.0, 1e-5));
}

TEST_CASE("the linear law returns its coefficient of restitution and its characteristic overlap") {
  ContactParameters p = parameters(NormalLaw::hooke, 0.6);
  p.limit_force = false;
  // With attraction by damping at the end kept, the contact ends when the spheres part, which is a little before half a period.
  const Impact damped = head_on(p, 0.1, 2e-8);
  const double log_e = std::log(0.6), zeta = -log_e / std::sqrt(pi * pi + log_e * log_e);
  CHECK_THAT(damped.rebound, WithinRel(std::exp(-zeta / std::sqrt(1 - zeta * zeta) * pi), 1e-3));

  const ContactParameters elastic = parameters(NormalLaw::hooke, 1.0);
  const double effective_mass = 0.5 * mass, root = std::sqrt(0.5 * radius), e_star = elastic.elasticity.effective_youngs_modulus;
  const double k = hooke(HertzParameters{e_star, 1.0, 1.0}, 1.0, 0.5 * radius, effective_mass, 1.0, 0.0).force;
  // At the characteristic velocity the linear spring stores the impact energy at Hertz's overlap scaled by the source's factor.
  CHECK_THAT(k, WithinRel(16.0 / 15.0 * root * e_star * std::pow(15.0 * effective_mass / (16.0 * root * e_star), 0.2), 1e-12));
  CHECK_THAT(head_on(elastic, 0.1, 2e-8).peak, WithinRel(0.1 * std::sqrt(k * effective_mass), 1e-5));
}

TEST_CASE("restitution of the damped Hertz contact does not depend on the impact speed") {
  const ContactParameters p = parameters(NormalLaw::hertz, 0.5);
  const double slow = head_on(p, 0.01, 4e-8).rebound, fast = head_on(p, 1.0, 1e-8).rebound;
  CHECK_THAT(slow, WithinRel(fast, 2e-3));
  CHECK_THAT(slow, WithinAbs(0.5, 0.03));
}

TEST_CASE("a wall is the partner with infinite radius and mass") {
  CHECK(reduced(radius, double(INFINITY)) == radius);
  CHECK(reduced(double(INFINITY), mass) == mass);
  CHECK_THAT(reduced(2.0, 6.0), WithinRel(1.5, 1e-15));
}

TEST_CASE("forces balance: action and reaction, and torques that conserve angular momentum") {
  ContactParameters p = parameters(NormalLaw::hertz, 0.5);
  ContactState state;
  ContactBodies b;
  const Vec3<double> x1{0.8e-3, -0.3e-3, 2.1e-3}, x2{-0.9e-3, 0.4e-3, -2.3e-3};
  b.separation = x1 - x2;
  b.velocity_1 = {0.1, -0.2, 0.05};
  b.velocity_2 = {-0.1, 0.3, 0.2};
  b.angular_velocity_1 = {10, -20, 5};
  b.angular_velocity_2 = {-3, 8, 15};
  b.radius_1 = 2.5e-3;
  b.radius_2 = 3.0e-3;
  b.mass_1 = mass;
  b.mass_2 = 2.0 * mass;
  const ContactForce f = contact_step(p, b, 1e-5, state);
  REQUIRE(f.interacting);
  const Vec3<double> moment = cross(x1, f.force) - cross(x2, f.force) + f.torque_1 + f.torque_2;
  CHECK_THAT(norm(moment), WithinAbs(0.0, 1e-15));
  CHECK_THAT(dot(f.tangential, f.normal), WithinAbs(0.0, 1e-15));
}

TEST_CASE("exact touching gives a finite force, coincident centres none") {
  const ContactParameters p = parameters(NormalLaw::hertz, 0.5);
  ContactBodies b;
  b.radius_1 = b.radius_2 = radius;
  b.mass_1 = b.mass_2 = mass;
  for (double x : {1e-150, 2.0 * radius, 2.0 * radius * (1 - 1e-16)}) {
    ContactState state;
    b.separation = {x, 0, 0};
    const ContactForce f = contact_step(p, b, 1e-5, state);
    CHECK(std::isfinite(norm(f.force)));
    CHECK(std::isfinite(norm(f.torque_1)));
  }
  // Any direction would be a guess: engines end such a run.
  for (double x : {0.0, 1e-300}) {
    ContactState state;
    b.separation = {x, 0, 0};
    const ContactForce f = contact_step(p, b, 1e-5, state);
    CHECK(has_no_direction(f.normal));
    CHECK(!std::isfinite(norm(f.force)));
  }
}
