// The forces of the last step, for an engine that asks for the forces of one moment again where one run ends and the next begins:
// computing them anew, from the velocities of the full step, would give others.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

#include "geometry.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

class LastForces {
 public:
  std::vector<ContactWrench> wrenches;  ///< of the contacts

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
    const auto near = [](const Vec3<double>& a, const Vec3<double>& b) { return norm(a - b) <= 1e-12 * (norm(a) + norm(b)); };
    const auto whole = [&box](double Vec3<double>::* axis, int k, const Vec3<double>& moved) {
      const double length = box.length.*axis, way = moved.*axis;
      return way == 0.0 || (box.periodic[k] && std::fabs(std::fabs(way) - length) <= 1e-12 * length);
    };
    const auto same = [&](const Body& now, const Body& then) {
      const Vec3<double> moved = now.position - then.position;
      Body put_back = now;  // but for what may differ
      put_back.position = then.position;
      put_back.force = then.force;
      put_back.torque = then.torque;
      return to_numbers(put_back) == to_numbers(then) && near(now.force, then.force) && near(now.torque, then.torque) &&
             whole(&Vec3<double>::x, 0, moved) && whole(&Vec3<double>::y, 1, moved) && whole(&Vec3<double>::z, 2, moved);
    };
    return std::equal(bodies.begin(), bodies.end(), bodies_.begin(), bodies_.end(), same);
  }

  auto fields() { return std::tie(wrenches, bodies_); }

 private:
  std::vector<Body> bodies_;
};

}  // namespace impact
}  // namespace dembark
