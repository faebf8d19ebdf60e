// Local error of an engine's own steps, from the accelerations of the last ones: no force is computed anew.
//
// Velocity Verlet, and leapfrog, whose positions are the same, take from x(n), v(n) and the accelerations a
//   x(n+1) = x(n) + h v(n) + h^2/2 a(n)            v(n+1) = v(n) + h/2 [a(n) + a(n+1)].
// The next term of Taylor's series, and what the corrector of Adams and Moulton (adams.hpp) has beyond the trapezoid, are their errors,
//   e_x = h^2/6 [a(n+1) - a(n)]                    e_v = h/24 [-3 a(n+1) + 7 a(n) - 5 a(n-1) + a(n-2)],
// exact minus computed to leading order, for angular velocities as for velocities. Where a contact begins or ends, or friction begins to
// slide, a jumps in its derivatives; there the estimates are of the right size, no more.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>

#include "../contact_energy.hpp"  // SixVector

namespace dembark {

/// What the step that ended left undone: of position (m), velocity (m/s) and angular velocity (rad/s).
struct LocalError {
  std::array<double, 3> position{};
  SixVector velocity{};
};

/// Accelerations (m/s^2, then rad/s^2) of a body in its last steps: nineteen numbers, which an engine may keep beside the body.
class AccelerationHistory {
 public:
  /// Takes the accelerations at the end of a step of h (s). False as long as there are too few, or after forget().
  bool step(const SixVector& newest, double h, LocalError& error) {
    const bool enough = known_ == double(kept_.size());
    if (enough) {
      for (std::size_t k = 0; k < newest.size(); ++k)
        error.velocity[k] = h / 24.0 * (-3.0 * newest[k] + 7.0 * kept_[0][k] - 5.0 * kept_[1][k] + kept_[2][k]);
      for (std::size_t k = 0; k < error.position.size(); ++k) error.position[k] = h * h / 6.0 * (newest[k] - kept_[0][k]);
    } else {
      known_ += 1.0;
    }
    kept_[2] = kept_[1];
    kept_[1] = kept_[0];
    kept_[0] = newest;
    return enough;
  }
  /// The body was moved by other means, or the step was changed.
  void forget() { known_ = 0.0; }

 private:
  std::array<SixVector, 3> kept_{};  ///< newest first
  double known_ = 0.0;               ///< how many of them are right
};

/// What errors are measured by, and how large they may be over it.
struct ErrorScales {
  double length = 0.0;  ///< m, > 0: of position, such as the mean diameter
  double speed = 0.0;   ///< m/s, > 0: of velocity, and of angular velocity times the radius
  double limit = 1e-3;  ///< > 0

  /// The one clear line about what is wrong with these, or nullptr.
  const char* error() const {
    if (!(length > 0.0) || std::isinf(length)) return "length (m) must be a number > 0";
    if (!(speed > 0.0) || std::isinf(speed)) return "speed (m/s) must be a number > 0";
    if (!(limit > 0.0)) return "limit must be > 0";
    return nullptr;
  }
};

/// Errors of one kind over a run, or over the part of one process: these merge in any order.
struct ErrorTally {
  double largest = 0.0, squares = 0.0, count = 0.0, exceeded = 0.0;
  long body = -1;  ///< the one with the largest error; of equals the lowest

  void add(double value, long id, double limit) {
    squares += value * value;
    count += 1.0;
    if (value > limit) exceeded += 1.0;
    note(value, id);
  }
  void merge(const ErrorTally& other) {
    squares += other.squares;
    count += other.count;
    exceeded += other.exceeded;
    if (other.body >= 0) note(other.largest, other.body);
  }
  double rms() const { return count > 0.0 ? std::sqrt(squares / count) : 0.0; }
  auto fields() { return std::tie(largest, squares, count, exceeded, body); }

 private:
  void note(double value, long id) {
    if (body >= 0 && (value < largest || (value == largest && id > body))) return;
    largest = value;
    body = id;
  }
};

/// Of positions, velocities and angular velocities, each over its scale.
struct StepErrors {
  ErrorTally position, velocity, spin;

  void add(const LocalError& e, double radius, long id, const ErrorScales& scales) {
    position.add(size(e.position[0], e.position[1], e.position[2]) / scales.length, id, scales.limit);
    velocity.add(size(e.velocity[0], e.velocity[1], e.velocity[2]) / scales.speed, id, scales.limit);
    spin.add(size(e.velocity[3], e.velocity[4], e.velocity[5]) * radius / scales.speed, id, scales.limit);
  }
  void merge(const StepErrors& other) {
    position.merge(other.position);
    velocity.merge(other.velocity);
    spin.merge(other.spin);
  }
  auto fields() { return std::tie(position, velocity, spin); }

 private:
  static double size(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }
};

}  // namespace dembark
