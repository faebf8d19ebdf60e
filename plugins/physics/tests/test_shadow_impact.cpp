#include <cmath>

#include "catch.hpp"

#include "dembark/integration/shadow_impact.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

ContactParameters material(double restitution, double friction, NormalLaw law = NormalLaw::hertz) {
  ContactParameters p;
  p.normal_law = law;
  p.characteristic_velocity = 0.5;
  const double e = effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), g = effective_shear_modulus(5e6, 0.3, 5e6, 0.3);
  p.elasticity = HertzParameters(e, g, restitution);
  p.friction.static_friction = p.friction.kinetic_friction = friction;
  return p;
}

ContactBodies spheres(const Vec3<double>& approach, const Vec3<double>& spin = {}) {
  ContactBodies b;
  b.radius_1 = 2.5e-3;
  b.radius_2 = 3e-3;
  b.mass_1 = 4.0 / 3.0 * pi * 2500.0 * std::pow(b.radius_1, 3);
  b.mass_2 = 4.0 / 3.0 * pi * 2500.0 * std::pow(b.radius_2, 3);
  b.separation = {b.radius_1 + b.radius_2, 0.0, 0.0};
  b.velocity_1 = approach;
  b.angular_velocity_1 = spin;
  return b;
}

/// The same by leapfrog as engines do it, forces with the velocities of half a step before, from a touch `phase` steps ago.
double engine_deviation(const ContactParameters& p, ContactBodies b, double h, double phase, const PairInertia& inertia = {}) {
  const auto move = [&b](double t) { b.separation += t * (b.velocity_1 - b.velocity_2); };
  move(phase * h);
  ShadowImpact shadow;
  ContactState state;
  REQUIRE(shadow.begin(p, b, 4, 9, h, inertia));
  CHECK_THAT(shadow.elapsed, WithinRel(phase * h, 1e-6));
  const auto turn = [h](Vec3<double>& spin, double factor, double mass, double radius, const Vec3<double>& torque) {
    if (factor > 0.0) spin += (h / (factor * mass * radius * radius)) * torque;
  };
  double found = -1.0;
  for (auto stage = ShadowImpact::Stage::going_on; stage == ShadowImpact::Stage::going_on;) {
    const ContactForce f = contact_step(p, b, h, state);
    b.velocity_1 += (h / b.mass_1) * f.force;
    b.velocity_2 -= (h / b.mass_2) * f.force;
    turn(b.angular_velocity_1, inertia.factor_1, b.mass_1, b.radius_1, f.torque_1);
    turn(b.angular_velocity_2, inertia.factor_2, b.mass_2, b.radius_2, f.torque_2);
    move(h);
    stage = shadow.follow(b, {}, h, found);
    REQUIRE(stage != ShadowImpact::Stage::dropped);
  }
  return found;
}

double rms_deviation(const ContactParameters& p, const ContactBodies& b, double h, const PairInertia& inertia = {}) {
  double sum = 0.0;
  for (int k = 0; k < 8; ++k) {
    const double d = engine_deviation(p, b, h * (1.0 + 0.0173 * k), (k + 0.5) / 8.0, inertia);
    sum += d * d / 8.0;
  }
  return std::sqrt(sum);
}

}  // namespace

TEST_CASE("shadow impacts: the reference gives back the speed of an elastic impact, in its time", "[shadow]") {
  const ContactBodies b = spheres({-0.7, 0, 0});
  const ContactParameters p = material(1.0, 0.0);
  const ReferenceImpact impact(p, b);
  REQUIRE(impact.ended());
  CHECK_THAT(impact.outgoing().velocity.x, WithinRel(0.7, 1e-6));
  CHECK_THAT(impact.duration(), WithinRel(2.9432750 * largest_overlap(p, b.effective_radius(), b.effective_mass(), 0.7) / 0.7, 1e-5));
}

TEST_CASE("shadow impacts: Hooke's law with damping has its coefficient of restitution", "[shadow]") {
  for (const double e : {0.9, 0.5}) {
    ContactParameters p = material(e, 0.0, NormalLaw::hooke);
    const ReferenceImpact impact(p, spheres({-0.7, 0, 0}));
    REQUIRE(impact.ended());
    // The contact ends without overlap; there damping has pulled for a while, and all of the restitution is reached.
    CHECK_THAT(impact.outgoing().velocity.x, WithinRel(0.7 * e, 1e-5));
  }
}

TEST_CASE("shadow impacts: an oblique impact with friction does not depend on the reference's steps", "[shadow]") {
  for (const double friction : {0.1, 0.6}) {
    const ContactParameters p = material(0.7, friction);
    const ContactBodies b = spheres({-0.7, 0.3, -0.2}, {40, -20, 90});
    const PairMotion some = ReferenceImpact(p, b).outgoing(), more = ReferenceImpact(p, b, {}, 1200).outgoing();
    CAPTURE(friction);
    CHECK(deviation(some, more, b.radius_1, b.radius_2, norm(b.velocity_1)) < 5e-4);
    CHECK(norm(more.spin_1 - b.angular_velocity_1) > 1.0);
  }
}

TEST_CASE("shadow impacts: damping that begins with the fourth root of the overlap", "[shadow]") {
  const ContactParameters p = material(0.6, 0.0);
  const ContactBodies b = spheres({-0.7, 0, 0});
  const double some = ReferenceImpact(p, b).outgoing().velocity.x, more = ReferenceImpact(p, b, {}, 1200).outgoing().velocity.x;
  CHECK_THAT(some, WithinRel(more, 1e-4));
}

TEST_CASE("shadow impacts: the lag of damping is of first order in the step, and is found", "[shadow]") {
  const ContactParameters p = material(0.6, 0.0, NormalLaw::hooke);
  const ContactBodies b = spheres({-0.7, 0, 0});
  const double time = ReferenceImpact(p, b).duration();
  const double coarse = rms_deviation(p, b, time / 25), fine = rms_deviation(p, b, time / 1600);
  CHECK_THAT(std::log2(coarse / fine) / 6.0, WithinAbs(1.0, 0.2));
  CHECK(coarse > 1e-3);
  // Without damping the same steps err by their second order.
  CHECK(rms_deviation(material(1.0, 0.0, NormalLaw::hooke), b, time / 1600) < 0.2 * fine);
}

TEST_CASE("shadow impacts: an engine comes to the reference", "[shadow]") {
  const ContactParameters p = material(0.7, 0.3);
  const ContactBodies b = spheres({-0.7, 0.3, -0.2}, {40, -20, 90});
  CHECK(rms_deviation(p, b, ReferenceImpact(p, b).duration() / 2000) < 2e-3);
  // Discs, one that does not turn, and none that does.
  for (const PairInertia& other : {PairInertia{0.5, 0.5}, PairInertia{0.4, 0.0}, PairInertia{0.0, 0.0}}) {
    const ReferenceImpact impact(p, b, other);
    CAPTURE(other.factor_1, other.factor_2);
    CHECK(rms_deviation(p, b, impact.duration() / 2000, other) < 2e-3);
    CHECK(deviation(impact.outgoing(), ReferenceImpact(p, b).outgoing(), b.radius_1, b.radius_2, norm(b.velocity_1)) > 1e-2);
  }
}

TEST_CASE("shadow impacts: what is no impact of two is left out", "[shadow]") {
  const ContactParameters p = material(0.7, 0.3);
  ContactBodies b = spheres({-0.5, 0, 0});
  ShadowImpact shadow;
  CHECK_FALSE(shadow.begin(p, b, 1, 2, 1e-5));  // no overlap
  b.separation.x -= 1e-5;
  CHECK_FALSE(shadow.begin(p, b, 1, 2, 1e-5));  // longer ago than the step
  CHECK(shadow.begin(p, b, 1, 2, 3e-5));
  double found = -1.0;
  ContactBodies pushed = b;
  pushed.velocity_2.y = 0.01;  // by a third
  CHECK(shadow.follow(pushed, {}, 1e-5, found) == ShadowImpact::Stage::dropped);
  CHECK(shadow.follow(b, {}, 1e-5, found) == ShadowImpact::Stage::going_on);
  auto stage = ShadowImpact::Stage::going_on;
  for (int k = 0; k < 1000 && stage == ShadowImpact::Stage::going_on; ++k) stage = shadow.follow(b, {}, 1e-5, found);
  CHECK(stage == ShadowImpact::Stage::dropped);  // they do not part
  b.mass_2 = INFINITY;
  CHECK_FALSE(shadow.begin(p, b, 1, 2, 3e-5));
  b = spheres({0.5, 0, 0});
  b.separation.x -= 1e-5;
  CHECK_FALSE(shadow.begin(p, b, 1, 2, 3e-5));  // they part
}
