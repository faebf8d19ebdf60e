// Monitor of the time step of a run: how wrong the steps are, how many of them the shortest contact takes, and what to do about it.
//
// Three judges, none of which adds a force:
//
//   local errors     of positions, velocities and angular velocities (step_error.hpp), over a length and a speed
//   contact time     pi sqrt(m* / k), half a period of two bodies on the tangent stiffness k = dF/d(overlap) of their normal spring, over
//                    the step; a contact without damping lasts that long under Hooke's law
//   shadow impacts   binary impacts integrated anew (shadow_impact.hpp)
//
// Steps are judged in samples, every so many; the accelerations of the three steps before a sample are all that has to be kept. Samples
// are told by the number of the step alone, and tallies merge in any order: a run on many processes or threads has the same samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../constants.hpp"
#include "../message_text.hpp"
#include "step_error.hpp"

namespace dembark {

/// What follows when a sample is beyond the limits.
enum class MonitorAction {
  report,  ///< nothing: numbers only
  warn,    ///< one line, for each kind of finding once
  stop,    ///< the run ends with that line
  adapt,   ///< the step is halved after an interval beyond the limits, and doubled again after one that is well within them
};
/// Their names, in their order.
inline std::vector<std::string> monitor_action_names() { return {"report", "warn", "stop", "adapt"}; }

struct MonitorSettings {
  /// 1e-2 is about what ten steps a contact miss, where one of Hooke's law begins: (pi/10)^2 / 8 = 1.2e-2 of the speed.
  ErrorScales scales{0.0, 0.0, 1e-2};
  long every = 20;            ///< steps from sample to sample, 1 or more
  double least_steps = 10.0;  ///< of the shortest contact, > 0
  MonitorAction action = MonitorAction::warn;

  /// The one clear line about what is wrong with these settings, or nullptr.
  const char* error() const {
    if (const char* const wrong = scales.error()) return wrong;
    if (every < 1) return "every must be 1 step or more";
    if (!(least_steps > 0.0) || std::isinf(least_steps)) return "contact_steps must be a number > 0";
    return nullptr;
  }

  /// Whether step n is a sample.
  bool samples(long n) const { return n % every == 0; }
  /// Whether its accelerations are needed, and whether it is the first of those of a sample.
  bool keeps(long n) const { return every <= 4 || samples(n) || n % every >= every - 3; }
  bool begins(long n) const { return every > 4 && n % every == every - 3; }
};

/// Half a period of oscillation of two bodies of this reduced mass (kg) on a spring (N/m), in steps of h (s).
inline double contact_steps(double effective_mass, double stiffness, double h) {
  return stiffness > 0.0 ? pi * std::sqrt(effective_mass / stiffness) / h : INFINITY;
}

/// The contact that took the fewest steps, over a run or the part of one process: these merge in any order.
struct ShortestContact {
  double steps = INFINITY;
  long one = -1, two = -1;  ///< its bodies, the lower number first; of equals the lowest. -1: there was none; a wall is -2

  void add(double other, long a, long b) {
    if (a >= 0 && b >= 0 && b < a) std::swap(a, b);
    if (other > steps || std::isinf(other)) return;
    if (other == steps && (a > one || (a == one && b >= two))) return;
    steps = other;
    one = a;
    two = b;
  }
  void merge(const ShortestContact& other) { add(other.steps, other.one, other.two); }
  auto fields() { return std::tie(steps, one, two); }
};
constexpr long monitor_wall = -2;

/// Everything that is found. `impacts`: deviations of shadow impacts; their body is the lower of the two.
struct MonitorTally {
  StepErrors errors{};
  ShortestContact contact{};
  ErrorTally impacts{};

  void merge(const MonitorTally& other) {
    errors.merge(other.errors);
    contact.merge(other.contact);
    impacts.merge(other.impacts);
  }
  auto fields() { return std::tie(errors, contact, impacts); }
};

/// The sums of a run, and those of the present interval, at whose end `adapt` acts.
class StepMonitor {
 public:
  MonitorSettings settings{};
  MonitorTally run{}, interval{};

  /// Takes the accelerations of a body (m/s^2, then rad/s^2) at the end of step n of h (s), for which settings.keeps(n) holds.
  void take(AccelerationHistory& history, const SixVector& accelerations, double radius, long id, long n, double h) {
    if (settings.begins(n)) history.forget();
    LocalError e;
    if (history.step(accelerations, h, e) && settings.samples(n)) interval.errors.add(e, radius, id, settings.scales);
  }
  /// Takes a contact of a sample, see contact_steps(). Of a wall `two` is monitor_wall.
  void take_contact(double effective_mass, double stiffness, double h, long one, long two) {
    interval.contact.add(contact_steps(effective_mass, stiffness, h), one, two);
  }
  void take_impact(double deviation, long one) { interval.impacts.add(deviation, one, INFINITY); }
  /// Moves the tallies of the interval into the sums of the run.
  void close_interval() {
    run.merge(interval);
    interval = {};
  }
  MonitorTally all() const {
    MonitorTally sum = run;
    sum.merge(interval);
    return sum;
  }
};

/// Kinds of findings, and whether a tally has them.
constexpr int monitor_kinds = 4;
inline bool finding(const MonitorTally& t, const MonitorSettings& s, int kind) {
  const ErrorTally* const errors[] = {&t.errors.position, &t.errors.velocity, &t.errors.spin};
  return kind < 3 ? errors[kind]->exceeded > 0.0 : t.contact.steps < s.least_steps;
}
inline bool within_limits(const MonitorTally& t, const MonitorSettings& s) {
  for (int kind = 0; kind < monitor_kinds; ++kind)
    if (finding(t, s, kind)) return false;
  return true;
}

/// A finding in words. `body`: what the engine calls a body.
inline std::string finding_text(const MonitorTally& t, const MonitorSettings& s, int kind, const std::string& body) {
  if (kind == 3) {
    const auto name = [&](long id) { return id == monitor_wall ? std::string("a wall") : body + " " + std::to_string(id); };
    return "the contact of " + name(t.contact.one) + " and " + name(t.contact.two) + " lasts " + number_text(t.contact.steps, 3) +
           " steps, less than " + number_text(s.least_steps, 3) + "; take a shorter time step";
  }
  const ErrorTally* const errors[] = {&t.errors.position, &t.errors.velocity, &t.errors.spin};
  static const char* const words[] = {"position", "velocity", "angular velocity"};
  const std::string scale = kind == 0 ? "length = " + number_text(s.scales.length, 3) : "speed = " + number_text(s.scales.speed, 3);
  return std::string("the error of the ") + words[kind] + " of " + body + " " + std::to_string(errors[kind]->body) + " in one step is " +
         number_text(errors[kind]->largest, 3) + " times " + scale + (kind == 2 ? " over its radius" : "") +
         ", more than limit = " + number_text(s.scales.limit, 3) + "; take a shorter time step";
}

/// What `adapt` does after an interval: halves of the nominal time step, 0 ... deepest_level.
constexpr int deepest_level = 10;
/// The step goes to h / 2^level. It grows again when twice the step would have stayed at half of the limits: errors of positions and
/// velocities are of third order in the step or less, from the touch of two bodies on (step_error.hpp).
inline int adapted_level(const MonitorTally& interval, const MonitorSettings& s, int level) {
  if (!within_limits(interval, s)) return std::min(level + 1, deepest_level);
  const double largest = std::max({interval.errors.position.largest, interval.errors.velocity.largest, interval.errors.spin.largest});
  // An interval without contacts says nothing about the next one.
  const bool touched = !std::isinf(interval.contact.steps);
  const bool room = touched && 8.0 * largest <= 0.5 * s.scales.limit && interval.contact.steps >= 4.0 * s.least_steps;
  return room ? std::max(level - 1, 0) : level;
}

}  // namespace dembark
