// The rule of carried liquid: shares, simultaneous requests, return; conservation over random sequences of contacts.
#include "catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "dembark/capillary/liquid.hpp"

using namespace dembark::capillary;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Bridge {
  std::size_t i, j;
  NewBridge<double> liquid;
};

/// Holders with radii, whose contacts ask, form and break in steps.
struct Assembly {
  std::vector<double> radius, liquid;
  std::vector<Bridge> bridges;
  ShareRule share;
  Return rule = Return::equal;
  double largest = flat<double>;
  Demands demands;

  void touch(const std::vector<std::pair<std::size_t, std::size_t>>& contacts) {
    demands.resize(liquid.size());
    for (const auto& [i, j] : contacts) {
      demands.add(i, share(radius[i], radius[j]));
      demands.add(j, share(radius[j], radius[i]));
    }
    const std::vector<double> before = liquid;
    for (const auto& [i, j] : contacts) {
      const double given_i = share(radius[i], radius[j]) * grant(before[i], demands.of(i));
      const double given_j = share(radius[j], radius[i]) * grant(before[j], demands.of(j));
      const NewBridge<double> bridge = form_bridge(given_i, given_j, radius[i], radius[j], rule, largest);
      liquid[i] = remaining(liquid[i], bridge.from_i);
      liquid[j] = remaining(liquid[j], bridge.from_j);
      bridges.push_back({i, j, bridge});
    }
  }
  void rupture(std::size_t k) {
    const Bridge b = bridges[k];
    liquid[b.i] += returned(b.liquid.volume, b.liquid.imbalance);
    liquid[b.j] += returned(b.liquid.volume, -b.liquid.imbalance);
    bridges.erase(bridges.begin() + std::ptrdiff_t(k));
  }
  double total() const {
    long double sum = 0;
    for (const double v : liquid) sum += v;
    for (const Bridge& b : bridges) sum += b.liquid.volume;
    return double(sum);
  }
};

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
  Demands demands;
  demands.resize(1);
  for (int k = 0; k < n; ++k) demands.add(0, share);
  double left = liquid;
  for (int k = 0; k < n; ++k) left = remaining(left, share * grant(liquid, demands.of(0)));
  CHECK(left >= 0.0);
  CHECK_THAT(left, WithinAbs(liquid * std::max(0.0, 1.0 - n * share), 1e-15 * n * liquid));
  demands.clear();
  CHECK(demands.of(0) == 0.0);
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
  one.rule = rule;
  one.share = share;
  one.largest = 1e-12;
  const std::size_t n = 40;
  for (std::size_t i = 0; i < n; ++i) {
    one.radius.push_back(std::pow(10.0, -4.0 + 2.0 * u(random)));
    one.liquid.push_back(i % 5 ? std::pow(10.0, -13.0 + 3.0 * u(random)) : 0.0);
  }
  const double total = one.total();
  std::vector<std::pair<std::size_t, std::size_t>> contacts;
  for (int step = 0; step < 300; ++step) {
    contacts.clear();
    for (int k = 0; k < 30; ++k) {
      const std::size_t i = std::size_t(u(random) * n), j = std::size_t(u(random) * n);
      if (i != j) contacts.emplace_back(i, j);
    }
    Assembly other = one;
    one.touch(contacts);
    std::shuffle(contacts.begin(), contacts.end(), random);
    for (auto& [i, j] : contacts)
      if (u(random) < 0.5) std::swap(i, j);
    other.touch(contacts);
    for (std::size_t i = 0; i < n; ++i) REQUIRE_THAT(other.liquid[i], WithinAbs(one.liquid[i], 1e-13 * total));
    REQUIRE(*std::min_element(one.liquid.begin(), one.liquid.end()) >= 0.0);
    while (one.bridges.size() > 50) one.rupture(std::size_t(u(random) * double(one.bridges.size())));
    REQUIRE_THAT(one.total(), WithinRel(total, 1e-15 * (step + 10)));
  }
  while (!one.bridges.empty()) one.rupture(0);
  CHECK_THAT(one.total(), WithinRel(total, 1e-13));
}
