// How far a spin about the normal carries the tangential spring.
#include <cmath>
#include <random>
#include "catch.hpp"

#include "dembark/contact.hpp"
#include "dembark/impact/motion.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

/// Direction (rad) of the elastic displacement of a sphere on a wall at rest, sheared along x and then turned by `angle` about the normal.
double carried(double angle) {
  ContactParameters p;
  p.elasticity = {effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), effective_shear_modulus(5e6, 0.3, 5e6, 0.3), 1.0};
  p.friction.static_friction = p.friction.kinetic_friction = 100.0;
  ContactBodies b;
  b.radius_1 = 2e-3;
  b.mass_1 = 1e-4;
  b.separation = {0.0, 0.0, 1.99e-3};
  ContactState state;
  state.friction.displacement = {1e-7, 0.0, 0.0};
  b.angular_velocity_1 = {0.0, 0.0, angle / 1e-2};
  for (int k = 0; k < 1000; ++k) contact_step(p, b, 1e-5, state);
  CHECK_THAT(norm(state.friction.displacement), WithinRel(1e-7, 1e-9));
  return std::atan2(state.friction.displacement.y, state.friction.displacement.x);
}

}  // namespace

TEST_CASE("a sphere that spins on a wall at rest carries the spring as far as two equally soft layers of bristles do") {
  // Bristles that stick: those of the sphere turn about the middle of the patch, those of the wall stay. Each holds the difference of its
  // roots; the sum of all is the force. Sheared by xi, the roots lie xi/2 before and behind the points of the patch.
  const double xi = 0.1, angle = 0.8;
  Vec3<double> sum{};
  for (int k = 0; k < 60; ++k) {
    const double r = std::sqrt((k + 0.5) / 60.0);
    for (int m = 0; m < 12; ++m) {
      const double phase = 2.0 * pi * m / 12.0 + k, x = r * std::cos(phase), y = r * std::sin(phase);
      const Vec3<double> sphere{std::cos(angle) * (x + 0.5 * xi) - std::sin(angle) * y,
                                std::sin(angle) * (x + 0.5 * xi) + std::cos(angle) * y, 0.0};
      sum += sphere - Vec3<double>{x - 0.5 * xi, y, 0.0};
    }
  }
  const double expected = std::atan2(sum.y, sum.x);
  CHECK_THAT(expected, WithinRel(0.5 * angle, 1e-12));
  CHECK_THAT(carried(angle), WithinRel(expected, 1e-6));
}

TEST_CASE("a pair that turns as a rigid body takes the spring along") {
  CHECK_THAT(contact_twist(Vec3<double>{0, 0, 1}, {1, 2, 30}, {3, 4, 30}, 0.01), WithinRel(0.3, 1e-14));
}

TEST_CASE("a contact that turns as a rigid body keeps its spring in the frame of the body, at walls and between grains") {
  std::mt19937 random(4711);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const auto direction = [&] {
    Vec3<double> v{any(random), any(random), any(random)};
    return v * (1.0 / norm(v));
  };
  constexpr double dt = 1e-5;
  constexpr int steps = 2000;
  for (int trial = 0; trial < 40; ++trial) {
    const bool wall = trial % 2 == 0;
    ContactParameters p;
    p.elasticity = {effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), effective_shear_modulus(5e6, 0.3, 5e6, 0.3), 1.0};
    p.friction.static_friction = p.friction.kinetic_friction = 100.0;
    p.rolling = {RollingModel::elastic_plastic, 100.0, 0.0};
    if (trial % 3 == 0) p.friction.presliding = Presliding::partial_slip;
    const Vec3<double> spin = 30.0 * direction(), first = direction();
    // The axis goes through the place of contact; far from it the motion is the same but for a translation of both.
    const auto turned = [&](const Vec3<double>& v, double angle) {
      const Vec3<double> axis = spin * (1.0 / norm(spin)), side = cross(axis, v);
      return v + std::sin(angle) * side + (1.0 - std::cos(angle)) * cross(axis, side);
    };
    ContactBodies b;
    b.radius_1 = 2e-3;
    b.mass_1 = 1e-4;
    b.angular_velocity_1 = spin;
    const double apart = wall ? 1.99e-3 : 4.99e-3;
    if (wall) b.wall_spin = spin;
    else b.radius_2 = 3e-3, b.mass_2 = 1e-4, b.angular_velocity_2 = spin;
    const Vec3<double> far = 10.0 * direction();
    ContactState state;
    Vec3<double> spring = cross(first, direction());
    spring *= 1e-8 / norm(spring);
    for (int k = 0; k <= steps; ++k) {
      const double angle = norm(spin) * dt * k;
      b.separation = apart * turned(first, angle);
      b.velocity_1 = cross(spin, b.separation) + far;
      b.velocity_2 = far;
      if (k == 0) {
        // Sheared once, along `spring`.
        b.velocity_1 += spring * (1.0 / dt);
        contact_step(p, b, dt, state);
        spring = state.friction.displacement;
        state.rolling_angle = spring * 1e3;
        continue;
      }
      contact_step(p, b, dt, state);
    }
    const Vec3<double> expected = turned(spring, norm(spin) * dt * steps);
    CHECK(norm(state.friction.displacement - expected) < 1e-3 * norm(spring));
    CHECK(norm(state.rolling_angle - 1e3 * expected) < 1e-3 * norm(1e3 * spring));
  }
}

TEST_CASE("impacts and contacts turn the spring alike, at walls and between bodies") {
  std::vector<impact::Body> bodies(2);
  for (int k = 0; k < 2; ++k) {
    bodies[k].id = k;
    bodies[k].mass = bodies[k].inertia = bodies[k].radius = 1.0;
    bodies[k].spin = {0.1, 0.2, k == 0 ? 7.0 : -3.0};
  }
  impact::Motion motion;
  motion.begin(bodies, 1e-3, 1.0);
  impact::Row row{};
  row.a = 0;
  row.normal = {0, 0, 1};
  row.b = -1;
  CHECK_THAT(motion.twist(row, 1e-3), WithinAbs(contact_twist(row.normal, bodies[0].spin, {}, 1e-3), 1e-18));
  CHECK_THAT(motion.twist(row, 1e-3), WithinRel(3.5e-3, 1e-14));
  row.b = 1;
  CHECK_THAT(motion.twist(row, 1e-3), WithinRel(2e-3, 1e-14));
}
