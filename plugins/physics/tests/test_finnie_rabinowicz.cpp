#include <cmath>
#include <vector>
#include "catch.hpp"

#include "dembark/finnie_rabinowicz.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

constexpr double N = 2.0, k = 1e5, area = 1e-8;

struct Drive {
  FinnieRabinowicz law;
  FrictionState<double> state{};
  double position = 0.0;

  /// Force on body 1 after moving it to `to` along x in one step.
  double move(double to, double normal_force = N) {
    const double step = to - position;
    position = to;
    return friction_step(law, normal_force, k, 0.0, area, Vec3<double>{step, 0, 0}, 1.0, state).x;
  }
};

FinnieRabinowicz law(double s, double kin, double sc, double tau = unlimited_strength, Presliding p = Presliding::linear) {
  FinnieRabinowicz l;
  l.static_friction = s;
  l.kinetic_friction = kin;
  l.critical_slip_distance = sc;
  l.interface_shear_strength = tau;
  l.presliding = p;
  return l;
}

}  // namespace

TEST_CASE("below the limit the contact is the Mindlin spring, and it comes back without loss") {
  Drive d{law(0.5, 0.3, 1e-5)};
  for (double u : {1e-6, 5e-6, 9e-6, 2e-6, -8e-6, 0.0}) CHECK_THAT(d.move(u), WithinAbs(-k * u, 1e-13 * k * 1e-5));
  CHECK(d.state.dissipated_energy == 0.0);
  CHECK(d.state.slip == 0.0);
}

TEST_CASE("in sliding the force lies on the limit curve of the accumulated slip, whatever the step") {
  // The drop of friction over its distance beside the spring: a fifth, almost as steep, steeper.
  for (const double steepness : {0.2, 0.95, 2.0})
    for (const double step : {1e-8, 1e-6, 1e-4}) {
      const double distance = 0.2 * N / (k * steepness);
      Drive d{law(0.5, 0.3, distance)};
      int slipping = 0;
      for (int i = 1; i <= 2000; ++i) {
        const double force = -d.move(i * step);
        if (!(d.state.slip > 0.0)) continue;
        ++slipping;
        const double mu = 0.3 + 0.2 * std::exp(-d.state.slip / distance);
        CHECK_THAT(force, WithinRel(mu * N, 1e-14));
        CHECK_THAT(d.state.slip, WithinRel(i * step - force / k, 1e-9));
      }
      CHECK(slipping > 900);
    }
}

TEST_CASE("finite shear strength: Coulomb at low pressure, strength times area at high pressure, (2) between") {
  const double tau = 1e8;  // tau A = 1 N
  const FinnieRabinowicz l = law(0.5, 0.5, 0.0, tau);
  CHECK_THAT(shear_limit(l, 0.5, 1e-6, area), WithinRel(0.5e-6, 1e-6));
  CHECK_THAT(shear_limit(l, 0.5, 1e3, area), WithinRel(tau * area, 1e-12));
  CHECK_THAT(shear_limit(l, 0.5, 2.0, area), WithinRel(1.0 - std::exp(-1.0), 1e-12));
  CHECK(shear_limit(l, 0.5, 0.0, area) == 0.0);
  CHECK(shear_limit(l, 0.5, -1.0, area) == 0.0);
  CHECK(shear_limit(l, 0.5, 1.0, 0.0) == 0.0);

  Drive d{law(0.5, 0.3, 1e-5, tau)};
  for (int i = 1; i <= 100; ++i) d.move(i * 1e-6);
  const double mu = 0.3 + 0.2 * std::exp(-d.state.slip / 1e-5);
  CHECK_THAT(k * d.state.displacement.x, WithinRel(tau * area * (1.0 - std::exp(-mu * N / (tau * area))), 1e-12));
}

TEST_CASE("zero critical slip distance drops to kinetic friction with the first slip and stays there") {
  Drive d{law(0.5, 0.3, 0.0)};
  CHECK_THAT(-d.move(0.999e-5), WithinRel(0.999, 1e-12));
  for (double u : {1.01e-5, 1.5e-5, 3e-5}) CHECK_THAT(-d.move(u), WithinRel(0.3 * N, 1e-12));
}

TEST_CASE("steady slow sliding shows no saw-tooth between static and kinetic friction") {
  // A switch that resets the spring swings between mu_s N and mu_k N with the period (mu_s - mu_k) N / k_t = 4e-6 m.
  for (double sc : {0.0, 1e-7, 1e-5}) {
    Drive d{law(0.5, 0.3, sc)};
    double last = 0.0;
    int rises_after_peak = 0;
    bool peaked = false;
    for (int i = 1; i <= 4000; ++i) {
      const double force = -d.move(i * 1e-8);
      if (peaked && force > last * (1 + 1e-12)) ++rises_after_peak;
      peaked = peaked || force < last;
      last = force;
    }
    CHECK(peaked);
    CHECK(rises_after_peak == 0);
  }
}

TEST_CASE("a contact that sticks again heals, at once or with its time constant") {
  for (double healing_time : {0.0, 2.0}) {
    Drive d{law(0.5, 0.3, 1e-5)};
    d.law.healing_time = healing_time;
    d.move(1e-3);
    CHECK(d.state.slip > 9e-4);
    const double slip = d.state.slip;
    d.move(1e-3 - 1e-7);
    CHECK_THAT(d.state.slip, WithinAbs(healing_time > 0.0 ? slip * std::exp(-0.5) : 0.0, 1e-15));
  }
}

TEST_CASE("equal coefficients and unlimited strength are Coulomb friction with a spring") {
  Drive d{law(0.4, 0.4, 1e-5)};
  double spring = 0.0, position = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double u = 3e-5 * std::sin(0.05 * i);
    spring += u - position;
    position = u;
    spring = std::max(-0.4 * N / k, std::min(0.4 * N / k, spring));
    CHECK_THAT(d.move(u), WithinAbs(-k * spring, 1e-12));
  }
}

TEST_CASE("closed loops dissipate, and what they dissipate is the work done on the contact") {
  for (Presliding p : {Presliding::linear, Presliding::exponential})
    for (double amplitude : {5e-6, 1.2e-5, 1e-4}) {
      Drive d{law(0.5, 0.3, 1e-5, 1e9, p)};
      double work = 0.0, last_force = 0.0, last_energy = 0.0;
      const int steps = 200000;
      for (int i = 1; i <= steps; ++i) {
        const double before = d.position;
        const double force = -d.move(amplitude * std::sin(6.283185307179586 * 2 * i / steps));
        work += 0.5 * (force + last_force) * (d.position - before);
        last_force = force;
        CHECK(d.state.dissipated_energy >= last_energy);
        last_energy = d.state.dissipated_energy;
      }
      const double stored = 0.5 * last_force * last_force / k;
      CHECK_THAT(d.state.dissipated_energy, WithinAbs(work - stored, 2e-4 * std::abs(work) + 1e-16));
    }
}

TEST_CASE("exponential pre-sliding under monotone loading is T_max (1 - exp(-k u / T_max)) for any step") {
  for (int steps : {1, 7, 1000}) {
    Drive d{law(0.5, 0.5, 1e-5, unlimited_strength, Presliding::exponential)};
    for (int i = 1; i <= steps; ++i) d.move(2e-5 * i / steps);
    CHECK_THAT(k * d.state.displacement.x, WithinRel(0.5 * N * (1.0 - std::exp(-k * 2e-5 / (0.5 * N))), 1e-12));
  }
}

TEST_CASE("no normal force, no friction; and the next load starts from nothing") {
  for (Presliding p : {Presliding::linear, Presliding::exponential}) {
    Drive d{law(0.5, 0.3, 1e-5, 1e8, p)};
    d.move(1e-4);
    CHECK(d.move(1.1e-4, 0.0) == 0.0);
    CHECK(d.move(1.2e-4, -1.0) == 0.0);
    CHECK(norm(d.state.displacement) == 0.0);
  }
}

TEST_CASE("where the spring is softer than the drop of friction the force falls to the far branch at once") {
  Drive d{law(0.9, 0.1, 1e-7)};  // (mu_s - mu_k) N / s_c = 1.6e7 N/m > k
  d.move(0.9 * N / k);
  CHECK_THAT(-d.move(0.9 * N / k + 1e-9), WithinRel(0.1 * N, 1e-6));
}

TEST_CASE("the elastic displacement turns with the contact plane and keeps its length") {
  const Vec3<double> start{3e-6, 0, 4e-6};
  for (double angle : {1e-4, 1e-2}) {
    // The normal turns from y about z through 60 degrees; a displacement along z stays, one along x turns.
    Vec3<double> v = start;
    const int steps = static_cast<int>(1.0471975511965976 / angle);
    for (int i = 1; i <= steps; ++i) {
      const double a = i * angle;
      v = rotate_to_plane(v, Vec3<double>{-std::sin(a), std::cos(a), 0}, 0.0);
    }
    const double a = steps * angle;
    const Vec3<double> expected{3e-6 * std::cos(a), 3e-6 * std::sin(a), 4e-6};
    CHECK_THAT(norm(v), WithinRel(5e-6, 1e-11));
    CHECK_THAT(norm(v - expected), WithinAbs(0.0, 5e-6 * angle));
  }
}

TEST_CASE("spin about the normal turns the displacement with the grains") {
  Vec3<double> v{5e-6, 0, 0};
  const int steps = 1000;
  for (int i = 0; i < steps; ++i) v = rotate_to_plane(v, Vec3<double>{0, 0, 1}, 1.5707963267948966 / steps);
  CHECK_THAT(norm(v - Vec3<double>{0, 5e-6, 0}), WithinAbs(0.0, 5e-6 * 1e-6));
  CHECK_THAT(norm(v), WithinRel(5e-6, 1e-12));
}

TEST_CASE("impossible parameters are named") {
  CHECK(law(0.5, 0.3, 1e-5).error() == nullptr);
  CHECK(std::string(law(0.3, 0.5, 1e-5).error()).find("must not exceed") != std::string::npos);
  CHECK(law(-0.1, -0.2, 1e-5).error() != nullptr);
  CHECK(law(0.5, 0.3, -1e-5).error() != nullptr);
  CHECK(law(0.5, 0.3, 1e-5, 0.0).error() != nullptr);
  CHECK(law(NAN, 0.3, 1e-5).error() != nullptr);
}

TEST_CASE("asked again in a step of zero length, a sliding contact answers the same force, without viscous part") {
  for (double sc : {0.0, 1e-7, 1e-3}) {
    const FinnieRabinowicz l = law(0.5, 0.3, sc);
    FrictionState<double> state;
    const Vec3<double> velocity{0.1, 0, 0};
    Vec3<double> force{};
    for (int i = 0; i < 50; ++i) force = friction_step(l, N, k, 3.0, area, velocity, 1e-5, state);
    REQUIRE(state.slip > 0.0);
    FrictionState<double> copy = state;
    CHECK_THAT(friction_step(l, N, k, 3.0, area, velocity, 0.0, copy).x, WithinRel(force.x, 1e-8));
    CHECK(copy.slip == state.slip);
  }
}
