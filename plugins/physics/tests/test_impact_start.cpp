// What a run of impacts must not begin with: overlaps, and a time step that resolves no impact.
#include <cmath>
#include <limits>
#include <string>
#include <vector>
#include "catch.hpp"

#include "dembark/impact/start.hpp"

using namespace dembark;
using namespace dembark::impact;
using Catch::WithinRel;

namespace {

Body log(std::int64_t id, double mass, double x, int material = 0) {
  Body b;
  b.id = id;
  b.mass = mass;
  b.inertia = 1.0;
  b.radius = 0.1;
  b.material = material;
  b.position = {x, 0.0, 0.0};
  return b;
}

Settings softer_and_harder() {
  Settings s;
  s.materials = {{1e7, 0.0}, {3e7, 0.0}};
  s.pairs.assign(4, ImpactPairLaw());
  return s;
}

std::string wrong(std::vector<Body> bodies, ContactGeometry around = {}) {
  std::vector<Contact> contacts;
  around.find(bodies, 0.0, contacts);
  return start_error(bodies, contacts, "log", [](std::int64_t wall) { return "wall " + std::to_string(wall); });
}

}  // namespace

TEST_CASE("a start may overlap by a twentieth of the smaller radius") {
  CHECK(wrong({log(1, 50, 0.0), log(2, 50, 0.2 - 4.99e-3)}) == "");
  CHECK(wrong({log(1, 50, 0.0), log(2, 50, 0.2 - 5.01e-3)}) ==
        "log 1 and log 2 overlap at the start by 0.0501 of the radius; at most 0.05 is allowed");
  std::vector<Body> unequal = {log(1, 50, 0.0), log(2, 50, 0.15 - 4e-3)};
  unequal[1].radius = 0.05;
  CHECK(wrong(unequal) == "log 1 and log 2 overlap at the start by 0.08 of the radius; at most 0.05 is allowed");
}

TEST_CASE("a column of twelve logs at rest may begin") {
  // 50 kg each on springs of 1e7 N/m: the lowest contact carries eleven of them.
  std::vector<Body> column;
  double place = 0.0;
  for (int k = 0; k < 12; ++k) {
    column.push_back(log(k + 1, 50, place));
    place += 0.2 - (11 - k) * 50 * 9.81 / (0.5 * 1e7);
  }
  CHECK(wrong(column) == "");
}

TEST_CASE("the worst of all overlaps is named, walls too") {
  ContactGeometry around;
  Plane end;
  end.id = wall_key(2);
  end.normal = {-1.0, 0.0, 0.0};
  end.point = {0.45, 0.0, 0.0};
  around.planes = {end};
  const std::vector<Body> row = {log(1, 50, 0.0), log(2, 50, 0.195), log(3, 50, 0.385)};
  CHECK(wrong(row) == "log 2 and log 3 overlap at the start by 0.1 of the radius; at most 0.05 is allowed");
  CHECK(wrong(row, around) == "log 3 and wall 2 overlap at the start by 0.35 of the radius; at most 0.05 is allowed");
}

TEST_CASE("what is held fast, and points, may overlap") {
  std::vector<Body> held = {log(1, INFINITY, 0.0), log(2, INFINITY, 0.1)}, points = {log(1, 50, 0.0), log(2, 50, 0.05)};
  CHECK(wrong(held) == "");
  held[1].mass = 50.0;
  CHECK(wrong(held) != "");
  points[1].radius = 0.0;
  CHECK(wrong(points) == "");
}

TEST_CASE("the stiffest contact is that of the lightest logs that can meet") {
  const Settings s = softer_and_harder();
  ContactGeometry around;
  CHECK(stiffest_contact(s, {}, around) == 0.0);
  CHECK(stiffest_contact(s, {log(1, 50, 0.0)}, around) == 0.0);
  CHECK(stiffest_contact(s, {log(1, 50, 0.0), log(2, INFINITY, 1.0)}, around) == 0.0);
  // Equal logs: k = s / 2, m* = m / 2.
  CHECK_THAT(stiffest_contact(s, {log(1, 50, 0.0), log(2, 50, 1.0)}, around), WithinRel(std::sqrt(1e7 / 50), 1e-14));
  CHECK_THAT(stiffest_contact(s, {log(1, 20, 0.0), log(2, 50, 1.0), log(3, 30, 2.0)}, around),
             WithinRel(std::sqrt(5e6 * (1.0 / 20 + 1.0 / 30)), 1e-14));
  // Of two materials: k = 7.5e6.
  CHECK_THAT(stiffest_contact(s, {log(1, 20, 0.0), log(2, 80, 1.0, 1)}, around), WithinRel(std::sqrt(7.5e6 / 16), 1e-14));
  // A wall that gives way, and a rigid one.
  Plane ground;
  ground.stiffness = 4e7;
  around.planes = {ground};
  CHECK_THAT(stiffest_contact(s, {log(1, 20, 0.0)}, around), WithinRel(std::sqrt(8e6 / 20), 1e-14));
  Drum shell;
  around.drums = {shell};
  CHECK_THAT(stiffest_contact(s, {log(1, 20, 0.0)}, around), WithinRel(std::sqrt(1e7 / 20), 1e-14));
}

TEST_CASE("the end of a log with a length is lighter than the log") {
  Body slender = log(1, 40, 0.0);
  slender.half_axis = {0.0, 0.3, 0.4};
  slender.inertia = slender.axial_inertia = 40.0 / 12.0;  // of a rod of 1 m: an end feels a quarter of the mass
  ContactGeometry around;
  around.planes = {Plane()};
  CHECK_THAT(stiffest_contact(softer_and_harder(), {slender}, around), WithinRel(std::sqrt(1e7 / 10), 1e-14));
  slender.mass = slender.inertia = slender.axial_inertia = INFINITY;
  CHECK(stiffest_contact(softer_and_harder(), {slender}, around) == 0.0);
}

TEST_CASE("a time step beyond 1 / omega is warned of") {
  Settings s = softer_and_harder();
  const std::vector<Body> logs = {log(1, 50, 0.0), log(2, 50, 1.0)};  // omega = 447.2 rad/s
  s.dt = 2.2e-3;
  CHECK(step_warning(s, logs, {}) == "");
  s.dt = 4.4721e-3;
  CHECK(step_warning(s, logs, {}) ==
        "the time step of 0.00447 s is 2 / omega of the stiffest contact; impacts are resolved up to 1 / omega, 0.00224 s: peak forces, "
        "durations and losses of impacts mean nothing");
}
