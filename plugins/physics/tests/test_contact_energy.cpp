#include <algorithm>
#include <cmath>
#include <random>
#include "catch.hpp"

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/contact_energy.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

const capillary::BridgeLaw bridge(capillary::Model::willett, 0.35);

/// Sums over an oblique impact of two spheres by leapfrog.
struct Account {
  double kinetic_change = 0.0, total = 0.0, normal = 0.0, viscous = 0.0, tangential = 0.0, friction = 0.0, capillary = 0.0, liquid = 0.0,
         rolling = 0.0, rolling_viscous = 0.0, scale = 0.0, worst = 0.0;
  double half_way = 0.0;  ///< worst difference of what the normal spring took and what it holds
  double unsplit = 0.0;   ///< worst difference of the parts' sum and the force, and of their torques, relative
};

double kinetic(const ContactBodies& b) {
  const auto of = [](double m, double r, const Vec3<double>& v, const Vec3<double>& w) {
    return 0.5 * m * (dot(v, v) + 0.4 * r * r * dot(w, w));
  };
  return of(b.mass_1, b.radius_1, b.velocity_1, b.angular_velocity_1) + of(b.mass_2, b.radius_2, b.velocity_2, b.angular_velocity_2);
}

Account impact(const ContactParameters& p, double dt) {
  ContactState state;
  ContactBodies b;
  b.radius_1 = 2e-3;
  b.radius_2 = 3e-3;
  b.mass_1 = 8e-5;
  b.mass_2 = 3e-4;
  b.separation = {0.0, 0.0, 5.00001e-3};
  b.velocity_1 = {0.15, 0.05, -0.3};
  b.angular_velocity_1 = {20.0, -15.0, 30.0};
  Account out;
  const double start = kinetic(b);
  out.scale = start;
  for (double t = 0.0; t < 4e-3; t += dt) {
    const ContactForce f = contact_step(p, b, dt, state);
    const ContactParts parts = contact_parts(p, b, f, state);
    Vec3<double> rest = f.force, rest_torque = f.torque_2;
    const double arm_2 = relative_motion(b, f.normal, f.overlap).arm_2;
    for (std::size_t k = 0; k < force_part_count; ++k) {
      rest -= parts.load[k];
      rest_torque += arm_2 * cross(f.normal, parts.load[k]);
    }
    rest_torque += parts[ContactPart::rolling_elastic] + parts[ContactPart::rolling_viscous];
    // Next to nothing is left of spring and damping where they cancel.
    const double size = norm(parts[ContactPart::normal_elastic]) + norm(parts[ContactPart::normal_viscous]) + norm(f.force);
    if (size > 0.0) out.unsplit = std::max({out.unsplit, norm(rest) / size, norm(rest_torque) / (size * b.radius_2)});
    const ContactBodies before = b;
    b.velocity_1 += (dt / b.mass_1) * f.force;
    b.velocity_2 -= (dt / b.mass_2) * f.force;
    b.angular_velocity_1 += (dt / (0.4 * b.mass_1 * b.radius_1 * b.radius_1)) * f.torque_1;
    b.angular_velocity_2 += (dt / (0.4 * b.mass_2 * b.radius_2 * b.radius_2)) * f.torque_2;
    ContactBodies mean = b;
    mean.velocity_1 = 0.5 * (before.velocity_1 + b.velocity_1);
    mean.velocity_2 = 0.5 * (before.velocity_2 + b.velocity_2);
    mean.angular_velocity_1 = 0.5 * (before.angular_velocity_1 + b.angular_velocity_1);
    mean.angular_velocity_2 = 0.5 * (before.angular_velocity_2 + b.angular_velocity_2);
    const RelativeMotion motion = relative_motion(mean, f.normal, f.overlap);
    const Vec3<double> velocity = motion.normal_velocity * f.normal + motion.tangential_velocity;
    const auto work = [&](ContactPart part) { return dot(parts[part], velocity) * dt; };
    const double normal = work(ContactPart::normal_elastic), tangential = work(ContactPart::tangential_elastic);
    const double viscous = work(ContactPart::normal_viscous) + work(ContactPart::tangential_viscous);
    const double capillary = work(ContactPart::cohesive), liquid = work(ContactPart::liquid_viscous);
    const Vec3<double> spin = mean.angular_velocity_1 - mean.spin_2();
    const double rolling = dot(parts[ContactPart::rolling_elastic], spin) * dt, lost = dot(parts[ContactPart::rolling_viscous], spin) * dt;
    out.rolling += rolling;
    out.rolling_viscous += lost;
    out.total += normal + viscous + tangential + capillary + liquid + rolling + lost;
    out.normal += normal;
    out.viscous += viscous;
    out.tangential += tangential;
    out.capillary += capillary;
    out.liquid += liquid;
    out.friction = std::max(out.friction, state.friction.dissipated_energy);
    out.worst = std::max(out.worst, std::abs(kinetic(b) - start - out.total));
    // Half of this step's work is of the way after its positions.
    out.half_way = std::max(out.half_way, std::abs(-(out.normal - 0.5 * normal) - parts.normal_stored));
    b.separation += dt * (b.velocity_1 - b.velocity_2);
  }
  out.kinetic_change = kinetic(b) - start;
  return out;
}

ContactParameters parameters(double restitution, double friction, bool wet, double viscosity = 0.0) {
  ContactParameters p;
  p.elasticity = {effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), effective_shear_modulus(5e6, 0.3, 5e6, 0.3), restitution};
  p.friction.static_friction = p.friction.kinetic_friction = friction;
  if (wet) p.cohesion = {CohesionLaw::bridge, {&bridge, 0.072, 1e-11, {viscosity, 1e-5}}};
  return p;
}

}  // namespace

TEST_CASE("works of all parts of a contact balance the kinetic energy to round-off at any step") {
  for (const double viscosity : {-1.0, 0.0, 0.01})  // -1: dry
    for (const double friction : {0.0, 0.2, 100.0})
      for (const double restitution : {1.0, 0.4})
        for (const double dt : {1e-6, 2e-5}) {
          for (const NormalLaw law : {NormalLaw::hertz, NormalLaw::hooke})
            for (const Presliding path : {Presliding::linear, Presliding::exponential}) {
              ContactParameters p = parameters(restitution, friction, viscosity >= 0.0, viscosity);
              p.normal_law = law;
              p.friction.presliding = path;
              p.friction.friction_limit = law == NormalLaw::hertz ? FrictionLimit::elastic : FrictionLimit::total;
              const Account a = impact(p, dt);
              CHECK(std::abs(a.total) > 1e-9 * a.scale);
              CHECK(a.worst < 1e-12 * a.scale);
              CHECK(a.unsplit < 1e-14);
            }
        }
}

TEST_CASE("rolling resistance is booked: springs lose what they yield, a dashpot and a constant torque take energy only") {
  for (const double dt : {1e-6, 2e-5})
    for (const RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic}) {
      ContactParameters p = parameters(0.4, 0.2, false);
      p.rolling = {model, 0.1, 0.3};
      const Account a = impact(p, dt);
      CHECK(a.worst < 1e-12 * a.scale);
      CHECK(a.unsplit < 1e-14);
      CHECK(a.rolling_viscous < -1e-5 * a.scale);
      if (model == RollingModel::constant_torque) CHECK(a.rolling == 0.0);
      else CHECK(a.rolling < -1e-5 * a.scale);
    }
}

TEST_CASE("what the rolling spring took at constant load is what it holds") {
  // A pair that is pressed together and rolled within the limit: k_r is constant.
  ContactParameters p = parameters(1.0, 0.0, false);
  p.normal_law = NormalLaw::hooke;
  p.rolling = {RollingModel::elastic_plastic, 1e3, 0.0};
  ContactState state;
  ContactBodies b;
  b.radius_1 = 2e-3;
  b.mass_1 = 8e-5;
  b.separation = {0.0, 0.0, 1.99e-3};
  Vec3<double> before{};
  double took = 0.0, held = 0.0;
  const double dt = 1e-7;
  for (int i = 0; i < 1000; ++i) {
    b.angular_velocity_1 = {std::cos(0.01 * i), 0.5, 0.0};
    const ContactParts parts = contact_parts(p, b, contact_step(p, b, dt, state), state);
    // The mean of the couple before and after the step.
    took -= 0.5 * dt * dot(before + parts[ContactPart::rolling_elastic], b.angular_velocity_1);
    before = parts[ContactPart::rolling_elastic];
    held = parts.rolling_stored;
  }
  CHECK(held > 0.0);
  CHECK_THAT(took, WithinRel(held, 1e-9));
}

TEST_CASE("each part does what it is due to") {
  const Account slides = impact(parameters(0.4, 0.2, false), 1e-6);
  CHECK(slides.viscous < 0.0);
  CHECK(slides.tangential < 0.0);
  CHECK(slides.capillary == 0.0);
  // What the spring of a contact that has ended took is what the law says that slip lost, give or take the change of its stiffness.
  const Account elastic = impact(parameters(1.0, 0.2, false), 1e-6);
  CHECK(elastic.viscous == 0.0);
  CHECK_THAT(-elastic.tangential, WithinRel(elastic.friction, 0.3));
  CHECK_THAT(elastic.normal, WithinAbs(0.0, 1e-6 * elastic.scale));
  const Account smooth = impact(parameters(1.0, 0.0, false), 1e-6);
  CHECK(smooth.tangential == 0.0);
  CHECK_THAT(smooth.kinetic_change, WithinAbs(0.0, 1e-6 * smooth.scale));
  CHECK(impact(parameters(1.0, 0.0, true), 1e-6).liquid == 0.0);
  CHECK(impact(parameters(1.0, 0.0, true, 0.01), 1e-6).liquid < 0.0);
  CHECK(impact(parameters(1.0, 0.0, true), 1e-6).capillary < 0.0);  // the bridge forms at the touch and ruptures far behind it
}

TEST_CASE("what the normal spring took is what it holds, with an error of second order in the step") {
  const ContactParameters p = parameters(1.0, 0.0, false);
  const double coarse = impact(p, 4e-6).half_way, fine = impact(p, 2e-6).half_way, finest = impact(p, 1e-6).half_way;
  CHECK_THAT(std::log2(coarse / fine), WithinAbs(2.0, 0.2));
  CHECK_THAT(std::log2(fine / finest), WithinAbs(2.0, 0.2));
}

TEST_CASE("held bodies: springs without damping, finite forces and parts, whatever the law") {
  for (const bool wall : {true, false})
    for (const NormalLaw law : {NormalLaw::hertz, NormalLaw::hooke})
      for (const Presliding path : {Presliding::linear, Presliding::exponential, Presliding::partial_slip})
        for (const RollingModel rolling : {RollingModel::off, RollingModel::constant_torque, RollingModel::elastic_plastic})
          for (const double viscosity : {-1.0, 0.0, 0.01})
            for (const double speed : {0.0, 0.1}) {
              ContactParameters p = parameters(0.5, 0.5, viscosity >= 0.0, viscosity);
              p.normal_law = law;
              p.friction.presliding = path;
              p.rolling = {rolling, 0.1, 0.3};
              ContactBodies b;
              b.radius_1 = 2e-3;
              b.mass_1 = b.mass_2 = INFINITY;
              if (!wall) b.radius_2 = 3e-3;
              b.separation = {0.0, 0.0, wall ? 1.99e-3 : 4.99e-3};
              b.velocity_1 = {0.3 * speed, 0.0, -speed};
              b.angular_velocity_1 = {10.0 * speed, 0.0, 20.0 * speed};
              for (const double dt : {0.0, 1e-6}) {
                ContactState state;
                const ContactForce f = contact_step(p, b, dt, state);
                const ContactParts parts = contact_parts(p, b, f, state);
                const double spring = hertz(p.elasticity, b.effective_radius(), 0.0, 1e-5, 0.0).force;
                CHECK(std::abs(f.normal_force - spring) < 1e-12 * spring);
                CHECK(norm(parts[ContactPart::normal_viscous]) < 1e-12 * spring);
                CHECK(std::isfinite(norm(f.force) + norm(f.torque_1) + norm(f.torque_2) + norm(f.rolling)));
                CHECK(std::isfinite(norm(state.friction.displacement) + state.friction.slip + norm(state.rolling_angle)));
                for (const Vec3<double>& load : parts.load) CHECK(std::isfinite(norm(load)));
                CHECK(std::abs(parts.normal_stored - 0.4 * spring * 1e-5) < 1e-12 * spring);
                CHECK(p.cohesion.liquid.stable_time_step(b.effective_radius(), b.effective_mass()) == INFINITY);
              }
            }
}
