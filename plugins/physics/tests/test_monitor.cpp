#include <cmath>
#include <vector>

#include "catch.hpp"

#include "dembark/integration/monitor.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

MonitorSettings settings() {
  MonitorSettings s;
  s.scales = {1.0, 1.0, 1e-3};
  return s;
}

/// A body on a spring, omega = 1, by velocity Verlet with steps of h.
MonitorTally oscillator(double h, long steps, long every) {
  StepMonitor monitor;
  monitor.settings = settings();
  monitor.settings.every = every;
  AccelerationHistory history;
  double x = 1.0, v = 0.0;
  for (long n = 1; n <= steps; ++n) {
    const double a = -x;
    x += h * v + 0.5 * h * h * a;
    v += 0.5 * h * (a - x);
    if (monitor.settings.keeps(n)) monitor.take(history, {-x, 0, 0, 0, 0, -x}, 0.5, 7, n, h);
  }
  return monitor.all();
}

}  // namespace

TEST_CASE("monitor: samples need the three steps before them, and nothing else", "[monitor]") {
  MonitorSettings s = settings();
  s.every = 20;
  for (long n = 1; n <= 200; ++n) {
    CHECK(s.samples(n) == (n % 20 == 0));
    CHECK(s.keeps(n) == (n % 20 == 0 || n % 20 >= 17));
    CHECK(s.begins(n) == (n % 20 == 17));
  }
  for (const long every : {1L, 2L, 3L, 4L}) {
    s.every = every;
    for (long n = 1; n <= 12; ++n) {
      CHECK(s.keeps(n));
      CHECK_FALSE(s.begins(n));
    }
  }
}

TEST_CASE("monitor: errors of samples are those of every step", "[monitor]") {
  const double h = 0.1;
  const MonitorTally each = oscillator(h, 40000, 1), some = oscillator(h, 40000, 20);
  CHECK(each.errors.position.count == 39997.0);
  CHECK(some.errors.position.count == 2000.0);
  CHECK_THAT(some.errors.velocity.rms(), WithinRel(each.errors.velocity.rms(), 1e-3));
  CHECK_THAT(some.errors.velocity.largest, WithinRel(each.errors.velocity.largest, 1e-3));
  // e_x = h^3/6 |x'''|, e_v = h^3/12 |v'''| to leading order, of amplitude 1.
  CHECK_THAT(each.errors.position.largest, WithinRel(h * h * h / 6.0, 0.01));
  CHECK_THAT(each.errors.velocity.largest, WithinRel(h * h * h / 12.0, 0.01));
  CHECK_THAT(each.errors.spin.largest, WithinRel(0.5 * each.errors.velocity.largest, 1e-12));
  CHECK(each.errors.spin.body == 7);
}

TEST_CASE("monitor: the contact time of Hooke's law is that of the elastic impact", "[monitor]") {
  const double m = 2e-4, k = 3e3, h = 1e-7;
  double x = 0.0, v = -1.0;
  long steps = 0;
  do {  // until it leaves
    v -= h * k / m * x;
    x += h * v;
    ++steps;
  } while (x < 0.0);
  CHECK_THAT(contact_steps(m, k, h), WithinRel(double(steps), 1e-3));
  CHECK(std::isinf(contact_steps(m, 0.0, h)));
}

TEST_CASE("monitor: the shortest contact does not depend on the order", "[monitor]") {
  const std::vector<std::array<double, 3>> rows = {{12, 5, 4}, {7, 9, 2}, {7, 3, 8}, {30, 1, double(monitor_wall)}, {INFINITY, 0, 1}};
  ShortestContact forward, backward, parts[2];
  for (std::size_t k = 0; k < rows.size(); ++k) {
    forward.add(rows[k][0], long(rows[k][1]), long(rows[k][2]));
    const auto& other = rows[rows.size() - 1 - k];
    backward.add(other[0], long(other[1]), long(other[2]));
    parts[k % 2].add(rows[k][0], long(rows[k][1]), long(rows[k][2]));
  }
  parts[0].merge(parts[1]);
  for (const ShortestContact& found : {forward, backward, parts[0]}) {
    CHECK(found.steps == 7.0);
    CHECK(found.one == 2);
    CHECK(found.two == 9);
  }
  ShortestContact none;
  none.merge({});
  CHECK(none.one == -1);
}

TEST_CASE("monitor: findings in words", "[monitor]") {
  const MonitorSettings s = settings();
  MonitorTally t;
  CHECK(within_limits(t, s));
  LocalError e;
  e.velocity = {0.0, 2e-3, 0.0, 0.0, 0.0, 1.0};
  t.errors.add(e, 5e-3, 12, s.scales);
  t.contact.add(6.28, 3, monitor_wall);
  CHECK_FALSE(within_limits(t, s));
  CHECK_FALSE(finding(t, s, 0));
  CHECK(finding_text(t, s, 1, "atom") ==
        "the error of the velocity of atom 12 in one step is 0.002 times speed = 1, more than limit = 0.001; take a shorter time step");
  CHECK(finding_text(t, s, 2, "atom") ==
        "the error of the angular velocity of atom 12 in one step is 0.005 times speed = 1 over its radius, more than limit = 0.001; "
        "take a shorter time step");
  CHECK(finding_text(t, s, 3, "body") == "the contact of body 3 and a wall lasts 6.28 steps, less than 10; take a shorter time step");
}

TEST_CASE("monitor: the step is halved beyond the limits, and doubled well within", "[monitor]") {
  const MonitorSettings s = settings();
  const auto row = [&s](double error, double steps) {
    MonitorTally t;
    LocalError e;
    e.position = {error, 0, 0};
    t.errors.add(e, 1.0, 1, s.scales);
    t.contact.add(steps, 1, 2);
    return t;
  };
  CHECK(adapted_level(row(2e-3, 100), s, 0) == 1);
  CHECK(adapted_level(row(0.0, 9.9), s, 3) == 4);
  CHECK(adapted_level(row(2e-3, 100), s, deepest_level) == deepest_level);
  CHECK(adapted_level(row(5e-5, 100), s, 2) == 1);
  CHECK(adapted_level(row(5e-5, 100), s, 0) == 0);  // never longer than the nominal one
  CHECK(adapted_level(row(5e-5, 30), s, 2) == 2);   // twice the step would be too near to the limit
  CHECK(adapted_level(row(5e-4, 100), s, 2) == 2);
  CHECK(adapted_level({}, s, 2) == 2);  // no contact: nothing is known
}

TEST_CASE("monitor: settings that make no sense are named", "[monitor]") {
  MonitorSettings s = settings();
  CHECK(s.error() == nullptr);
  s.every = 0;
  CHECK(std::string(s.error()) == "every must be 1 step or more");
  s = settings();
  s.least_steps = 0.0;
  CHECK(std::string(s.error()) == "contact_steps must be a number > 0");
  s.scales.speed = -1.0;
  CHECK(std::string(s.error()) == "speed (m/s) must be a number > 0");
}
