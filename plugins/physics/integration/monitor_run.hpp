// A monitor over the runs of an engine, the same in all of them: what its command says, the intervals of `adapt`, what was found, its
// figures, and what restart files keep. The engines bring accelerations, contacts, and the pairs whose impacts are integrated anew.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../archive.hpp"
#include "../keyword_reader.hpp"
#include "monitor.hpp"
#include "shadow_impact.hpp"

namespace dembark {

/// Numbers that a monitored body keeps.
constexpr int monitor_history_numbers = sizeof(AccelerationHistory) / sizeof(double);
static_assert(monitor_history_numbers * sizeof(double) == sizeof(AccelerationHistory));

/// What a monitor is to do.
struct MonitorCommand {
  MonitorSettings settings{{1.0, 0.0, 1e-2}};
  bool mean_length = true;  ///< errors of positions are measured by the mean diameter of the spheres
  long rows = 0;            ///< nominal time steps in an interval of `adapt`
  long impacts = 0;         ///< every how many an impact is integrated anew; 0: none

  [[noreturn]] static void refuse(const std::string& line) { throw std::invalid_argument(line); }
  void set_action(const std::string& word) {
    if (!option_from_name(monitor_action_names(), word, settings.action))
      refuse("action '" + word + "' is unknown; it can be " + names_text(monitor_action_names()));
  }
  /// Throws std::invalid_argument with one line about what is wrong.
  void check() const {
    if (settings.scales.speed == 0.0) refuse("it needs 'speed', the speed (m/s) that errors of velocities are measured by");
    if (const char* const wrong = settings.error()) refuse(wrong);
    if (impacts < 0) refuse("impacts must be 0 (none) or more, not " + std::to_string(impacts));
    const bool adapts = settings.action == MonitorAction::adapt;
    if (adapts && rows < 1)
      refuse("action 'adapt' needs 'rows', the number (1 or more) of nominal time steps from one change of the step to the next");
    if (!adapts && rows != 0) refuse("rows belongs to action adapt");
  }

  /// From the words of `fix ID group integration/monitor ...`. Throws std::invalid_argument with one line.
  static MonitorCommand read(const std::vector<std::string>& words) {
    MonitorCommand command;
    MonitorSettings& s = command.settings;
    keywords::Reader in(words);
    while (in.left()) {
      const std::string word = in.word("", ""), value = "the value";
      if (word == "speed") s.scales.speed = in.number(word, value);
      else if (word == "length") {
        s.scales.length = in.number(word, value);
        command.mean_length = false;
      } else if (word == "limit") s.scales.limit = in.number(word, value);
      else if (word == "contact_steps") s.least_steps = in.number(word, value);
      else if (word == "every") s.every = in.integer(word, value);
      else if (word == "impacts") command.impacts = in.integer(word, value);
      else if (word == "rows") command.rows = in.integer(word, value);
      else if (word == "action") command.set_action(in.word(word, value));
      else refuse("keyword '" + word + "' is unknown; it can be speed, length, limit, every, contact_steps, impacts, action, rows");
    }
    command.check();
    return command;
  }
};

/// Binary impacts that are integrated anew. All processes have all of them; the one that owns the body with the lower number follows it.
class ShadowImpacts {
 public:
  /// What follow() needs to know of a pair.
  struct Meeting {
    bool here = false;    ///< this process owns the first body
    bool judged = false;  ///< the second is there, and the same weight acts on both
    ContactBodies bodies{};
    Vec3<double> gravity{};  ///< m/s^2
  };

  void add(const std::vector<ShadowImpact>& begun) {
    shadows_.insert(shadows_.end(), begun.begin(), begun.end());
    over.resize(shadows_.size(), 0);
  }

  /// A step of `step` s later.
  void follow(double step, StepMonitor& monitor, const std::function<Meeting(const ShadowImpact&)>& meeting) {
    for (std::size_t k = 0; k < shadows_.size(); ++k) {
      if (over[k]) continue;
      ShadowImpact& shadow = shadows_[k];
      const Meeting now = meeting(shadow);
      if (!now.here) {
        shadow.wait(step);
        over[k] = shadow.lasts_too_long(step);
        continue;
      }
      double found = 0.0;
      const auto stage = now.judged ? shadow.follow(now.bodies, now.gravity, step, found) : ShadowImpact::Stage::dropped;
      over[k] = stage != ShadowImpact::Stage::going_on;
      if (stage == ShadowImpact::Stage::compared) monitor.take_impact(found, shadow.one);
    }
  }

  /// Those that are over go.
  void drop() {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < shadows_.size(); ++k)
      if (!over[k]) shadows_[kept++] = shadows_[k];
    shadows_.resize(kept);
    over.assign(kept, 0);
  }

  const std::vector<ShadowImpact>& all() const { return shadows_; }
  void restore(std::vector<ShadowImpact> shadows) {
    shadows_ = std::move(shadows);
    over.assign(shadows_.size(), 0);
  }

  std::vector<int> over;  ///< which of them have ended, as far as this process knows

 private:
  std::vector<ShadowImpact> shadows_;  // the same on all processes
};

class MonitorRun {
 public:
  StepMonitor monitor;
  bool mean_length = true;     ///< errors of positions wait for measure_length()
  long rows = 0, impacts = 0;  ///< see MonitorCommand
  ShadowImpacts shadows;
  /// Of many processes: makes the tally of this one that of all, with the same bits on each.
  std::function<void(MonitorTally&)> merge_processes = [](MonitorTally&) {};

  MonitorRun() = default;
  explicit MonitorRun(const MonitorCommand& command) : mean_length(command.mean_length) { set(command); }

  /// A command for the steps to come. A mean length that was measured stays.
  void set(const MonitorCommand& command) {
    const double length = mean_length ? command.settings.scales.length : monitor.settings.scales.length;
    monitor.settings = command.settings;
    if (command.mean_length) monitor.settings.scales.length = length;
    rows = command.rows;
    impacts = command.impacts;
  }

  /// Lengths (m) are over the mean of the diameters whose sum and number these are. Throws std::invalid_argument where there are none.
  void measure_length(double sum, double count) {
    if (count == 0.0) MonitorCommand::refuse("there are no spheres yet whose mean diameter could be taken; give 'length' (m)");
    monitor.settings.scales.length = sum / count;
    mean_length = false;
  }

  /// From here on steps are of h (s).
  void take_step(double h) {
    state_.step = h;
    state_.level = 0;
  }
  /// At the beginning of a run in step n, with the step h (s) of the engine; then step() is the one to take. What the script has set since
  /// the last run is the new nominal time step.
  void begin(double h, long n) {
    if (state_.step == 0.0 || (h != step() && h != state_.step)) take_step(h);
    const double end = double(n) + std::ldexp(rows, level());  // of an interval that begins now: no other is later, unless steps began anew
    if (rows > 0 && (state_.interval_end <= double(n) || state_.interval_end > end)) state_.interval_end = end;
  }
  double step() const { return std::ldexp(state_.step, -level()); }  ///< s, of the steps to come
  int level() const { return int(state_.level); }                    ///< step() is the nominal time step over 2^level
  long interval_end() const { return long(state_.interval_end); }

  /// At the end of step n: where an interval ends, step() may be another from here on. Collective.
  void end_step(long n) {
    merged_at_ = -1;
    if (rows == 0 || double(n) < state_.interval_end) return;
    state_.level = adapted_level(merged(monitor.interval), monitor.settings, level());
    monitor.close_interval();
    state_.interval_end = double(n) + std::ldexp(rows, level());
  }

  /// One line for each kind of finding that is made for the first time. `body`: what the engine calls a body. Collective.
  std::vector<std::string> new_findings(long n, const std::string& body) {
    std::vector<std::string> lines;
    const MonitorAction action = monitor.settings.action;
    if (action != MonitorAction::warn && action != MonitorAction::stop) return lines;
    const MonitorTally all = merged(monitor.interval);
    for (int kind = 0; kind < monitor_kinds; ++kind) {
      if (state_.said >> kind & 1 || !finding(all, monitor.settings, kind)) continue;
      state_.said |= 1 << kind;
      lines.push_back("at step " + std::to_string(n) + ' ' + finding_text(all, monitor.settings, kind, body));
    }
    return lines;
  }

  static constexpr std::array<const char*, 24> figure_names{{"position",     "position_rms",  "position_body",  "position_exceeded",
                                                             "velocity",     "velocity_rms",  "velocity_body",  "velocity_exceeded",
                                                             "spin",         "spin_rms",      "spin_body",      "spin_exceeded",
                                                             "judged",       "contact_steps", "contact_body_1", "contact_body_2",
                                                             "energy_error", "step",          "level",          "next_row",
                                                             "impacts",      "impact",        "impact_rms",     "impact_body"}};
  static constexpr int energy_error = 16;  ///< the engine's: step error of an energy account over what was turned over
  /// Figure k at the end of step n. Collective.
  double figure(int k, long n) {
    if (merged_at_ != n) merged_ = merged(monitor.all());
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
      case 19: return state_.interval_end;
      case 20: return merged_.impacts.count;
      case 21: return merged_.impacts.largest;
      case 22: return merged_.impacts.rms();
      case 23: return double(merged_.impacts.body);
      default: return 0.0;
    }
  }

  /// What goes on over runs and restarts, the same on all processes but for the tallies.
  struct State {
    MonitorTally run{}, interval{};
    double step = 0.0;           // s, nominal
    double interval_end = -1.0;  // its step
    std::int64_t level = 0;      // the time step in use is the nominal one over 2^level
    std::int64_t said = 0;       // bits of the kinds of findings that were reported

    auto fields() { return std::tie(run, interval, step, interval_end, level, said); }
  };
  State state() const {
    State now = state_;
    now.run = monitor.run;
    now.interval = monitor.interval;
    return now;
  }
  /// What restart files keep: the states of each process by themselves, for a run that goes on adds to the same tallies.
  std::vector<double> saved(std::vector<State> all) const {
    std::vector<ShadowImpact> under_way = shadows.all();
    double length = monitor.settings.scales.length;
    Archive out;
    archive(out, length, all, under_way);
    return out.numbers();
  }
  /// On another number of processes the first has the tallies of all. Throws std::invalid_argument with one line where the numbers are not
  /// such a state.
  void restore(std::vector<double> numbers, int process = 0, int processes = 1) {
    std::vector<State> all;
    std::vector<ShadowImpact> under_way;
    double length = 0.0;
    Archive in(std::move(numbers));
    archive(in, length, all, under_way);
    if (all.empty()) throw std::invalid_argument("the saved state is incomplete or damaged: it is that of no process");
    if (mean_length) monitor.settings.scales.length = length;
    mean_length = false;
    shadows.restore(std::move(under_way));
    state_ = all[0];
    monitor.run = monitor.interval = {};
    for (int p = 0; p < int(all.size()); ++p)
      if (int(all.size()) == processes ? p == process : process == 0) {
        monitor.run.merge(all[std::size_t(p)].run);
        monitor.interval.merge(all[std::size_t(p)].interval);
      }
  }

 private:
  static void archive(Archive& a, double& length, std::vector<State>& all, std::vector<ShadowImpact>& under_way) {
    FormatVersion format{1.0};
    a.all(std::tie(format, length, all, under_way));
    a.end();
  }
  MonitorTally merged(MonitorTally tally) const {
    merge_processes(tally);
    return tally;
  }

  State state_;
  long merged_at_ = -1;
  MonitorTally merged_;
};

}  // namespace dembark
