// One time step of all contacts of a system of logs.
//
// The engine is at step n of a leapfrog: positions x_n, velocities v = v_{n-1/2}, forces f of everything else. With the contact forces N
// the velocity becomes v' = v + tau M^-1 (f + G N). The contact law is imposed on the gap
//     theta gap_{n+1} + (1 - theta) gap_{n-1} = gap_n + (2 theta - 1) tau u + theta tau^2 G^T M^-1 (f + G N),   u = G^T v,
// linear in the motion of the step, plus the deformation N/s of the boundaries:
//     D = A N + B,  D >= 0,  N >= 0,  D N = 0,
//     A = diag(1/s_a + 1/s_b) + theta tau^2 G^T M^-1 G,   B = gap_n + (2 theta - 1) tau u + theta tau^2 G^T M^-1 f.
// theta = 1: backward differences, the published scheme (G. N. Kolesnikov, 2013); two bodies part with e = exp(-pi omega tau / 2), and
// energy never grows. theta = 1/2: reversible in time, no such loss. In general e = exp(-pi (2 theta - 1) omega tau / 2).
//
// `kick`: the velocity that moves the bodies is v + kick tau F / m. 1 in the loop; 1/2 where v is the velocity at the full step, as at
// the set-up of velocity Verlet; then v_{n-1/2} = v - tau F / 2m, and theta in A becomes h = theta kick + (1 - theta)(1 - kick).
//
// Body damping: the force -lambda (theta v' + (1 - theta) v) on bodies that had an active contact in the last step. It turns the masses
// into m' = m + g tau lambda, g = theta kick - (1 - theta)(1 - kick), and f into f - lambda v; theta = 1: (M/tau^2 + Lambda/tau)^-1.
// Contact damping: N = s delta + c (delta - delta_last) / tau, delta the deformation, which relaxes while the contact is open; 1/s
// becomes 1/(s + c/tau), and B gets the deformation delta_last c / (s tau + c) that is still there.
//
// Friction is solved in turn with N: N with the last friction forces in f; friction from N; N again with the friction forces in f,
// and so on. The last solve is that of N, so D is that of the motion that happens. With LcpMethod::automatic it is made by the chain of
// normal_forces.hpp; those before it, which only tell friction its limits, are relaxed to four digits. The other methods solve all of them
// exactly.
//
// Candidates that would stay open anyway are not solved for, and looked at again afterwards (screening.hpp).
//
// Results do not depend on the order in which bodies and contacts are given.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "assembly.hpp"
#include "friction.hpp"
#include "geometry.hpp"
#include "history.hpp"
#include "motion.hpp"
#include "normal_forces.hpp"
#include "screening.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

class System {
 public:
  /// Throws std::invalid_argument with one line about what is wrong.
  explicit System(Settings settings) : settings_(std::move(settings)) {
    const std::string wrong = settings_error(settings_);
    if (!wrong.empty()) throw std::invalid_argument(wrong);
  }
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  const Settings& settings() const { return settings_; }
  /// Whether there was a step, here or in the state that was restored.
  bool begun() const { return history_.last().begun; }

  /// A new time step (s) from the next step on.
  void set_dt(double dt) {
    if (!(dt > 0.0) || std::isinf(dt)) throw std::invalid_argument("time step must be > 0 s and finite, not " + std::to_string(dt));
    settings_.dt = dt;
  }

  /// Appends all candidates with gap <= reach (m) to `contacts`.
  using Search = std::function<void(double reach, std::vector<Contact>& contacts)>;

  /// The forces of the contacts of a step; see wrenches().
  /// time: s, of this step. kick: see above, in (0, 1]. A call with the time of the last one does that step again, from the state
  /// before it: histories, totals and records count it once. Wrong bodies or contacts leave the system as it was.
  /// search: asked again with a larger reach where the motion that comes out could have closed gaps beyond the first. wall_speed (m/s):
  /// the fastest that a wall surface moves towards anything. reach: 0, or what the search is asked for once, whatever moves.
  const StepReport& step(const std::vector<Body>& bodies, const Search& search, double wall_speed, double time, double kick,
                         double reach = 0.0) {
    begin(bodies, kick);
    const bool again = history_.last().begun && time == time_, widens = reach == 0.0;
    const StepReport last = report_;
    history_.begin(again);
    report_ = history_.base().report;
    try {
      double swept = widens ? default_reach(bodies, settings_.dt, wall_speed) : reach;
      do {
        reach = swept;
        found_.clear();
        search(reach, found_);
        motion_.clear_tangential();
        motion_.accelerate();
        screening_.begin(found_, motion_, (2.0 * settings_.theta - 1.0) * settings_.dt, h_ * settings_.dt * settings_.dt);
        do solve_contacts(bodies);
        while (screening_.missed(found_, motion_));
        swept = 1.1 * screening_.swept(motion_, wall_speed);
      } while (widens && swept > reach);
    } catch (...) {
      assembly_.clear();
      report_ = last;
      throw;
    }
    report_.contacts = int(found_.size());
    weight_ = again ? weight_ : kick_;
    turns_.turn(bodies, history_.last().begun ? time - time_ : 0.0);
    time_ = time;
    finish(bodies);
    return report_;
  }

  /// Of the contacts on each body, body damping included, in the order of the bodies.
  const std::vector<ContactWrench>& wrenches() const { return wrenches_; }
  const StepReport& report() const { return report_; }
  /// Of the last step, sorted by (key_a, key_b): the candidates that were solved for. The others are open.
  const std::vector<ContactResult>& contacts() const {
    const std::vector<Row>& rows = assembly_.rows();
    results_.resize(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& r = rows[i];
      const Eigen::Index k = Eigen::Index(i);
      results_[i] = {r.a, r.b, r.key_a, r.key_b, r.normal, r.gap, forces_.z[k], friction_.force[i], r.point, forces_.w[k]};
    }
    return results_;
  }
  /// Impacts that ended since the last call.
  std::vector<Impact> take_finished() { return std::exchange(history_.finished, {}); }

  /// Everything needed to go on bit for bit, as numbers that survive as doubles.
  std::vector<double> state() const { return to_numbers(*this); }
  /// Throws std::invalid_argument if `state` is none.
  void restore(const std::vector<double>& state) {
    from_numbers(state, *this);
    assembly_.clear();
    report_ = history_.last().report;
  }
  auto fields() { return std::tie(format_, time_, weight_, history_, turns_); }

 private:
  void begin(const std::vector<Body>& bodies, double kick) {
    if (!(kick > 0.0 && kick <= 1.0)) throw std::invalid_argument("kick must be > 0 and <= 1, not " + std::to_string(kick));
    motion_.begin(bodies, settings_.dt, kick);
    kick_ = kick;
    h_ = settings_.theta * kick + (1.0 - settings_.theta) * (1.0 - kick);
    g_ = settings_.theta * kick - (1.0 - settings_.theta) * (1.0 - kick);
  }

  /// Forces of the contacts that are near, and the motion of the bodies with them.
  void solve_contacts(const std::vector<Body>& bodies) {
    assembly_.take(bodies, found_, screening_, [&](const Key& key) { return history_.recall(key); }, settings_);
    std::vector<Row>& rows = assembly_.rows();
    history_.take(rows);
    damp_bodies(bodies);
    begin_rows();
    bool friction = friction_.begin(rows, settings_.dt, kick_, motion_);
    solver_.prepare(assembly_, motion_, h_ * settings_.dt * settings_.dt, settings_.lcp);
    for (int sweep = 0;; ++sweep) {
      const bool last = !friction || sweep == settings_.friction_sweeps;
      solve(last);
      motion_.move();
      if (last) return;
      friction = friction_.sweep(rows, forces_, motion_);
      if (!friction && !solver_.approaches()) return;  // nothing has changed since the last solve, which was exact
    }
  }

  void damp_bodies(const std::vector<Body>& bodies) {
    const double response = g_ * settings_.dt;
    const auto damp = [&](int b) { motion_.damp(b, settings_.materials[bodies[b].material].damping, response); };
    for (const Row& r : assembly_.rows()) {
      if (!r.before->active) continue;
      damp(r.a);
      if (r.b >= 0) damp(r.b);
    }
    for (const std::int64_t id : history_.lost_bodies)
      for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].id == id) damp(int(b));
  }

  void begin_rows() {
    const std::vector<Row>& rows = assembly_.rows();
    const std::size_t n = rows.size();
    forces_.resize(n);
    offset_.resize(Eigen::Index(n));
    for (std::size_t i = 0; i < n; ++i) {
      const Row& r = rows[i];
      const ContactHistory& before = *r.before;
      offset_[Eigen::Index(i)] =
          gap_of(r) + (2.0 * settings_.theta - 1.0) * settings_.dt * motion_.gap_rate(r) + r.viscous * r.compliance * before.deformation;
      forces_.active[i] = before.active;
      // Where to begin: the contact force as if the spring were at rest.
      forces_.z[Eigen::Index(i)] = before.active ? r.stiffness * before.deformation : 0.0;
    }
  }

  /// m, of the undeformed bodies, as the contact law takes it. The law plans with the turn of a step as if it were straight, and a capsule
  /// that swings arrives short of the plan by up to (omega tau)^2 / 2 of its lever. With theta = 1 the springs are not charged with that:
  /// what they have been compressed by is what the last step planned, at most, and energy never grows. A drum bends towards the bodies, and
  /// the logs would slowly sink into it.
  double gap_of(const Row& r) const {
    if (!r.lever || r.concave || settings_.theta < 1.0) return r.gap;
    return std::max(r.gap, -r.before->deformation);
  }

  /// The normal forces, with the friction forces as they are.
  void solve(bool last) {
    const std::vector<Row>& rows = assembly_.rows();
    motion_.clear_normal();
    if (rows.empty()) return;
    const double scale = h_ * settings_.dt * settings_.dt;
    motion_.accelerate();
    for (std::size_t i = 0; i < rows.size(); ++i)
      forces_.q[Eigen::Index(i)] = offset_[Eigen::Index(i)] + scale * motion_.gap_acceleration(rows[i]);
    solver_.solve(assembly_, motion_, last, forces_, report_);
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (forces_.active[i]) motion_.add_normal(rows[i], forces_.z[Eigen::Index(i)]);
  }

  /// Forces out; energies, impacts and histories on.
  void finish(const std::vector<Body>& bodies) {
    const std::vector<Row>& rows = assembly_.rows();
    const double length = weight_ * settings_.dt;       // s, the stretch of time this step stands for
    const double middle = 1.0 - 0.5 * weight_ / kick_;  // where its mean velocity lies between v (0) and v' (1)
    history_.settle(report_);
    motion_.go_back(middle);
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (forces_.active[i] || !rows[i].before->idle() || dot(friction_.force[i], friction_.force[i]) > 0.0) finish_contact(i, length);
    wrenches_.assign(bodies.size(), {});
    for (const int b : motion_.damped) {
      const Vec3<double> change = motion_.change[b].velocity;
      // lambda on theta v' + (1 - theta) v_{n-1/2}
      const Vec3<double> on = -motion_.response[b].damping * (bodies[b].velocity + (g_ / kick_) * change);
      wrenches_[b].force += on;
      report_.dissipated_energy -= length * dot(on, bodies[b].velocity + middle * change);
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      wrenches_[b].force += motion_.normal[b].force + motion_.tangential[b].force;
      wrenches_[b].torque += motion_.tangential[b].torque;
      if (!motion_.normal_torque.empty()) wrenches_[b].torque += motion_.normal_torque[b];
    }
    report_.pivots_total += report_.pivots;
    report_.peak_force_so_far = std::max(report_.peak_force_so_far, report_.peak_force);
    report_.worst_certificate = std::max(report_.worst_certificate, report_.certificate);
    history_.commit(report_);
  }

  /// What contact i leaves to the next step, and its part of the report.
  void finish_contact(std::size_t i, double length) {
    const Row& r = assembly_.rows()[i];
    const double n = forces_.z[Eigen::Index(i)];
    const ContactHistory& before = *r.before;
    ContactHistory now = before;
    now.active = forces_.active[i];
    now.friction = now.active && FrictionForces::acts(r) ? friction_.state[i] : FrictionState<double>();
    now.normal = r.normal;
    now.deformation = (n + r.viscous * before.deformation) * r.compliance;
    // Below the last digit of the gap, what is left of it acts on nothing any more.
    if (!now.active && now.deformation < std::numeric_limits<double>::epsilon() * std::abs(r.gap)) now.deformation = 0.0;
    now.elastic = elastic_energy(r, now);
    report_.elastic_energy += now.elastic;

    // What the bodies (and the wall) put into the contact and its springs do not hold is lost.
    const Vec3<double> on_a = n * r.normal + friction_.force[i];
    const double lost = -length * dot(on_a, motion_.surface_velocity(r)) - (now.elastic - before.elastic);
    report_.dissipated_energy += lost;
    Impact& impact = now.impact;
    if (now.active && !before.active) {
      ++report_.impacts_begun;
      impact = Impact();
      impact.time = time_;
      impact.relative_speed = -motion_.gap_rate(r);
      impact.point = r.point;
      impact.normal = r.normal;
      impact.turn_a = turns_[r.a];
      impact.turn_b = r.b >= 0 ? turns_[r.b] : 0.0;
    }
    impact.dissipated += lost;
    impact.friction_loss -=
        length * dot(friction_.force[i], motion_.surface_velocity(r)) + sheared_energy(r, now) - sheared_energy(r, before);
    if (now.active) {
      ++report_.active;
      impact.duration += length;
      impact.impulse += n * length;
      impact.peak_force = std::max(impact.peak_force, n);
      report_.peak_force = std::max(report_.peak_force, n);
      report_.impulse_sum += n * length;
    } else if (before.active) {
      history_.finish({r.key_a, r.key_b}, now);
    }
    if (!now.idle()) history_.add({r.key_a, r.key_b}, now);
  }

  FormatVersion format_{4.0};
  Settings settings_;
  Screening screening_;
  Assembly assembly_;
  HistoryKeeper history_;
  Turns turns_;
  Motion motion_;
  FrictionForces friction_;
  NormalForces solver_;
  StepReport report_;
  std::vector<Contact> found_;  ///< by the search of the step
  std::vector<ContactWrench> wrenches_;
  double time_ = 0.0, kick_ = 1.0, weight_ = 1.0, h_ = 1.0, g_ = 1.0;
  Unknowns forces_;         ///< z: N, w: D, of the deformed bodies
  Eigen::VectorXd offset_;  ///< m, of q, but for the accelerations
  mutable std::vector<ContactResult> results_;
};

}  // namespace impact
}  // namespace dembark
