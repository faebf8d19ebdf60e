#include <array>
#include <cmath>
#include <complex>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "catch.hpp"

#include "dembark/constants.hpp"
#include "dembark/integration/adams.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

/// x'' = -omega^2 x.
struct Oscillator {
  double omega = 1.0;
  void operator()(double, const double* y, double* f) const {
    f[0] = y[1];
    f[1] = -omega * omega * y[0];
  }
};

/// A unit mass that meets a wall at x = 0 with unit speed; force delta^power. Touches where x changes its sign.
struct Impact {
  double power = 1.5;
  void operator()(double, const double* y, double* f) const {
    f[0] = y[1];
    f[1] = y[0] < 0.0 ? std::pow(-y[0], power) : 0.0;
  }
};

struct Touch {
  static constexpr std::size_t count = 1;
  void operator()(double, const double* y, double* g) const { g[0] = y[0]; }
};

/// Of an elastic impact at unit speed and mass under delta^power with unit stiffness.
double duration_of(double power) {
  const double deepest = std::pow(0.5 * (power + 1.0), 1.0 / (power + 1.0));
  // T_c = 2 d_max / v integral_0^1 dx / sqrt(1 - x^(power + 1))
  return 2.0 * deepest * std::sqrt(pi) * std::tgamma(1.0 + 1.0 / (power + 1.0)) / std::tgamma(0.5 + 1.0 / (power + 1.0));
}

constexpr double no_limit = 1e300;

/// rms over random phases of the error of the speed after an impact of about `steps` steps.
double speed_error(double power, double steps, bool located) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  double sum = 0.0;
  constexpr int phases = 200;
  for (int i = 0; i < phases; ++i) {
    const double h = duration_of(power) / (steps * (1.0 + 0.1 * uniform(random)));
    const std::vector<double> start{(4.0 + uniform(random)) * h, -1.0}, scale{1.0, 1.0};
    const auto run = [&](auto&& adams) {
      while (!(adams.state()[0] > 0.0 && adams.state()[1] > 0.0)) adams.advance(no_limit);
      return adams.state()[1];
    };
    const AdamsSettings settings{h, 2, 1e-12};
    const double speed = located ? run(Adams<Impact, Touch>(Impact{power}, settings, 0.0, start, scale))
                                 : run(Adams<Impact>(Impact{power}, settings, 0.0, start, scale));
    sum += (speed - 1.0) * (speed - 1.0);
  }
  return std::sqrt(sum / phases);
}

double exponent(double power, double coarse, double fine, bool located) {
  return std::log(speed_error(power, coarse, located) / speed_error(power, fine, located)) / std::log(fine / coarse);
}

/// Largest growth in a step of P(EC)^m E for x'' = -omega^2 x: the largest root of its linear recursion in (y_n, f_n ... f_(n-3)),
/// which for y' = i omega y reads (z = i omega h)
///   p = y + z/24 (55 y_n - 59 ...),  c_k = y + z/24 (9 c_(k-1) + 19 y_n - 5 ... + ...).
double growth(double z_abs, int corrections) {
  using Complex = std::complex<double>;
  const Complex z(0.0, z_abs);
  // y_(n+1) as weights of y_n ... y_(n-3).
  std::array<Complex, 4> p{1.0 + z * 55.0 / 24.0, -z * 59.0 / 24.0, z * 37.0 / 24.0, -z * 9.0 / 24.0}, c = p;
  for (int k = 0; k < corrections; ++k) {
    std::array<Complex, 4> next{1.0 + z * 19.0 / 24.0, -z * 5.0 / 24.0, z * 1.0 / 24.0, 0.0};
    for (int i = 0; i < 4; ++i) next[i] += z * 9.0 / 24.0 * c[i];
    c = next;
  }
  Eigen::Matrix4cd companion = Eigen::Matrix4cd::Zero();
  for (int i = 0; i < 4; ++i) companion(0, i) = c[i];
  for (int i = 1; i < 4; ++i) companion(i, i - 1) = 1.0;
  // Its spectral radius by Gelfand's formula, |C^n|^(1/n): Eigen's eigenvalues take a minute to compile with the sanitizers.
  double logarithm = 0.0;
  for (int k = 0; k < 40; ++k) {
    const double norm = companion.norm();
    logarithm += std::ldexp(std::log(norm), -k);
    companion = ((1.0 / norm) * companion).eval();
    companion = (companion * companion).eval();
  }
  return std::exp(logarithm);
}

}  // namespace

TEST_CASE("Adams: a smooth oscillator is integrated to fourth order", "[adams]") {
  const auto error = [](double steps) {
    const double period = 2.0 * pi;
    Adams<Oscillator> adams({}, {period / steps, 2, 1e-3}, 0.0, {1.0, 0.0}, {1.0, 1.0});
    while (adams.time() < 5.0 * period) adams.advance(5.0 * period);
    return std::hypot(adams.state()[0] - 1.0, adams.state()[1]);
  };
  for (const double steps : {80.0, 160.0, 320.0}) CHECK_THAT(std::log2(error(steps) / error(2.0 * steps)), WithinAbs(4.0, 0.1));
}

TEST_CASE("Adams: the estimate of the local error is the local error", "[adams]") {
  Adams<Oscillator> adams({}, {2.0 * pi / 160.0, 2, 1e-3}, 0.0, {1.0, 0.0}, {1.0, 1.0});
  for (int i = 0; i < 10; ++i) adams.advance(no_limit);
  double estimates = 0.0, errors = 0.0;
  for (int i = 0; i < 160; ++i) {
    const std::vector<double> before = adams.state();
    const double start = adams.time();
    adams.advance(no_limit);
    const double h = adams.time() - start;
    const double x = before[0] * std::cos(h) + before[1] * std::sin(h), v = before[1] * std::cos(h) - before[0] * std::sin(h);
    errors += std::hypot(x - adams.state()[0], v - adams.state()[1]);
    estimates += std::hypot(adams.error_estimate()[0], adams.error_estimate()[1]);
  }
  CHECK_THAT(estimates / errors, WithinAbs(1.0, 0.02));
}

TEST_CASE("Adams: the signal comes when the corrections do not settle, and not before", "[adams]") {
  const auto signals = [](double omega_h, double tolerance) {
    Adams<Oscillator> adams({1.0}, {omega_h, 2, tolerance}, 0.0, {1.0, 0.0}, {1.0, 1.0});
    int count = 0;
    for (int i = 0; i < 100; ++i) count += adams.advance(no_limit).signal;
    return count;
  };
  CHECK(signals(0.05, 1e-6) == 0);
  CHECK(signals(0.5, 1e-6) == 97);  // all but the three Runge-Kutta steps
  Adams<Oscillator> adams({}, {0.01, 2, 1e-6}, 0.0, {1.0, 0.0}, {1.0, 1.0});
  for (int i = 0; i < 3; ++i) CHECK(adams.advance(no_limit).corrections == 0);
  CHECK(adams.advance(no_limit).corrections == 1);  // the first agrees with the predictor
}

TEST_CASE("Adams: undamped oscillations grow as the largest root of its characteristic polynomial", "[adams]") {
  for (const int corrections : {1, 2}) {
    const double z = 0.314;
    // With such a tolerance all corrections are made.
    Adams<Oscillator> adams({1.0}, {z, corrections, 1e-300}, 0.0, {1.0, 0.0}, {1.0, 1.0});
    const auto energy = [&] { return std::hypot(adams.state()[0], adams.state()[1]); };
    for (int i = 0; i < 200; ++i) adams.advance(no_limit);
    const double before = energy();
    const int steps = 2000;
    for (int i = 0; i < steps; ++i) adams.advance(no_limit);
    CHECK_THAT(std::log(energy() / before) / steps, WithinRel(std::log(growth(z, corrections)), 0.1));
    CHECK(energy() > before);
  }
}

TEST_CASE("Adams: duration of an elastic impact", "[adams]") {
  for (const double power : {1.0, 1.5}) {
    Adams<Impact, Touch> adams({power}, {duration_of(power) / 400.0, 2, 1e-12}, 0.0, {0.1, -1.0}, {1.0, 1.0});
    std::vector<double> touches;
    while (touches.size() < 2)
      if (adams.advance(no_limit).event == 0) touches.push_back(adams.time());
    CHECK_THAT(touches[0], WithinAbs(0.1, 1e-14));
    CHECK_THAT(touches[1] - touches[0], WithinRel(duration_of(power), 1e-6));
    CHECK_THAT(adams.state()[1], WithinAbs(1.0, 1e-6));
  }
  CHECK_THAT(duration_of(1.5) / std::pow(1.25, 0.4), WithinRel(2.943275, 1e-6));  // Hertz: T_c = 2.9433 delta_max / v
}

TEST_CASE("Adams: a touch costs the order, unless it is located", "[adams]") {
  CHECK_THAT(exponent(1.0, 20.0, 160.0, false), WithinAbs(2.0, 0.1));
  CHECK_THAT(exponent(1.5, 20.0, 160.0, false), WithinAbs(2.5, 0.1));
  CHECK_THAT(speed_error(1.5, 160.0, false), WithinRel(3.1e-6, 0.5));
  CHECK_THAT(exponent(1.0, 20.0, 160.0, true), WithinAbs(5.0, 0.1));
  // Hertz's force has a second derivative without bound at the touch, wherever the step begins.
  CHECK_THAT(exponent(1.5, 40.0, 320.0, true), WithinAbs(2.5, 0.1));
  CHECK(speed_error(1.5, 160.0, true) < 0.2 * speed_error(1.5, 160.0, false));
}

TEST_CASE("Adams: an event is found to the last bits, and the integrator starts anew there", "[adams]") {
  Adams<Oscillator, Touch> adams({2.0}, {0.05, 2, 1e-9}, 0.0, {1.0, 0.0}, {1.0, 1.0});
  int found = 0;
  while (found < 3)
    if (adams.advance(no_limit).event == 0) {
      ++found;
      CHECK_THAT(adams.time(), WithinAbs((found - 0.5) * pi / 2.0, 2e-5));
      CHECK_THAT(adams.state()[0], WithinAbs(0.0, 1e-14));
      CHECK(adams.advance(no_limit).corrections == 0);
    }
}

TEST_CASE("Adams: a run ends at its limit", "[adams]") {
  Adams<Oscillator> adams({}, {0.03, 2, 1e-9}, 0.0, {1.0, 0.0}, {1.0, 1.0});
  while (adams.time() < 1.0) adams.advance(1.0);
  CHECK(adams.time() == 1.0);
  CHECK_THAT(adams.state()[0], WithinAbs(std::cos(1.0), 1e-7));
  CHECK(adams.advance(1.0).corrections == 0);
  CHECK(adams.time() == 1.0);
}

TEST_CASE("Adams: settings that make no sense are refused", "[adams]") {
  const std::vector<double> one{1.0, 1.0};
  CHECK_THROWS_WITH(Adams<Oscillator>({}, {0.0}, 0.0, one, one), "step (s) must be a number > 0");
  CHECK_THROWS_WITH(Adams<Oscillator>({}, {0.1, 0}, 0.0, one, one), "corrections must be 1 or more");
  CHECK_THROWS_WITH(Adams<Oscillator>({}, {0.1, 2, 0.0}, 0.0, one, one), "tolerance must be > 0");
  CHECK_THROWS_WITH(Adams<Oscillator>({}, {0.1}, 0.0, one, {1.0}), "scale must have one number for each component of the state");
  CHECK_THROWS_WITH(Adams<Oscillator>({}, {0.1}, 0.0, one, {1.0, 0.0}), "each scale must be > 0");
}
