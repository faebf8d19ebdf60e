#include <cmath>
#include "catch.hpp"

#include "dembark/rolling_resistance.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

constexpr double R = 2e-3, N = 3.0, k_t = 1e5, dt = 1e-6;
const Vec3<double> up{0, 0, 1};

RollingResistance law(RollingModel model, double friction, bool torsion = false) { return {model, friction, torsion}; }

}  // namespace

TEST_CASE("a constant torque opposes the rotation and does not ask how fast it is") {
  const auto constant = law(RollingModel::constant_torque, 0.1);
  Vec3<double> kept{};
  for (double rate : {1e-9, 1.0, 1e6}) {
    const auto torque = rolling_step(constant, up, R, N, 2.0 * N, k_t, {0.6 * rate, -0.8 * rate, 0.0}, dt, kept);
    CHECK_THAT(torque.x, WithinRel(-0.6 * 0.1 * R * N, 1e-12));
    CHECK_THAT(torque.y, WithinRel(0.8 * 0.1 * R * N, 1e-12));
  }
  const auto still = rolling_step(constant, up, R, N, N, k_t, {}, dt, kept);
  CHECK(norm(still) == 0.0);
  CHECK(norm(kept) == 0.0);
}

TEST_CASE("the spring resists in proportion to the angle, up to its limit, and gives back what it holds") {
  const auto spring = law(RollingModel::elastic_plastic, 0.1);
  Vec3<double> kept{};
  const double most = 0.1 * R * N, angle = 0.5 * most / (k_t * R * R);
  const Vec3<double> spin{0.0, angle / dt, 0.0};
  CHECK_THAT(rolling_step(spring, up, R, 0.0, N, k_t, spin, dt, kept).y, WithinRel(-0.5 * most, 1e-12));
  CHECK_THAT(rolling_energy(kept, R, k_t), WithinRel(0.25 * most * angle, 1e-12));
  CHECK_THAT(rolling_step(spring, up, R, 0.0, N, k_t, -spin, dt, kept).y, WithinAbs(0.0, 1e-12 * most));
  for (int i = 0; i < 5; ++i) rolling_step(spring, up, R, 0.0, N, k_t, spin, dt, kept);
  CHECK_THAT(kept.y, WithinRel(-most, 1e-12));
  // The way back starts at the limit: elastic.
  CHECK_THAT(rolling_step(spring, up, R, 0.0, N, k_t, -spin, dt, kept).y, WithinRel(-0.5 * most, 1e-12));
  // Half the load: the spring lets go.
  CHECK_THAT(norm(rolling_step(spring, up, R, 0.0, 0.25 * N, k_t, {}, dt, kept)), WithinRel(0.25 * most, 1e-12));
}

TEST_CASE("without torsion nothing acts about the normal") {
  for (RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic}) {
    Vec3<double> kept{};
    const Vec3<double> spin{3.0, 0.0, 4.0};
    CHECK(rolling_step(law(model, 0.1), up, R, N, N, k_t, spin, dt, kept).z == 0.0);
    kept = {};
    CHECK(rolling_step(law(model, 0.1, true), up, R, N, N, k_t, spin, dt, kept).z < 0.0);
  }
  // LIGGGHTS divides by the whole rotation, also by the part that is then left out.
  Vec3<double> kept{};
  CHECK_THAT(rolling_step(law(RollingModel::constant_torque, 0.1), up, R, N, N, k_t, {3.0, 0.0, 4.0}, dt, kept).x,
             WithinRel(-0.6 * 0.1 * R * N, 1e-12));
}

TEST_CASE("a sphere that rolls on a plane slows down by 5/7 mu_r g and stops") {
  const double g = 9.81, m = 1e-3, friction = 0.05, inertia = 0.4 * m * R * R, step = 1e-5;
  for (RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic}) {
    // Rolling without sliding: 7/5 m dv/dt = -M / R.
    double v = 0.1;
    Vec3<double> kept{};
    const int steps = 10000;
    for (int i = 0; i < steps; ++i) {
      const auto torque = rolling_step(law(model, friction), up, R, m * g, m * g, k_t, {0.0, v / R, 0.0}, step, kept);
      v += torque.y / R / (m + inertia / (R * R)) * step;
    }
    CHECK_THAT(v, WithinRel(0.1 - 5.0 / 7.0 * friction * g * steps * step, 1e-3));
  }
}

TEST_CASE("nothing without a model or without friction, and one line for what cannot be") {
  Vec3<double> kept{};
  CHECK(norm(rolling_step(law(RollingModel::none, 0.1), up, R, N, N, k_t, {1, 2, 3}, dt, kept)) == 0.0);
  for (RollingModel model : {RollingModel::constant_torque, RollingModel::elastic_plastic})
    CHECK(norm(rolling_step(law(model, 0.0), up, R, N, N, k_t, {1, 2, 3}, dt, kept)) == 0.0);
  CHECK(law(RollingModel::none, 0.1).error() == nullptr);
  CHECK(law(RollingModel::none, -0.1).error() != nullptr);
  CHECK(law(RollingModel::none, NAN).error() != nullptr);
}
