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
// and so on. The last solve is that of N, so D is that of the motion that happens. With LcpMethod::automatic it is made by relaxation.hpp,
// by elimination.hpp where that would take longer, and by LcpSolver where neither reaches rounding; those before it, which only tell
// friction its limits, are relaxed to four digits. The other methods solve all of them exactly.
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
#include "candidates.hpp"
#include "friction.hpp"
#include "geometry.hpp"
#include "motion.hpp"
#include "normal_forces.hpp"
#include "records.hpp"
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

  /// A new time step (s) from the next step on.
  void set_dt(double dt) {
    if (!(dt > 0.0) || std::isinf(dt)) throw std::invalid_argument("time step must be > 0 s and finite, not " + std::to_string(dt));
    settings_.dt = dt;
  }

  /// Appends all candidates with gap <= reach (m) to `contacts`.
  using Search = std::function<void(double reach, std::vector<Contact>& contacts)>;

  /// Adds the forces (N) and torques (N m) of the contacts, body damping included, to `force` and `torque`, in the order of the bodies.
  /// time: s, of this step. kick: see above, in (0, 1]. A call with the time of the last one does that step again, from the state
  /// before it: histories, totals and records count it once. Wrong bodies or contacts leave the system as it was.
  /// search: asked again with a larger reach where the motion that comes out could have closed gaps beyond the first. wall_speed (m/s):
  /// the fastest that a wall surface moves towards anything.
  const StepReport& step(const std::vector<Body>& bodies, const Search& search, double wall_speed, double time, double kick,
                         std::vector<Vec3<double>>& force, std::vector<Vec3<double>>& torque) {
    begin(bodies, kick, force, torque);
    double reach = default_reach(bodies, settings_.dt, wall_speed);
    found_.clear();
    search(reach, found_);
    return run(bodies, found_, time, force, torque, [&] {
      const double swept = 1.1 * screening_.swept(motion_, wall_speed);
      if (swept <= reach) return false;
      reach = swept;
      found_.clear();
      search(reach, found_);
      return true;
    });
  }

  /// The same with all candidates as given.
  const StepReport& step(const std::vector<Body>& bodies, const std::vector<Contact>& contacts, double time, double kick,
                         std::vector<Vec3<double>>& force, std::vector<Vec3<double>>& torque) {
    begin(bodies, kick, force, torque);
    return run(bodies, contacts, time, force, torque, [] { return false; });
  }

  const StepReport& report() const { return report_; }
  /// Of the last step, sorted by (key_a, key_b): the candidates that were solved for. The others are open.
  const std::vector<ContactResult>& contacts() const {
    const std::vector<Row>& rows = assembly_.rows();
    results_.resize(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& r = rows[i];
      const Eigen::Index k = Eigen::Index(i);
      results_[i] = {r.a, r.b, r.key_a, r.key_b, r.gap, normal_[k], opening_[k], tangential_[i], r.normal, r.place};
    }
    return results_;
  }
  /// Impacts that ended since the last call.
  std::vector<Impact> take_finished() { return records_.take_finished(); }

  /// Everything needed to go on bit for bit, as numbers that survive as doubles.
  std::vector<double> state() const {
    std::vector<double> out{1.0, stepped_ ? 1.0 : 0.0, time_, weight_};
    records_.save(out);
    return out;
  }
  /// Throws std::invalid_argument if `state` is none.
  void restore(const std::vector<double>& state) {
    if (state.size() < 4 || state[0] != 1.0) throw std::invalid_argument("impact state: not written by this version of dembark");
    stepped_ = state[1] != 0.0;
    time_ = state[2];
    weight_ = state[3];
    std::size_t at = 4;
    records_.load(state, at);
    if (at != state.size())
      throw std::invalid_argument("impact state: " + std::to_string(state.size()) + " numbers, but " + std::to_string(at) +
                                  " belong to it");
    assembly_.clear();
    report_ = StepReport();
    put_totals();
  }

 private:
  void begin(const std::vector<Body>& bodies, double kick, const std::vector<Vec3<double>>& force,
             const std::vector<Vec3<double>>& torque) {
    if (!(kick > 0.0 && kick <= 1.0)) throw std::invalid_argument("kick must be > 0 and <= 1, not " + std::to_string(kick));
    if (force.size() != bodies.size() || torque.size() != bodies.size())
      throw std::invalid_argument(std::to_string(bodies.size()) + " bodies need as many forces and torques, not " +
                                  std::to_string(force.size()) + " and " + std::to_string(torque.size()));
    motion_.begin(bodies, settings_.dt, kick);
    kick_ = kick;
    h_ = settings_.theta * kick + (1.0 - settings_.theta) * (1.0 - kick);
    g_ = settings_.theta * kick - (1.0 - settings_.theta) * (1.0 - kick);
  }

  /// widen(): gets more candidates where there may be any.
  template <class Widen>
  const StepReport& run(const std::vector<Body>& bodies, const std::vector<Contact>& contacts, double time,
                        std::vector<Vec3<double>>& force, std::vector<Vec3<double>>& torque, Widen widen) {
    const bool again = stepped_ && time == time_;
    const StepReport last = report_;
    records_.begin(again);
    try {
      report_ = StepReport();
      do {
        motion_.clear_tangential();
        motion_.accelerate();
        screening_.begin(contacts, motion_, (2.0 * settings_.theta - 1.0) * settings_.dt, h_ * settings_.dt * settings_.dt);
        do solve_contacts(bodies, contacts);
        while (screening_.missed(contacts, motion_));
      } while (widen());
      report_.contacts = int(contacts.size());
    } catch (...) {
      records_.cancel();
      assembly_.clear();
      report_ = last;
      throw;
    }
    weight_ = again ? weight_ : kick_;
    stepped_ = true;
    time_ = time;
    finish(bodies, force, torque);
    return report_;
  }

  /// Forces of the contacts that are near, and the motion of the bodies with them.
  void solve_contacts(const std::vector<Body>& bodies, const std::vector<Contact>& contacts) {
    candidates_.take(contacts, screening_, [&](const Key& key) { return records_.recall(key); });
    assembly_.update(bodies, contacts, candidates_.sorted(), settings_);
    records_.take(candidates_.sorted(), assembly_.rows());
    damp_bodies(bodies);
    if (!stepped_) deform_overlaps();
    set_rows();
    bool friction = has_friction();
    for (int sweep = 0;; ++sweep) {
      const bool last = !friction || sweep == settings_.friction_sweeps;
      solve(last);
      motion_.move();
      if (last) return;
      friction = sweep_friction();
      if (!friction && !solver_.approaches()) return;  // nothing has changed since the last solve, which was exact
    }
  }

  void damp_bodies(const std::vector<Body>& bodies) {
    const double response = g_ * settings_.dt;
    const auto damp = [&](int b) { motion_.damp(b, settings_.materials[bodies[b].material].damping, response); };
    const std::vector<Row>& rows = assembly_.rows();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!records_.before(i).active) continue;
      damp(rows[i].a);
      if (rows[i].b >= 0) damp(rows[i].b);
    }
    for (const std::int64_t id : records_.lost_bodies)
      for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].id == id) damp(int(b));
  }

  /// Bodies that overlap from the beginning have been deformed before: else contact damping would take the overlap for a sudden blow.
  void deform_overlaps() {
    const std::vector<Row>& rows = assembly_.rows();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double overlap = -rows[i].gap;
      if (!(overlap > 0.0)) continue;
      records_.remember(i).deformation = overlap;
      records_.remember(i).elastic = 0.5 * rows[i].stiffness * overlap * overlap;
    }
  }

  void set_rows() {
    const std::vector<Row>& rows = assembly_.rows();
    motion_.clear_tangential();
    const std::size_t n = rows.size();
    active_.resize(n);
    start_.resize(n);
    tangential_.resize(n);
    offset_.resize(Eigen::Index(n));
    q_.resize(Eigen::Index(n));
    normal_.resize(Eigen::Index(n));
    opening_.resize(Eigen::Index(n));
    for (std::size_t i = 0; i < n; ++i) {
      const Row& r = rows[i];
      const Memory& before = records_.before(i);
      offset_[Eigen::Index(i)] =
          r.gap + (2.0 * settings_.theta - 1.0) * settings_.dt * motion_.gap_rate(r) + r.viscous * r.compliance * before.deformation;
      active_[i] = before.active;
      // Where to begin: the contact force as if the spring were at rest.
      normal_[Eigen::Index(i)] = before.active ? r.stiffness * before.deformation : 0.0;
      start_[i] = {};
      if (before.active && r.law->friction.static_friction > 0.0) {
        start_[i] = -tangential_stiffness(r) * rotate_to_plane(before.friction.displacement, r.normal, motion_.twist(r, settings_.dt));
        motion_.add_tangential(r, start_[i]);
      }
      tangential_[i] = start_[i];
    }
    solver_.prepare(assembly_, motion_, h_ * settings_.dt * settings_.dt, settings_.lcp);
  }

  static double tangential_stiffness(const Row& r) { return r.law->tangential_stiffness_ratio * r.stiffness; }

  /// The normal forces, with the friction forces as they are.
  void solve(bool last) {
    const std::vector<Row>& rows = assembly_.rows();
    motion_.clear_normal();
    if (rows.empty()) return;
    const double scale = h_ * settings_.dt * settings_.dt;
    motion_.accelerate();
    for (std::size_t i = 0; i < rows.size(); ++i)
      q_[Eigen::Index(i)] = offset_[Eigen::Index(i)] + scale * motion_.gap_acceleration(rows[i]);
    solver_.solve(assembly_, motion_, q_, last, active_, normal_, opening_, report_);
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (active_[i]) motion_.add_normal(rows[i], normal_[Eigen::Index(i)]);
  }

  bool has_friction() const {
    for (const Row& r : assembly_.rows())
      if (r.law->friction.static_friction > 0.0) return true;
    return false;
  }

  /// All friction forces once, from the velocities with those of the last sweep. False if nothing changed.
  bool sweep_friction() {
    const std::vector<Row>& rows = assembly_.rows();
    trial_.resize(rows.size());
    friction_.resize(rows.size());
    bool changed = false;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& r = rows[i];
      FrictionState<double>& state = friction_[i];
      Vec3<double> force{};
      state = {};
      if (active_[i] && r.law->friction.static_friction > 0.0) {
        state.slip = records_.before(i).friction.slip;
        Vec3<double> velocity = motion_.surface_velocity(r);
        velocity -= dot(velocity, r.normal) * r.normal;
        force = friction_sweep(r, normal_[Eigen::Index(i)], motion_.tangential_response(r), velocity, tangential_[i], start_[i],
                               settings_.dt, kick_, state);
      }
      const Vec3<double>& last = tangential_[i];
      changed = changed || force.x != last.x || force.y != last.y || force.z != last.z;
      trial_[i] = force;
    }
    if (!changed) return false;
    tangential_.swap(trial_);
    motion_.clear_tangential();
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (active_[i]) motion_.add_tangential(rows[i], tangential_[i]);
    return true;
  }

  /// Forces out; energies, impacts and memories on.
  void finish(const std::vector<Body>& bodies, std::vector<Vec3<double>>& force, std::vector<Vec3<double>>& torque) {
    const std::vector<Row>& rows = assembly_.rows();
    const double length = weight_ * settings_.dt;       // s, the stretch of time this step stands for
    const double middle = 1.0 - 0.5 * weight_ / kick_;  // where its mean velocity lies between v (0) and v' (1)
    Totals& totals = records_.totals;
    records_.settle();
    motion_.go_back(middle);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Memory& before = records_.before(i);
      Memory& now = records_.now[i];
      if (!active_[i] && before.idle()) {
        if (!now.idle()) now = Memory();
        continue;
      }
      const Row& r = rows[i];
      const double n = normal_[Eigen::Index(i)];
      now = before;
      now.friction = {};
      if (active_[i] && r.law->friction.static_friction > 0.0) now.friction = friction_[i];
      now.active = active_[i];
      now.normal = r.normal;
      now.deformation = (n + r.viscous * before.deformation) * r.compliance;
      // Below the last digit of the gap, what is left of it acts on nothing any more.
      if (!now.active && now.deformation < std::numeric_limits<double>::epsilon() * std::abs(r.gap)) now.deformation = 0.0;
      now.elastic = 0.5 * r.stiffness * now.deformation * now.deformation +
                    0.5 * tangential_stiffness(r) * dot(now.friction.displacement, now.friction.displacement);
      report_.elastic_energy += now.elastic;

      // What the bodies (and the wall) put into the contact and its springs do not hold is lost.
      const Vec3<double> on_a = n * r.normal + tangential_[i];
      const double lost = -length * dot(on_a, motion_.surface_velocity(r)) - (now.elastic - before.elastic);
      totals.dissipated += lost;
      if (now.active && !before.active) {
        totals.impacts_begun += 1.0;
        now.time = time_;
        now.duration = now.impulse = now.peak_force = now.dissipated = 0.0;
        now.relative_speed = -motion_.gap_rate(r);
        now.place = r.place;
      }
      now.dissipated += lost;
      if (now.active) {
        ++report_.active;
        now.duration += length;
        now.impulse += n * length;
        now.peak_force = std::max(now.peak_force, n);
        report_.peak_force = std::max(report_.peak_force, n);
        totals.impulse += n * length;
        continue;
      }
      if (before.active) records_.finish(r.key_a, r.key_b, now);
      if (now.idle()) now = Memory();
    }
    for (const int b : motion_.damped) {
      const Vec3<double> change = motion_.change[b].velocity;
      // lambda on theta v' + (1 - theta) v_{n-1/2}
      const Vec3<double> on = -motion_.response[b].damping * (bodies[b].velocity + (g_ / kick_) * change);
      force[b] += on;
      totals.dissipated -= length * dot(on, bodies[b].velocity + middle * change);
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      force[b] += motion_.normal[b].force + motion_.tangential[b].force;
      torque[b] += motion_.tangential[b].torque;
    }
    totals.pivots += report_.pivots;
    totals.peak_force = std::max(totals.peak_force, report_.peak_force);
    totals.certificate = std::max(totals.certificate, report_.certificate);
    put_totals();
  }

  void put_totals() {
    const Totals& t = records_.totals;
    report_.impacts_begun = std::int64_t(t.impacts_begun);
    report_.pivots_total = std::int64_t(t.pivots);
    report_.impulse_sum = t.impulse;
    report_.peak_force_so_far = t.peak_force;
    report_.dissipated_energy = t.dissipated;
    report_.worst_certificate = t.certificate;
  }

  Settings settings_;
  Screening screening_;
  Candidates candidates_;
  Assembly assembly_;
  Records records_;
  Motion motion_;
  NormalForces solver_;
  StepReport report_;
  std::vector<Contact> found_;  ///< by the search of the step
  double time_ = 0.0, kick_ = 1.0, weight_ = 1.0, h_ = 1.0, g_ = 1.0;
  bool stepped_ = false;
  std::vector<char> active_;
  std::vector<Vec3<double>> start_, tangential_, trial_;
  Eigen::VectorXd offset_, q_, normal_, opening_;
  std::vector<FrictionState<double>> friction_;
  mutable std::vector<ContactResult> results_;
};

}  // namespace impact
}  // namespace dembark
