#include <algorithm>
#include <cmath>
#include "catch.hpp"

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/contact.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

constexpr double radius = 2e-3, mass = 8e-5, mu = 0.3;

ContactParameters parameters(FrictionLimit limit, double restitution = 0.5) {
  ContactParameters p;
  p.elasticity = {effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), effective_shear_modulus(5e6, 0.3, 5e6, 0.3), restitution};
  p.friction.static_friction = p.friction.kinetic_friction = mu;
  p.friction.friction_limit = limit;
  return p;
}

/// A sphere on a plane, pressed in by `overlap` (m), that slides along x at 10 m/s and moves up at `rate` (m/s): after a step of 1 ms it
/// slips.
ContactForce slides(const ContactParameters& p, double overlap, double rate) {
  ContactState state;
  ContactBodies b;
  b.radius_1 = radius;
  b.mass_1 = mass;
  b.separation = {0.0, 0.0, radius - overlap};
  b.velocity_1 = {10.0, 0.0, rate};
  return contact_step(p, b, 1e-3, state);
}

double spring(const ContactParameters& p, double overlap) { return p.respond(radius, mass, overlap, 0.0).force; }

}  // namespace

TEST_CASE("a sliding contact bears mu times the spring's force, or times what the dash-pot makes of it") {
  const double overlap = 2e-5;
  for (const NormalLaw law : {NormalLaw::hertz, NormalLaw::hooke})
    for (const Presliding path : {Presliding::linear, Presliding::exponential, Presliding::partial_slip})
      for (const double rate : {-0.2, 0.0, 0.1}) {
        const auto of = [&](FrictionLimit limit) {
          ContactParameters p = parameters(limit);
          p.normal_law = law;
          p.friction.presliding = path;
          return p;
        };
        const ContactForce elastic = slides(of(FrictionLimit::elastic), overlap, rate),
                           total = slides(of(FrictionLimit::total), overlap, rate);
        const double at_rest = spring(of(FrictionLimit::elastic), overlap);
        CHECK_THAT(elastic.tangential.x, WithinRel(-mu * at_rest, 1e-9));
        CHECK_THAT(total.tangential.x, WithinRel(-mu * total.normal_force, 1e-9));
        // The normal force itself is the same.
        CHECK(elastic.normal_force == total.normal_force);
        CHECK((total.normal_force > at_rest * (1.0 + 1e-9)) == (rate < 0.0));
      }
}

TEST_CASE("without damping both limits are the same to the bit, and so are contacts that stick") {
  for (const Presliding path : {Presliding::linear, Presliding::exponential, Presliding::partial_slip})
    for (const double rate : {-0.2, 0.1}) {
      ContactParameters elastic = parameters(FrictionLimit::elastic, 1.0), total = parameters(FrictionLimit::total, 1.0);
      elastic.friction.presliding = total.friction.presliding = path;
      CHECK(slides(elastic, 2e-5, rate).tangential.x == slides(total, 2e-5, rate).tangential.x);
    }
  ContactParameters elastic = parameters(FrictionLimit::elastic), total = parameters(FrictionLimit::total);
  for (ContactParameters* p : {&elastic, &total}) p->friction.static_friction = p->friction.kinetic_friction = 1e6;
  CHECK(slides(elastic, 2e-5, -0.2).tangential.x == slides(total, 2e-5, -0.2).tangential.x);
}

TEST_CASE("a contact that parts faster than its spring pushes still has friction of the spring, with and without limit_force") {
  for (const bool limited : {false, true}) {
    ContactParameters elastic = parameters(FrictionLimit::elastic), total = parameters(FrictionLimit::total);
    elastic.limit_force = total.limit_force = limited;
    const double overlap = 1e-6;
    CHECK(slides(total, overlap, 2.0).normal_force <= 0.0);
    CHECK(slides(total, overlap, 2.0).tangential.x == 0.0);
    CHECK_THAT(slides(elastic, overlap, 2.0).tangential.x, WithinRel(-mu * spring(elastic, overlap), 1e-9));
  }
}

TEST_CASE("a bridge pulls the surfaces together and takes nothing from what limits friction") {
  static const capillary::BridgeLaw bridge(capillary::Model::willett, 0.3);
  for (const FrictionLimit limit : {FrictionLimit::total, FrictionLimit::elastic}) {
    ContactParameters wet = parameters(limit), dry = wet;
    wet.cohesion = {CohesionLaw::bridge, {&bridge, 0.072, 1e-11, {}}};
    const ContactForce of_wet = slides(wet, 2e-5, 0.1), of_dry = slides(dry, 2e-5, 0.1);
    CHECK(of_wet.cohesive_force > 0.0);
    CHECK(of_wet.tangential.x == of_dry.tangential.x);
  }
}

TEST_CASE("a shear strength limits what either normal force allows") {
  for (const FrictionLimit limit : {FrictionLimit::total, FrictionLimit::elastic}) {
    ContactParameters p = parameters(limit);
    const double overlap = 2e-5;
    p.friction.interface_shear_strength = 1e4;
    const ContactForce found = slides(p, overlap, -0.2);
    const double strength = 1e4 * pi * radius * overlap, load = limit == FrictionLimit::total ? found.normal_force : spring(p, overlap);
    CHECK_THAT(found.tangential.x, WithinRel(strength * std::expm1(-mu * load / strength), 1e-12));
  }
}

TEST_CASE("rolling resistance keeps the normal force with its dash-pot") {
  for (const FrictionLimit limit : {FrictionLimit::total, FrictionLimit::elastic}) {
    ContactParameters p = parameters(limit);
    p.rolling = {RollingModel::constant_torque, 0.1, 0.0};
    ContactState state;
    ContactBodies b;
    b.radius_1 = radius;
    b.mass_1 = mass;
    b.separation = {0.0, 0.0, radius - 2e-5};
    b.velocity_1 = {0.0, 0.0, -0.2};
    b.angular_velocity_1 = {1e5, 0.0, 0.0};
    const ContactForce found = contact_step(p, b, 1e-6, state);
    CHECK_THAT(norm(found.rolling), WithinRel(0.1 * radius * found.normal_force, 1e-12));
  }
}
