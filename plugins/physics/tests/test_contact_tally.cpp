// The tally of contacts' parts, and the words of commands.
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>
#include "catch.hpp"

#include "dembark/capillary/liquid_words.hpp"
#include "dembark/contact_tally.hpp"

using namespace dembark;
using Catch::WithinRel;

namespace {

ContactParts parts() {
  ContactParts p;
  p.count = contact_part_count;
  for (std::size_t k = 0; k < p.count; ++k) p.load[k] = {double(k) + 1.0, 0.5, -double(k)};
  p.normal_stored = 3.0;
  p.tangential_stored = 2.0;
  p.rolling_stored = 1.0;
  return p;
}

ContactLevers levers() {
  ContactLevers l;
  l.one = {0.0, 0.0, -1e-3};
  l.two = {0.0, 0.0, 2e-3};
  return l;
}

}  // namespace

TEST_CASE("a pair is tallied once, whichever processes own its bodies") {
  ContactTally both, first, second;
  both.clear(2, 1e-5);
  first.clear(1, 1e-5);
  second.clear(1, 1e-5);
  both.add_pair(parts(), levers(), 0, 1);
  first.add_pair(parts(), levers(), 0, 1);
  CHECK(both.loads[0] == first.loads[0]);
  CHECK(both.loads[1] != both.loads[0]);
  for (std::size_t k = 0; k < force_part_count; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis) CHECK(both.loads[0][k][axis] == -both.loads[1][k][axis]);
  CHECK(first.normal_stored == 0.5 * both.normal_stored);
  CHECK(first.tangential_stored == 0.5 * both.tangential_stored);
  CHECK(first.rolling_stored == 0.5 * both.rolling_stored);
}

TEST_CASE("parts that no contact has had are told, and change no power") {
  ContactParts dry;
  dry[ContactPart::normal_elastic] = {0.0, 0.0, 2.0};
  dry[ContactPart::tangential_elastic] = {0.5, 0.0, 0.0};
  ContactTally tally;
  tally.clear(2, 1e-5);
  tally.add_pair(dry, levers(), 0, 1);
  std::array<bool, contact_part_count> expected{}, every;
  expected[std::size_t(ContactPart::normal_elastic)] = expected[std::size_t(ContactPart::tangential_elastic)] = true;
  every.fill(true);
  CHECK(tally.present == expected);

  EnergyBody body;
  // One that does not turn: what acts about its axes is taken by the walls.
  body.mass = {2.0, 2.0, 2.0, 0.0, 0.0, 0.0};
  body.velocity = {1.0, -2.0, 3.0, 40.0, 50.0, 60.0};
  body.set_forces({0.5, 0.0, 2.0, 0.0, -5e-4, 0.0}, {});
  Powers some, all;
  some.add_loads(body, tally.loads[0], tally.present);
  all.add_loads(body, tally.loads[0], every);
  CHECK(some.power == all.power);
  CHECK(some.rate == all.rate);
  CHECK_THAT(some.power[std::size_t(ContactPart::normal_elastic)], WithinRel(6.0, 1e-15));
  CHECK_THAT(some.power[std::size_t(ContactPart::tangential_elastic)], WithinRel(0.5 - 5e-4 * 50.0, 1e-14));
  CHECK_THAT(some.power[Powers::walls], WithinRel(5e-4 * 50.0, 1e-14));

  tally.clear(2, 1e-5);
  CHECK(tally.present == std::array<bool, contact_part_count>{});
  tally.add_wall(dry, levers(), 1, {});
  CHECK(tally.present == expected);
}

TEST_CASE("a wall works with the velocity of the moment, and takes from the bodies what it does") {
  constexpr double dt = 1e-3;
  ContactTally tally;
  tally.clear(1, dt);
  const ContactTally::WallMotion wall{{1.0, 0.0, 0.0}, {0.0, 2.0, 0.0}, {4.0, 0.0, 0.0}, {0.0, 6.0, 0.0}};
  tally.add_wall(parts(), levers(), 0, wall, 0.5);
  for (std::size_t k = 0; k < contact_part_count; ++k) {
    const Vec3<double> load = 0.5 * parts().load[k];
    const double power = k < force_part_count ? load.x * (1.0 + 0.5 * dt * 4.0) : load.y * (2.0 + 0.5 * dt * 6.0);
    CHECK_THAT(tally.wall_power[k], WithinRel(power, 1e-15));
    CHECK_THAT(tally.wall_rate[k], WithinRel(k < force_part_count ? 4.0 * load.x : 6.0 * load.y, 1e-15));
  }
  CHECK(tally.normal_stored == 0.5 * parts().normal_stored);
  Powers all;
  tally.add_walls(all);
  double sum = 0.0;
  for (std::size_t k = 0; k <= Powers::walls; ++k) sum += all.power[k];
  CHECK(std::abs(sum) < 1e-14 * all.power[Powers::walls]);
  tally.clear(3, dt);
  CHECK(tally.loads.size() == 3);
  CHECK((tally.wall_power[0] == 0.0 && tally.normal_stored == 0.0));
}

TEST_CASE("the words of the liquid: rules, walls, and one line for what is wrong") {
  capillary::LiquidLedger ledger;
  const capillary::GrainContent grains = capillary::read_liquid(
      {"content", "0.01", "share", "fraction", "0.2", "return", "radius", "max_bridge", "1e-9", "wall", "base", "1e-6", "0.5", "0.25"},
      "fix wall", ledger);
  CHECK_THAT(grains.of(2e-3), WithinRel(0.01 * 4.0 / 3.0 * pi * 8e-9, 1e-14));
  CHECK(ledger.largest_bridge == 1e-9);
  REQUIRE(ledger.wall("base"));
  CHECK(ledger.wall("base")->pool == 1e-6);
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"content", "nan"}, "content: the value must be a number, not 'nan'"},
      {{"volume"}, "volume: the value is missing"},
      {{"content", "0.1", "volume", "1e-9"}, "the liquid of a grain is given once: either content or volume"},
      {{"wall", "base", "1", "1"},
       "wall must be followed by the ID of a fix wall, its liquid (m^3), the share it gives and the part it gets back"},
      {{"soak", "1"}, "keyword 'soak' is unknown; there are content, volume, share, return, max_bridge, wall"}};
  for (const auto& [words, line] : wrong) {
    capillary::LiquidLedger other;
    CHECK_THROWS_WITH(capillary::read_liquid(words, "fix wall", other), line);
  }
}

TEST_CASE("after a restart walls hold what the file says, by the rules of the words") {
  capillary::LiquidLedger before, after;
  capillary::read_liquid({"content", "0", "wall", "base", "1e-6", "0.5", "0.25", "wall", "gone", "2e-6", "1", "1"}, "fix wall", before);
  capillary::read_liquid({"content", "0", "wall", "base", "9", "0.1", "0.2", "wall", "new", "3e-6", "1", "1"}, "fix wall", after);
  restore_liquid(after, before.saved(false));
  REQUIRE(after.walls.size() == 3);
  CHECK((after.wall("base")->pool == 1e-6 && after.wall("base")->share == 0.1 && after.wall("base")->part == 0.2));
  CHECK((after.wall("gone")->pool == 2e-6 && after.wall("gone")->share == 0.0));
  CHECK((after.wall("new")->pool == 3e-6 && after.wall("new")->share == 1.0));
}
