// What contacts remember from step to step: the deformation, the friction spring, whether they were active, and the impact that is
// under way. Two levels are kept, before and after the last step, so that a step can be done again: engines ask for the forces of one
// moment twice where one run ends and the next begins.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "assembly.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

struct Memory {
  bool active = false;
  double deformation = 0.0;  ///< m, of both springs
  double elastic = 0.0;      ///< J, in them and in the friction spring
  FrictionState<double> friction{};
  Vec3<double> normal{};
  // the impact under way
  double time = 0.0, duration = 0.0, peak_force = 0.0, impulse = 0.0, relative_speed = 0.0, dissipated = 0.0;
  Vec3<double> place{};

  /// Nothing to remember; all else is as in a new one then.
  bool idle() const { return !active && elastic == 0.0; }

  /// Calls visit(double&) for everything, for saving and loading.
  template <class Visit>
  void each(Visit visit) {
    double flag = active ? 1.0 : 0.0;
    visit(flag);
    active = flag != 0.0;
    for (double* p :
         {&deformation, &elastic, &friction.displacement.x, &friction.displacement.y, &friction.displacement.z, &friction.slip, &normal.x,
          &normal.y, &normal.z, &time, &duration, &peak_force, &impulse, &relative_speed, &dissipated, &place.x, &place.y, &place.z})
      visit(*p);
  }
};

/// Running totals, in both levels too.
struct Totals {
  double impacts_begun = 0.0, pivots = 0.0, impulse = 0.0, peak_force = 0.0, dissipated = 0.0, certificate = 0.0;
  template <class Visit>
  void each(Visit visit) {
    for (double* p : {&impacts_begun, &pivots, &impulse, &peak_force, &dissipated, &certificate}) visit(*p);
  }
};

class Records {
 public:
  /// Memory after the step, in the order of the rows.
  std::vector<Memory> now;
  Totals totals_before, totals;
  /// Bodies (ids) of contacts that were active and are not among the candidates any more.
  std::vector<std::int64_t> lost_bodies;

  /// Memory before the step of row i.
  const Memory& before(std::size_t i) const { return from_[i] >= 0 ? prior_[std::size_t(from_[i])] : blank_; }
  /// The same, to be changed.
  Memory& remember(std::size_t i) {
    if (from_[i] < 0) {
      from_[i] = int(prior_.size());
      prior_.emplace_back();
    }
    return prior_[std::size_t(from_[i])];
  }

  /// Begins a step. `again`: the last step once more, from the same state.
  void begin(bool again) {
    again_ = again;
    cursor_ = 0;
    kept_totals_ = {totals_before, totals};
    kept_from_ = from_;
    if (again) {
      kept_ = now;
      totals = totals_before;
      now.clear();
      for (std::size_t i = 0; i < keys_.size(); ++i) now.push_back(before(i));
      prior_.swap(now);
      prior_keys_ = keys_;
      return;
    }
    totals_before = totals;
    prior_.swap(now);
    prior_keys_.swap(keys_);
  }

  /// Takes begin() and take() back.
  void cancel() {
    std::tie(totals_before, totals) = kept_totals_;
    from_.swap(kept_from_);
    if (again_) {
      now.swap(kept_);
      keys_ = prior_keys_;
      from_.resize(keys_.size());
      std::iota(from_.begin(), from_.end(), 0);
      return;
    }
    prior_.swap(now);
    prior_keys_.swap(keys_);
  }

  /// Where something is remembered of a contact, or -1; fast while keys ascend from call to call.
  int recall(const Key& key) {
    const std::size_t n = prior_keys_.size();
    if (cursor_ > 0 && !(prior_keys_[cursor_ - 1] < key)) cursor_ = 0;
    for (int step = 0; cursor_ < n && prior_keys_[cursor_] < key; ++cursor_)
      if (++step > 8) {
        const auto from = prior_keys_.begin() + std::ptrdiff_t(cursor_);
        cursor_ = std::size_t(std::lower_bound(from, prior_keys_.end(), key) - prior_keys_.begin());
        break;
      }
    return cursor_ < n && prior_keys_[cursor_] == key && !prior_[cursor_].idle() ? int(cursor_) : -1;
  }

  /// The rows of the step, with what `recall` said about each; may be called again with more of them.
  void take(const std::vector<Sorted>& sorted, const std::vector<Row>& rows) {
    lost_bodies.clear();
    keys_.resize(sorted.size());
    from_.resize(sorted.size());
    left_.assign(prior_keys_.size(), 1);
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      keys_[i] = sorted[i].key;
      from_[i] = sorted[i].memory;
      if (from_[i] >= 0) left_[std::size_t(from_[i])] = 0;
    }
    orphans_.clear();
    for (std::size_t o = 0; o < left_.size(); ++o)
      if (left_[o] && prior_[o].elastic != 0.0) orphans_.push_back(o);
    if (orphans_.empty()) return;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (rows[i].b < 0 && from_[i] < 0) inherit(i, rows[i]);
    for (const std::size_t o : orphans_) {
      if (!left_[o] || !prior_[o].active) continue;
      lost_bodies.push_back(prior_keys_[o].first);
      if (prior_keys_[o].second >= 0) lost_bodies.push_back(prior_keys_[o].second);
    }
  }

  /// The rows are those of the step: makes room for what they will remember, and books what memories held that no row has taken.
  void settle() {
    now.resize(keys_.size());
    for (const std::size_t o : orphans_) {
      if (!left_[o]) continue;
      totals.dissipated += prior_[o].elastic;
      if (prior_[o].active) finish(prior_keys_[o].first, prior_keys_[o].second, prior_[o]);
    }
  }

  /// The impact of `memory` is over. What the springs still hold then (contact damping lets go before they are straight, friction) is
  /// lost as they relax, and is part of its loss.
  void finish(std::int64_t a, std::int64_t b, const Memory& memory) {
    if (again_) return;  // reported the first time
    finished_.push_back({a, b, memory.time, memory.duration, memory.peak_force, memory.impulse, memory.relative_speed, memory.place,
                         memory.dissipated + memory.elastic});
  }

  std::vector<Impact> take_finished() {
    std::vector<Impact> out;
    out.swap(finished_);
    return out;
  }

  /// Appends everything to `out`.
  void save(std::vector<double>& out) const {
    const auto put = [&](double& x) { out.push_back(x); };
    out.push_back(double(keys_.size()));
    out.push_back(double(finished_.size()));
    Totals t = totals_before, u = totals;
    t.each(put);
    u.each(put);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      out.push_back(double(keys_[i].first));
      out.push_back(double(keys_[i].second));
      Memory m = before(i), n = now[i];
      m.each(put);
      n.each(put);
    }
    for (Impact f : finished_) each(f, put);
  }

  /// Takes everything back from `in` at `at`, which moves behind it.
  void load(const std::vector<double>& in, std::size_t& at) {
    const auto get = [&](double& x) {
      if (at >= in.size())
        throw std::invalid_argument("impact state: " + std::to_string(in.size()) + " numbers are too few for what it says it holds");
      x = in[at++];
    };
    const auto count = [&] {
      double n = -1.0;
      get(n);
      if (!(n >= 0.0 && n <= double(in.size()))) throw std::invalid_argument("impact state: not written by this version of dembark");
      return std::size_t(n);
    };
    const std::size_t n = count(), f = count();
    totals_before.each(get);
    totals.each(get);
    keys_.assign(n, Key());
    prior_.assign(n, Memory());
    from_.resize(n);
    std::iota(from_.begin(), from_.end(), 0);
    now.assign(n, Memory());
    finished_.assign(f, Impact());
    for (std::size_t i = 0; i < n; ++i) {
      double a = 0.0, b = 0.0;
      get(a);
      get(b);
      keys_[i] = Key(std::int64_t(a), std::int64_t(b));
      prior_[i].each(get);
      now[i].each(get);
    }
    for (Impact& i : finished_) each(i, get);
  }

 private:
  template <class Visit>
  static void each(Impact& f, Visit visit) {
    double a = double(f.a), b = double(f.b);
    visit(a);
    visit(b);
    f.a = std::int64_t(a);
    f.b = std::int64_t(b);
    for (double* p :
         {&f.time, &f.duration, &f.peak_force, &f.impulse, &f.relative_speed, &f.place.x, &f.place.y, &f.place.z, &f.dissipated})
      visit(*p);
  }

  /// A body that rolls from one feature of a wall to the next keeps its contact: the new one takes the memory of the one that has gone
  /// and points nearly the same way.
  void inherit(std::size_t i, const Row& row) {
    int best = -1;
    double closest = 0.9;
    for (const std::size_t o : orphans_) {
      const Key& key = prior_keys_[o];
      if (!left_[o] || key.first != row.key_a || key.second >= 0 || wall_number(key.second) != wall_number(row.key_b)) continue;
      const double along = dot(prior_[o].normal, row.normal);
      if (along > closest) {
        closest = along;
        best = int(o);
      }
    }
    if (best < 0) return;
    from_[i] = best;
    left_[std::size_t(best)] = 0;
  }

  bool again_ = false;
  std::vector<Key> keys_, prior_keys_;  ///< of the rows of the step, and of the one before
  std::vector<Memory> prior_;           ///< memory before the step; see from_
  std::vector<Memory> kept_;            ///< for cancel()
  std::pair<Totals, Totals> kept_totals_;
  std::vector<int> kept_from_;  ///< likewise
  std::vector<int> from_;       ///< of each row its place there, -1: nothing is remembered
  std::size_t cursor_ = 0;      ///< see recall()
  std::vector<char> left_;      ///< memories that no row has taken
  std::vector<std::size_t> orphans_;
  std::vector<Impact> finished_;
  Memory blank_;
};

}  // namespace impact
}  // namespace dembark
