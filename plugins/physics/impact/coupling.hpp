// The impacts of an engine's run: what lies between the bodies that the engine has and the forces that it gets, and is the same in each
// engine with velocity Verlet. Histories, clock, file of impacts, the forces of the last step, and what restart files keep.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../archive.hpp"
#include "command.hpp"
#include "impact_file.hpp"
#include "last_forces.hpp"
#include "start.hpp"
#include "system.hpp"

namespace dembark {
namespace impact {

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
  void open_file() {
    try {
      file_.open(command.impacts_file, wall_legend(command.walls));
    } catch (const std::runtime_error& e) {
      throw std::runtime_error(std::string("impacts: ") + e.what());
    }
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
  }

  /// The forces of step `now` on the bodies that were taken.
  void step(std::int64_t now) { solve(now, 1.0); }

  /// Those of the set-up of a run, with velocities of the full step: half a kick follows. A run that goes on where one has ended knows the
  /// forces of its step. Throws std::invalid_argument with one line about bodies that must not begin as they are.
  void set_up(std::int64_t now) {
    if (!system_.begun()) check_start();
    if (last_step_ != now || !last_.hold(bodies_, command.around.pairs.box)) solve(now, 0.5);
    else wrenches_ = last_.wrenches;
  }

  /// One line, once for each time step (s), where it resolves no impact; else nothing. After set_up().
  std::string step_warning() {
    if (judged_dt_ == last_dt_) return {};
    judged_dt_ = last_dt_;
    return impact::step_warning(system_.settings(), bodies_, command.around);
  }

  /// The forces, in the order in which the bodies were given.
  void hand_out(std::vector<ContactWrench>& gathered) const {
    gathered.resize(bodies_.size());
    for (std::size_t i = 0; i < bodies_.size(); ++i) gathered[order_[i]] = wrenches_[i];
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
    return double(bodies_.size() * (sizeof(Body) + 2 * sizeof(ContactWrench)) + std::size_t(report.contacts) * sizeof(Contact));
  }

 private:
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
    const auto search = [&](double reach, std::vector<Contact>& contacts) { around.find(bodies_, reach, contacts); };
    report = system_.step(bodies_, search, around.wall_speed(), time, kick);
    wrenches_ = system_.wrenches();
    file_.append(system_.take_finished());
    results_.clear();
    last_step_ = now;
    kept_ = false;
  }

  void archive(Archive& a) {
    FormatVersion format{3.0};
    std::size_t types = command.types, here = types;
    std::vector<std::string> walls = command.walls;
    a.all(std::tie(format, types, walls));
    if (types != here)
      throw std::invalid_argument("the restart file has " + std::to_string(types) + " atom types, the command " + std::to_string(here));
    for (std::size_t k = 0; k < std::min(walls.size(), command.walls.size()); ++k)
      if (command.walls[k] != walls[k])
        throw std::invalid_argument("wall " + std::to_string(k + 1) + " is " + walls[k] + " in the restart file and " + command.walls[k] +
                                    " in the command; keep the order, add walls at the end, take them away from the end");
    std::vector<double> state = system_.state();
    std::vector<ContactResult> contacts = this->contacts();
    a.all(std::tie(last_step_, last_dt_, clock_time_, clock_step_, last_, report, file_, state, contacts));
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
  std::vector<ContactResult> results_;  ///< of the step of a restart file
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
