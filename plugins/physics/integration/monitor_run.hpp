// What `fix integration/monitor` of LIGGGHTS and of LAMMPS does alike: its words, the tallies of all ranks, its rows, and what goes into
// restart files. The engines bring accelerations, contacts and the pairs that meet.
#pragma once

#include <mpi.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "monitor.hpp"
#include "shadow_impact.hpp"

namespace dembark {

/// Numbers that a monitored body keeps.
constexpr int monitor_history_numbers = sizeof(AccelerationHistory) / sizeof(double);
static_assert(monitor_history_numbers * sizeof(double) == sizeof(AccelerationHistory));

/// Binary impacts that are integrated anew. All ranks have all of them; the one that owns the body with the lower number follows it.
class ShadowImpacts {
 public:
  explicit ShadowImpacts(MPI_Comm world) : world_(world) {}

  /// What follow() needs to know of a pair.
  struct Meeting {
    bool here = false;    ///< this rank owns the first body
    bool judged = false;  ///< the second is there, and the same weight acts on both
    ContactBodies bodies{};
    Vec3<double> gravity{};  ///< m/s^2
  };

  /// Takes up those that began on this rank. Collective.
  void add(const std::vector<ShadowImpact>& mine) {
    int ranks = 1;
    MPI_Comm_size(world_, &ranks);
    const int own = int(mine.size() * sizeof(ShadowImpact));
    std::vector<int> counts(std::size_t(ranks), 0), offsets(std::size_t(ranks), 0);
    MPI_Allgather(&own, 1, MPI_INT, counts.data(), 1, MPI_INT, world_);
    for (std::size_t r = 1; r < counts.size(); ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
    std::vector<ShadowImpact> all(std::size_t(offsets.back() + counts.back()) / sizeof(ShadowImpact));
    if (all.empty()) return;
    MPI_Allgatherv(mine.data(), own, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE, world_);
    shadows_.insert(shadows_.end(), all.begin(), all.end());
    over_.resize(shadows_.size(), 0);
  }

  /// A step of `step` s later.
  void follow(double step, StepMonitor& monitor, const std::function<Meeting(const ShadowImpact&)>& meeting) {
    for (std::size_t k = 0; k < shadows_.size(); ++k) {
      if (over_[k]) continue;
      ShadowImpact& shadow = shadows_[k];
      const Meeting now = meeting(shadow);
      if (!now.here) {
        shadow.wait(step);
        over_[k] = shadow.lasts_too_long(step);
        continue;
      }
      double found = 0.0;
      const auto stage = now.judged ? shadow.follow(now.bodies, now.gravity, step, found) : ShadowImpact::Stage::dropped;
      over_[k] = stage != ShadowImpact::Stage::going_on;
      if (stage == ShadowImpact::Stage::compared) monitor.take_impact(found, shadow.one);
    }
  }

  /// Those that have ended go. Collective.
  void drop() {
    if (shadows_.empty()) return;
    MPI_Allreduce(MPI_IN_PLACE, over_.data(), int(over_.size()), MPI_INT, MPI_MAX, world_);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < shadows_.size(); ++k)
      if (!over_[k]) shadows_[kept++] = shadows_[k];
    restore(std::vector<ShadowImpact>(shadows_.begin(), shadows_.begin() + std::ptrdiff_t(kept)));
  }

  const std::vector<ShadowImpact>& all() const { return shadows_; }
  void restore(std::vector<ShadowImpact> shadows) {
    shadows_ = std::move(shadows);
    over_.assign(shadows_.size(), 0);
  }

 private:
  MPI_Comm world_;
  std::vector<ShadowImpact> shadows_;  // the same on all ranks
  std::vector<int> over_;              // which of them have ended, as far as this rank knows
};

class MonitorRun {
 public:
  StepMonitor monitor;
  bool mean_length = true;  ///< errors of positions are measured by the mean diameter of the group
  long rows = 0;            ///< steps of the deck between two rows of `adapt`
  long impacts = 0;         ///< every how many an impact is integrated anew; 0: none
  ShadowImpacts shadows;

  /// From the words of the command. Throws std::invalid_argument with one line.
  MonitorRun(const std::vector<std::string>& words, MPI_Comm world) : shadows(world), world_(world) {
    MPI_Comm_size(world, &ranks_);
    MPI_Comm_rank(world, &rank_);
    MonitorSettings& s = monitor.settings;
    s.scales.length = 1.0;
    for (std::size_t k = 0; k < words.size(); ++k) {
      const std::string& word = words[k];
      if (word == "speed") s.scales.speed = number(words, k);
      else if (word == "length") {
        s.scales.length = number(words, k);
        mean_length = false;
      } else if (word == "limit") s.scales.limit = number(words, k);
      else if (word == "contact_steps") s.least_steps = number(words, k);
      else if (word == "every") s.every = whole(words, k);
      else if (word == "impacts") {
        impacts = whole(words, k);
        if (impacts < 0) refuse("impacts must be 0 (none) or more: every how many an impact is integrated anew");
      } else if (word == "rows") {
        rows = whole(words, k);
        if (rows < 1) refuse("rows must be 1 step or more");
      } else if (word == "action") {
        const std::string value = ++k < words.size() ? words[k] : "";
        if (!option_from_name(monitor_action_names(), value, s.action))
          refuse("action '" + value + "' is unknown; it can be report, warn, stop, adapt");
      } else refuse("keyword '" + word + "' is unknown; it can be speed, length, limit, every, contact_steps, impacts, action, rows");
    }
    if (s.scales.speed == 0.0) refuse("it needs 'speed V', the speed (m/s) that errors of velocities are measured by");
    if (const char* const wrong = s.error()) refuse(wrong);
    if (s.action == MonitorAction::adapt && rows == 0) refuse("action adapt needs 'rows N': steps of the deck between two rows of output");
    if (s.action != MonitorAction::adapt && rows > 0) refuse("rows belongs to action adapt");
  }

  /// Lengths (m) are over the mean of the diameters whose sum and number on this rank these are. False where there are none. Collective.
  bool measure_length(double sum, double count) {
    double mine[] = {sum, count}, all[2];
    MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world_);
    if (all[1] == 0.0) return false;
    monitor.settings.scales.length = all[0] / all[1];
    mean_length = false;
    return true;
  }

  /// At the beginning of a run in step n, with the step h (s) of the engine; then step() is the one to take. What the script has set since
  /// the last run is the new step of the deck.
  void begin(double h, long n) {
    if (state_.step == 0.0 || h != step()) {
      if (h != state_.step) state_.level = 0;
      state_.step = h;
    }
    if (rows > 0 && state_.next_row <= double(n)) state_.next_row = double(n) + std::ldexp(rows, int(state_.level));
  }
  double step() const { return std::ldexp(state_.step, -int(state_.level)); }  ///< s, of the steps to come

  /// At the end of step n: where a row ends, step() may be another from here on. Collective.
  void end_step(long n) {
    merged_at_ = -1;
    if (rows == 0 || double(n) < state_.next_row) return;
    state_.level = adapted_level(merged(false), monitor.settings, int(state_.level));
    monitor.close_row();
    state_.next_row = double(n) + std::ldexp(rows, int(state_.level));
  }

  /// One line for each kind of finding that is made for the first time. `body`: what the engine calls a body. Collective.
  std::vector<std::string> new_findings(long n, const std::string& body) {
    const MonitorAction action = monitor.settings.action;
    if (action != MonitorAction::warn && action != MonitorAction::stop) return {};
    int mine = 0, found = 0;
    for (int kind = 0; kind < monitor_kinds; ++kind)
      if (finding(monitor.row, monitor.settings, kind)) mine |= 1 << kind;
    MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_BOR, world_);
    found &= ~int(state_.said);
    if (!found) return {};
    state_.said |= found;
    const MonitorTally all = merged(false);
    std::vector<std::string> lines;
    for (int kind = 0; kind < monitor_kinds; ++kind)
      if (found >> kind & 1) lines.push_back("at step " + std::to_string(n) + ' ' + finding_text(all, monitor.settings, kind, body));
    return lines;
  }

  static constexpr int figures = 24;
  static constexpr int energy_error = 16;  ///< the engine's: step error of an energy account over what was turned over
  /// Figure k, from 0 on, at the end of step n. Collective.
  double figure(int k, long n) {
    if (merged_at_ != n) merged_ = merged(true);
    merged_at_ = n;
    const ErrorTally* const errors[] = {&merged_.errors.position, &merged_.errors.velocity, &merged_.errors.spin};
    if (k < 12) {
      const ErrorTally& e = *errors[k / 4];
      const double values[] = {e.largest, e.rms(), double(e.body), e.exceeded};
      return values[k % 4];
    }
    switch (k) {
      case 12: return errors[0]->count;
      case 13: return std::isinf(merged_.contact.steps) ? 0.0 : merged_.contact.steps;
      case 14: return double(merged_.contact.one);
      case 15: return double(merged_.contact.two);
      case 17: return step();
      case 18: return double(state_.level);
      case 19: return state_.next_row;
      case 20: return merged_.impacts.count;
      case 21: return merged_.impacts.largest;
      case 22: return merged_.impacts.rms();
      case 23: return double(merged_.impacts.body);
      default: return 0.0;
    }
  }
  /// The tallies of each rank by themselves: a run that goes on adds to the same ones. Empty on all ranks but the first. Collective.
  std::vector<double> saved() {
    shadows.drop();
    State mine = state_;
    mine.run = monitor.run;
    mine.row = monitor.row;
    std::vector<State> all(std::size_t(ranks_), State{});
    MPI_Gather(&mine, int(sizeof mine), MPI_BYTE, all.data(), int(sizeof mine), MPI_BYTE, 0, world_);
    if (rank_ != 0) return {};
    const std::vector<ShadowImpact>& impacts_now = shadows.all();
    std::vector<double> out{double(ranks_), double(sizeof(State)), double(impacts_now.size()), monitor.settings.scales.length};
    append(out, all);
    append(out, impacts_now);
    return out;
  }
  /// On another number of ranks the first has the tallies of all. What another version wrote is left.
  void restore(const char* buffer) {
    double head[4];
    std::memcpy(head, buffer, sizeof head);
    if (head[1] != double(sizeof(State))) return;
    if (mean_length) monitor.settings.scales.length = head[3];
    mean_length = false;
    std::vector<State> all(std::size_t(head[0]), State{});
    std::vector<ShadowImpact> impacts_then(static_cast<std::size_t>(head[2]));
    std::memcpy(static_cast<void*>(all.data()), buffer + sizeof head, all.size() * sizeof(State));
    std::memcpy(static_cast<void*>(impacts_then.data()), buffer + sizeof head + all.size() * sizeof(State),
                impacts_then.size() * sizeof(ShadowImpact));
    shadows.restore(std::move(impacts_then));
    state_ = all[0];
    monitor.run = monitor.row = {};
    for (int r = 0; r < int(all.size()); ++r)
      if (int(all.size()) == ranks_ ? r == rank_ : rank_ == 0) {
        monitor.run.merge(all[std::size_t(r)].run);
        monitor.row.merge(all[std::size_t(r)].row);
      }
  }

 private:
  /// What goes on over runs and restarts, the same on all ranks but for the tallies.
  struct State {
    MonitorTally run{}, row{};
    double step = 0.0;       // s, of the deck
    double next_row = -1.0;  // its step
    std::int64_t level = 0;  // the step in use is that of the deck over 2^level
    std::int64_t said = 0;   // bits of the kinds of findings that were told
  };

  template <class T>
  static void append(std::vector<double>& out, const std::vector<T>& what) {
    static_assert(sizeof(T) % sizeof(double) == 0);
    const std::size_t before = out.size();
    out.resize(before + what.size() * (sizeof(T) / sizeof(double)));
    std::memcpy(out.data() + before, what.data(), what.size() * sizeof(T));
  }

  [[noreturn]] static void refuse(const std::string& line) { throw std::invalid_argument(line); }
  static double number(const std::vector<std::string>& words, std::size_t& k) {
    const std::string& word = words[k];
    char* end = nullptr;
    const double value = ++k < words.size() ? std::strtod(words[k].c_str(), &end) : 0.0;
    if (!end || *end || words[k].empty())
      refuse("after " + word + " there must be a number" + (k < words.size() ? ", not '" + words[k] + "'" : ""));
    return value;
  }
  static long whole(const std::vector<std::string>& words, std::size_t& k) {
    const std::string& word = words[k];
    const double value = number(words, k);
    if (value != std::floor(value) || std::abs(value) > 1e9) refuse(word + " must be a whole number of steps, not '" + words[k] + "'");
    return long(value);
  }

  /// The ranks' in their order, so that all have the same bits. Collective.
  MonitorTally merged(bool whole_run) const {
    const MonitorTally mine = whole_run ? monitor.all() : monitor.row;
    std::vector<MonitorTally> each(std::size_t(ranks_), MonitorTally{});
    MPI_Allgather(&mine, int(sizeof mine), MPI_BYTE, each.data(), int(sizeof mine), MPI_BYTE, world_);
    MonitorTally all;
    for (const MonitorTally& one : each) all.merge(one);
    return all;
  }

  MPI_Comm world_;
  int ranks_ = 1, rank_ = 0;
  State state_;
  long merged_at_ = -1;
  MonitorTally merged_;
};

}  // namespace dembark
