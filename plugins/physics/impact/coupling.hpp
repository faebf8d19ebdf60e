// The impacts of an engine's run: what lies between the bodies that the engine has and the forces that it gets, and is the same in each
// engine with velocity Verlet. Histories, clock, file of impacts, the forces of the last step, and what restart files keep.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../archive.hpp"
#include "attitude.hpp"
#include "command.hpp"
#include "impact_file.hpp"
#include "last_forces.hpp"
#include "log_list.hpp"
#include "start.hpp"
#include "system.hpp"

namespace dembark {
namespace impact {

/// What a body gets back from a step.
struct BodyUpdate {
  Vec3<double> force{}, torque{};  ///< N, N m, of the contacts; the torque is that on a body with the inertia of Command::inertia()
  Vec3<double> spin{};             ///< rad/s, half a step before, or as it was given
  Attitude attitude{};             ///< of logs with a length
};

class Coupling {
 public:
  Command command;    ///< walls may be moved between steps
  StepReport report;  ///< of the last step

  /// Throws std::invalid_argument with one line about what is wrong with the command.
  explicit Coupling(Command words) : command(std::move(words)), system_(command.settings) {}

  /// The time step (s) from step `now` on.
  void set_dt(double dt, std::int64_t now) {
    system_.set_dt(dt);
    if (last_dt_ > 0.0 && last_dt_ != dt) {
      last_step_ = -1;  // the forces of another time step are not those of this one
      clock_time_ += double(now - clock_step_) * last_dt_;
      clock_step_ = now;
    }
    last_dt_ = dt;
  }

  /// Before the first step. Throws std::runtime_error with one line.
  void open_files() {
    const auto named = [](const char* keyword, const auto& work) {
      try {
        work();
      } catch (const std::runtime_error& e) {
        throw std::runtime_error(std::string(keyword) + ": " + e.what());
      }
    };
    named("impacts", [&] { file_.open(command.impacts_file, wall_legend(command.walls)); });
    if (!command.logs_file.empty() && listed_.empty()) named("logs", [&] { listed_ = read_logs(command.logs_file); });
  }

  /// All bodies as they are, in any order, with the forces of everything else.
  void take(const std::vector<Body>& gathered, const PeriodicBox& box) {
    const std::size_t n = gathered.size();
    const auto before = [&](std::size_t a, std::size_t b) { return gathered[a].id < gathered[b].id; };
    // Bodies seldom change their places in an engine's arrays: the order of the last step is tried first.
    if (order_.size() != n || !std::is_sorted(order_.begin(), order_.end(), before)) {
      order_.resize(n);
      std::iota(order_.begin(), order_.end(), std::size_t(0));
      std::sort(order_.begin(), order_.end(), before);
    }
    bodies_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      bodies_[i] = gathered[order_[i]];
      if (i > 0 && bodies_[i - 1].id == bodies_[i].id)
        throw std::runtime_error("two atoms have the number " + std::to_string(bodies_[i].id));
    }
    command.around.pairs.box = box;
    if (command.has_lengths()) lay_logs();
  }

  /// The forces of step `now` on the bodies that were taken.
  void step(std::int64_t now) {
    for (std::size_t i = 0; i < logs_.size(); ++i)
      if (logs_[i].moves) logs_[i].attitude.turn(bodies_[i], last_dt_);
    solve(now, 1.0);
  }

  /// Those of the set-up of a run, with velocities of the full step: half a kick follows. A run that goes on where one has ended knows the
  /// forces of its step. Throws std::invalid_argument with one line about bodies that must not begin as they are.
  void set_up(std::int64_t now) {
    if (!system_.begun()) check_start();
    if (last_step_ == now && last_.hold(bodies_, command.around.pairs.box)) {
      wrenches_ = last_.wrenches;
      return;
    }
    for (std::size_t i = 0; i < logs_.size(); ++i) logs_[i].attitude.begin(bodies_[i]);
    solve(now, 0.5);
  }

  /// One line, once for each time step (s), where it resolves no impact; else nothing. After set_up().
  std::string step_warning() {
    if (judged_dt_ == last_dt_) return {};
    judged_dt_ = last_dt_;
    return impact::step_warning(system_.settings(), bodies_, command.around);
  }

  /// In the order in which the bodies were given.
  void hand_out(std::vector<BodyUpdate>& gathered) const {
    gathered.resize(bodies_.size());
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& b = bodies_[i];
      const ContactWrench& w = wrenches_[i];
      BodyUpdate& update = gathered[order_[i]] = {w.force, w.torque, b.spin, {}};
      if (logs_.empty()) continue;
      if (!std::isinf(b.mass)) update.torque = command.inertia(b.mass, b.radius) * kicked(b, b.torque + w.torque, 1.0) - b.torque;
      update.attitude = logs_[i].attitude;
    }
  }

  /// At the end of a step or of a run: the bodies as the engine has moved them.
  void end_step(const std::vector<Body>& gathered) {
    if (!kept_) {
      last_.keep(bodies_);
      last_.wrenches = wrenches_;
      kept_ = true;
    }
    take(gathered, command.around.pairs.box);
    last_.move(bodies_);
  }

  /// Of the last step; the model itself does not keep those of a restart file.
  const std::vector<ContactResult>& contacts() const { return results_.empty() ? system_.contacts() : results_; }

  /// What restart files keep, bit for bit.
  std::vector<double> state() {
    Archive out;
    archive(out);
    return out.numbers();
  }
  /// Throws std::invalid_argument with one line where `state` is not that of these walls and types.
  void restore(std::vector<double> state) {
    Archive in(std::move(state));
    archive(in);
  }

  double memory() const {
    return double(bodies_.size() * (sizeof(Body) + 2 * sizeof(ContactWrench)) + logs_.size() * sizeof(Log) +
                  std::size_t(report.contacts) * sizeof(Contact));
  }

 private:
  /// With a length.
  struct Log {
    std::int64_t id = 0;
    bool moves = false;  ///< it was there in a step
    Attitude attitude{};
    auto fields() { return std::tie(id, moves, attitude); }
  };

  /// Gives the bodies what logs with a length have more; new ones lie as the command says.
  void lay_logs() {
    const auto same = [](const Log& log, const Body& b) { return log.id == b.id; };
    if (!std::equal(logs_.begin(), logs_.end(), bodies_.begin(), bodies_.end(), same)) {
      std::vector<Log> known;
      known.swap(logs_);
      for (const Body& b : bodies_) {
        const auto at = std::lower_bound(known.begin(), known.end(), b.id, [](const Log& log, std::int64_t id) { return log.id < id; });
        logs_.push_back(at != known.end() && at->id == b.id ? *at : Log{b.id, false, first_attitude(b)});
      }
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      logs_[i].attitude.shape(bodies_[i]);
      if (!logs_[i].moves) logs_[i].attitude.begin(bodies_[i]);
    }
  }
  Attitude first_attitude(const Body& b) const {
    const auto listed = listed_.find(b.id);
    if (listed != listed_.end()) return listed->second;
    if (command.lengths.empty())
      throw std::invalid_argument("logs: file " + command.logs_file + " has no line for atom " + std::to_string(b.id));
    return {command.lengths[std::size_t(b.material)], rotation_to(command.axis), {}};
  }

  void check_start() {
    std::vector<Contact> contacts;
    command.around.find(bodies_, 0.0, contacts);
    const auto wall = [&](std::int64_t number) { return "wall " + command.walls[std::size_t(number)]; };
    const std::string wrong = start_error(bodies_, contacts, "atom", wall);
    if (!wrong.empty()) throw std::invalid_argument(wrong);
  }

  void solve(std::int64_t now, double kick) {
    const double time = clock_time_ + double(now - clock_step_) * last_dt_;
    ContactGeometry& around = command.around;
    const auto search = [&](double reach, std::vector<Contact>& contacts) {
      around.find(bodies_, reach, contacts);
      leave_out_held(bodies_, contacts);
    };
    report = system_.step(bodies_, search, around.wall_speed(), time, kick);
    wrenches_ = system_.wrenches();
    for (std::size_t i = 0; i < logs_.size(); ++i) {
      logs_[i].attitude.momentum += (kick * last_dt_) * (bodies_[i].torque + wrenches_[i].torque);
      logs_[i].moves = true;
    }
    file_.append(system_.take_finished());
    results_.clear();
    last_step_ = now;
    kept_ = false;
  }

  void archive(Archive& a) {
    FormatVersion format{4.0};
    std::size_t types = command.types, here = types;
    bool lengths = command.has_lengths();
    std::vector<std::string> walls = command.walls;
    a.all(std::tie(format, types, lengths, walls));
    if (lengths != command.has_lengths())
      throw std::invalid_argument(std::string("the logs of the restart file have ") + (lengths ? "a" : "no") +
                                  " length, those of the command " + (lengths ? "none" : "one"));
    if (types != here)
      throw std::invalid_argument("the restart file has " + std::to_string(types) + " atom types, the command " + std::to_string(here));
    for (std::size_t k = 0; k < std::min(walls.size(), command.walls.size()); ++k)
      if (command.walls[k] != walls[k])
        throw std::invalid_argument("wall " + std::to_string(k + 1) + " is " + walls[k] + " in the restart file and " + command.walls[k] +
                                    " in the command; keep the order, add walls at the end, take them away from the end");
    std::vector<double> state = system_.state();
    std::vector<ContactResult> contacts = this->contacts();
    a.all(std::tie(last_step_, last_dt_, clock_time_, clock_step_, last_, logs_, report, file_, state, contacts));
    a.end();
    results_ = std::move(contacts);
    if (!a.reading()) return;
    system_.restore(state);
    kept_ = true;
  }

  System system_;
  ImpactFile file_;
  // All bodies by number, as they came and what each of them gets.
  std::vector<Body> bodies_;
  std::vector<ContactWrench> wrenches_;
  std::vector<std::size_t> order_;
  std::vector<Log> logs_;                    ///< as the bodies; empty: in cross-section
  std::map<std::int64_t, Attitude> listed_;  ///< as the command's file lists them
  std::vector<ContactResult> results_;       ///< of the step of a restart file
  LastForces last_;
  bool kept_ = false;  ///< last_ is that of the last step
  std::int64_t last_step_ = -1;
  double last_dt_ = 0.0, judged_dt_ = 0.0;
  // Time of a step: an engine's own clock may not survive a restart with another time step.
  double clock_time_ = 0.0;
  std::int64_t clock_step_ = 0;
};

}  // namespace impact
}  // namespace dembark
