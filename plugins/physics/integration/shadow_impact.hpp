// Shadow impacts: a binary impact of a run integrated anew by the reference integrator (adams.hpp), to compare the outgoing velocities.
//
// The local errors of step_error.hpp see what the scheme misses of the forces that it met. They do not see that these forces were computed
// with velocities of half a step before, as engines do it, which makes damping late, of first order in the step. An impact as a whole
// shows it.
//
// The state of the reference is separation, velocities and angular velocities of both spheres; the history of the contact advances from
// step to step with the mean velocity of the step, which is of second order. Touch and release are located. An engine has a new contact
// first when it overlaps; no force has acted yet, so that the touch lies on a straight line before it.
//
// Spheres or discs of homogeneous density without a liquid bridge. Accurate to 1e-4 of its speed without friction, to 5e-4 with it (see the
// tests).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "../contact.hpp"
#include "../fnv.hpp"
#include "adams.hpp"

namespace dembark {

/// Velocity of body 1 against body 2 (m/s), and angular velocities (rad/s).
struct PairMotion {
  Vec3<double> velocity{}, spin_1{}, spin_2{};

  auto fields() { return std::tie(velocity, spin_1, spin_2); }
};
inline PairMotion pair_motion(const ContactBodies& b) { return {b.velocity_1 - b.velocity_2, b.angular_velocity_1, b.angular_velocity_2}; }

inline double pair_gap(const ContactBodies& b) { return norm(b.separation) - (b.radius_1 + b.radius_2); }

/// How far apart two motions are, in parts of `speed`: of velocities and of velocities of the surfaces.
inline double deviation(const PairMotion& a, const PairMotion& b, double radius_1, double radius_2, double speed) {
  return std::max({norm(a.velocity - b.velocity), radius_1 * norm(a.spin_1 - b.spin_1), radius_2 * norm(a.spin_2 - b.spin_2)}) / speed;
}

/// Moves overlapping spheres (m, m/s) back along their free flight to where they touched. Returns how long ago (s) that was, or < 0 if they
/// were not apart `before` (s).
inline double back_to_touch(ContactBodies& b, double before) {
  const Vec3<double> u = b.velocity_1 - b.velocity_2;
  const double reach = b.radius_1 + b.radius_2, uu = dot(u, u), su = dot(b.separation, u),
               past = dot(b.separation, b.separation) - reach * reach;
  if (!(past < 0.0) || !(su < 0.0)) return -1.0;
  // |s - u t| = reach, t > 0.
  const double t = (su + std::sqrt(su * su - uu * past)) / uu;
  if (!(t >= 0.0) || t > before) return -1.0;
  b.separation -= t * u;
  return t;
}

/// Largest overlap (m) of a head-on impact without damping at this speed (m/s): the energy is in the spring.
inline double largest_overlap(const ContactParameters& p, double radius, double mass, double speed) {
  const double unit = p.respond(radius, mass, 1.0, 0.0).normal_stiffness;  // dF/d(overlap) at an overlap of 1 m
  if (p.normal_law == NormalLaw::hooke) return speed * std::sqrt(mass / unit);
  return std::pow(15.0 / 8.0 * mass * speed * speed / unit, 0.4);  // m v^2 / 2 = 4/15 (unit) x^(5/2)
}

/// Moments of inertia over m r^2 with which two bodies turn: 2/5 of spheres, 1/2 of discs, 0 of what does not turn.
struct PairInertia {
  double factor_1 = 0.4, factor_2 = 0.4;
};

/// An impact from the touch to the release.
class ReferenceImpact {
 public:
  /// `steps`: about how many to take for the time in contact.
  ReferenceImpact(const ContactParameters& parameters, const ContactBodies& at_touch, const PairInertia& inertia = {}, int steps = 150)
      : force_{parameters, inertia, at_touch}, bodies_(at_touch) {
    const double speed = -dot(at_touch.separation, at_touch.velocity_1 - at_touch.velocity_2) / norm(at_touch.separation);
    if (!(speed > 0.0)) return;
    const double overlap = largest_overlap(parameters, at_touch.effective_radius(), at_touch.effective_mass(), speed);
    const double time = pi * overlap / speed;
    run(time / steps, 20.0 * time, speed);
  }

  /// False where they did not part within twenty times the time of an elastic impact.
  bool ended() const { return ended_; }
  double duration() const { return time_; }  ///< s
  PairMotion outgoing() const { return pair_motion(bodies_); }

 private:
  typedef std::array<Vec3<double>, 5> State;  // separation, velocities, angular velocities
  static constexpr std::size_t size = 15;

  static State unpack(const double* y) {
    State s;
    for (std::size_t k = 0; k < s.size(); ++k) s[k] = {y[3 * k], y[3 * k + 1], y[3 * k + 2]};
    return s;
  }
  static void pack(const State& s, double* y) {
    for (std::size_t k = 0; k < s.size(); ++k) {
      y[3 * k] = s[k].x;
      y[3 * k + 1] = s[k].y;
      y[3 * k + 2] = s[k].z;
    }
  }
  static State state_of(const ContactBodies& b) {
    return {b.separation, b.velocity_1, b.velocity_2, b.angular_velocity_1, b.angular_velocity_2};
  }
  static void put(const State& s, ContactBodies& b) {
    b.separation = s[0];
    b.velocity_1 = s[1];
    b.velocity_2 = s[2];
    b.angular_velocity_1 = s[3];
    b.angular_velocity_2 = s[4];
  }

  /// Derivatives, with the history of the contact as it was at the last step.
  struct Force {
    ContactParameters parameters;
    PairInertia inertia;
    ContactBodies last;
    ContactState history{};
    double time = 0.0;

    /// Force of the contact at a state, and its history there.
    ContactForce at(double t, const State& s, ContactState& then) const {
      ContactBodies b = last;
      put(s, b);
      // The law of the contact goes on smoothly to the touch and the release, which are located: damping acts up to there.
      const double least = (1.0 - 1e-12) * (b.radius_1 + b.radius_2), distance = norm(b.separation);
      if (distance > least) b.separation *= least / distance;
      then = history;
      if (t > time) {
        ContactBodies mean = b;
        mean.velocity_1 = 0.5 * (last.velocity_1 + b.velocity_1);
        mean.velocity_2 = 0.5 * (last.velocity_2 + b.velocity_2);
        mean.angular_velocity_1 = 0.5 * (last.angular_velocity_1 + b.angular_velocity_1);
        mean.angular_velocity_2 = 0.5 * (last.angular_velocity_2 + b.angular_velocity_2);
        contact_step(parameters, mean, t - time, then);
      }
      return contact_step(parameters, b, 0.0, then, false);
    }
    void advance(double t, const State& s) {
      ContactState then;
      at(t, s, then);
      history = then;
      put(s, last);
      time = t;
    }
  };
  struct Rates {
    const Force* force;
    void operator()(double t, const double* y, double* f) const {
      const State s = unpack(y);
      ContactState then;
      const ContactForce c = force->at(t, s, then);
      const ContactBodies& b = force->last;
      const auto turned = [](const Vec3<double>& torque, double factor, double mass, double radius) {
        return torque * (factor > 0.0 ? 1.0 / (factor * mass * radius * radius) : 0.0);
      };
      pack({s[1] - s[2], c.force * (1.0 / b.mass_1), c.force * (-1.0 / b.mass_2),
            turned(c.torque_1, force->inertia.factor_1, b.mass_1, b.radius_1),
            turned(c.torque_2, force->inertia.factor_2, b.mass_2, b.radius_2)},
           f);
    }
  };
  struct Gap {
    static constexpr std::size_t count = 1;
    double reach;
    void operator()(double, const double* y, double* g) const { g[0] = std::sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]) - reach; }
  };

  void run(double step, double limit, double speed) {
    std::vector<double> y(size), scale(size, speed);
    pack(state_of(bodies_), y.data());
    std::fill(scale.begin(), scale.begin() + 3, speed * step);
    std::fill(scale.begin() + 9, scale.end(), speed / std::min(bodies_.radius_1, bodies_.radius_2));
    const double reach = bodies_.radius_1 + bodies_.radius_2;
    // Damping of Hertz's contact begins and ends with the fourth root of the overlap: the steps are short there, and grow with it.
    while (time_ < limit && !ended_) {
      const double closing = -dot(bodies_.separation, bodies_.velocity_1 - bodies_.velocity_2) / norm(bodies_.separation);
      const double ahead = std::abs(pair_gap(bodies_)) / std::max(std::abs(closing), 1e-9 * speed);
      const double h = std::clamp(0.25 * ahead, step / 1024.0, step);
      Adams<Rates, Gap> adams({&force_}, {h, 2, 1e-9}, time_, y, scale, {reach});
      for (int left = std::clamp(int(std::min(0.5 * ahead / h, 32.0)), 4, 32); left > 0 && !ended_; --left) {
        adams.advance(limit);
        y = adams.state();
        const State now = unpack(y.data());
        force_.advance(adams.time(), now);
        put(now, bodies_);
        ended_ = pair_gap(bodies_) >= 0.0 && dot(bodies_.separation, bodies_.velocity_1 - bodies_.velocity_2) > 0.0;
      }
      time_ = adams.time();
    }
  }

  Force force_;
  ContactBodies bodies_;
  bool ended_ = false;
  double time_ = 0.0;
};

/// Whether the impact of these bodies in step n is one of every `kth`, on whatever process or thread it is asked.
inline bool picked(long one, long two, long n, long kth) {
  return (fnv1a(std::array<long, 3>{one, two, n}) >> 20) % static_cast<std::uint64_t>(kth) == 0;
}

/// An impact that goes on in a run, beside the reference, which is over.
struct ShadowImpact {
  long one = -1, two = -1;
  PairMotion expected{};
  Vec3<double> momentum{};                ///< kg m/s, of both at the touch
  double mass_1 = 0.0, mass_2 = 0.0;      ///< kg
  double radius_1 = 0.0, radius_2 = 0.0;  ///< m
  double speed = 0.0;                     ///< m/s, of the one against the other at the touch
  double elapsed = 0.0, duration = 0.0;   ///< s, since then, and in contact under the reference

  auto fields() { return std::tie(one, two, expected, momentum, mass_1, mass_2, radius_1, radius_2, speed, elapsed, duration); }

  /// Begins with bodies that overlap for the first time, less than `step` (s) after their touch. False where there is nothing to compare.
  bool begin(const ContactParameters& p, ContactBodies b, long first, long second, double step, const PairInertia& inertia = {}) {
    if (std::isinf(b.mass_1) || std::isinf(b.mass_2) || p.cohesion.on()) return false;
    elapsed = back_to_touch(b, step);
    if (elapsed < 0.0) return false;
    const ReferenceImpact reference(p, b, inertia);
    if (!reference.ended()) return false;
    one = first;
    two = second;
    expected = reference.outgoing();
    duration = reference.duration();
    mass_1 = b.mass_1;
    mass_2 = b.mass_2;
    radius_1 = b.radius_1;
    radius_2 = b.radius_2;
    momentum = mass_1 * b.velocity_1 + mass_2 * b.velocity_2;
    speed = norm(b.velocity_1 - b.velocity_2);
    return true;
  }

  void wait(double step) { elapsed += step; }
  /// They do not part: something holds them.
  bool lasts_too_long(double step) const { return elapsed > 3.0 * duration + 4.0 * step; }

  enum class Stage { going_on, compared, dropped };
  /// A step (s) later. `compared`: they have parted, and `found` is the deviation of their velocities from the reference, over `speed`.
  /// `dropped`: others took part, which the momentum tells, beside that of `gravity` (m/s^2); or they do not part.
  Stage follow(const ContactBodies& b, const Vec3<double>& gravity, double step, double& found) {
    wait(step);
    const double total = mass_1 + mass_2;
    const Vec3<double> lost = mass_1 * b.velocity_1 + mass_2 * b.velocity_2 - momentum - (total * elapsed) * gravity;
    // The velocities may be those of half a step ago.
    if (norm(lost) > 1e-6 * total * speed + 2.0 * total * step * norm(gravity) || lasts_too_long(step)) return Stage::dropped;
    if (pair_gap(b) < 0.0 || dot(b.separation, b.velocity_1 - b.velocity_2) <= 0.0) return Stage::going_on;
    found = deviation(pair_motion(b), expected, radius_1, radius_2, speed);
    return Stage::compared;
  }
};

}  // namespace dembark
