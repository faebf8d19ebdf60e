#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "catch.hpp"

#include "dembark/sph/contact_potential.hpp"
#include "dembark/sph/kernels.hpp"
#include "dembark/sph/moment.hpp"
#include "dembark/sph/pair_terms.hpp"
#include "dembark/sph/shepard.hpp"
#include "dembark/sph/shifting.hpp"
#include "dembark/sph/state.hpp"
#include "dembark/sph/wall.hpp"
#include "dembark/sph/xsph.hpp"

using namespace dembark;
using namespace dembark::sph;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

/// Calls check(kernel, dimension, h) for both kernels in the plane and in space.
template <class Check>
void each_kernel(const Check& check) {
  for (const int dimension : {2, 3})
    for (const double h : {0.013, 1.7}) {
      check(WendlandC2(dimension, h), dimension, h);
      check(CubicSpline(dimension, h), dimension, h);
    }
}

/// Of f over 0 ... to, by Simpson's rule.
template <class Function>
double integral(double to, const Function& f) {
  constexpr int n = 4000;
  double sum = f(0.0) + f(to);
  for (int k = 1; k < n; ++k) sum += (k % 2 == 1 ? 4.0 : 2.0) * f(to * k / n);
  return sum * to / (3.0 * n);
}

}  // namespace

TEST_CASE("SPH kernels: they integrate to one, and their slope is their derivative over the distance", "[sph]") {
  each_kernel([](const auto& kernel, int dimension, double h) {
    const auto shell = [&](double r) { return dimension == 2 ? 2.0 * pi * r : 4.0 * pi * r * r; };
    CHECK_THAT(integral(2.0 * h, [&](double r) { return shell(r) * kernel.value(r); }), WithinRel(1.0, 1e-9));
    // -1/dimension integral r W' = 1: the moment of a lattice that is infinitely fine.
    CHECK_THAT(-integral(2.0 * h, [&](double r) { return shell(r) * r * r * kernel.slope(r); }) / dimension, WithinRel(1.0, 1e-9));
    for (const double q : {0.1, 0.5, 0.9, 1.1, 1.5, 1.9}) {
      const double r = q * h, step = 1e-5 * h, derivative = (kernel.value(r + step) - kernel.value(r - step)) / (2.0 * step);
      CHECK_THAT(kernel.slope(r) * r, WithinRel(derivative, 1e-6));
      CHECK(kernel.slope(r) < 0.0);
    }
    CHECK(kernel.value(2.0001 * h) == 0.0);
    CHECK(kernel.slope(3.0 * h) == 0.0);
    CHECK(std::isfinite(kernel.slope(0.0)));
  });
}

TEST_CASE("SPH kernels: packs get the bits of doubles", "[sph]") {
  typedef Pack<4> Four;
  each_kernel([](const auto& kernel, int, double h) {
    const double r[] = {0.0, 0.7 * h, 1.6 * h, 2.5 * h};
    const Four value = kernel.value(Four::load(r)), slope = kernel.slope(Four::load(r));
    for (int k = 0; k < 4; ++k) {
      CHECK(value[k] == kernel.value(r[k]));
      CHECK(slope[k] == kernel.slope(r[k]));
    }
  });
}

TEST_CASE("SPH kernels: the moment of a lattice goes to one with h over the spacing", "[sph]") {
  for (const int dimension : {2, 3}) {
    const auto error = [&](double ratio) { return std::abs(lattice_moment(WendlandC2(dimension, ratio), dimension, ratio, 1.0) - 1.0); };
    CHECK(error(1.3) > 0.02);
    CHECK(error(4.0) < 2e-4);
    // Free of units.
    CHECK_THAT(lattice_moment(WendlandC2(dimension, 0.013), dimension, 0.013, 0.01),
               WithinRel(lattice_moment(WendlandC2(dimension, 1.3), dimension, 1.3, 1.0), 1e-12));
  }
}

TEST_CASE("SPH state: Tait's law, its inverse, its limits and its energy", "[sph]") {
  for (const double gamma : {1.0, 3.5, 7.0}) {
    const Tait state{1000.0, 40.0, gamma, true};
    CHECK(state.pressure(1000.0) == 0.0);
    for (const double rho : {980.0, 1003.0, 1050.0}) {
      CHECK_THAT(initial_density(state, state.pressure(rho)), WithinRel(rho, 1e-12));
      const double dp = (state.pressure(rho + 1e-3) - state.pressure(rho - 1e-3)) / 2e-3;
      CHECK_THAT(dp, WithinRel(1600.0 * std::pow(rho / 1000.0, gamma - 1.0), 1e-6));  // the square of the speed of sound
      // de = p/rho^2 drho
      const double de = (state.energy(rho + 1e-2) - state.energy(rho - 1e-2)) / 2e-2;
      CHECK_THAT(de, WithinRel(state.pressure(rho) / (rho * rho), 1e-4));
      CHECK(state.energy(rho) > 0.0);
    }
    CHECK_THAT(state.pressure(1000.01), WithinRel(16.0, 1e-4));  // small compression: c^2 (rho - rho_0)
  }
  const Tait free{1000.0, 40.0};
  CHECK(free.pressure(990.0) == 0.0);
  CHECK(free.energy(990.0) == 0.0);
  CHECK(free.pressure(1010.0) == Tait{1000.0, 40.0, 7.0, true}.pressure(1010.0));
}

TEST_CASE("SPH pair terms: antisymmetric, dissipative, none in a rigid rotation", "[sph]") {
  const PairCoefficients c = PairCoefficients::of(0.1, 1.0, 0.013, 40.0, 1000.0, 0.1, 0.1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const WendlandC2 kernel(3, 0.013);
  for (int i = 0; i < 100; ++i) {
    const Vector d{0.01 * u(random), 0.01 * u(random), 0.01 * u(random)}, v{u(random), u(random), u(random)};
    const double push = c.mass * kernel.slope(norm(d)), rho_i = 1000.0 + 10.0 * u(random), rho_j = 1000.0 + 10.0 * u(random);
    const double forth = artificial_viscosity(c, dot(d, d), dot(v, d), rho_i, rho_j);
    CHECK(forth == artificial_viscosity(c, dot(d, d), dot(-v, -d), rho_j, rho_i));
    CHECK(forth >= 0.0);
    CHECK((forth > 0.0) == (dot(v, d) < 0.0));
    // Power on both, factor d.v, is a loss.
    CHECK(acceleration_factor(push, forth) * dot(d, v) <= 0.0);
    CHECK(diffusion_rate(c, push, rho_i, rho_j) == -diffusion_rate(c, push, rho_j, rho_i));
    CHECK((diffusion_rate(c, push, rho_i, rho_j) <= 0.0) == (rho_i >= rho_j));
    // Pressure drives apart, and density grows as particles approach.
    CHECK(acceleration_factor(push, 1.0) > 0.0);
    CHECK((compression_rate(push, dot(v, d)) > 0.0) == (dot(v, d) < 0.0));
    const Vector spin{u(random), u(random), u(random)};
    CHECK_THAT(artificial_viscosity(c, dot(d, d), dot(cross(spin, d), d), rho_i, rho_j), WithinAbs(0.0, 1e-12));
  }
  CHECK(artificial_viscosity(PairCoefficients::of(0.1, 1.0, 0.013, 40.0, 1000.0, 0.0, 0.1), 1e-4, -1.0, 1e3, 1e3) == 0.0);
}

TEST_CASE("SPH guard: a straight line that ends at its reach", "[sph]") {
  PairCoefficients c;
  CHECK(guard_stress(c, 0.5) == 0.0);  // off
  c.guard = 0.8;
  c.reach = 0.018;
  CHECK_THAT(guard_stress(c, 0.0), WithinRel(0.8, 1e-15));
  CHECK_THAT(guard_stress(c, 0.009), WithinRel(0.4, 1e-12));
  CHECK_THAT(guard_stress(c, 0.999 * c.reach), WithinRel(0.8e-3, 1e-9));
  for (const double r : {0.018, 0.02, 1.0}) CHECK(guard_stress(c, r) == 0.0);
}

TEST_CASE("SPH walls: still water has its own pressure beyond a wall, and an accelerated wall its added one", "[sph]") {
  const Vector gravity{0.0, 0.0, -9.81}, acceleration{3.0, 0.0, 1.0};
  const WendlandC2 kernel(3, 1.3);
  // Under water of depth z = 0 with p = -rho (g - a) . x, exact for any sums.
  for (const Vector& a : {Vector{}, acceleration}) {
    const Vector less = gravity - a, wall{0.2, -0.1, -10.6};
    WallSums sums;
    for (int i = -3; i <= 3; ++i)
      for (int j = -3; j <= 3; ++j)
        for (int k = 0; k < 4; ++k) {
          const Vector x{double(i), double(j), -10.0 + k};
          const double w = kernel.value(norm(wall - x));
          sums.weight += w;
          sums.pressure += w * 1000.0 * dot(less, x);
          sums.arm += (1000.0 * w) * (wall - x);
          sums.velocity += w * Vector{0.5, 0.0, 0.0};
        }
    CHECK_THAT(wall_pressure(sums, less, true), WithinRel(1000.0 * dot(less, wall), 1e-12));
    CHECK_THAT(wall_velocity(sums, {1.0, 0.0, 0.0}).x, WithinRel(1.5, 1e-12));
    CHECK(wall_pressure(sums, -100.0 * gravity, false) >= 0.0);
  }
  CHECK(wall_pressure({}, gravity, true) == 0.0);
  CHECK(wall_velocity({}, {1.0, 2.0, 3.0}).y == 2.0);
}

TEST_CASE("SPH shifting: from dense to sparse, by a tenth of the spacing at most, not at a surface", "[sph]") {
  const Shifting law{2.0};
  const Vector moved = shift(law, 2, 0.013, 0.01, 1e-4, {3.0, 4.0, 0.0}, {1.0, -2.0, 0.0}, 2.0);
  CHECK_THAT(moved.x, WithinRel(-2.0 * 0.013 * 5.0 * 1e-4, 1e-12));
  CHECK_THAT(moved.y, WithinRel(-2.0 * moved.x, 1e-12));
  CHECK_THAT(norm(shift(law, 2, 0.013, 0.01, 1e-4, {5.0, 0.0, 0.0}, {1e6, 0.0, 0.0}, 2.0)), WithinRel(1e-3, 1e-12));
  CHECK(norm(shift(law, 2, 0.013, 0.01, 1e-4, {5.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 1.49)) == 0.0);
  CHECK(norm(shift(law, 3, 0.013, 0.01, 1e-4, {5.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 2.74)) == 0.0);
}

TEST_CASE("SPH contact potential: its force is the gradient of its energy", "[sph]") {
  const CubicSpline kernel(3, 0.013);
  for (const int n : {1, 4}) {
    const ContactPotential law{1e15, n};
    for (const double r : {0.004, 0.012, 0.02}) {
      const double w0 = kernel.value(0.01), volumes = 1e-12, step = 1e-8;
      const double fall =
          -(contact_energy(law, kernel, r + step, volumes, w0) - contact_energy(law, kernel, r - step, volumes, w0)) / (2 * step);
      CHECK_THAT(contact_factor(law, kernel, r, volumes, w0) * r, WithinRel(fall, 1e-5));
    }
  }
}

TEST_CASE("SPH XSPH: two particles exchange as much momentum of drift", "[sph]") {
  const CubicSpline kernel(3, 0.013);
  for (const double r : {0.004, 0.012, 0.02}) {
    const double w = kernel.value(r), forth = xsph_weight(w, 1010.0, 990.0);
    CHECK(forth == xsph_weight(w, 990.0, 1010.0));
    CHECK_THAT(forth, WithinRel(w / 1000.0, 1e-12));
  }
  CHECK(std::string(Xsph{1.1}.error()) == "xsph must be between 0 and 1");
  CHECK(Xsph{NAN}.error() != nullptr);
}

TEST_CASE("SPH moment: a larger one is taken back, a surface is left alone", "[sph]") {
  CHECK_THAT(moment_correction(2, 0.974, 2.0 * 0.974), WithinRel(1.0, 1e-15));
  CHECK_THAT(moment_correction(3, 0.979, 3.0 * 0.979 * 1.01), WithinRel(1.0 / 1.01, 1e-12));
  CHECK(moment_correction(2, 0.974, 1.0) == 1.0);
  CHECK(moment_correction(3, 0.979, 0.0) == 1.0);
}

TEST_CASE("SPH Shepard: its weights sum to one, a uniform density stays, and none leaves the range around it", "[sph]") {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  each_kernel([&](const auto& kernel, int dimension, double h) {
    for (const double uniform : {0.0, 1003.0}) {
      std::vector<double> w{kernel.value(0.0)}, rho{1000.0};
      for (int k = 0; k < 30; ++k) {
        const Vector d{2.0 * h * u(random), 2.0 * h * u(random), dimension == 3 ? 2.0 * h * u(random) : 0.0};
        w.push_back(kernel.value(norm(d)));
        rho.push_back(1000.0 + 20.0 * u(random));
      }
      if (uniform > 0.0) rho.assign(rho.size(), uniform);
      double weight = 0.0, volume = 0.0, least = 1e9, most = 0.0, unity = 0.0;
      for (std::size_t k = 0; k < w.size(); ++k) {
        const ShepardTerms<double> terms = shepard_terms(w[k], rho[k]);
        weight += terms.weight, volume += terms.volume;
        if (w[k] > 0.0) least = std::min(least, rho[k]), most = std::max(most, rho[k]);
      }
      for (std::size_t k = 0; k < w.size(); ++k) unity += shepard_terms(w[k], rho[k]).volume / volume;
      CHECK_THAT(unity, WithinRel(1.0, 1e-12));
      const double found = shepard_density(weight, volume);
      if (uniform > 0.0) CHECK_THAT(found, WithinRel(uniform, 1e-14));
      else CHECK((found > least && found < most));
    }
  });
  CHECK(shepard_is_due(30, 60));
  CHECK(!shepard_is_due(30, 61));
  CHECK(!shepard_is_due(0, 60));
}
