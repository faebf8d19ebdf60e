// Carried liquid: shares, simultaneous requests, return; the ledger over random sequences of contacts, and when grains, walls or bridges
// go.
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "dembark/capillary/liquid_ledger.hpp"

using namespace dembark::capillary;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Bridge {
  BridgeSides sides;
  NewBridge<double> liquid;
};

/// Grains with radii and the walls of a ledger, whose contacts ask, form and break in steps.
struct Assembly {
  std::vector<double> radius, liquid;
  std::vector<Bridge> bridges;
  std::vector<BrokenBridge> broken;
  LiquidLedger ledger;

  GrainLiquid grains() { return {liquid.data(), int(liquid.size())}; }
  void begin(const std::vector<LiquidWall>& walls = {}) {
    ledger.walls = walls;
    ledger.resize(liquid.size());
  }
  void touch(const std::vector<BridgeSides>& contacts) {
    std::vector<BridgeRequest> requests;
    for (const BridgeSides& c : contacts) requests.push_back({c, radius[c.grain], c.wall ? flat<double> : radius[c.other]});
    ledger.give_back(broken, grains());
    ledger.form(requests, grains(), [this](const BridgeRequest& r, const NewBridge<double>& b) { bridges.push_back({r.sides, b}); });
  }
  void rupture(std::size_t k) {
    broken.push_back({bridges[k].sides, bridges[k].liquid.volume, bridges[k].liquid.imbalance});
    bridges.erase(bridges.begin() + std::ptrdiff_t(k));
  }
  void reconcile() {
    double excess = 0.0;
    REQUIRE(ledger.reconcile_pairs(
                grains(),
                [this](auto visit) {
                  for (const Bridge& b : bridges)
                    if (!b.sides.wall) visit(b.sides.grain, b.sides.other, b.liquid.volume, b.liquid.imbalance);
                },
                excess) < 0);
    ledger.reconcile_walls(grains(), [this](int i, std::size_t wall, auto visit) {
      for (Bridge& b : bridges)
        if (b.sides.wall && b.sides.grain == i && b.sides.other == int(wall)) visit(b.liquid.volume, b.liquid.imbalance);
    });
  }
  double total() {
    const auto all = ledger.totals(grains());
    return all.grains + all.bridges + all.walls + ledger.lost;
  }
};

/// Three wet grains in a row on a wet wall, each with a bridge to its neighbours and to the wall.
Assembly row_on_wall(Return split) {
  Assembly row;
  row.radius = {1e-3, 2e-3, 1e-3};
  row.liquid = {1e-10, 2e-10, 3e-10};
  row.ledger.split = split;
  row.begin({{"floor", 4e-10, 0.1, 0.3}});
  row.touch({{0, 1, false}, {2, 1, false}, {0, 0, true}, {1, 0, true}, {2, 0, true}});
  REQUIRE(row.bridges.size() == 5);
  return row;
}

}  // namespace

TEST_CASE("the facing cap", "[liquid]") {
  CHECK_THAT(cap_share(1e-3, 1e-3), WithinRel(0.5 * (1.0 - std::sqrt(0.75)), 1e-15));
  CHECK_THAT(cap_share(2e-3, 1e-3), WithinRel(0.5 * (1.0 - std::sqrt(1.0 - 1.0 / 9.0)), 1e-14));
  CHECK(cap_share(1e-3, flat<double>) == 0.5);
  // Ratios that cancel or overflow in the plain formula.
  CHECK_THAT(cap_share(1.0, 1e-12), WithinRel(0.25e-24, 1e-11));
  CHECK_THAT(cap_share(1e-12, 1.0), WithinAbs(0.5, 1e-6));
  CHECK_THAT(cap_share(1e-200, 1e200), WithinRel(0.5, 1e-15));
  CHECK(cap_share(1e200, 1e-200) == 0.0);
  CHECK_THAT(cap_share(2.0f, 1.0f), WithinRel(0.5f * (1.0f - std::sqrt(8.0f / 9.0f)), 1e-5f));
}

TEST_CASE("shares grow with the neighbour, and the caps of a close packing leave some film", "[liquid]") {
  double before = 0.0;
  for (const double other : {0.01, 0.1, 0.5, 1.0, 3.0, 100.0}) {
    CHECK(cap_share(1.0, other) > before);
    before = cap_share(1.0, other);
  }
  CHECK(12.0 * cap_share(1.0, 1.0) < 1.0);
}

TEST_CASE("rules outside their range are named", "[liquid]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double factor : {0.0, -1.0, 2.1, nan}) CHECK(ShareRule{ShareRule::Kind::cap, factor}.error() != nullptr);
  for (const double factor : {0.0, -1.0, 1.1, nan}) CHECK(ShareRule{ShareRule::Kind::fraction, factor}.error() != nullptr);
  CHECK(ShareRule{}.error() == nullptr);
  CHECK(ShareRule{ShareRule::Kind::cap, 2.0}(1.0, flat<double>) == 1.0);
  CHECK(ShareRule{ShareRule::Kind::fraction, 0.05}(1.0, 7.0) == 0.05);
  CHECK(return_names().size() == static_cast<std::size_t>(Return::taken) + 1);
}

TEST_CASE("n requests at once never take more than there is", "[liquid]") {
  const int n = GENERATE(1, 2, 3, 20, 1000);
  const double liquid = 3e-11, share = 0.3;
  Assembly star;
  star.ledger.share = {ShareRule::Kind::fraction, share};
  star.radius.assign(std::size_t(n) + 1, 1e-3);
  star.liquid.assign(std::size_t(n) + 1, 0.0);
  star.liquid[0] = liquid;
  star.begin();
  std::vector<BridgeSides> contacts;
  for (int k = 1; k <= n; ++k) contacts.push_back({0, k, false});
  star.touch(contacts);
  CHECK(star.liquid[0] >= 0.0);
  CHECK_THAT(star.liquid[0], WithinAbs(liquid * std::max(0.0, 1.0 - n * share), 1e-15 * n * liquid));
  for (const Bridge& b : star.bridges) CHECK(b.liquid.volume == star.bridges[0].liquid.volume);
}

TEST_CASE("a dry pair forms an empty bridge, a dry side gives nothing", "[liquid]") {
  const NewBridge<double> dry = form_bridge(0.0, 0.0, 1.0, 2.0, Return::radius);
  CHECK(dry.volume == 0.0);
  CHECK(dry.imbalance == 0.0);
  const NewBridge<double> one = form_bridge(1e-12, 0.0, 1.0, 1.0, Return::equal);
  CHECK(returned(one.volume, one.imbalance) == 0.5e-12);
  CHECK(returned(one.volume, -one.imbalance) == 0.5e-12);
}

TEST_CASE("both sides of a pair reckon the same bridge", "[liquid]") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int k = 0; k < 1000; ++k) {
    const Return rule = static_cast<Return>(k % 3);
    const double a = u(random), b = u(random), ra = u(random) + 0.1, rb = u(random) + 0.1, largest = k % 2 ? u(random) : flat<double>;
    const NewBridge<double> one = form_bridge(a, b, ra, rb, rule, largest), other = form_bridge(b, a, rb, ra, rule, largest);
    REQUIRE(one.volume == other.volume);
    REQUIRE(one.from_i == other.from_j);
    REQUIRE(one.imbalance == -other.imbalance);
    REQUIRE(one.volume <= largest * (1.0 + 1e-15));
    REQUIRE_THAT(returned(one.volume, one.imbalance) + returned(one.volume, -one.imbalance), WithinRel(one.volume, 1e-15));
    if (rule == Return::taken) REQUIRE_THAT(returned(one.volume, one.imbalance), WithinAbs(one.from_i, 1e-15 * one.volume));
    if (rule == Return::radius) REQUIRE_THAT(returned(one.volume, one.imbalance), WithinRel(one.volume * ra / (ra + rb), 1e-14));
  }
}

TEST_CASE("grains that have gathered their liquid get back what bridges take", "[liquid]") {
  const auto split = GENERATE(Return::equal, Return::radius);
  const auto share = GENERATE(ShareRule{}, ShareRule{ShareRule::Kind::fraction, 0.3});
  for (const double other : {1e-3, 2e-3, 2e-2}) {
    const double radius = 1e-3, liquid = 1e-10, mine = gathered(share, split, radius, other, liquid);
    const NewBridge<double> bridge = form_bridge(share(radius, other) * mine, share(other, radius) * liquid, radius, other, split);
    CHECK_THAT(returned(bridge.volume, bridge.imbalance), WithinRel(bridge.from_i, 1e-13));
  }
}

TEST_CASE("bridges are foreseen by the sizes of the grains", "[liquid]") {
  const double small = 1e-3, large = 1e-2, content = 0.01;
  WettestGrains wettest{large};
  for (const double radius : {small, large}) wettest.add(radius, content * std::pow(radius, 3));
  const auto likely = [&](double radius, double other) { return wettest.likely_bridge(ShareRule{}, Return::equal, radius, other); };
  // Grains of one size: twice what a wall asks of them.
  CHECK_THAT(likely(large, large), WithinRel(content * std::pow(large, 3), 1e-14));
  CHECK(likely(large, flat<double>) == likely(large, large));
  // Small ones gather films as thick as those of the large ones, but no more.
  CHECK(likely(small, small) >= content * std::pow(small, 3));
  CHECK_THAT(likely(small, small), WithinRel(content * large * small * small, 1e-14));
  CHECK(likely(small, large) < 0.1 * likely(large, large));
  CHECK(likely(small, large) == likely(large, small));
  // One small grain that was made wet counts as it is.
  wettest.add(small, content * std::pow(large, 3));
  CHECK(likely(small, small) == likely(large, large));
}

TEST_CASE("a wall keeps its part", "[liquid]") {
  const NewBridge<double> bridge = form_wall_bridge(3.0, 1.0, 0.25, Return::equal);
  CHECK(returned(bridge.volume, bridge.imbalance) == 3.0);
  CHECK(returned(form_wall_bridge(3.0, 0.0, 0.0, Return::radius).volume, 3.0) == 3.0);
  const NewBridge<double> taken = form_wall_bridge(3.0, 1.0, 0.9, Return::taken);
  CHECK(returned(taken.volume, -taken.imbalance) == 1.0);
}

TEST_CASE("random contacts and ruptures conserve the liquid in any order", "[liquid]") {
  const auto rule = GENERATE(Return::equal, Return::radius, Return::taken);
  const auto share = GENERATE(ShareRule{}, ShareRule{ShareRule::Kind::fraction, 1.0}, ShareRule{ShareRule::Kind::cap, 2.0});
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  Assembly one;
  one.ledger.split = rule;
  one.ledger.share = share;
  one.ledger.largest_bridge = 1e-12;
  const std::size_t n = 40;
  for (std::size_t i = 0; i < n; ++i) {
    one.radius.push_back(std::pow(10.0, -4.0 + 2.0 * u(random)));
    one.liquid.push_back(i % 5 ? std::pow(10.0, -13.0 + 3.0 * u(random)) : 0.0);
  }
  one.begin({{"wet", 1e-12, 0.2, 0.5}, {"dry"}});
  const double total = one.total();
  std::vector<BridgeSides> contacts;
  for (int step = 0; step < 300; ++step) {
    contacts.clear();
    for (int k = 0; k < 30; ++k) {
      const int i = int(u(random) * n), j = int(u(random) * n);
      if (i != j) contacts.push_back({i, k % 5 ? j : j % 2, k % 5 == 0});
    }
    Assembly other = one;
    one.touch(contacts);
    std::shuffle(contacts.begin(), contacts.end(), random);
    std::shuffle(other.broken.begin(), other.broken.end(), random);
    other.touch(contacts);
    REQUIRE(other.liquid == one.liquid);
    REQUIRE(*std::min_element(one.liquid.begin(), one.liquid.end()) >= 0.0);
    while (one.bridges.size() > 50) one.rupture(std::size_t(u(random) * double(one.bridges.size())));
    REQUIRE_THAT(one.total(), WithinRel(total, 1e-15 * (step + 10)));
  }
  while (!one.bridges.empty()) one.rupture(0);
  one.touch({});
  CHECK_THAT(one.total(), WithinRel(total, 1e-13));
  CHECK_THAT(one.ledger.totals(one.grains()).bridges, WithinAbs(0.0, 1e-14 * total));
}

TEST_CASE("swapped sides of a contact get the same bridge", "[liquid]") {
  Assembly one, other;
  one.radius = other.radius = {1e-3, 2e-3};
  one.liquid = other.liquid = {3e-10, 1e-10};
  one.begin();
  other.begin();
  one.touch({{0, 1, false}});
  other.touch({{1, 0, false}});
  CHECK(one.liquid == other.liquid);
  CHECK(one.bridges[0].liquid.volume == other.bridges[0].liquid.volume);
}

TEST_CASE("bridges that vanish with a grain go back to those who stay", "[liquid]") {
  const auto split = GENERATE(Return::equal, Return::radius, Return::taken);
  Assembly row = row_on_wall(split);
  const double total = row.total();
  const std::vector<double> before = row.liquid;
  const double pool = row.ledger.walls[0].pool;
  // In the order in which they formed: pairs 0-1 and 2-1, then the wall with 0, 1 and 2.
  const NewBridge<double> first = row.bridges[0].liquid, second = row.bridges[1].liquid, floor = row.bridges[3].liquid;
  const double taken_along = before[1] + returned(first.volume, -first.imbalance) + returned(second.volume, -second.imbalance) +
                             returned(floor.volume, floor.imbalance);
  row.ledger.remove(1, row.grains());
  row.bridges = {row.bridges[2], row.bridges[4]};
  row.reconcile();
  row.touch({});
  CHECK_THAT(row.ledger.lost, WithinRel(taken_along, 1e-14));
  CHECK_THAT(row.liquid[0], WithinRel(before[0] + returned(first.volume, first.imbalance), 1e-14));
  CHECK_THAT(row.liquid[2], WithinRel(before[2] + returned(second.volume, second.imbalance), 1e-14));
  CHECK_THAT(row.ledger.walls[0].pool, WithinRel(pool + returned(floor.volume, -floor.imbalance), 1e-14));
  CHECK_THAT(row.total(), WithinRel(total, 1e-14));
}

TEST_CASE("a bridge that an engine doubled or dropped at a wall is split as it was to be", "[liquid]") {
  const auto split = GENERATE(Return::equal, Return::radius, Return::taken);
  Assembly row = row_on_wall(split), dropped = row;
  const double total = row.total(), own = row.liquid[0], pool = row.ledger.walls[0].pool;
  const NewBridge<double> bridge = row.bridges[2].liquid;
  dropped.bridges.erase(dropped.bridges.begin() + 2);
  dropped.reconcile();
  dropped.touch({});
  row.bridges.push_back(row.bridges[2]);
  row.reconcile();
  CHECK_THAT(row.bridges[2].liquid.volume, WithinRel(0.5 * bridge.volume, 1e-14));
  row.rupture(5);
  row.rupture(2);
  row.touch({});
  for (Assembly* one : {&row, &dropped}) {
    CHECK_THAT(one->liquid[0], WithinRel(own + returned(bridge.volume, bridge.imbalance), 1e-14));
    CHECK_THAT(one->ledger.walls[0].pool, WithinRel(pool + returned(bridge.volume, -bridge.imbalance), 1e-14));
    CHECK_THAT(one->total(), WithinRel(total, 1e-14));
  }
}

TEST_CASE("a wall that goes leaves its bridges to the grains and takes its own liquid along", "[liquid]") {
  Assembly row = row_on_wall(Return::taken);
  const double total = row.total(), pool = row.ledger.walls[0].pool;
  const double in_bridges = row.ledger.totals(row.grains()).bridges;
  row.ledger.change_walls({"lid", "floor"}, row.grains());
  CHECK(row.total() == total);
  CHECK(row.ledger.walls[1].pool == pool);
  row.ledger.change_walls({"lid"}, row.grains());
  CHECK(row.ledger.lost == pool);
  CHECK_THAT(row.total(), WithinRel(total, 1e-14));
  CHECK(row.ledger.totals(row.grains()).bridges < in_bridges);
}

TEST_CASE("new grains are counted as added, missing liquid is told", "[liquid]") {
  Assembly some;
  some.radius = {1e-3, 1e-3, 1e-3};
  some.liquid = {1e-10, GrainLiquid::unset, 0.0};
  some.begin();
  const auto full = [](int) { return 4e-10; };
  REQUIRE(some.ledger.admit(some.grains(), full) < 0);
  CHECK(some.ledger.audit(some.grains(), true) == 0.0);
  CHECK(some.ledger.expected == 5e-10);
  CHECK(some.ledger.added == 0.0);
  some.radius.push_back(1e-3);
  some.liquid.push_back(GrainLiquid::unset);
  some.ledger.resize(4);
  REQUIRE(some.ledger.admit(some.grains(), full) < 0);
  CHECK(some.ledger.audit(some.grains(), true) == 0.0);
  CHECK(some.ledger.added == 4e-10);
  some.liquid[0] = 0.0;
  CHECK_THAT(some.ledger.audit(some.grains(), true), WithinRel(1e-10, 1e-12));
  some.liquid[0] = -1e-12;
  CHECK(some.ledger.admit(some.grains(), full) == 0);
  some.liquid.erase(some.liquid.begin());
  const double lost = some.ledger.lost;
  CHECK(some.ledger.audit(some.grains(), true) == 0.0);
  CHECK(some.ledger.lost == lost);
}

TEST_CASE("two processes reckon a pair across their border alike", "[liquid]") {
  // Each has one grain and a copy of the other's; they exchange what their grains grant.
  std::vector<double> radius{1e-3, 2e-3}, liquid{3e-10, 1e-10};
  std::vector<NewBridge<double>> bridges;
  std::vector<std::vector<double>> left;
  for (const int me : {0, 1}) {
    LiquidLedger ledger;
    std::vector<double> mine{liquid[me]};
    const GrainLiquid grains{mine.data(), 1};
    ledger.resize(2);
    ledger.copy_to_others = [&](std::vector<double>& grants) { grants[1] = liquid[1 - me]; };  // one request: all is granted
    std::vector<BridgeRequest> requests{{{0, 1, false}, radius[me], radius[1 - me]}};
    ledger.form(requests, grains, [&](const BridgeRequest&, const NewBridge<double>& b) { bridges.push_back(b); });
    left.push_back(mine);
  }
  CHECK(bridges[0].volume == bridges[1].volume);
  CHECK(bridges[0].imbalance == -bridges[1].imbalance);
  CHECK_THAT(left[0][0] + left[1][0] + bridges[0].volume, WithinRel(4e-10, 1e-15));
}

TEST_CASE("what a restart file holds brings everything back", "[liquid]") {
  Assembly row = row_on_wall(Return::taken), again;
  row.ledger.remove(2, row.grains());
  const std::string saved = row.ledger.saved(true);
  again.liquid = row.liquid;
  again.ledger.restore(saved);
  CHECK(again.total() == row.total());
  CHECK(again.ledger.saved(true) == saved);
  CHECK_THROWS_WITH(again.ledger.restore("liquid-1 0 0 0"), Catch::Contains("another version"));
  // Cut off behind any of its words: none of the walls and tallies is taken for zero.
  for (std::size_t end = saved.find(' '); end != std::string::npos; end = saved.find(' ', end + 1))
    CHECK_THROWS_AS(again.ledger.restore(saved.substr(0, end)), std::runtime_error);
  CHECK_THROWS_WITH(again.ledger.restore("liquid-2 0 0 0 0 -1 0"), Catch::Contains("incomplete"));
}
