// Adhesion of dry surfaces, and the seat that it shares with bridges.
#include <cmath>

#include "catch.hpp"
#include "dembark/contact.hpp"

using namespace dembark;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double W = 0.05, R = 1e-4, E = 1e7;

double jkr(double overlap) { return jkr_force(W, R, E, jkr_contact_radius(W, R, E, overlap)); }

Cohesion adhesion(CohesionLaw law) {
  Cohesion cohesion;
  cohesion.law = law;
  cohesion.work_of_adhesion = W;
  cohesion.cohesive_force = 3e-6;
  return cohesion;
}

/// A sphere that meets a wall at `speed` (m/s) without other losses: its speed when it has left, 0 where it sticks.
double rebound(CohesionLaw law, double speed, double steps_per_contact) {
  ContactParameters p;
  p.elasticity = {E, 4e6, 1.0};
  p.cohesion = adhesion(law);
  const double mass = 1e-8, longest = 2.94 * std::pow(mass * mass / (E * E * R * speed), 0.2);
  const double dt = longest / steps_per_contact;
  ContactBodies b;
  b.radius_1 = R;
  b.mass_1 = mass;
  b.separation = {0.0, 0.0, R + 1e-12};
  b.velocity_1 = {0.0, 0.0, -speed};
  ContactState state;
  for (int k = 0; k < 40 * steps_per_contact; ++k) {
    b.separation.z += dt * b.velocity_1.z;
    const ContactForce out = contact_step(p, b, dt, state);
    b.velocity_1.z += dt * out.force.z / mass;
    if (k > 10 && !out.interacting) return b.velocity_1.z;
  }
  return 0.0;
}

}  // namespace

TEST_CASE("the contact radius solves the equation of Johnson, Kendall and Roberts", "[cohesion]") {
  const double reach = jkr_rupture_distance(W, R, E);
  for (const double overlap : {-reach * (1.0 - 1e-9), -0.5 * reach, 0.0, 1e-9, 1e-7, 1e-6, 1e-5}) {
    const double a = jkr_contact_radius(W, R, E, overlap);
    CHECK_THAT(a * a / R - std::sqrt(2.0 * pi * W * a / E), WithinAbs(overlap, 1e-13 * (a * a / R)));
  }
}

TEST_CASE("pull-off forces are those of the theories", "[cohesion]") {
  const double pull_off = 1.5 * pi * W * R;
  // The least force of JKR lies where its slope in the contact radius vanishes: a^3 = 9 pi W R^2 / (8 E).
  const double a = std::cbrt(9.0 * pi * W * R * R / (8.0 * E));
  CHECK_THAT(jkr_force(W, R, E, a), WithinRel(-pull_off, 1e-12));
  for (const double factor : {0.99, 1.01}) CHECK(jkr_force(W, R, E, factor * a) > -pull_off);
  CHECK_THAT(jkr(0.0), WithinRel(-8.0 / 9.0 * pull_off, 1e-12));
  CHECK_THAT(jkr(-jkr_rupture_distance(W, R, E) * (1.0 - 1e-12)), WithinRel(-5.0 / 9.0 * pull_off, 1e-5));
  CohesionState state;
  CHECK_THAT(cohesion_step(adhesion(CohesionLaw::dmt), {R, INFINITY, -1e-8, true, E}, state), WithinRel(2.0 * pi * W * R, 1e-14));
  CHECK(cohesion_step(adhesion(CohesionLaw::constant), {R, R, -1e-8, true, E}, state) == 3e-6);
  CHECK(!state.held());
}

TEST_CASE("without work of adhesion a JKR contact is Hertz's", "[cohesion]") {
  for (const double overlap : {1e-8, 1e-6}) {
    const double hertz = 4.0 / 3.0 * E * std::sqrt(R * overlap) * overlap;
    CHECK_THAT(jkr_attraction(1e-12, R, E, overlap), WithinAbs(0.0, 1e-4 * hertz));
    CHECK(jkr_attraction(0.0, R, E, overlap) <= 1e-14 * hertz);
  }
  CHECK(jkr_rupture_distance(0.0, R, E) == 0.0);
}

TEST_CASE("a JKR contact forms at the touch, holds over the gap and breaks", "[cohesion]") {
  const Cohesion law = adhesion(CohesionLaw::jkr);
  const double reach = jkr_rupture_distance(W, R, E);
  CohesionState state;
  CHECK(cohesion_step(law, {R, INFINITY, 0.5 * reach, false, E}, state) == 0.0);
  CHECK(!state.held());
  CHECK(cohesion_step(law, {R, INFINITY, -1e-9, true, E}, state) > 0.0);
  CHECK_THAT(state.rupture_distance, WithinRel(reach, 1e-14));
  CHECK_THAT(cohesion_step(law, {R, INFINITY, 0.5 * reach, false, E}, state), WithinRel(-jkr(-0.5 * reach), 1e-12));
  CHECK(cohesion_step(law, {R, INFINITY, 1.001 * reach, false, E}, state) == 0.0);
  CHECK(!state.held());
  CHECK(cohesion_step(law, {R, INFINITY, 0.5 * reach, false, E}, state) == 0.0);
}

TEST_CASE("an impact loses the work between touch and rupture, or sticks", "[cohesion]") {
  const double mass = 1e-8, sticking = std::sqrt(2.0 * jkr_loss(W, R, E) / mass);
  for (const double factor : {1.2, 2.0, 5.0}) {
    const double speed = factor * sticking, expected = std::sqrt(speed * speed - sticking * sticking);
    CHECK_THAT(rebound(CohesionLaw::jkr, speed, 4000), WithinRel(expected, 2e-3));
    // Its attraction has no hysteresis: nothing is lost.
    CHECK_THAT(rebound(CohesionLaw::dmt, speed, 4000), WithinRel(speed, 2e-3));
  }
  CHECK(rebound(CohesionLaw::jkr, 0.8 * sticking, 400) == 0.0);
}

TEST_CASE("what another law left of a contact ends with the law", "[cohesion]") {
  const CohesionContact touching = [] {
    CohesionContact c;
    c.radius_1 = c.radius_2 = R;
    c.effective_youngs_modulus = E;
    c.touching = true;
    return c;
  }();
  for (const CohesionLaw law : {CohesionLaw::none, CohesionLaw::constant, CohesionLaw::dmt}) {
    CohesionState state;
    cohesion_step(adhesion(CohesionLaw::jkr), touching, state);
    REQUIRE(state.held());
    cohesion_step(adhesion(law), touching, state);
    CHECK_FALSE(state.held());
  }
}

TEST_CASE("equal spheres have the force of half the radius against a wall", "[cohesion]") {
  CohesionState one, other;
  for (const CohesionLaw law : {CohesionLaw::dmt, CohesionLaw::jkr})
    CHECK_THAT(cohesion_step(adhesion(law), {2.0 * R, 2.0 * R, -1e-8, true, E}, one),
               WithinRel(cohesion_step(adhesion(law), {R, INFINITY, -1e-8, true, E}, other), 1e-14));
}
