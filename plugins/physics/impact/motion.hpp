// What a step does to the bodies: sums of forces, and the velocities they lead to.
#pragma once

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "assembly.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// Sums over the contacts of a body, and what its motion answers with.
struct BodySums {
  double inverse = 0.0;       ///< 1/m', 1/kg
  double spin_inverse = 0.0;  ///< 1/I, 1/(kg m^2)
  double damping = 0.0;       ///< lambda if it acts in this step, N s/m
  int active = 0;             ///< contacts with N > 0
  Vec3<double> free{};        ///< f - lambda v, N
  Vec3<double> normal{}, tangential{}, torque{};
};

class Motion {
 public:
  std::vector<BodySums> sums;
  std::vector<int> damped;  ///< bodies with lambda > 0, in the order of the contacts

  /// Begins a step; `bodies` must outlive it. Throws std::invalid_argument with one line about the body that is wrong.
  void begin(const std::vector<Body>& bodies, double dt, double kick) {
    bodies_ = &bodies;
    interval_ = kick * dt;
    sums.resize(bodies.size());
    damped.clear();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      check(bodies[b]);
      sums[b] = BodySums();
      sums[b].inverse = 1.0 / bodies[b].mass;
      sums[b].spin_inverse = 1.0 / bodies[b].inertia;
      sums[b].free = bodies[b].force;
    }
  }

  /// Body damping lambda (N s/m) acts on body b; response: g tau (s).
  void damp(int b, double lambda, double response) {
    BodySums& s = sums[b];
    if (lambda == 0.0 || s.damping > 0.0 || s.inverse == 0.0) return;
    s.damping = lambda;
    s.inverse = 1.0 / ((*bodies_)[b].mass + response * lambda);
    s.free -= lambda * (*bodies_)[b].velocity;
    damped.push_back(b);
  }

  void clear_normal() {
    for (BodySums& s : sums) s.normal = {}, s.active = 0;
  }
  void add_normal(const Row& r, double force) {
    sums[r.a].normal += force * r.normal;
    ++sums[r.a].active;
    if (r.b < 0) return;
    sums[r.b].normal -= force * r.normal;
    ++sums[r.b].active;
  }
  void clear_tangential() {
    for (BodySums& s : sums) s.tangential = s.torque = {};
  }
  void add_tangential(const Row& r, const Vec3<double>& t) {
    const Vec3<double> moment = cross(r.normal, t);
    sums[r.a].tangential += t;
    sums[r.a].torque -= r.arm_a * moment;
    if (r.b < 0) return;
    sums[r.b].tangential -= t;
    sums[r.b].torque -= r.arm_b * moment;
  }

  /// Rate of the gap (m/s) with the velocities v.
  double gap_rate(const Row& r) const {
    return dot(r.normal, (*bodies_)[r.a].velocity - (r.b >= 0 ? (*bodies_)[r.b].velocity : r.point_velocity));
  }
  /// Acceleration of the gap (m/s^2) by all forces but the normal ones.
  double gap_acceleration(const Row& r) const {
    Vec3<double> a = sums[r.a].inverse * (sums[r.a].free + sums[r.a].tangential);
    if (r.b >= 0) a -= sums[r.b].inverse * (sums[r.b].free + sums[r.b].tangential);
    return dot(r.normal, a);
  }
  /// Response (1/kg) of the contact to a tangential force, the bodies shared out among their active contacts.
  double tangential_response(const Row& r) const {
    const BodySums& a = sums[r.a];
    double w = a.active * (a.inverse + r.arm_a * r.arm_a * a.spin_inverse);
    if (r.b < 0) return w;
    const BodySums& b = sums[r.b];
    return w + b.active * (b.inverse + r.arm_b * r.arm_b * b.spin_inverse);
  }

  /// v' - v and omega' - omega of a body, all forces as they are.
  Vec3<double> velocity_change(int b) const {
    const BodySums& s = sums[b];
    return (interval_ * s.inverse) * (s.free + s.tangential + s.normal);
  }
  Vec3<double> spin_change(int b) const { return (interval_ * sums[b].spin_inverse) * ((*bodies_)[b].torque + sums[b].torque); }

  /// Velocity of the surface of a relative to that of b (m/s), `part` of the way from v to v'.
  Vec3<double> surface_velocity(const Row& r, double part) const {
    const Body& a = (*bodies_)[r.a];
    Vec3<double> v = a.velocity + part * velocity_change(r.a);
    Vec3<double> spin = r.arm_a * (a.spin + part * spin_change(r.a));
    if (r.b >= 0) {
      const Body& b = (*bodies_)[r.b];
      v -= b.velocity + part * velocity_change(r.b);
      spin += r.arm_b * (b.spin + part * spin_change(r.b));
    } else {
      v -= r.point_velocity;
    }
    return v - cross(spin, r.normal);
  }

  /// Turn of the contact about its normal in the step (rad): the friction spring turns with the bodies.
  double twist(const Row& r, double dt) const {
    const Vec3<double>& a = (*bodies_)[r.a].spin;
    return dt * (r.b >= 0 ? 0.5 * dot(a + (*bodies_)[r.b].spin, r.normal) : dot(a, r.normal));
  }

 private:
  static void check(const Body& b) {
    const char* wrong = nullptr;
    if (!(b.mass > 0.0)) wrong = "mass must be > 0 kg";
    else if (!(b.inertia > 0.0)) wrong = "inertia must be > 0 kg m^2";
    else if (!(b.radius >= 0.0) || std::isinf(b.radius)) wrong = "radius must be >= 0 m and finite";
    else if (b.id < 0) wrong = "ids must be >= 0";
    else {
      const Vec3<double> sum = b.position + b.velocity + b.spin + b.force + b.torque;
      if (!std::isfinite(sum.x + sum.y + sum.z)) wrong = "position, velocity, spin, force and torque must be finite numbers";
    }
    if (wrong) throw std::invalid_argument("body " + std::to_string(b.id) + ": " + wrong);
  }

  const std::vector<Body>* bodies_ = nullptr;
  double interval_ = 0.0;
};

}  // namespace impact
}  // namespace dembark
