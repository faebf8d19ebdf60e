#include <algorithm>
#include <cmath>
#include <vector>

#include "catch.hpp"

#include "dembark/integration/step_error.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

struct Ratio {
  double position, velocity;
};

/// rms of the estimates over rms of the true local errors of velocity Verlet, x'' = -x, steps of h.
Ratio estimate_over_true(double h) {
  AccelerationHistory history;
  double x = 1.0, v = 0.0, estimate_x = 0.0, estimate_v = 0.0, true_x = 0.0, true_v = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double exact_x = x * std::cos(h) + v * std::sin(h), exact_v = v * std::cos(h) - x * std::sin(h);
    const double a = -x;
    x += h * v + 0.5 * h * h * a;
    v += 0.5 * h * (a - x);
    LocalError e;
    if (!history.step({-x, 0, 0, 0, 0, 0}, h, e)) continue;
    estimate_x += e.position[0] * e.position[0];
    estimate_v += e.velocity[0] * e.velocity[0];
    true_x += (exact_x - x) * (exact_x - x);
    true_v += (exact_v - v) * (exact_v - v);
  }
  return {std::sqrt(estimate_x / true_x), std::sqrt(estimate_v / true_v)};
}

}  // namespace

TEST_CASE("step errors: rms of the estimates is that of the true local errors of velocity Verlet", "[step_error]") {
  for (const double h : {0.02, 0.05, 0.1, 0.2}) {
    const Ratio ratio = estimate_over_true(h);
    CAPTURE(h);
    CHECK_THAT(ratio.position, WithinAbs(1.0, 0.02));
    CHECK_THAT(ratio.velocity, WithinAbs(1.0, 0.02));
  }
}

TEST_CASE("step errors: sign, and exactness for accelerations that are cubic in time", "[step_error]") {
  // a = t^3: v = t^4/4, and Adams and Moulton's rule is exact.
  const double h = 0.1;
  AccelerationHistory history;
  LocalError e;
  const auto a = [h](int n) { return std::pow(n * h, 3); };
  for (int n = 0; n < 3; ++n) CHECK_FALSE(history.step({0, a(n), 0, 0, 0, 2.0 * a(n)}, h, e));
  REQUIRE(history.step({0, a(3), 0, 0, 0, 2.0 * a(3)}, h, e));
  const double exact = (std::pow(3 * h, 4) - std::pow(2 * h, 4)) / 4.0, trapezoid = 0.5 * h * (a(2) + a(3));
  CHECK_THAT(e.velocity[1], WithinRel(exact - trapezoid, 1e-12));
  CHECK_THAT(e.velocity[5], WithinRel(2.0 * (exact - trapezoid), 1e-12));
  CHECK(e.velocity[0] == 0.0);
  history.forget();
  CHECK_FALSE(history.step({}, h, e));
}

TEST_CASE("step errors: nothing under a constant force", "[step_error]") {
  AccelerationHistory history;
  LocalError e;
  for (int n = 0; n < 5; ++n) history.step({0, 0, -9.81, 0, 0, 3.0}, 1e-4, e);
  CHECK_THAT(e.velocity[2], WithinAbs(0.0, 1e-18));
  CHECK(e.position[2] == 0.0);
}

TEST_CASE("step errors: tallies of parts merge to that of the whole", "[step_error]") {
  const ErrorScales scales{2.0, 4.0, 0.5};
  StepErrors whole, parts[2];
  for (long id = 0; id < 10; ++id) {
    LocalError e;
    e.position = {0.3 * double(id), 0.4 * double(id), 0.0};
    e.velocity = {0, 0, double(10 - id), double(id), 0, 0};
    whole.add(e, 0.5, id, scales);
    parts[id % 2].add(e, 0.5, id, scales);
  }
  parts[1].merge(parts[0]);
  for (const StepErrors& told : {whole, parts[1]}) {
    CHECK_THAT(told.position.largest, WithinRel(0.5 * 9.0 / 2.0, 1e-15));
    CHECK(told.position.body == 9);
    CHECK(told.position.exceeded == 7.0);  // 0.25 id > 0.5
    CHECK(told.velocity.body == 0);
    CHECK_THAT(told.velocity.largest, WithinRel(10.0 / 4.0, 1e-15));
    CHECK_THAT(told.spin.largest, WithinRel(9.0 * 0.5 / 4.0, 1e-15));
    CHECK_THAT(told.position.rms(), WithinRel(0.25 * std::sqrt(28.5), 1e-14));
    CHECK(told.spin.count == 10.0);
  }
  ErrorTally none;
  none.merge({});
  CHECK(none.body == -1);
  CHECK(none.rms() == 0.0);
}

TEST_CASE("step errors: scales that make no sense are named", "[step_error]") {
  CHECK(std::string(ErrorScales{0.0, 1.0}.error()) == "length (m) must be a number > 0");
  CHECK(std::string(ErrorScales{1.0, -1.0}.error()) == "speed (m/s) must be a number > 0");
  CHECK(std::string(ErrorScales{1.0, 1.0, 0.0}.error()) == "limit must be > 0");
  CHECK(ErrorScales{1.0, 1.0}.error() == nullptr);
}
