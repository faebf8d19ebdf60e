// The forces of the last step, for an engine that asks for the forces of one moment again where one run ends and the next begins:
// computing them anew, from the velocities of the full step, would give others.
#pragma once

#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

#include "pairs.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

class LastForces {
 public:
  std::vector<Vec3<double>> force, torque;  ///< N and N m, of the contacts

  /// Of a step: its bodies, with the forces of everything else.
  void keep(const std::vector<Body>& bodies) { bodies_ = bodies; }
  /// At its end: the bodies as the engine has moved them.
  void move(const std::vector<Body>& bodies) {
    if (bodies.size() != bodies_.size()) return bodies_.clear();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies_[i].position = bodies[i].position;
      bodies_[i].velocity = bodies[i].velocity;
      bodies_[i].spin = bodies[i].spin;
    }
  }

  /// Whether they are those of these bodies: nothing was changed, added or removed since, but for whole lengths of a periodic box and
  /// for the rounding of the forces of everything else.
  bool hold(const std::vector<Body>& bodies, const PeriodicBox& box) const {
    if (bodies.size() != bodies_.size()) return false;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Body &now = bodies[i], &then = bodies_[i];
      if (now.id != then.id || now.material != then.material || now.mass != then.mass || now.inertia != then.inertia ||
          now.radius != then.radius || !same(now.velocity, then.velocity) || !same(now.spin, then.spin) || !near(now.force, then.force) ||
          !near(now.torque, then.torque))
        return false;
      const Vec3<double> moved = now.position - then.position;
      if (!whole(moved.x, box.periodic[0], box.length.x) || !whole(moved.y, box.periodic[1], box.length.y) ||
          !whole(moved.z, box.periodic[2], box.length.z))
        return false;
    }
    return true;
  }

  auto fields() { return std::tie(force, torque, bodies_); }

 private:
  static bool same(const Vec3<double>& a, const Vec3<double>& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
  static bool near(const Vec3<double>& a, const Vec3<double>& b) { return norm(a - b) <= 1e-12 * (norm(a) + norm(b)); }
  static bool whole(double moved, bool periodic, double length) {
    return moved == 0.0 || (periodic && std::fabs(std::fabs(moved) - length) <= 1e-12 * length);
  }

  std::vector<Body> bodies_;
};

}  // namespace impact
}  // namespace dembark
