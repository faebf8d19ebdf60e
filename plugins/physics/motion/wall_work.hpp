// What a moving wall does to grains: force, torque, power, and their sums over a run. Engines add up the contacts; the rest is here.
#pragma once

#include "../vec3.hpp"
#include "prescribed_motion.hpp"

namespace dembark {

/// The time of an engine's steps, from when a motion begins: step times time step, so that it is exact to the last digit however long the
/// run; across changes of the time step too. Plain numbers, for restarts.
struct MotionClock {
  double origin = 0.0, step = 0.0, length = 0.0;  ///< s, at this step, and s of the steps from there on
  double begun = 0.0;                             ///< s, when the motion began: where the wall stood then, its displacement is zero
  double running = 0.0;                           ///< 1: it has begun

  /// A motion begins at step `n`, unless it has; the engine's own clock had `time` (s) at step `at`, and runs by `h` (s) a step.
  void begin(double time, long at, long n, double h) {
    if (running > 0.0) return;
    *this = {time, double(at), h, 0.0, 1.0};
    begun = this->time(n, h);
  }
  /// s, at the beginning of step `n`, which and the next ones are of `h` s.
  double time(long n, double h) {
    if (h != length) {
      origin += (double(n) - step) * length;
      step = double(n);
      length = h;
    }
    return origin + (double(n) - step) * length;
  }
};

/// Force (N) of a wall on all grains, and its torque (N m) about a point.
struct WallLoad {
  Vec3<double> force{}, torque{};

  /// Of a force on a grain at `from`, seen from the point, and a torque about the grain's centre.
  void add(const Vec3<double>& from, const Vec3<double>& on_grain, const Vec3<double>& about_centre) {
    force += on_grain;
    torque += cross(from, on_grain) + about_centre;
  }
};

/// W, of a wall whose load is about centre(state).
inline double wall_power(const WallLoad& load, const WallState& state, const Vec3<double>& axis) {
  return dot(load.force, state.velocity) + state.rate * dot(load.torque, axis);
}

/// Work (J) and impulse (N s) on the grains up to now, by the trapezoidal rule over every step; plain numbers, for restarts.
struct WallSums {
  double work = 0.0;
  Vec3<double> impulse{};
  double power = 0.0;  ///< W, of the last step
  Vec3<double> force{};
  double begun = 0.0;  ///< 1: there is a last step

  void begin(double now, const Vec3<double>& by) {
    power = now;
    force = by;
    begun = 1.0;
  }
  void step(double h, double now, const Vec3<double>& by) {
    work += 0.5 * h * (power + now);
    impulse += (0.5 * h) * (force + by);
    begin(now, by);
  }
};

/// How the velocity of a wall's surface changes from the half step before a time to the one after it, over the step: of the mean velocities
/// of the steps, with the wall where it is at that time. Half of it from the former is the velocity at the time, to second order.
struct WallAcceleration {
  Vec3<double> linear{}, angular{}, centre{};  ///< m/s^2, rad/s^2, m

  Vec3<double> at(const Vec3<double>& place) const { return linear + cross(angular, place - centre); }
};
inline WallAcceleration wall_acceleration(const PrescribedMotion& motion, double t, double h) {
  const WallStep before = motion.step(t - h, h), after = motion.step(t, h);
  return {(1.0 / h) * (after.velocity - before.velocity), ((after.rate - before.rate) / h) * motion.axis(), motion.centre(motion.at(t))};
}

}  // namespace dembark
