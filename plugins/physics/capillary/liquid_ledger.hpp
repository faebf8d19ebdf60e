// The liquid of a run: what each grain and each wall owns, what is in bridges, and what forms and breaks in a step.
//
// The liquid of a bridge stays the property of its two sides: what each of them gets back is fixed when the bridge forms (liquid.hpp). The
// ledger tallies for each grain its part of all bridges to grains and, for each wall, its own part and the wall's part of the bridges to
// that wall. So what was in bridges that vanish without breaking, because a grain was deleted or the engine dropped a contact, is known
// and goes back to those whose it is.
//
// During a step the engine collects which touching contacts have no bridge and which bridges broke, in any order. At its end it calls
// give_back() and then form(): all is granted from what is there before the first bridge forms, so the order has no effect on the result.
// Each process keeps the grains that it owns and sees others as copies; a pair of two processes is reckoned on both from the same
// numbers. SI units (m^3).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "liquid.hpp"

namespace dembark::capillary {

struct LiquidWall {
  std::string name;
  double pool = 0.0;                  // m^3 that it owns
  double share = 0.0;                 // 0...1 of that which a new bridge asks for
  double part = 0.0;                  // 0...1 of a broken bridge that it gets; with Return::taken what it gave
  double change = 0.0;                // of the pool, by this process, since all of them last settled it
  std::vector<double> of_grain, own;  // for each grain, its part and the wall's of the bridges between them

  /// Nullptr, or what is wrong.
  const char* error() const {
    if (!(pool >= 0.0 && std::isfinite(pool))) return "its liquid (m^3) must be >= 0 and finite";
    if (!(share >= 0.0 && share <= 1.0 && part >= 0.0 && part <= 1.0)) return "share and part must lie in 0...1";
    return nullptr;
  }
};

/// What grains of a process own, without bridges: the first `owned` are its own. A grain that is new has the volume `unset`.
struct GrainLiquid {
  static constexpr double unset = -1.0;
  double* volume = nullptr;
  int owned = 0;
};

class LiquidLedger {
 public:
  ShareRule share;
  Return split = Return::equal;
  double largest_bridge = flat<double>;
  std::vector<LiquidWall> walls;
  double lost = 0.0;      // went with grains and walls that left
  double added = 0.0;     // came with grains after the first, or was set from outside
  double expected = 0.0;  // what there should be
  /// Puts the sums of all processes in place of a process's own; as it stands, of one.
  std::function<void(std::vector<long double>&)> sum_over_processes = [](std::vector<long double>&) {};
  /// Copies numbers of owned grains to their copies, if there are any.
  std::function<void(std::vector<double>&)> copy_to_others;

  void resize(std::size_t grains) {
    each_tally([grains](std::vector<double>& tally) { tally.resize(grains, 0.0); });
    demands_.resize(grains, 0.0);
    grants_.resize(grains, -1.0);
  }

  /// The numbers that belong to a grain and go where it goes: `visit(number)` for each, always in the same order.
  template <class Visit>
  void each_number(int grain, Visit visit) {
    each_tally([&](std::vector<double>& tally) { visit(tally[grain]); });
  }
  std::size_t numbers() const { return 1 + 2 * walls.size(); }

  LiquidWall* wall(const std::string& name) {
    const auto found = std::find_if(walls.begin(), walls.end(), [&](const LiquidWall& wall) { return wall.name == name; });
    return found == walls.end() ? nullptr : &*found;
  }

  /// The walls that there are now; new ones are dry. Bridges to walls that are gone belong to their grains, as they will not break.
  void change_walls(const std::vector<std::string>& names, GrainLiquid grains) {
    std::vector<LiquidWall> now;
    for (const std::string& name : names) {
      LiquidWall* const known = wall(name);
      now.push_back(known ? std::exchange(*known, {}) : LiquidWall{name});
    }
    for (const LiquidWall& gone : walls) {
      lost += gone.pool;
      expected -= gone.pool;
      for (int i = 0; i < std::min(grains.owned, int(gone.own.size())); ++i) grains.volume[i] += gone.of_grain[i] + gone.own[i];
    }
    walls = std::move(now);
    resize(of_pairs_.size());
  }

  /// Gives new grains what `initial(i)` says. Returns a grain with an impossible volume, or -1.
  template <class Initial>
  int admit(GrainLiquid grains, Initial initial) {
    std::vector<long double> come(2, 0.0L);
    for (int i = 0; i < grains.owned; ++i) {
      double& volume = grains.volume[i];
      if (volume == GrainLiquid::unset) {
        volume = initial(i);
        come[0] += volume;
        come[1] += 1.0L;
      } else if (!(volume >= 0.0 && std::isfinite(volume))) {
        return i;
      }
    }
    sum_over_processes(come);
    if (counted_ < 0) return -1;  // all are new
    added += double(come[0]);
    expected += double(come[0]);
    counted_ += static_cast<long long>(come[1]);
    return -1;
  }

  /// A grain of an engine that tells which ones it deletes: its liquid leaves with its part of its bridges. Their other sides get
  /// theirs when reconcile_pairs() finds the bridges gone.
  void remove(int grain, GrainLiquid grains) {
    double all = grains.volume[grain] + of_pairs_[grain];
    for (LiquidWall& wall : walls) {
      all += wall.of_grain[grain];
      wall.change += wall.own[grain];
    }
    lost += all;
    expected -= all;
    if (counted_ > 0) --counted_;
    grains.volume[grain] = 0.0;
    each_number(grain, [](double& number) { number = 0.0; });
  }

  void give_back(std::vector<BrokenBridge>& broken, GrainLiquid grains) {
    std::sort(broken.begin(), broken.end());
    for (const BrokenBridge& b : broken) {
      double back = returned(b.volume, b.imbalance);
      for (const Account& side : accounts(b.sides, grains)) {
        if (side.owner) {
          *side.tally -= back;
          *side.owner += back;
          // What rounding leaves of the tally of the last bridge goes back with it.
          if (std::abs(*side.tally) <= 1e-3 * rounding * back) *side.owner += std::exchange(*side.tally, 0.0);
        }
        back = returned(b.volume, -b.imbalance);
      }
    }
    broken.clear();
  }

  /// Grants what all contacts ask for. `store(request, bridge)` puts a NewBridge into its contact. Collective; requests are used up.
  template <class Request, class Store>
  void form(std::vector<Request>& requests, GrainLiquid grains, Store store) {
    // A contact whose two sides are dry waits for the next step.
    const auto dry = [&](const Request& r) {
      const auto [grain, other, wall] = r.sides;
      if (grains.volume[grain] > 0.0) return false;
      return wall ? !(walls[other].share > 0.0) : other < grains.owned && !(grains.volume[other] > 0.0);
    };
    requests.erase(std::remove_if(requests.begin(), requests.end(), dry), requests.end());
    std::sort(requests.begin(), requests.end());
    grant(requests, grains);
    for (const Request& r : requests) withdraw(r, grains, store);
    requests.clear();
    std::vector<long double> none;
    if (std::any_of(wall_grants_.begin(), wall_grants_.end(), [](double grant) { return grant != 0.0; })) settle_walls(none);
  }

  /// Compares the tallies with the bridges between grains that are really there: `each(visit)` calls visit(i, j, volume, imbalance) for
  /// all of them. What vanished goes back to each side. Returns a grain whose bridges hold `excess` (m^3) more than it gave, or -1.
  template <class EachBridge>
  int reconcile_pairs(GrainLiquid grains, EachBridge each, double& excess) {
    std::vector<double> in_bridges(std::size_t(grains.owned), 0.0);
    each([&](int i, int j, double volume, double imbalance) {
      in_bridges[i] += returned(volume, imbalance);
      if (j < grains.owned) in_bridges[j] += returned(volume, -imbalance);
    });
    for (int i = 0; i < grains.owned; ++i) {
      double& tallied = of_pairs_[i];
      const double back = tallied - in_bridges[i], noise = rounding * std::max(tallied, grains.volume[i]);
      if (back < -noise) {
        excess = -back;
        return i;
      }
      if (back <= noise) continue;
      grains.volume[i] += back;
      tallied = in_bridges[i];
    }
    return -1;
  }

  /// The same for bridges to walls: `each(i, wall, visit)` calls visit(volume, imbalance) for all of grain i to that wall and lets it
  /// change them. Engines move, copy and drop the contacts of a grain that passes from one facet of a mesh to the next: what fell out
  /// goes back as from a broken bridge, what was doubled is scaled down to what was given.
  template <class EachBridge>
  void reconcile_walls(GrainLiquid grains, EachBridge each) {
    for (int i = 0; i < grains.owned; ++i)
      for (std::size_t w = 0; w < walls.size(); ++w) {
        double &of_grain = walls[w].of_grain[i], &own = walls[w].own[i];
        if (of_grain == 0.0 && own == 0.0) continue;
        const double tallied = of_grain + own;
        double in_bridges = 0.0;
        each(i, w, [&](double& volume, double&) { in_bridges += volume; });
        if (in_bridges > 0.0 && std::abs(tallied - in_bridges) <= rounding * in_bridges) continue;
        if (in_bridges > 0.0 && in_bridges > tallied) {
          const double scale = std::max(tallied, 0.0) / in_bridges;
          each(i, w, [&](double& volume, double& imbalance) {
            volume *= scale;
            imbalance *= scale;
          });
          continue;
        }
        const double kept = in_bridges > 0.0 ? in_bridges / tallied : 0.0;
        grains.volume[i] = remaining(grains.volume[i], -(1.0 - kept) * of_grain);
        walls[w].change += (1.0 - kept) * own;
        of_grain *= kept;
        own *= kept;
      }
  }

  struct Totals {
    double grains, bridges, walls;
    long long count;  // of grains
    double held() const { return grains + bridges + walls; }
  };
  /// Of all processes. Collective.
  Totals totals(GrainLiquid grains) {
    std::vector<long double> sums(4, 0.0L);
    for (int i = 0; i < grains.owned; ++i) {
      sums[0] += std::max(grains.volume[i], 0.0);
      each_number(i, [&](double tallied) { sums[1] += tallied; });
    }
    for (const LiquidWall& wall : walls) sums[2] += wall.change;
    sums[3] = grains.owned;
    sum_over_processes(sums);
    double pools = double(sums[2]);
    for (const LiquidWall& wall : walls) pools += wall.pool;
    return {double(sums[0]), double(sums[1]), pools, static_cast<long long>(sums[3])};
  }

  /// Compares what is there with what should be. Less is lost if there are fewer grains than before; else it was changed from outside,
  /// or, within a run, something is wrong: then what is missing (m^3) is returned, otherwise 0. Collective.
  double audit(GrainLiquid grains, bool in_run) {
    const Totals there = totals(grains);
    const double now = there.held(), missing = expected - now;
    double wrong = 0.0;
    if (counted_ < 0) {
      expected = now;
    } else if (there.count < counted_) {
      lost += missing;
      expected = now;
    } else if (std::abs(missing) > 1e-9 * std::max(now, expected)) {
      if (in_run) wrong = missing;
      added -= missing;
      expected = now;
    }
    counted_ = there.count;
    return wrong;
  }

  /// What a restart file or a saved scene has to hold: these sums, the walls and, where they do not travel with the grains, the tallies.
  std::string saved(bool tallies) {
    std::ostringstream text;
    text << std::setprecision(std::numeric_limits<double>::max_digits10) << format << ' ' << lost << ' ' << added << ' ' << expected << ' '
         << counted_ << ' ' << walls.size() << ' ' << (tallies ? of_pairs_.size() : 0);
    for (const LiquidWall& wall : walls)
      text << ' ' << wall.name << ' ' << wall.pool + wall.change << ' ' << wall.share << ' ' << wall.part;
    if (tallies)
      each_tally([&](const std::vector<double>& tally) {
        for (const double number : tally) text << ' ' << number;
      });
    return text.str();
  }
  /// std::runtime_error for what another version saved, and for what is incomplete.
  void restore(const std::string& saved) {
    std::istringstream text(saved);
    std::string found;
    std::size_t wall_count = 0, grains = 0;
    text >> found >> lost >> added >> expected >> counted_ >> wall_count >> grains;
    if (found != format || !text) throw std::runtime_error("the liquid was saved by another version of dembark; start from new files");
    const bool fits = wall_count <= saved.size() && grains <= saved.size();  // each has a character or more
    walls.assign(fits ? wall_count : 0, {});
    for (LiquidWall& wall : walls) text >> wall.name >> wall.pool >> wall.share >> wall.part;
    resize(fits ? grains : 0);
    each_tally([&](std::vector<double>& tally) {
      for (double& number : tally) text >> number;
    });
    if (!fits || !text) throw std::runtime_error("the saved liquid is incomplete: its file is damaged; start from another one");
  }

 private:
  static constexpr const char* format = "liquid-2";
  // Tallies and bridges differ by the rounding of sums only; more than this part of them is a bridge that came or went unseen.
  static constexpr double rounding = 1e-11;

  /// Where a side of a bridge keeps what it owns, and its part of bridges; none of a grain of another process.
  struct Account {
    double *owner = nullptr, *tally = nullptr;
  };
  std::array<Account, 2> accounts(const BridgeSides& sides, GrainLiquid grains) {
    const auto [grain, other, wall] = sides;
    double& own = grains.volume[grain];
    if (wall) return {{{&own, &walls[other].of_grain[grain]}, {&walls[other].change, &walls[other].own[grain]}}};
    return {{{&own, &of_pairs_[grain]}, other < grains.owned ? Account{&grains.volume[other], &of_pairs_[other]} : Account{}}};
  }

  template <class Visit>
  void each_tally(Visit visit) {
    visit(of_pairs_);
    for (LiquidWall& wall : walls) {  // NOLINT(misc-const-correctness): visits change it
      visit(wall.of_grain);
      visit(wall.own);
    }
  }

  /// Fills in what each grain and wall grants per unit share.
  template <class Request>
  void grant(const std::vector<Request>& requests, GrainLiquid grains) {
    // All processes have to know whether any pair asks, and what is asked of each wall.
    std::vector<long double> common(1 + walls.size(), 0.0L);
    if (!requests.empty()) demands_.assign(demands_.size(), 0.0);
    for (const Request& r : requests) {
      demands_[r.sides.grain] += share(r.radius, r.other_radius);
      if (r.sides.wall) {
        common[1 + r.sides.other] += walls[r.sides.other].share;
        continue;
      }
      common[0] = 1.0L;
      if (r.sides.other < grains.owned) demands_[r.sides.other] += share(r.other_radius, r.radius);
    }
    settle_walls(common);
    wall_grants_.clear();
    for (std::size_t w = 0; w < walls.size(); ++w)
      wall_grants_.push_back(walls[w].share * capillary::grant(walls[w].pool, double(common[1 + w])));
    // -1: nothing was asked of this grain where it is owned.
    const bool copies = common[0] != 0.0L && copy_to_others;
    if (copies) grants_.assign(grants_.size(), -1.0);
    for (int i = 0; i < grains.owned && !requests.empty(); ++i)
      if (demands_[i] > 0.0) grants_[i] = capillary::grant(grains.volume[i], demands_[i]);
    if (copies) copy_to_others(grants_);
  }

  template <class Request, class Store>
  void withdraw(const Request& r, GrainLiquid grains, Store& store) {
    const auto [grain, other, wall] = r.sides;
    const double given = share(r.radius, r.other_radius) * grants_[grain];
    NewBridge<double> bridge;
    if (wall) bridge = form_wall_bridge(given, wall_grants_[other], walls[other].part, split, largest_bridge);
    else {
      if (grants_[other] < 0.0) return;  // both owners have to see the contact in the same step
      bridge = form_bridge(given, share(r.other_radius, r.radius) * grants_[other], r.radius, r.other_radius, split, largest_bridge);
    }
    if (!(bridge.volume > 0.0)) return;
    store(r, bridge);
    const auto [own, its] = accounts(r.sides, grains);
    *own.owner = remaining(*own.owner, bridge.from_i);
    *own.tally += returned(bridge.volume, bridge.imbalance);
    if (!its.owner) return;
    *its.owner = wall ? *its.owner - bridge.from_j : remaining(*its.owner, bridge.from_j);
    *its.tally += returned(bridge.volume, -bridge.imbalance);
  }

  /// Puts what all processes gave and took into the pools, and the sums of all into `sums`. Collective.
  void settle_walls(std::vector<long double>& sums) {
    const std::size_t first = sums.size();
    for (LiquidWall& wall : walls) sums.push_back(std::exchange(wall.change, 0.0));
    sum_over_processes(sums);
    for (std::size_t w = 0; w < walls.size(); ++w) walls[w].pool = remaining(walls[w].pool, -double(sums[first + w]));
  }

  std::vector<double> of_pairs_;  // for each grain, its part of its bridges to grains
  std::vector<double> demands_, grants_, wall_grants_;
  long long counted_ = -1;  // grains when liquid was last counted; -1: never
};

}  // namespace dembark::capillary
