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
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "liquid.hpp"

namespace dembark::capillary {

/// The two sides of a contact: a grain, and another grain or a wall by its number.
struct BridgeSides {
  int grain = 0, other = 0;
  bool wall = false;

  bool operator<(const BridgeSides& b) const { return std::tie(wall, grain, other) < std::tie(b.wall, b.grain, b.other); }
};

/// A touching contact without a bridge. Engines derive from it what they need to find the contact again.
struct BridgeRequest {
  BridgeSides sides;
  double radius = 0.0, other_radius = 0.0;  // m; of a wall `flat`

  bool operator<(const BridgeRequest& r) const { return sides < r.sides; }
};

/// A bridge that broke. `imbalance`: as in NewBridge.
struct BrokenBridge {
  BridgeSides sides;
  double volume = 0.0, imbalance = 0.0;

  bool operator<(const BrokenBridge& b) const { return std::tie(sides, volume, imbalance) < std::tie(b.sides, b.volume, b.imbalance); }
};

struct LiquidWall {
  std::string name;
  double pool = 0.0;   // m^3 that it owns
  double share = 0.0;  // 0...1 of that which a new bridge asks for
  double part = 0.0;   // 0...1 of a broken bridge that it gets; with Return::taken what it gave
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

  /// Numbers that belong to a grain and go where it goes.
  std::size_t row_size() const { return 1 + 2 * walls.size(); }
  double* row(int grain) { return &tallies_[std::size_t(grain) * row_size()]; }
  const double* row(int grain) const { return &tallies_[std::size_t(grain) * row_size()]; }
  void clear_row(int grain) { std::fill_n(row(grain), row_size(), 0.0); }
  void resize(std::size_t grains) {
    tallies_.resize(grains * row_size(), 0.0);
    demands_.resize(grains, 0.0);
    grants_.resize(grains, -1.0);
    returned_.resize(walls.size(), 0.0);
  }

  LiquidWall* wall(const std::string& name) {
    const auto found = std::find_if(walls.begin(), walls.end(), [&](const LiquidWall& wall) { return wall.name == name; });
    return found == walls.end() ? nullptr : &*found;
  }

  /// The walls that there are now; new ones are dry. Bridges to walls that are gone belong to their grains, as they will not break.
  void change_walls(const std::vector<std::string>& names, GrainLiquid grains) {
    const std::size_t old_size = row_size();
    const std::vector<double> old = tallies_;
    std::vector<LiquidWall> now;
    std::vector<int> place(walls.size(), -1);  // of the former walls among those of now
    for (const std::string& name : names) {
      const LiquidWall* const known = wall(name);
      if (known) place[std::size_t(known - walls.data())] = int(now.size());
      now.push_back(known ? *known : LiquidWall{name});
    }
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (place[w] >= 0) continue;
      lost += walls[w].pool;
      expected -= walls[w].pool;
    }
    walls = now;
    tallies_.assign(old.size() / old_size * row_size(), 0.0);
    for (int i = 0; i < grains.owned; ++i) {
      const double* from = &old[std::size_t(i) * old_size];
      *row(i) = *from++;
      for (const int w : place) {
        if (w >= 0) std::copy_n(from, 2, row(i) + 1 + 2 * w);
        else grains.volume[i] += from[0] + from[1];
        from += 2;
      }
    }
    returned_.resize(walls.size(), 0.0);
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
    const double* const tally = row(grain);
    double all = grains.volume[grain] + tally[0];
    for (std::size_t w = 0; w < walls.size(); ++w) {
      all += tally[1 + 2 * w];
      returned_[w] += tally[2 + 2 * w];
    }
    lost += all;
    expected -= all;
    if (counted_ > 0) --counted_;
    grains.volume[grain] = 0.0;
    clear_row(grain);
  }

  void give_back(std::vector<BrokenBridge>& broken, GrainLiquid grains) {
    std::sort(broken.begin(), broken.end());
    for (const BrokenBridge& b : broken) {
      const auto [grain, other, wall] = b.sides;
      const double own = returned(b.volume, b.imbalance), its = returned(b.volume, -b.imbalance);
      if (wall) {
        give_back(own, row(grain)[1 + 2 * other], grains.volume[grain]);
        give_back(its, row(grain)[2 + 2 * other], returned_[other]);
        continue;
      }
      give_back(own, *row(grain), grains.volume[grain]);
      if (other < grains.owned) give_back(its, *row(other), grains.volume[other]);
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
    if (grant(requests, grains))
      for (const Request& r : requests) withdraw(r, grains, store);
    for (const int i : asked_) demands_[i] = 0.0;
    asked_.clear();
    requests.clear();
    settle_walls();
  }

  /// Compares the tallies with the bridges between grains that are really there: `each(visit)` calls visit(i, j, volume, imbalance) for
  /// all of them. What vanished goes back to each side. Returns a grain whose bridges hold `excess` more than it gave, or -1.
  template <class EachBridge>
  int reconcile_pairs(GrainLiquid grains, EachBridge each, double& excess) {
    std::vector<double> held(std::size_t(grains.owned), 0.0);
    each([&](int i, int j, double volume, double imbalance) {
      held[i] += returned(volume, imbalance);
      if (j < grains.owned) held[j] += returned(volume, -imbalance);
    });
    for (int i = 0; i < grains.owned; ++i) {
      double& tallied = *row(i);
      const double back = tallied - held[i], noise = rounding * std::max(tallied, grains.volume[i]);
      if (back < -noise) {
        excess = -back / held[i];
        return i;
      }
      if (back <= noise) continue;
      grains.volume[i] += back;
      tallied = held[i];
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
        double* const tally = row(i) + 1 + 2 * w;
        if (tally[0] == 0.0 && tally[1] == 0.0) continue;
        const double tallied = tally[0] + tally[1];
        double held = 0.0;
        each(i, w, [&](double& volume, double&) { held += volume; });
        if (held > 0.0 && std::abs(tallied - held) <= rounding * held) continue;
        if (held > 0.0 && held > tallied) {
          const double scale = std::max(tallied, 0.0) / held;
          each(i, w, [&](double& volume, double& imbalance) {
            volume *= scale;
            imbalance *= scale;
          });
          continue;
        }
        const double kept = held > 0.0 ? held / tallied : 0.0;
        grains.volume[i] = remaining(grains.volume[i], -(1.0 - kept) * tally[0]);
        returned_[w] += (1.0 - kept) * tally[1];
        tally[0] *= kept;
        tally[1] *= kept;
      }
  }

  struct Totals {
    double grains, bridges, walls;
    long long count;  // of grains
  };
  /// Of all processes. Collective.
  Totals totals(GrainLiquid grains) const {
    std::vector<long double> sums(4, 0.0L);
    for (int i = 0; i < grains.owned; ++i) {
      sums[0] += std::max(grains.volume[i], 0.0);
      for (std::size_t k = 0; k < row_size(); ++k) sums[1] += row(i)[k];
    }
    for (const double back : returned_) sums[2] += back;
    sums[3] = grains.owned;
    sum_over_processes(sums);
    double pools = double(sums[2]);
    for (const LiquidWall& wall : walls) pools += wall.pool;
    return {double(sums[0]), double(sums[1]), pools, static_cast<long long>(sums[3])};
  }

  /// Compares what is there with what should be. Less is lost if there are fewer grains than before; else it was changed from outside,
  /// or, within a run, something is wrong: then the missing part of it is returned, otherwise 0. Collective.
  double audit(GrainLiquid grains, bool in_run) {
    const Totals there = totals(grains);
    const double now = there.grains + there.bridges + there.walls, missing = expected - now;
    double wrong = 0.0;
    if (counted_ < 0) {
      expected = now;
    } else if (there.count < counted_) {
      lost += missing;
      expected = now;
    } else if (std::abs(missing) > 1e-9 * std::max(now, expected)) {
      if (in_run) wrong = missing / expected;
      added -= missing;
      expected = now;
    }
    counted_ = there.count;
    return wrong;
  }

  /// What a restart file has to hold besides the names of the walls: these sums, the walls' liquid and, where they do not travel with the
  /// grains, the rows.
  std::vector<double> saved(bool rows) const {
    std::vector<double> numbers{lost, added, expected, double(counted_), double(walls.size())};
    for (std::size_t w = 0; w < walls.size(); ++w)
      numbers.insert(numbers.end(), {walls[w].pool + returned_[w], walls[w].share, walls[w].part});
    if (rows) numbers.insert(numbers.end(), tallies_.begin(), tallies_.end());
    return numbers;
  }
  void restore(const double* numbers, std::size_t count) {
    lost = numbers[0];
    added = numbers[1];
    expected = numbers[2];
    counted_ = static_cast<long long>(numbers[3]);
    walls.clear();
    const double* at = numbers + 5;
    for (std::size_t w = 0; w < static_cast<std::size_t>(numbers[4]); ++w, at += 3) walls.push_back({"", at[0], at[1], at[2]});
    returned_.assign(walls.size(), 0.0);
    tallies_.assign(at, numbers + count);
  }

 private:
  // Tallies and bridges differ by the rounding of sums only; more than this part of them is a bridge that came or went unseen.
  static constexpr double rounding = 1e-11;

  /// What rounding leaves of the tally of the last bridge goes back with it.
  static void give_back(double amount, double& tally, double& owner) {
    tally -= amount;
    owner += amount;
    if (std::abs(tally) > 1e-3 * rounding * amount) return;
    owner += tally;
    tally = 0.0;
  }

  void demand(int grain, double share_of_it) {
    if (demands_[grain] == 0.0) asked_.push_back(grain);
    demands_[grain] += share_of_it;
  }

  /// Fills in what each grain and wall grants per unit share. Returns whether anything was asked for here.
  template <class Request>
  bool grant(const std::vector<Request>& requests, GrainLiquid grains) {
    // All processes have to know whether any pair asks, and of each wall what it got back and what is asked of it.
    const std::size_t n = walls.size();
    std::vector<long double> common(1 + 2 * n, 0.0L);
    for (const Request& r : requests) {
      demand(r.sides.grain, share(r.radius, r.other_radius));
      if (r.sides.wall) {
        common[1 + n + r.sides.other] += walls[r.sides.other].share;
        continue;
      }
      common[0] = 1.0L;
      if (r.sides.other < grains.owned) demand(r.sides.other, share(r.other_radius, r.radius));
    }
    std::copy(returned_.begin(), returned_.end(), common.begin() + 1);
    sum_over_processes(common);
    wall_grants_.assign(n, 0.0);
    taken_.assign(n, 0.0L);
    for (std::size_t w = 0; w < n; ++w) {
      walls[w].pool += double(common[1 + w]);
      wall_grants_[w] = walls[w].share * capillary::grant(walls[w].pool, double(common[1 + n + w]));
      returned_[w] = 0.0;
    }
    // -1: nothing was asked of this grain where it is owned.
    const bool copies = common[0] != 0.0L && copy_to_others;
    if (copies) std::fill(grants_.begin(), grants_.end(), -1.0);
    for (const int i : asked_) grants_[i] = capillary::grant(grains.volume[i], demands_[i]);
    if (copies) copy_to_others(grants_);
    return !requests.empty();
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
    const double own = returned(bridge.volume, bridge.imbalance), its = returned(bridge.volume, -bridge.imbalance);
    grains.volume[grain] = remaining(grains.volume[grain], bridge.from_i);
    if (wall) {
      row(grain)[1 + 2 * other] += own;
      row(grain)[2 + 2 * other] += its;
      taken_[other] += bridge.from_j;
      return;
    }
    row(grain)[0] += own;
    if (other >= grains.owned) return;
    grains.volume[other] = remaining(grains.volume[other], bridge.from_j);
    row(other)[0] += its;
  }

  void settle_walls() {
    if (std::all_of(wall_grants_.begin(), wall_grants_.end(), [](double grant) { return grant == 0.0; })) return;
    sum_over_processes(taken_);
    for (std::size_t w = 0; w < walls.size(); ++w) walls[w].pool = remaining(walls[w].pool, double(taken_[w]));
  }

  std::vector<double> tallies_, demands_, grants_, returned_, wall_grants_;
  std::vector<long double> taken_;
  std::vector<int> asked_;
  long long counted_ = -1;  // grains when liquid was last counted; -1: never
};

}  // namespace dembark::capillary
