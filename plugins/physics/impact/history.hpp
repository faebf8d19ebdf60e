// The history of contacts from step to step: the deformation, the friction spring, whether they were active, and the impact under way.
// That before the last step is kept beside that after it, so that a step can be done again: engines ask for the forces of one moment
// twice where one run ends and the next begins.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "assembly.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

struct ContactHistory {
  bool active = false;
  double deformation = 0.0;  ///< m, of both springs
  double elastic = 0.0;      ///< J, in them and in the friction spring
  FrictionState<double> friction{};
  Vec3<double> normal{};
  Impact impact{};  ///< under way

  /// As a new one.
  bool idle() const { return !active && elastic == 0.0; }

  auto fields() { return std::tie(active, deformation, elastic, friction.displacement, friction.slip, normal, impact); }
};

/// J, in the friction spring.
inline double sheared_energy(const Row& row, const ContactHistory& history) {
  return 0.5 * tangential_stiffness(row) * dot(history.friction.displacement, history.friction.displacement);
}
/// J, in both springs.
inline double elastic_energy(const Row& row, const ContactHistory& history) {
  return 0.5 * row.stiffness * history.deformation * history.deformation + sheared_energy(row, history);
}

/// All that a step leaves to the next.
struct Histories {
  std::vector<Key> keys;  ///< ascending, of the contacts that are not idle
  std::vector<ContactHistory> contacts;
  StepReport report;   ///< its totals
  bool begun = false;  ///< a step has been done

  void add(const Key& key, const ContactHistory& history) {
    keys.push_back(key);
    contacts.push_back(history);
  }
  void clear() {
    keys.clear();
    contacts.clear();
  }
  auto fields() { return std::tie(keys, contacts, report, begun); }
};

/// How far bodies have turned since the first step. Logs in cross-section turn about one axis of coordinates, so the sum of the
/// components of their spin is the spin about it; of bodies that turn about any axis the number means nothing.
class Turns {
 public:
  /// rad, of body number `i` of the last call of turn().
  double operator[](int i) const { return angles_[place_[std::size_t(i)]]; }

  /// elapsed: s, in which the bodies had their spins. New ones begin at 0.
  void turn(const std::vector<Body>& bodies, double elapsed) {
    const std::size_t n = bodies.size();
    bool same = ids_.size() == n && place_.size() == n;
    for (std::size_t i = 0; same && i < n; ++i) same = ids_[place_[i]] == bodies[i].id;
    if (!same) take(bodies);
    for (std::size_t i = 0; i < n; ++i) angles_[place_[i]] += elapsed * (bodies[i].spin.x + bodies[i].spin.y + bodies[i].spin.z);
  }

  auto fields() { return std::tie(ids_, angles_); }

 private:
  void take(const std::vector<Body>& bodies) {
    const Turns before(std::move(*this));
    ids_.clear();
    for (const Body& body : bodies) ids_.push_back(body.id);
    std::sort(ids_.begin(), ids_.end());
    angles_.assign(ids_.size(), 0.0);
    for (std::size_t k = 0; k < ids_.size(); ++k) {
      const std::size_t known = before.find(ids_[k]);
      if (known < before.ids_.size() && before.ids_[known] == ids_[k]) angles_[k] = before.angles_[known];
    }
    place_.clear();
    for (const Body& body : bodies) place_.push_back(find(body.id));
  }
  std::size_t find(std::int64_t id) const { return std::size_t(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin()); }

  std::vector<std::int64_t> ids_;  // in their order, so that a state does not depend on that of the bodies
  std::vector<double> angles_;
  std::vector<std::size_t> place_;  // of each body in these
};

class HistoryKeeper {
 public:
  /// Impacts that have ended, for output.
  std::vector<Impact> finished;
  /// Bodies (ids) of contacts that were active and are not among the candidates any more.
  std::vector<std::int64_t> lost_bodies;

  /// Begins a step. `again`: the last step once more, from the same state. Nothing has happened until commit().
  void begin(bool again) {
    again_ = again;
    cursor_ = 0;
    next_.clear();
  }
  /// What the step begins from.
  const Histories& base() const { return again_ ? before_ : after_; }
  const Histories& last() const { return after_; }

  /// Where in base() the history of a contact is, or -1; fast while keys ascend from call to call.
  int recall(const Key& key) {
    const std::vector<Key>& keys = base().keys;
    const std::size_t n = keys.size();
    if (cursor_ > 0 && !(keys[cursor_ - 1] < key)) cursor_ = 0;
    for (int step = 0; cursor_ < n && keys[cursor_] < key; ++cursor_)
      if (++step > 8) {
        cursor_ = std::size_t(std::lower_bound(keys.begin() + std::ptrdiff_t(cursor_), keys.end(), key) - keys.begin());
        break;
      }
    return cursor_ < n && keys[cursor_] == key ? int(cursor_) : -1;
  }

  /// Tells the rows of the step, with what `recall` said about each, what was before; may be called again with more of them.
  void take(std::vector<Row>& rows) {
    const std::vector<ContactHistory>& contacts = base().contacts;
    lost_bodies.clear();
    left_.assign(contacts.size(), 1);
    for (Row& r : rows) {
      r.before = &blank_;
      if (r.memory >= 0) hand_on(std::size_t(r.memory), r);
    }
    orphans_.clear();
    for (std::size_t o = 0; o < left_.size(); ++o)
      if (left_[o]) orphans_.push_back(o);
    if (!base().begun) deform_overlaps(rows);
    if (!orphans_.empty())
      for (Row& r : rows)
        if (r.b < 0 && !r.lever && r.before == &blank_) inherit(r);
    keep_energies(rows);
    if (orphans_.empty()) return;
    for (const std::size_t o : orphans_) {
      const Key& key = base().keys[o];
      if (!left_[o] || !contacts[o].active) continue;
      lost_bodies.push_back(key.first);
      if (key.second >= 0) lost_bodies.push_back(shown_id(key.second));
    }
  }

  /// The impact of a contact is over. What its springs still hold then (contact damping lets go before they are straight, friction) is
  /// lost as they relax, and is part of its loss.
  void finish(const Key& key, const ContactHistory& history) {
    if (again_) return;  // reported the first time
    Impact& impact = finished.emplace_back(history.impact);
    impact.a = key.first;
    impact.b = key.second;
    impact.dissipated += history.elastic;
  }

  void add(const Key& key, const ContactHistory& history) { next_.add(key, history); }

  /// What is held by contacts that no row has taken on is lost.
  void settle(StepReport& report) {
    for (const std::size_t o : orphans_) {
      if (!left_[o]) continue;
      const ContactHistory& history = base().contacts[o];
      report.dissipated_energy += history.elastic;
      if (history.active) finish(base().keys[o], history);
    }
  }

  /// The histories that were added are those after the step.
  void commit(const StepReport& report) {
    next_.report = report.totals();
    next_.begun = true;
    if (!again_) std::swap(before_, after_);
    std::swap(after_, next_);
  }

  auto fields() { return std::tie(before_, after_, finished); }

 private:
  void hand_on(std::size_t memory, Row& row) {
    row.before = &base().contacts[memory];
    left_[memory] = 0;
  }

  /// Bodies that overlap from the beginning have been deformed before: else contact damping would take the overlap for a sudden blow.
  void deform_overlaps(std::vector<Row>& rows) {
    overlaps_.assign(rows.size(), ContactHistory());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double overlap = -rows[i].gap;
      if (!(overlap > 0.0)) continue;
      overlaps_[i].deformation = overlap;
      overlaps_[i].elastic = 0.5 * rows[i].stiffness * overlap * overlap;
      rows[i].before = &overlaps_[i];
    }
  }

  /// Springs whose stiffness has changed with the share of their contact hold what they held.
  void keep_energies(std::vector<Row>& rows) {
    changed_.clear();
    changed_.reserve(rows.size());  // rows point into it
    for (Row& r : rows) {
      if (!r.lever || r.before == &blank_) continue;
      const double held = elastic_energy(r, *r.before);
      if (held == r.before->elastic || !(held > 0.0)) continue;
      const double part = std::sqrt(r.before->elastic / held);
      ContactHistory& now = changed_.emplace_back(*r.before);
      now.deformation *= part;
      now.friction.displacement *= part;
      r.before = &now;
    }
  }

  /// A body that rolls from one feature of a wall to the next keeps its contact: the new one takes on the history of the one that has
  /// gone and points nearly the same way.
  void inherit(Row& row) {
    int best = -1;
    double closest = 0.9;
    for (const std::size_t o : orphans_) {
      const Key& key = base().keys[o];
      if (!left_[o] || key.first != row.key_a || key.second >= 0 || wall_number(key.second) != wall_number(row.key_b)) continue;
      const double along = dot(base().contacts[o].normal, row.normal);
      if (along > closest) {
        closest = along;
        best = int(o);
      }
    }
    if (best >= 0) hand_on(std::size_t(best), row);
  }

  bool again_ = false;
  Histories before_, after_, next_;
  std::vector<ContactHistory> overlaps_;  ///< see deform_overlaps()
  std::vector<ContactHistory> changed_;   ///< see keep_energies()
  std::size_t cursor_ = 0;                ///< see recall()
  std::vector<char> left_;                ///< of base(): no row has taken it on
  std::vector<std::size_t> orphans_;
  const ContactHistory blank_{};
};

}  // namespace impact
}  // namespace dembark
