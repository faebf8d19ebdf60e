// Capillary models as an engine calls them: names, limits, published closed forms, continuity, bad numbers.
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/constants.hpp"

using dembark::pi;
using namespace dembark::capillary;
using Catch::Contains;
using Catch::Matchers::WithinRel;

namespace {

constexpr double degree = pi / 180.0;
const std::initializer_list<Model> models{Model::exact,      Model::willett, Model::willett_full,
                                          Model::rabinovich, Model::bagheri, Model::constant};

/// Largest change of the force between neighbours of `steps` gaps, close together at touching and, as the square of the distance to it,
/// at rupture, where the slope of the exact force is infinite.
double largest_step(const BridgeForce& force, double v, int steps) {
  const double reach = force.rupture_distance(1.0, 1.0, v);
  double before = force.force(1.0, 1.0, 0.0, v, 1.0), largest = 0.0;
  for (int i = 1; i < steps; ++i) {
    const double u = 1.0 - static_cast<double>(i) / steps;
    const double f = force.force(1.0, 1.0, reach * (1.0 - u * u), v, 1.0);
    largest = std::max(largest, std::fabs(f - before));
    before = f;
  }
  return largest;
}

}  // namespace

TEST_CASE("every model has one name", "[capillary]") {
  const auto names = model_names();
  REQUIRE(names.size() == models.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    Model model = Model::constant;
    CHECK(model_from_name(names[i].c_str(), model));
    CHECK(static_cast<std::size_t>(model) == i);
  }
  Model model = Model::bagheri;
  CHECK_FALSE(model_from_name("Exact", model));
  CHECK_FALSE(model_from_name("", model));
  CHECK_FALSE(model_from_name(nullptr, model));
  CHECK(model == Model::bagheri);
}

TEST_CASE("a contact angle outside 0...pi/2 is refused in one line", "[capillary]") {
  for (const double angle : {-1e-9, 1.5709, 30.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CHECK_THROWS_AS(BridgeLaw(Model::exact, angle), std::invalid_argument);
    CHECK_THROWS_WITH(BridgeLaw(Model::willett, angle), Contains("contact angle") && Contains("0...pi/2") && !Contains("\n"));
  }
  CHECK_NOTHROW(BridgeLaw(Model::willett, std::acos(0.0)));
  CHECK_NOTHROW(BridgeLaw(Model::willett, 90.0 * degree));
}

TEST_CASE("Willett's closed form agrees with the capillary law of YADE", "[capillary]") {
  // A value of YADE's own checks: radii 19 and 32.5 um, 248.485 nm apart.
  const double r1 = 19e-6, r2 = 32.5e-6;
  const BridgeLaw force(Model::willett, 10.0 * degree);
  CHECK_THAT(force.force(r1, r2, 248.485e-9, 12e-19, 0.024), WithinRel(6.78192074e-7, 2e-9));
}

TEST_CASE("touching forces of the closed forms", "[capillary]") {
  const double v = 1e-3;
  for (const double theta : {0.0, 0.4, 1.0}) {
    const double dry = 2.0 * pi * std::cos(theta);
    CHECK_THAT(BridgeLaw(Model::willett, theta).force(1.0, 1.0, 0.0, v, 1.0), WithinRel(dry, 1e-14));
    CHECK_THAT(BridgeLaw(Model::constant, theta).force(1.0, 1.0, 0.0, v, 1.0), WithinRel(dry, 1e-14));
    const double alpha = std::pow(2.0 * v / pi, 0.25);
    CHECK_THAT(BridgeLaw(Model::rabinovich, theta).force(1.0, 1.0, 0.0, v, 1.0),
               WithinRel(dry + 2.0 * pi * std::sin(alpha) * std::sin(alpha + theta), 1e-13));
  }
}

TEST_CASE("Rabinovich's formula in its published form", "[capillary]") {
  const double theta = 0.5, v = 2e-3;
  const BridgeLaw force(Model::rabinovich, theta);
  for (const double s : {1e-4, 1e-2, 0.1}) {
    const double q = -1.0 + std::sqrt(1.0 + 2.0 * v / (pi * s * s)), d = 0.5 * s * q, alpha = std::sqrt(s * q);
    const double published = 2.0 * pi * (std::cos(theta) / (1.0 + s / (2.0 * d)) + std::sin(alpha) * std::sin(alpha + theta));
    CHECK_THAT(force.force(1.0, 1.0, s, v, 1.0), WithinRel(published, 1e-11));
  }
}

TEST_CASE("the regressions stay near the exact force", "[capillary]") {
  // Bands of the published comparisons, wide enough for the fits and far too narrow for a wrong coefficient.
  for (const double theta : {0.0, 15.0 * degree, 30.0 * degree}) {
    const BridgeLaw exact(Model::exact, theta, Pairs::equal), willett(Model::willett_full, theta), bagheri(Model::bagheri, theta);
    for (const double v : {1e-4, 1e-3, 1e-2, 5e-2})
      for (const double x : {0.0, 0.05, 0.2, 0.4, 0.6, 0.8}) {
        const double s = x * exact.rupture_distance(1.0, 1.0, v), f = exact.force(1.0, 1.0, s, v, 1.0);
        CAPTURE(theta, v, x);
        CHECK(std::fabs(willett.force(1.0, 1.0, s, v, 1.0) / f - 1.0) < 0.035);
        CHECK(std::fabs(bagheri.force(1.0, 1.0, s, v, 1.0) / f - 1.0) < 0.12);
      }
  }
}

TEST_CASE("rupture distances of the closed forms", "[capillary]") {
  const double r = 2e-3, volume = 1e-11, theta = 0.6;
  const double lian = (1.0 + 0.5 * theta) * std::cbrt(volume);
  const double c = std::cbrt(volume) / r, willett = r * (1.0 + 0.5 * theta) * (c + 0.1 * c * c);
  for (const Model m : {Model::rabinovich, Model::constant})
    CHECK_THAT(BridgeLaw(m, theta).rupture_distance(r, r, volume), WithinRel(lian, 1e-13));
  for (const Model m : {Model::willett, Model::willett_full, Model::bagheri})
    CHECK_THAT(BridgeLaw(m, theta).rupture_distance(r, r, volume), WithinRel(willett, 1e-13));
}

TEST_CASE("forces scale with size and surface tension", "[capillary]") {
  for (const Model m : models) {
    const BridgeLaw force(m, 0.3, Pairs::equal);
    const double one = force.force(1.0, 1.0, 0.03, 1e-3, 1.0);
    CHECK_THAT(force.force(2.5e-4, 2.5e-4, 0.03 * 2.5e-4, 1e-3 * std::pow(2.5e-4, 3), 0.072), WithinRel(one * 2.5e-4 * 0.072, 1e-11));
    CHECK_THAT(force.rupture_distance(2.5e-4, 2.5e-4, 1e-3 * std::pow(2.5e-4, 3)),
               WithinRel(2.5e-4 * force.rupture_distance(1.0, 1.0, 1e-3), 1e-12));
  }
}

TEST_CASE("forces are continuous from touching to rupture, finite there and zero beyond", "[capillary]") {
  for (const Model m : models)
    for (const double theta : {0.0, 0.5, 60.0 * degree}) {
      const BridgeLaw force(m, theta, Pairs::equal);
      for (const double v : {1e-6, 1e-4, 3e-2}) {
        CAPTURE(model_names()[static_cast<int>(m)], theta, v);
        const double touching = force.force(1.0, 1.0, 0.0, v, 1.0), reach = force.rupture_distance(1.0, 1.0, v);
        CHECK(force.force(1.0, 1.0, -0.2, v, 1.0) == touching);
        CHECK_THAT(force.force(1.0, 1.0, 1e-9 * std::sqrt(v), v, 1.0), WithinRel(touching, 1e-6));
        // A jump is as large in a hundred times finer steps; a steep slope, or the power-law onset of the regression, is not.
        CHECK(largest_step(force, v, 50000) <= 0.5 * largest_step(force, v, 500));
        CHECK(force.force(1.0, 1.0, reach, v, 1.0) > 0.0);
        CHECK_THAT(force.force(1.0, 1.0, reach * (1.0 - 1e-13), v, 1.0), WithinRel(force.force(1.0, 1.0, reach, v, 1.0), 1e-5));
        CHECK(force.force(1.0, 1.0, reach * (1.0 + 1e-9), v, 1.0) == 0.0);
      }
    }
}

TEST_CASE("the pull of a wetting bridge falls all the way", "[capillary]") {
  for (const Model m : {Model::exact, Model::willett, Model::willett_full, Model::rabinovich, Model::bagheri})
    for (const double theta : {0.0, 20.0 * degree, 40.0 * degree}) {
      const BridgeLaw force(m, theta, Pairs::equal);
      for (const double v : {1e-6, 1e-5, 1e-3, 2e-2}) {
        CAPTURE(model_names()[static_cast<int>(m)], theta, v);
        double before = force.force(1.0, 1.0, 0.0, v, 1.0);
        bool falls = true;
        const double reach = force.rupture_distance(1.0, 1.0, v);
        for (int i = 1; i < 2000; ++i) {
          const double f = force.force(1.0, 1.0, reach * i / 2000.0, v, 1.0);
          falls = falls && f <= before;
          before = f;
        }
        CHECK(falls);
      }
    }
}

TEST_CASE("no liquid, no force", "[capillary]") {
  for (const Model m : models) {
    const BridgeLaw force(m, 0.2, Pairs::equal);
    for (const double volume : {0.0, -0.0, -1e-12, std::numeric_limits<double>::quiet_NaN()}) {
      CHECK(force.force(1e-3, 1e-3, 0.0, volume, 0.07) == 0.0);
      CHECK(force.force(1e-3, 1e-3, 1e-5, volume, 0.07) == 0.0);
      CHECK(force.rupture_distance(1e-3, 1e-3, volume) == 0.0);
    }
  }
}

TEST_CASE("any numbers give finite forces", "[capillary]") {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Model m : models)
    for (const double theta : {0.0, 1e-300, 1e-9, 0.7, 60.0 * degree, 75.0 * degree, 89.999 * degree, 90.0 * degree}) {
      const BridgeLaw force(m, theta, Pairs::equal);
      bool finite = true;
      for (const double radius : {1e-9, 1e-3, 1.0})
        for (const double v :
             {1e-300, 1e-30, 1e-12, 9.3e-10, 9.4e-10, 1e-9, 1e-6, 0.03, 0.1, 0.5, 0.9999999999999999, 1.0, 2.0, 1e3, 1e29, 1e200}) {
          const double volume = v * radius * radius * radius, reach = force.rupture_distance(radius, radius, volume);
          finite = finite && std::isfinite(reach) && reach >= 0.0;
          for (const double gap : {-infinity, -1.0, -1e-300, 0.0, 1e-320, 1e-300, 1e-12 * radius, 0.5 * reach, reach * (1.0 - 1e-16), reach,
                                   2.0 * reach, radius, infinity}) {
            const double f = force.force(radius, radius, gap, volume, 0.07);
            const bool good = std::isfinite(f) && std::fabs(f) < 20.0 * radius * 0.07;
            if (!good)
              UNSCOPED_INFO(model_names()[static_cast<int>(m)] << " theta " << theta << " V* " << v << " R " << radius << " gap " << gap
                                                               << ": " << f);
            finite = finite && good;
          }
        }
      CHECK(finite);
    }
}

TEST_CASE("copies share the law", "[capillary]") {
  static_assert(std::is_trivially_copyable_v<BridgeForce>);
  const BridgeLaw first(Model::exact, 0.25, Pairs::equal);
  BridgeLaw second = first;
  CHECK(second.model() == Model::exact);
  CHECK(second.contact_angle() == 0.25);
  CHECK(first.tables.equal.rows == second.tables.equal.rows);
  CHECK(std::isnan(second.force(1e-3, 2e-3, 1e-5, 1e-12, 0.07)));
  second.complete();
  CHECK(second.force(1e-3, 2e-3, 1e-5, 1e-12, 0.07) == BridgeLaw(Model::exact, 0.25).force(1e-3, 2e-3, 1e-5, 1e-12, 0.07));
  CHECK(std::isnan(first.rupture_distance(1e-3, INFINITY, 1e-12)));
  CHECK(first.force(1e-3, 1e-3, 1e-5, 1e-12, 0.07) == second.force(1e-3, 1e-3, 1e-5, 1e-12, 0.07));
}
