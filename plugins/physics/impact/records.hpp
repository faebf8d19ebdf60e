// What contacts remember from step to step: the deformation, the friction spring, whether they were active, and the impact that is
// under way. Two levels are kept, before and after the last step, so that a step can be done again: engines ask for the forces of one
// moment twice where one run ends and the next begins.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "assembly.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

struct Memory {
  bool active = false;
  double deformation = 0.0;          ///< m, of both springs
  double elastic = 0.0;              ///< J, in them and in the friction spring
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
    for (double* p : {&deformation, &elastic, &friction.displacement.x, &friction.displacement.y, &friction.displacement.z, &friction.slip,
                      &normal.x, &normal.y, &normal.z, &time, &duration, &peak_force, &impulse, &relative_speed, &dissipated,
                      &place.x, &place.y, &place.z})
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
  /// Memory before and after the step, in the order of the rows.
  std::vector<Memory> before, now;
  Totals totals_before, totals;
  /// Bodies (ids) of contacts that were active and are not among the candidates any more.
  std::vector<std::int64_t> lost_bodies;

  /// Begins a step with these rows. `again`: the last step once more, from the same state.
  void begin(const std::vector<Row>& rows, bool again) {
    again_ = again;
    lost_bodies.clear();
    if (again) totals = totals_before;
    else {
      totals_before = totals;
      before.swap(now);
    }
    bool same = rows.size() == keys_.size();
    for (std::size_t i = 0; same && i < rows.size(); ++i) same = keys_[i] == Key(rows[i].key_a, rows[i].key_b);
    if (!same) match(rows);
    now.resize(rows.size());
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
      Memory m = before[i], n = now[i];
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
    before.assign(n, Memory());
    now.assign(n, Memory());
    finished_.assign(f, Impact());
    for (std::size_t i = 0; i < n; ++i) {
      double a = 0.0, b = 0.0;
      get(a);
      get(b);
      keys_[i] = Key(std::int64_t(a), std::int64_t(b));
      before[i].each(get);
      now[i].each(get);
    }
    for (Impact& i : finished_) each(i, get);
  }

 private:
  using Key = std::pair<std::int64_t, std::int64_t>;

  template <class Visit>
  static void each(Impact& f, Visit visit) {
    double a = double(f.a), b = double(f.b);
    visit(a);
    visit(b);
    f.a = std::int64_t(a);
    f.b = std::int64_t(b);
    for (double* p : {&f.time, &f.duration, &f.peak_force, &f.impulse, &f.relative_speed, &f.place.x, &f.place.y, &f.place.z,
                      &f.dissipated})
      visit(*p);
  }

  /// Carries the memory over to a new list of contacts; both lists are sorted by their keys.
  void match(const std::vector<Row>& rows) {
    scratch_.assign(rows.size(), Memory());
    orphans_.clear();
    fresh_.clear();
    std::size_t k = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Key key(rows[i].key_a, rows[i].key_b);
      while (k < keys_.size() && keys_[k] < key) orphans_.push_back(k++);
      if (k < keys_.size() && keys_[k] == key) scratch_[i] = before[k++];
      else if (rows[i].b < 0) fresh_.push_back(i);
    }
    while (k < keys_.size()) orphans_.push_back(k++);
    for (const std::size_t i : fresh_) inherit(rows[i], scratch_[i]);
    for (const std::size_t o : orphans_) {
      if (o == taken || before[o].elastic == 0.0) continue;
      const Memory& m = before[o];
      totals.dissipated += m.elastic;
      if (!m.active) continue;
      finish(keys_[o].first, keys_[o].second, m);
      lost_bodies.push_back(keys_[o].first);
      if (keys_[o].second >= 0) lost_bodies.push_back(keys_[o].second);
    }
    keys_.resize(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) keys_[i] = Key(rows[i].key_a, rows[i].key_b);
    before.swap(scratch_);
  }

  /// A body that rolls from one feature of a wall to the next keeps its contact: the new one takes the memory of the one that has gone
  /// and points nearly the same way.
  void inherit(const Row& row, Memory& memory) {
    std::size_t best = taken;
    double closest = 0.9;
    for (std::size_t& o : orphans_) {
      if (o == taken || keys_[o].first != row.key_a || keys_[o].second >= 0 || before[o].elastic == 0.0) continue;
      if (wall_number(keys_[o].second) != wall_number(row.key_b)) continue;
      const double along = dot(before[o].normal, row.normal);
      if (along > closest) {
        closest = along;
        best = std::size_t(&o - orphans_.data());
      }
    }
    if (best == taken) return;
    memory = before[orphans_[best]];
    orphans_[best] = taken;
  }

  static constexpr std::size_t taken = std::numeric_limits<std::size_t>::max();
  bool again_ = false;
  std::vector<Key> keys_;
  std::vector<Memory> scratch_;
  std::vector<std::size_t> orphans_, fresh_;
  std::vector<Impact> finished_;
};

}  // namespace impact
}  // namespace dembark
