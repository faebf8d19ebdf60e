// Viscous force of a bridge: equation of Reynolds, limits, the floor of the gap, and a whole contact that only ever loses energy by it.
#include "catch.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/contact.hpp"

using namespace dembark;
using namespace dembark::capillary;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const ViscousLiquid oil{0.1, 1e-6};
constexpr double R = 2e-3, volume = 1e-11;

/// Normal force per velocity by quadrature of Reynolds's equation in h = s + r^2/R: dp/dr = 6 eta r v / h^3, p = 0 where the liquid ends.
/// By parts F = int p 2 pi r dr = -pi int r^2 dp/dr dr.
double reynolds(double gap, double liquid) {
  const double end = std::sqrt(R * (std::sqrt(gap * gap + 2.0 * liquid / (pi * R)) - gap));
  const int n = 4000;
  double sum = 0.0;
  for (int k = 0; k <= n; ++k) {
    const double r = end * k / n, h = gap + r * r / R, weight = k == 0 || k == n ? 1.0 : k % 2 ? 4.0 : 2.0;
    sum += weight * 6.0 * pi * oil.viscosity * r * r * r / (h * h * h);
  }
  // The inner pressure times its area is -pi int r^2 dp; p falls to zero at the end.
  return sum * end / n / 3.0;
}

ContactBodies pair(double gap) {
  ContactBodies b;
  b.radius_1 = 2e-3;
  b.radius_2 = 1.5e-3;
  b.mass_1 = 8e-5;
  b.mass_2 = 4e-5;
  b.separation = {0.0, 0.0, b.radius_1 + b.radius_2 + gap};
  return b;
}

}  // namespace

TEST_CASE("normal resistance solves the equation of Reynolds in the liquid", "[viscous]") {
  for (const double gap : {1e-5, 5e-5, 2e-4})
    for (const double liquid : {1e-13, 1e-11, 1e-9})
      REQUIRE_THAT(viscous_resistance(oil, R, gap, liquid).normal, WithinRel(reynolds(gap, liquid), 1e-7));
}

TEST_CASE("limits of the resistance", "[viscous]") {
  // Unbounded liquid: 6 pi eta R*^2 / s.
  REQUIRE_THAT(viscous_resistance(oil, R, 1e-5, 1e6).normal, WithinRel(6.0 * pi * 0.1 * (0.5 * R) * (0.5 * R) / 1e-5, 1e-8));
  // A drop that is far smaller than the gap's own liquid: X -> V / (pi R s^2).
  const double x = 1e-20 / (pi * R * 1e-8);
  REQUIRE_THAT(viscous_resistance(oil, R, 1e-4, 1e-20).normal, WithinRel(1.5 * pi * 0.1 * R * R * x * x / 1e-4, 1e-6));
  // A sphere along a wall: 6 pi eta a (8/15 ln(a/s) + 0.9588), a = R / 2.
  REQUIRE_THAT(viscous_resistance(oil, R, 1e-5, volume).tangential,
               WithinRel(6.0 * pi * 0.1 * 1e-3 * (8.0 / 15.0 * std::log(100.0) + 0.9588), 1e-14));
  // The asymptote of a narrow gap must not turn round in a wide one.
  REQUIRE(viscous_resistance(oil, R, 1.0, volume).tangential == 0.0);
  const auto dry = viscous_resistance(oil, R, 1e-5, 0.0), inviscid = viscous_resistance(ViscousLiquid{}, R, 1e-5, volume);
  REQUIRE((dry.normal == 0.0 && dry.tangential == 0.0 && inviscid.normal == 0.0 && inviscid.tangential == 0.0));
}

TEST_CASE("the gap is taken at its floor, continuously", "[viscous]") {
  const auto floor = viscous_resistance(oil, R, 1e-6, volume);
  for (const double gap : {-1e-3, 0.0, 0.999e-6}) {
    REQUIRE(viscous_resistance(oil, R, gap, volume).normal == floor.normal);
    REQUIRE(viscous_resistance(oil, R, gap, volume).tangential == floor.tangential);
  }
  const auto above = viscous_resistance(oil, R, 1e-6 * (1.0 + 1e-9), volume);
  REQUIRE_THAT(above.normal, WithinRel(floor.normal, 1e-8));
  REQUIRE_THAT(above.tangential, WithinRel(floor.tangential, 1e-8));
  double before = floor.normal;
  for (double gap = 1e-6; gap < 1e-3; gap *= 1.3) {
    const auto r = viscous_resistance(oil, R, gap * 1.3, volume);
    REQUIRE((r.normal > 0.0 && r.normal < before && r.tangential > 0.0));
    before = r.normal;
  }
}

TEST_CASE("works on other scalars", "[viscous]") {
  REQUIRE_THAT(viscous_resistance(oil, static_cast<float>(R), 1e-5f, static_cast<float>(volume)).normal,
               WithinRel(static_cast<float>(viscous_resistance(oil, R, 1e-5, volume).normal), 1e-5f));
}

TEST_CASE("the time step limit is that of the normal force at the floor", "[viscous]") {
  const double mass = 3e-5;
  REQUIRE_THAT(viscous_time_step(oil, R, mass) * viscous_resistance(oil, R, 0.0, 1e6).normal, WithinRel(mass, 1e-6));
}

TEST_CASE("the liquid takes energy from any motion, and no angular momentum", "[viscous]") {
  const BridgeLaw bridge(Model::constant, 0.3);
  ContactParameters p;
  p.elasticity = {1e7, 4e6, 0.8};
  p.cohesion = {CohesionLaw::bridge, {&bridge, 0.0, volume, oil}};
  std::mt19937 chance(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const auto vector = [&](double scale) { return Vec3<double>{scale * any(chance), scale * any(chance), scale * any(chance)}; };
  for (int k = 0; k < 200; ++k) {
    ContactBodies b = pair(2e-4 * std::fabs(any(chance)));
    b.velocity_1 = vector(0.1);
    b.velocity_2 = vector(0.1);
    b.angular_velocity_1 = vector(50.0);
    b.angular_velocity_2 = vector(50.0);
    ContactState state;
    state.cohesion.bridge_volume = volume;
    state.cohesion.rupture_distance = 1.0;
    const ContactForce f = contact_step(p, b, 1e-7, state);
    const double power =
        dot(f.force, b.velocity_1 - b.velocity_2) + dot(f.torque_1, b.angular_velocity_1) + dot(f.torque_2, b.angular_velocity_2);
    const RelativeMotion m = relative_motion(b, f.normal, f.overlap);
    const auto c = viscous_resistance(oil, 2.0 * reduced(2e-3, 1.5e-3), -f.overlap, volume);
    REQUIRE(power < 0.0);
    REQUIRE_THAT(power, WithinRel(-c.normal * m.normal_velocity * m.normal_velocity -
                                      c.tangential * dot(m.tangential_velocity, m.tangential_velocity),
                                  1e-10));
    REQUIRE_THAT(norm(f.torque_1 + f.torque_2 + cross(b.separation, f.force)), WithinAbs(0.0, 1e-12 * norm(b.separation) * norm(f.force)));

    // Seen from the other body it is the same pair.
    ContactBodies other = b;
    std::swap(other.velocity_1, other.velocity_2);
    std::swap(other.angular_velocity_1, other.angular_velocity_2);
    std::swap(other.radius_1, other.radius_2);
    std::swap(other.mass_1, other.mass_2);
    other.separation = -b.separation;
    state = {};
    state.cohesion.bridge_volume = volume;
    state.cohesion.rupture_distance = 1.0;
    const ContactForce g = contact_step(p, other, 1e-7, state);
    REQUIRE_THAT(norm(g.force + f.force), WithinAbs(0.0, 1e-12 * norm(f.force)));
    REQUIRE_THAT(norm(g.torque_1 - f.torque_2), WithinAbs(0.0, 1e-12 * norm(f.torque_2)));
  }
}

TEST_CASE("there is no viscous force without a bridge", "[viscous]") {
  const BridgeLaw bridge(Model::constant, 0.3);
  ContactParameters p;
  p.elasticity = {1e7, 4e6, 0.8};
  p.cohesion = {CohesionLaw::bridge, {&bridge, 0.07, volume, oil}};
  ContactBodies b = pair(1e-6);
  b.velocity_1 = {0.2, 0.0, -0.3};
  ContactState state;
  REQUIRE(norm(contact_step(p, b, 1e-7, state).force) == 0.0);
  b.separation.z -= 2e-6;  // touches: the bridge forms, and resists at the floor
  const ContactForce touching = contact_step(p, b, 1e-7, state);
  const double floor = viscous_resistance(oil, 2.0 * reduced(2e-3, 1.5e-3), 0.0, volume).normal;
  REQUIRE_THAT(touching.viscous_normal, WithinRel(0.3 * floor, 1e-12));
  b.separation.z += state.cohesion.rupture_distance + 2e-6;
  b.velocity_1.z = 0.3;
  const ContactForce apart = contact_step(p, b, 1e-7, state);
  REQUIRE((norm(apart.force) == 0.0 && norm(apart.torque_1) == 0.0 && !apart.interacting));
}
