// Orientation of bodies, and their free rotation.
#pragma once

#include <cmath>
#include <tuple>

#include "../vec3.hpp"

namespace dembark {
namespace impact {

/// Of a rotation; unit.
struct Quaternion {
  double w = 1.0, x = 0.0, y = 0.0, z = 0.0;

  Vec3<double> turned(const Vec3<double>& v) const {
    const Vec3<double> q{x, y, z}, t = 2.0 * cross(q, v);
    return v + w * t + cross(q, t);
  }
  auto fields() { return std::tie(w, x, y, z); }
};

/// First q, then p.
inline Quaternion operator*(const Quaternion& p, const Quaternion& q) {
  return {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
          p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

/// About the direction of `turn` by its length (rad).
inline Quaternion rotation_by(const Vec3<double>& turn) {
  const double angle = norm(turn), part = angle > 0.0 ? std::sin(0.5 * angle) / angle : 0.5;
  return {std::cos(0.5 * angle), part * turn.x, part * turn.y, part * turn.z};
}

/// The direction and the angle (rad, at most half a turn) of a rotation; rotation_by() of it is q, or -q, which is the same.
inline Vec3<double> turn_of(const Quaternion& q) {
  const Vec3<double> axis{q.x, q.y, q.z};
  const double sine = norm(axis), part = sine > 0.0 ? 2.0 * std::atan2(sine, std::fabs(q.w)) / sine : 2.0;
  return (q.w < 0.0 ? -part : part) * axis;
}

inline Quaternion normalised(const Quaternion& q) {
  const double part = 1.0 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {part * q.w, part * q.x, part * q.y, part * q.z};
}

/// The shortest turn from z to `axis`, which is not zero; half a turn is one about x.
inline Quaternion rotation_to(const Vec3<double>& axis) {
  const Vec3<double> u = axis * (1.0 / norm(axis));
  // Twice the turn to the middle between both.
  return 1.0 + u.z > 1e-14 ? normalised({1.0 + u.z, -u.y, u.x, 0.0}) : Quaternion{0.0, 1.0, 0.0, 0.0};
}

/// Of a body with a moment of inertia `axial` about its axis u (unit) and `across` at right angles to it (kg m^2).
struct SymmetricInertia {
  double axial, across;

  /// Angular momentum (kg m^2/s) of the spin (rad/s).
  Vec3<double> momentum(const Vec3<double>& spin, const Vec3<double>& u) const {
    return across * spin + ((axial - across) * dot(spin, u)) * u;
  }
  /// Spin (rad/s) with the angular momentum.
  Vec3<double> spin(const Vec3<double>& momentum, const Vec3<double>& u) const {
    return (1.0 / across) * momentum + ((1.0 / axial - 1.0 / across) * dot(momentum, u)) * u;
  }
  /// J
  double energy(const Vec3<double>& spin, const Vec3<double>& u) const {
    const double along = dot(spin, u);
    return 0.5 * (across * dot(spin, spin) + (axial - across) * along * along);
  }
};

/// Free rotation in dt (s) of a body with the axis u (unit); exact. The axis turns about the angular momentum (kg m^2/s), which stays, with
/// |L| / across, and the body about its axis with (1 / axial - 1 / across) L u on top.
inline Quaternion free_turn(const SymmetricInertia& inertia, double dt, const Vec3<double>& momentum, const Vec3<double>& u) {
  const double own = (1.0 / inertia.axial - 1.0 / inertia.across) * dot(momentum, u);
  return rotation_by((dt / inertia.across) * momentum) * rotation_by((dt * own) * u);
}

}  // namespace impact
}  // namespace dembark
