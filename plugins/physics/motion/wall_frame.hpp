// The frame that a wall carries along, in which it rests: for surfaces that are stored once, at their place before the motion.
#pragma once

#include <cmath>

#include "prescribed_motion.hpp"

namespace dembark {

class WallFrame {
 public:
  /// Of a wall that has not moved.
  WallFrame() = default;
  WallFrame(const PrescribedMotion& motion, const WallState& state)
      : moves_(true),
        axis_(motion.axis()),
        origin_(motion.centre({})),
        centre_(motion.centre(state)),
        sine_(std::sin(state.angle)),
        less_cosine_(2.0 * std::pow(std::sin(0.5 * state.angle), 2)) {}

  /// Where in the wall's frame a place (m) is.
  DEMBARK_FUNCTION Vec3<double> inside(const Vec3<double>& place) const {
    return moves_ ? origin_ + turned(place - centre_, -sine_) : place;
  }
  /// A vector of the wall's frame, as it is seen from outside.
  DEMBARK_FUNCTION Vec3<double> outside(const Vec3<double>& vector) const { return moves_ ? turned(vector, sine_) : vector; }

 private:
  /// Rodrigues' formula; with 1 - cos, for small angles.
  DEMBARK_FUNCTION Vec3<double> turned(const Vec3<double>& v, double sine) const {
    const Vec3<double> side = cross(axis_, v);
    return v + sine * side + less_cosine_ * cross(axis_, side);
  }

  bool moves_ = false;
  Vec3<double> axis_{}, origin_{}, centre_{};
  double sine_ = 0.0, less_cosine_ = 0.0;
};

}  // namespace dembark
