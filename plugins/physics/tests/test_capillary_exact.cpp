// The exact bridge: single shapes against known surfaces, the table against the equation and against an independent solver.
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/constants.hpp"

using dembark::pi;
using namespace dembark::capillary;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double degree = pi / 180.0;

/// Touching bridge of any volume, by continuation from a small one.
BridgeCoordinates touching(const YoungLaplace& bridges, double volume) {
  double v = std::min(volume, 1e-6);
  BridgeCoordinates x = bridges.small_touching(v);
  REQUIRE(bridges.solve(v, 0.0, x));
  while (v < volume) {
    v = std::min(volume, 1.5 * v);
    REQUIRE(bridges.solve(v, 0.0, x));
  }
  return x;
}

/// Of the conditions on contact angle, volume and gap; 0 where a branch turns or another one crosses it.
double determinant(const PairYoungLaplace& bridges, const BridgeCoordinates& x) {
  constexpr double h = 1e-7;
  const BridgeShape here = bridges.shape(x);
  double slope[3][3];
  for (int i = 0; i < 3; ++i) {
    BridgeCoordinates y = x;
    y[i] += h;
    const BridgeShape moved = bridges.shape(y);
    REQUIRE(moved.valid);
    slope[i][0] = (moved.miss - here.miss) / h;
    slope[i][1] = std::log(moved.volume / here.volume) / h;
    slope[i][2] = std::log((moved.caps + moved.gap) / (moved.caps + here.gap)) / h;
  }
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double *a = slope[k], *b = slope[(k + 1) % 3], *c = slope[(k + 2) % 3];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]);
  }
  return sum;
}

/// Laws whose tables are solved for once.
const BridgeForce& exact(double degrees, Pairs pairs = Pairs::any) {
  static std::map<std::pair<double, Pairs>, BridgeLaw> built;
  return built.try_emplace({degrees, pairs}, Model::exact, degrees * degree, pairs).first->second;
}

}  // namespace

TEST_CASE("a cylinder between spheres", "[capillary]") {
  // Its slope is pi/2, so that beta = pi/2 - theta; k a = 1.
  const double theta = 65.0 * degree, beta = 0.5 * pi - theta, r = std::sin(beta), length = 0.8;
  const BridgeShape b = EqualSpheres(theta).shape({0.0, 0.5 * length / r, std::log(r / (0.5 * length))});
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
  const BridgeShape b = EqualSpheres(theta).shape({0.0, 0.0, std::log(a)});
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
  const BridgeShape b = EqualSpheres(89.0 * degree).shape({0.0, k, std::log(a)});
  REQUIRE(b.valid);
  CHECK_THAT(b.force, WithinAbs(0.0, 1e-13));
  CHECK_THAT(b.pressure * b.neck_radius, WithinRel(2.0, 1e-12));
}

TEST_CASE("solved bridges balance at the contact line and along the gap", "[capillary]") {
  for (const double theta : {0.0, 25.0 * degree, 60.0 * degree, 80.0 * degree}) {
    const YoungLaplace bridges(theta);
    const ExactBridge table(theta, Pairs::equal);
    for (const double v : {3e-5, 2e-3, 0.08}) {
      BridgeCoordinates x = touching(bridges, v);
      const double reach = table.rupture(v, 0.0);
      for (const double part : {0.02, 0.1, 0.3, 0.6, 0.8}) {
        const double gap = part * reach, h = 1e-4 * gap;
        CAPTURE(theta, v, part);
        BridgeCoordinates below = x;
        REQUIRE(bridges.solve(v, gap - h, below));
        REQUIRE(bridges.solve(v, gap, x));
        BridgeCoordinates above = x;
        REQUIRE(bridges.solve(v, gap + h, above));
        const BridgeShape b = bridges.shape(x);
        const double r = std::sin(b.half_filling_angle);
        CHECK_THAT(2.0 * pi * r * std::sin(b.half_filling_angle + theta) - pi * r * r * b.pressure, WithinRel(b.force, 1e-7));
        const double work = (bridges.shape(above).energy - bridges.shape(below).energy) / (2.0 * h);
        CHECK_THAT(b.force, WithinRel(work, 2e-5) || WithinAbs(work, 1e-6));
        CHECK_THAT(table.force(gap, v, 0.0), WithinRel(work, 1e-3));
      }
    }
  }
}

TEST_CASE("the table against an independent solver", "[capillary]") {
  // plugins/python/physics/young_laplace.py: shooting on the differential equation. Forces at 0, 0.1, 0.5, 0.9 and 0.99 of rupture, and
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
      {40, 1e-06, 0.013210515, {4.7338488, 0.7227789, 0.0529425, 0.0215341, 0.0166574}, 0.0158446},
      {40, 0.0001, 0.061589380, {4.5603539, 1.9110266, 0.2335359, 0.0983872, 0.0766786}, 0.0730783},
      {40, 0.007, 0.258634811, {4.0670219, 2.9056373, 0.8033145, 0.3824540, 0.3068868}, 0.2946828},
      {40, 0.1, 0.652580067, {3.3235581, 2.9622747, 1.4825845, 0.8450877, 0.7138178}, 0.6940907},
      {60, 1e-06, 0.014220304, {3.0565041, 0.4340885, 0.0391468, 0.0198093, 0.0175089}, 0.0172529},
      {60, 0.0001, 0.066272471, {2.8712084, 1.1855559, 0.1735366, 0.0906399, 0.0804809}, 0.0793501},
      {60, 0.007, 0.277552147, {2.3500282, 1.7869164, 0.6064981, 0.3541229, 0.3197999}, 0.3159821},
      {60, 0.1, 0.693411022, {1.5814876, 1.6706581, 1.1406099, 0.7865086, 0.7295740}, 0.7232822},
  };
  const double parts[] = {0.0, 0.1, 0.5, 0.9, 0.99};
  for (const Reference& r : references) {
    const BridgeForce& force = exact(r.degrees, Pairs::equal);
    CAPTURE(r.degrees, r.volume);
    const double reach = force.rupture_distance(1.0, 1.0, r.volume);
    CHECK_THAT(reach, WithinRel(r.rupture, 1e-5));
    for (int i = 0; i < 5; ++i) CHECK_THAT(force.force(1.0, 1.0, parts[i] * r.rupture, r.volume, 1.0), WithinRel(r.force[i], 1e-3));
    CHECK_THAT(force.force(1.0, 1.0, reach, r.volume, 1.0), WithinRel(r.at_rupture, 1e-2));
  }
}

TEST_CASE("the tables against an independent solver for unequal spheres", "[capillary]") {
  // As above, with the ratio of the radii before; 0 is a wall. In units of R = 2 R*.
  struct Reference {
    double ratio, degrees, volume, rupture, force[5], at_rupture;
  };
  const Reference references[] = {
      {0.5, 0, 1e-05, 0.021627311, {6.1578845, 2.2190534, 0.1997723, 0.0681668, 0.0483801}, 0.0416609},
      {0.5, 0, 0.001, 0.100106921, {5.8777419, 3.8790450, 0.8052280, 0.3039486, 0.2201184}, 0.1913348},
      {0.5, 0, 0.1, 0.446119724, {4.9121071, 4.3857869, 2.3641399, 1.2378393, 0.9633668}, 0.8601779},
      {0.5, 30, 1e-05, 0.026343573, {5.3052016, 1.5494936, 0.1345295, 0.0510649, 0.0377230}, 0.0337712},
      {0.5, 30, 0.001, 0.119769599, {5.0017553, 3.0590357, 0.5786614, 0.2407056, 0.1858199}, 0.1682303},
      {0.5, 30, 0.1, 0.523018316, {3.9678857, 3.5609581, 1.8968131, 1.0536879, 0.8533939}, 0.7742509},
      {0.5, 60, 1e-05, 0.029964562, {2.9897969, 0.7868338, 0.0855202, 0.0436508, 0.0385884}, 0.0373187},
      {0.5, 60, 0.001, 0.134701673, {2.6562350, 1.6407635, 0.3755118, 0.2039618, 0.1792747}, 0.1703740},
      {0.5, 60, 0.1, 0.586887701, {1.5657344, 1.6642078, 1.2426066, 0.8584774, 0.7515872}, 0.7003720},
      {0.2, 0, 1e-05, 0.021606862, {6.1565764, 2.2213851, 0.2000970, 0.0682974, 0.0485141}, 0.0418090},
      {0.2, 0, 0.001, 0.098559931, {5.8649623, 3.9055960, 0.8237892, 0.3124257, 0.2279190}, 0.1990928},
      {0.2, 0, 0.1, 0.403302223, {4.8018264, 4.3810273, 2.5462739, 1.3518697, 1.0389099}, 0.9196109},
      {0.2, 30, 1e-05, 0.026122834, {5.3040717, 1.5650963, 0.1363134, 0.0519634, 0.0389353}, 0.0350407},
      {0.2, 30, 0.001, 0.115920163, {4.9907773, 3.1124227, 0.6052737, 0.2531556, 0.1962333}, 0.1767968},
      {0.2, 30, 0.1, 0.472439645, {3.8734165, 3.5600122, 2.0430564, 1.1270555, 0.8853608}, 0.7877409},
      {0.2, 60, 1e-05, 0.029558519, {2.9891522, 0.8000284, 0.0869690, 0.0443051, 0.0389986}, 0.0374270},
      {0.2, 60, 0.001, 0.129873316, {2.6501410, 1.6724387, 0.3905677, 0.2101861, 0.1816397}, 0.1702655},
      {0.2, 60, 0.1, 0.535774960, {1.5187284, 1.6394675, 1.2976517, 0.8797708, 0.7405785}, 0.6740330},
      {0.05, 0, 1e-05, 0.021584559, {6.1551083, 2.2239362, 0.2004524, 0.0684395, 0.0486581}, 0.0419662},
      {0.05, 0, 0.001, 0.097257133, {5.8506192, 3.9276306, 0.8400371, 0.3194085, 0.2337182}, 0.2044602},
      {0.05, 0, 0.1, 0.380054917, {4.6791190, 4.3389826, 2.6528265, 1.4140954, 1.0738964}, 0.9440345},
      {0.05, 30, 1e-05, 0.025971529, {5.3028034, 1.5759623, 0.1375601, 0.0525634, 0.0396338}, 0.0357105},
      {0.05, 30, 0.001, 0.113526823, {4.9784564, 3.1457594, 0.6229482, 0.2605288, 0.2014653}, 0.1807713},
      {0.05, 30, 0.1, 0.445868646, {3.7682383, 3.5273035, 2.1280219, 1.1634678, 0.8953046}, 0.7872227},
      {0.05, 60, 1e-05, 0.029315146, {2.9884287, 0.8081188, 0.0878624, 0.0446907, 0.0392142}, 0.0374791},
      {0.05, 60, 0.001, 0.127076994, {2.6433019, 1.6909972, 0.3999189, 0.2136053, 0.1826162}, 0.1698989},
      {0.05, 60, 0.1, 0.508505020, {1.4664162, 1.6098158, 1.3304617, 0.8886972, 0.7303529}, 0.6556599},
      {0, 0, 1e-05, 0.021573977, {6.1543964, 2.2251494, 0.2006214, 0.0685068, 0.0487256}, 0.0420392},
      {0, 0, 0.001, 0.096721783, {5.8436655, 3.9365719, 0.8468897, 0.3222503, 0.2359552}, 0.2064614},
      {0, 0, 0.1, 0.372211452, {4.6200102, 4.3131327, 2.6903732, 1.4357033, 1.0850979}, 0.9513097},
      {0, 30, 1e-05, 0.025912468, {5.3021885, 1.5802431, 0.1380522, 0.0527945, 0.0398862}, 0.0359451},
      {0, 30, 0.001, 0.112634929, {4.9724832, 3.1581724, 0.6297819, 0.2632257, 0.2032460}, 0.1820703},
      {0, 30, 0.1, 0.436806779, {3.7175590, 3.5069613, 2.1588388, 1.1759392, 0.8978090}, 0.7859612},
      {0, 60, 1e-05, 0.029224843, {2.9880778, 0.8111579, 0.0881988, 0.0448324, 0.0392894}, 0.0374961},
      {0, 60, 0.001, 0.126058280, {2.6399864, 1.6977812, 0.4034559, 0.2148203, 0.1829074}, 0.1697104},
      {0, 60, 0.1, 0.499038633, {1.4412227, 1.5949535, 1.3427752, 0.8915800, 0.7261216}, 0.6485443},
  };
  const double parts[] = {0.0, 0.1, 0.5, 0.9, 0.99};
  for (const Reference& r : references) {
    const BridgeForce& force = exact(r.degrees);
    CAPTURE(r.ratio, r.degrees, r.volume);
    const double small = 0.5 * (1.0 + r.ratio), large = small / r.ratio;
    const double reach = force.rupture_distance(small, large, r.volume);
    CHECK_THAT(reach, WithinRel(r.rupture, 1e-3));
    for (int i = 0; i < 5; ++i) {
      CHECK_THAT(force.force(small, large, parts[i] * r.rupture, r.volume, 1.0), WithinRel(r.force[i], parts[i] > 0.9 ? 5e-3 : 1e-3));
      CHECK(force.force(small, large, parts[i] * r.rupture, r.volume, 1.0) ==
            force.force(large, small, parts[i] * r.rupture, r.volume, 1.0));
    }
    CHECK_THAT(force.force(small, large, reach, r.volume, 1.0), WithinRel(r.at_rupture, 2e-2));
  }
}

TEST_CASE("almost equal spheres and almost plane walls", "[capillary]") {
  for (const double degrees : {0.0, 30.0, 60.0})
    for (const double v : {1e-6, 1e-3, 0.1}) {
      const BridgeForce& force = exact(degrees);
      CAPTURE(degrees, v);
      const double equal = force.rupture_distance(1.0, 1.0, v), plane = force.rupture_distance(0.5, INFINITY, v);
      // The rupture distance goes with the imperfection e = 5e-7, at most with e^(2/3).
      CHECK_THAT(force.rupture_distance(1.0, 1.0 + 1e-6, v), WithinRel(equal, 5e-4));
      CHECK_THAT(force.rupture_distance(1.0, 1.0 + 1e-15, v), WithinRel(equal, 1e-13));
      CHECK_THAT(force.rupture_distance(0.5, 1e9, v), WithinRel(plane, 1e-7));
      for (const double part : {0.0, 0.3, 0.9}) {
        CHECK_THAT(force.force(1.0, 1.0 + 1e-6, part * equal, v, 1.0), WithinRel(force.force(1.0, 1.0, part * equal, v, 1.0), 1e-3));
        CHECK_THAT(force.force(0.5, 1e9, part * plane, v, 1.0), WithinRel(force.force(0.5, INFINITY, part * plane, v, 1.0), 1e-6));
      }
    }
}

TEST_CASE("a vanishing bridge to a wall pulls with 4 pi R1 gamma cos(theta)", "[capillary]") {
  for (const double degrees : {0.0, 30.0, 60.0}) {
    const double limit = 4.0 * pi * std::cos(degrees * degree);
    const double coarse = limit - exact(degrees).force(1.0, INFINITY, 0.0, 1.6e-6, 1.0),
                 fine = limit - exact(degrees).force(1.0, INFINITY, 0.0, 1e-7, 1.0);
    CHECK(coarse > 0.0);
    CHECK_THAT(coarse / fine, WithinRel(2.0, 0.05));
  }
}

TEST_CASE("a bridge between unequal spheres balances", "[capillary]") {
  for (const double asymmetry : {0.1, 0.6, 1.0})
    for (const double theta : {0.0, 40.0 * degree, 80.0 * degree}) {
      const PairYoungLaplace bridges(theta, asymmetry);
      const double v = 1e-3, h = 1e-6;
      const BridgeCoordinates start = touching(YoungLaplace(theta), v);
      BridgeCoordinates x = EqualSpheres(theta).among_unequal(start);
      double energy[3];
      for (int i = 0; i < 3; ++i) {
        REQUIRE(bridges.solve(v, 0.03 + (i - 1) * h, x));
        energy[i] = bridges.shape(x).energy;
      }
      REQUIRE(bridges.solve(v, 0.03, x));
      CAPTURE(asymmetry, theta);
      CHECK_THAT(bridges.shape(x).force, WithinRel((energy[2] - energy[0]) / (2.0 * h), 1e-6));
      CHECK_THAT(bridges.shape(x).miss, WithinAbs(0.0, 1e-10));
    }
}

TEST_CASE("a symmetric bridge is stable until asymmetric ones branch off", "[capillary]") {
  // Where rupture of equal spheres is no fold, the conditions on any meridian, symmetric or not, are singular.
  for (const double theta : {40.0 * degree, 60.0 * degree, 90.0 * degree})
    for (const double v : {1e-5, 1e-2, 0.5}) {
      const YoungLaplace equal(theta);
      const PairYoungLaplace any(theta, 0.0);
      const BridgeCoordinates start = touching(equal, v);
      BridgeCoordinates end = start;
      std::vector<BridgeCoordinates> path;
      REQUIRE(equal.rupture(v, end, path));
      CAPTURE(theta, v);
      const double at_touching = determinant(any, equal.among_unequal(start));
      CHECK(std::fabs(determinant(any, equal.among_unequal(end))) < 1e-6 * std::fabs(at_touching));
    }
}

TEST_CASE("a vanishing touching bridge pulls with 2 pi R gamma cos(theta)", "[capillary]") {
  for (const double theta : {0.0, 30.0 * degree, 60.0 * degree}) {
    const BridgeLaw force(Model::exact, theta, Pairs::equal);
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
    const BridgeLaw force(Model::exact, theta, Pairs::equal);
    for (const double v : {1e-8, 1e-6, 1e-4, 1e-3})
      CHECK_THAT(force.rupture_distance(1.0, 1.0, v), WithinRel((1.0 + 0.5 * theta) * std::cbrt(v), 0.04));
  }
}

TEST_CASE("the table is seamless in the volume", "[capillary]") {
  const ExactBridge table(0.35, Pairs::equal);
  for (int exponent = -31; exponent <= 1; ++exponent) {
    const double v = std::ldexp(1.0, exponent), below = v * (1.0 - 1e-12), above = v * (1.0 + 1e-12);
    CAPTURE(exponent);
    CHECK_THAT(table.rupture(above, 0.0), WithinRel(table.rupture(below, 0.0), 1e-9));
    CHECK_THAT(table.touching_force(above, 0.0), WithinRel(table.touching_force(below, 0.0), 1e-9));
    for (const double part : {0.01, 0.3, 0.9, 0.999}) {
      const double s = part * table.rupture(v, 0.0);
      CHECK_THAT(table.force(s, above, 0.0), WithinRel(table.force(s, below, 0.0), 1e-7));
    }
  }
}

TEST_CASE("more liquid reaches farther", "[capillary]") {
  for (const double theta : {0.0, 45.0 * degree, 90.0 * degree}) {
    const ExactBridge table(theta, Pairs::equal);
    double before = 0.0;
    bool grows = true;
    for (double v = 1e-11; v < 1.0; v *= 1.03) {
      grows = grows && table.rupture(v, 0.0) > before;
      before = table.rupture(v, 0.0);
    }
    CHECK(grows);
  }
}

TEST_CASE("a bridge that does not wet pushes when touching and pulls when drawn out", "[capillary]") {
  const BridgeLaw force(Model::exact, 90.0 * degree, Pairs::equal);
  for (const double v : {1e-4, 1e-2}) {
    // Thin cylinder of radius a between the spheres, pi a^4 / 2 = V: F = -pi a.
    CHECK_THAT(force.force(1.0, 1.0, 0.0, v, 1.0), WithinRel(-pi * std::pow(2.0 * v / pi, 0.25), 0.01));
    CHECK(force.force(1.0, 1.0, 0.5 * force.rupture_distance(1.0, 1.0, v), v, 1.0) > 0.0);
  }
}
