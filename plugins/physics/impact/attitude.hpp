// How capsules lie, and how they turn from step to step.
#pragma once

#include <array>
#include <cmath>
#include <tuple>

#include "capsules.hpp"
#include "rotation.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// Unit; of a body without a length any will do.
inline Vec3<double> axis_of(const Body& b) {
  const double half = norm(b.half_axis);
  return half > 0.0 ? b.half_axis * (1.0 / half) : Vec3<double>{0.0, 0.0, 1.0};
}
inline SymmetricInertia inertia_of(const Body& b) { return {has_length(b) ? b.axial_inertia : b.inertia, b.inertia}; }

/// Change of spin (rad/s) by a torque (N m) in a stretch of time (s).
inline Vec3<double> kicked(const Body& b, const Vec3<double>& torque, double stretch) {
  if (!has_length(b) || std::isinf(b.inertia)) return (stretch / b.inertia) * torque;
  return stretch * inertia_of(b).spin(torque, axis_of(b));
}

/// Of a capsule in a leapfrog. The angular momentum is what is kept, to the last digit; the spin follows.
struct Attitude {
  double length = 0.0;       ///< m, >= 0, between the centres of the caps
  Quaternion orientation{};  ///< from the axes of the body, z along its own, to space
  Vec3<double> momentum{};   ///< kg m^2/s, of rotation

  /// Makes the body the solid capsule that lies so.
  void shape(Body& b) const {
    const CapsuleInertia own = capsule_inertia(b.mass, b.radius, length);
    b.inertia = own.across;
    b.axial_inertia = own.axial;
    lay(b);
  }
  /// Lays the body along its axis.
  void lay(Body& b) const { b.half_axis = (0.5 * length) * orientation.turned({0.0, 0.0, 1.0}); }
  /// With the spin that the body has.
  void begin(const Body& b) { momentum = std::isinf(b.inertia) ? Vec3<double>() : inertia_of(b).momentum(b.spin, axis_of(b)); }
  /// Free rotation for dt (s).
  void turn(Body& b, double dt) {
    if (std::isinf(b.inertia)) {
      orientation = normalised(rotation_by(dt * b.spin) * orientation);
      return lay(b);
    }
    orientation = normalised(free_turn(b, dt) * orientation);
    lay(b);
    spin(b);
  }
  /// Gives the body the spin that belongs to the angular momentum.
  void spin(Body& b) const { b.spin = inertia_of(b).spin(momentum, axis_of(b)); }
  /// The spin (rad/s) with which an engine turns the body in dt (s) as turn() does.
  Vec3<double> mean_spin(const Body& b, double dt) const { return turn_of(free_turn(b, dt)) * (1.0 / dt); }

  auto fields() { return std::tie(length, orientation, momentum); }

 private:
  Quaternion free_turn(const Body& b, double dt) const {
    return impact::free_turn(inertia_of(b), dt, momentum, orientation.turned({0.0, 0.0, 1.0}));
  }
};

/// For output: length, direction, orientation.
inline std::array<double, 8> table_row(const Attitude& a) {
  const Vec3<double> axis = a.orientation.turned({0.0, 0.0, 1.0});
  const Quaternion& q = a.orientation;
  return {a.length, axis.x, axis.y, axis.z, q.w, q.x, q.y, q.z};
}

}  // namespace impact
}  // namespace dembark
