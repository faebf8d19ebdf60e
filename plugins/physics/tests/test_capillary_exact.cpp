// The exact bridge: single shapes against known surfaces, the table against the equation and against an independent solver.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "dembark/capillary/bridge.hpp"

using namespace dembark::capillary;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double degree = pi / 180.0;

/// Touching bridge of any volume, by continuation from a small one.
ShapeCoordinates touching(const YoungLaplace& bridges, double volume) {
  double v = std::min(volume, 1e-6);
  ShapeCoordinates x = bridges.small_touching(v);
  REQUIRE(bridges.solve(v, 0.0, x));
  while (v < volume) {
    v = std::min(volume, 1.5 * v);
    REQUIRE(bridges.solve(v, 0.0, x));
  }
  return x;
}

}  // namespace

TEST_CASE("a cylinder between spheres", "[capillary]") {
  // Its slope is pi/2, so that beta = pi/2 - theta; k a = 1.
  const double theta = 65.0 * degree, beta = 0.5 * pi - theta, r = std::sin(beta), length = 0.8;
  const BridgeShape b = bridge_shape({0.5 * length / r, std::log(r / (0.5 * length))}, theta);
  REQUIRE(b.valid);
  const double cap = 1.0 - std::cos(beta);
  CHECK_THAT(b.half_filling_angle, WithinRel(beta, 1e-13));
  CHECK_THAT(b.gap, WithinRel(length - 2.0 * cap, 1e-12));
  CHECK_THAT(b.volume, WithinRel(pi * r * r * length - 2.0 * pi * cap * cap * (3.0 - cap) / 3.0, 1e-12));
  CHECK_THAT(b.force, WithinRel(pi * r, 1e-12));
  CHECK_THAT(b.pressure, WithinRel(1.0 / r, 1e-12));
  CHECK_THAT(b.energy, WithinRel(2.0 * pi * r * length - std::cos(theta) * 4.0 * pi * cap, 1e-12));
}

TEST_CASE("a catenoid between spheres", "[capillary]") {
  const double theta = 20.0 * degree, a = 0.8;
  const BridgeShape b = bridge_shape({0.0, std::log(a)}, theta);
  REQUIRE(b.valid);
  const double beta = std::atan(a) - theta, neck = std::sin(beta) * a / std::hypot(a, 1.0);
  CHECK_THAT(b.half_filling_angle, WithinRel(beta, 1e-12));
  CHECK_THAT(b.neck_radius, WithinRel(neck, 1e-12));
  CHECK_THAT(b.gap, WithinRel(2.0 * (neck * std::asinh(1.0 / a) - 1.0 + std::cos(beta)), 1e-10));
  CHECK_THAT(b.force, WithinRel(2.0 * pi * neck, 1e-12));
  CHECK_THAT(b.pressure, WithinAbs(0.0, 1e-15));
}

TEST_CASE("a sphere of liquid between spheres pulls with nothing", "[capillary]") {
  // A sphere has no neck force: 2 pi r0 = pi r0^2 p. It is k a = 2.
  const double k = 0.5, a = 4.0;
  const BridgeShape b = bridge_shape({k, std::log(a)}, 89.0 * degree);
  REQUIRE(b.valid);
  CHECK_THAT(b.force, WithinAbs(0.0, 1e-13));
  CHECK_THAT(b.pressure * b.neck_radius, WithinRel(2.0, 1e-12));
}

TEST_CASE("solved bridges balance at the contact line and along the gap", "[capillary]") {
  for (const double theta : {0.0, 25.0 * degree, 60.0 * degree, 80.0 * degree}) {
    const YoungLaplace bridges(theta);
    const BridgeTable table(theta);
    for (const double v : {3e-5, 2e-3, 0.08}) {
      ShapeCoordinates x = touching(bridges, v);
      const double reach = table.rupture(v);
      for (const double part : {0.02, 0.1, 0.3, 0.6, 0.8}) {
        const double gap = part * reach, h = 1e-4 * gap;
        CAPTURE(theta, v, part);
        ShapeCoordinates below = x;
        REQUIRE(bridges.solve(v, gap - h, below));
        REQUIRE(bridges.solve(v, gap, x));
        ShapeCoordinates above = x;
        REQUIRE(bridges.solve(v, gap + h, above));
        const BridgeShape b = bridges.shape(x);
        const double r = std::sin(b.half_filling_angle);
        CHECK_THAT(2.0 * pi * r * std::sin(b.half_filling_angle + theta) - pi * r * r * b.pressure, WithinRel(b.force, 1e-7));
        const double work = (bridges.shape(above).energy - bridges.shape(below).energy) / (2.0 * h);
        CHECK_THAT(b.force, WithinRel(work, 2e-5) || WithinAbs(work, 1e-6));
        CHECK_THAT(table.force(gap, v), WithinRel(work, 1e-3));
      }
    }
  }
}

TEST_CASE("the table against an independent solver", "[capillary]") {
  // plugins/physics/python/young_laplace.py: shooting on the differential equation. Forces at 0, 0.1, 0.5, 0.9 and 0.99 of rupture, and
  // at rupture itself, where they rise with the root of the distance to it.
  struct Reference {
    double degrees, volume, rupture, force[5], at_rupture;
  };
  const Reference references[] = {
      {0, 1e-06, 0.010037990, {6.2131963, 1.3875699, 0.0949276, 0.0318668, 0.0225573}, 0.0194035},
      {0, 0.0001, 0.046653473, {6.0598612, 3.1125649, 0.4091949, 0.1443404, 0.1029207}, 0.0887520},
      {0, 0.007, 0.194068121, {5.6211340, 4.2783538, 1.3092002, 0.5414457, 0.3965845}, 0.3451863},
      {0, 0.1, 0.487990154, {4.9490799, 4.3496137, 2.1997924, 1.1148225, 0.8524928}, 0.7534902},
      {20, 1e-06, 0.011332003, {5.8310920, 1.1024652, 0.0749243, 0.0263643, 0.0186408}, 0.0158838},
      {20, 0.0001, 0.052772663, {5.6707749, 2.6641440, 0.3265041, 0.1198254, 0.0853243}, 0.0728955},
      {20, 0.007, 0.220984473, {5.2121262, 3.8331496, 1.0800555, 0.4560606, 0.3335153}, 0.2878054},
      {20, 0.1, 0.559053902, {4.5110910, 3.9305497, 1.8923246, 0.9678098, 0.7400536}, 0.6498854},
      {40, 1e-06, 0.013409369, {4.7338488, 0.7065618, 0.0517735, 0.0208855, 0.0153573}, 0.0132119},
      {40, 0.0001, 0.062559176, {4.5603539, 1.8841544, 0.2284447, 0.0953710, 0.0706041}, 0.0609063},
      {40, 0.007, 0.263616513, {4.0670219, 2.8845729, 0.7860071, 0.3696224, 0.2807521}, 0.2447423},
      {40, 0.1, 0.672210524, {3.3235581, 2.9492745, 1.4480464, 0.8096730, 0.6423788}, 0.5703881},
      {60, 1e-06, 0.016019863, {3.0565041, 0.3620020, 0.0338566, 0.0168921, 0.0133340}, 0.0117747},
      {60, 0.0001, 0.074861842, {2.8712084, 1.0572391, 0.1509092, 0.0774375, 0.0615227}, 0.0544837},
      {60, 0.007, 0.317404645, {2.3500282, 1.7050050, 0.5371625, 0.3045677, 0.2479939}, 0.2220627},
      {60, 0.1, 0.817416466, {1.5814876, 1.6649924, 1.0382702, 0.6836457, 0.5805719}, 0.5302132},
  };
  const double parts[] = {0.0, 0.1, 0.5, 0.9, 0.99};
  for (const Reference& r : references) {
    const BridgeForce force(Model::exact, r.degrees * degree);
    CAPTURE(r.degrees, r.volume);
    const double reach = force.rupture_distance(1.0, 1.0, r.volume);
    CHECK_THAT(reach, WithinRel(r.rupture, 1e-5));
    for (int i = 0; i < 5; ++i) CHECK_THAT(force.force(1.0, 1.0, parts[i] * r.rupture, r.volume, 1.0), WithinRel(r.force[i], 1e-3));
    CHECK_THAT(force.force(1.0, 1.0, reach, r.volume, 1.0), WithinRel(r.at_rupture, 1e-2));
  }
}

TEST_CASE("a vanishing touching bridge pulls with 2 pi R gamma cos(theta)", "[capillary]") {
  for (const double theta : {0.0, 30.0 * degree, 60.0 * degree}) {
    const BridgeForce force(Model::exact, theta);
    const double limit = 2.0 * pi * std::cos(theta);
    const double coarse = limit - force.force(1.0, 1.0, 0.0, 1.6e-7, 1.0), fine = limit - force.force(1.0, 1.0, 0.0, 1e-8, 1.0);
    CHECK(coarse > 0.0);
    CHECK(coarse < 0.05 * limit);
    // The first correction goes with the half-filling angle, V^(1/4).
    CHECK_THAT(coarse / fine, WithinRel(2.0, 0.03));
  }
}

TEST_CASE("rupture goes to Lian's distance for small wetting bridges", "[capillary]") {
  for (const double theta : {0.0, 20.0 * degree, 40.0 * degree}) {
    const BridgeForce force(Model::exact, theta);
    for (const double v : {1e-8, 1e-6, 1e-4, 1e-3}) CHECK_THAT(force.rupture_distance(1.0, 1.0, v), WithinRel((1.0 + 0.5 * theta) * std::cbrt(v), 0.04));
  }
}

TEST_CASE("the table is seamless in the volume", "[capillary]") {
  const BridgeTable table(0.35);
  for (int exponent = -31; exponent <= 1; ++exponent) {
    const double v = std::ldexp(1.0, exponent), below = v * (1.0 - 1e-12), above = v * (1.0 + 1e-12);
    CAPTURE(exponent);
    CHECK_THAT(table.rupture(above), WithinRel(table.rupture(below), 1e-9));
    CHECK_THAT(table.touching_force(above), WithinRel(table.touching_force(below), 1e-9));
    for (const double part : {0.01, 0.3, 0.9, 0.999}) {
      const double s = part * table.rupture(v);
      CHECK_THAT(table.force(s, above), WithinRel(table.force(s, below), 1e-7));
    }
  }
}

TEST_CASE("more liquid reaches farther", "[capillary]") {
  for (const double theta : {0.0, 45.0 * degree, 90.0 * degree}) {
    const BridgeTable table(theta);
    double before = 0.0;
    bool grows = true;
    for (double v = 1e-11; v < 1.0; v *= 1.03) {
      grows = grows && table.rupture(v) > before;
      before = table.rupture(v);
    }
    CHECK(grows);
  }
}

TEST_CASE("a bridge that does not wet pushes when touching and pulls when drawn out", "[capillary]") {
  const BridgeForce force(Model::exact, 90.0 * degree);
  for (const double v : {1e-4, 1e-2}) {
    // Thin cylinder of radius a between the spheres, pi a^4 / 2 = V: F = -pi a.
    CHECK_THAT(force.force(1.0, 1.0, 0.0, v, 1.0), WithinRel(-pi * std::pow(2.0 * v / pi, 0.25), 0.01));
    CHECK(force.force(1.0, 1.0, 0.5 * force.rupture_distance(1.0, 1.0, v), v, 1.0) > 0.0);
  }
}
