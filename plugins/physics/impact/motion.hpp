// What a step does to the bodies: sums of forces, and the velocities they lead to.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "../kinematics.hpp"
#include "assembly.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// What the motion of a body answers with.
struct BodyResponse {
  double inverse = 0.0;       ///< 1/m', 1/kg
  double spin_inverse = 0.0;  ///< 1/I, 1/(kg m^2)
  double damping = 0.0;       ///< lambda if it acts in this step, N s/m
  Vec3<double> free{};        ///< f - lambda v, N
  Vec3<double> torque{};      ///< N m
};

/// Sums over the contacts of a body, in parts that are cleared and read together: the loops over them cost what their memory does.
struct NormalSum {
  Vec3<double> force{};  ///< N
  int active = 0;        ///< contacts with N > 0
};
/// m/s and rad/s.
struct Velocity {
  Vec3<double> velocity{}, spin{};
};

/// What friction reads of a body: v', omega', and its response shared out among the contacts that carry a force.
struct Moved {
  Vec3<double> velocity{}, spin{};           ///< m/s, rad/s
  double inverse = 0.0, spin_inverse = 0.0;  ///< 1/kg, 1/(kg m^2)
};

class Motion {
 public:
  std::vector<BodyResponse> response;
  std::vector<NormalSum> normal;
  std::vector<ContactWrench> tangential;
  std::vector<Velocity> change;  ///< v' - v, omega' - omega; see move()
  std::vector<int> damped;       ///< bodies with lambda > 0, in the order of the contacts

  /// Begins a step; `bodies` must outlive it. Throws std::invalid_argument with one line about the body that is wrong.
  void begin(const std::vector<Body>& bodies, double dt, double kick) {
    bodies_ = &bodies;
    interval_ = kick * dt;
    response.resize(bodies.size());
    normal.assign(bodies.size(), NormalSum());
    tangential.assign(bodies.size(), ContactWrench());
    change.resize(bodies.size());
    moved_.resize(bodies.size());
    acceleration_.resize(bodies.size());
    damped.clear();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      check(bodies[b]);
      response[b] = {1.0 / bodies[b].mass, 1.0 / bodies[b].inertia, 0.0, bodies[b].force, bodies[b].torque};
    }
  }

  /// Body damping lambda (N s/m) acts on body b; stretch: g tau (s).
  void damp(int b, double lambda, double stretch) {
    BodyResponse& s = response[b];
    if (lambda == 0.0 || s.damping > 0.0 || s.inverse == 0.0) return;
    s.damping = lambda;
    s.inverse = 1.0 / ((*bodies_)[b].mass + stretch * lambda);
    s.free -= lambda * (*bodies_)[b].velocity;
    damped.push_back(b);
  }

  void clear_normal() { std::fill(normal.begin(), normal.end(), NormalSum()); }
  void add_normal(const Row& r, double force) {
    normal[r.a].force += force * r.normal;
    ++normal[r.a].active;
    if (r.b < 0) return;
    normal[r.b].force -= force * r.normal;
    ++normal[r.b].active;
  }
  void clear_tangential() { std::fill(tangential.begin(), tangential.end(), ContactWrench()); }
  void add_tangential(const Row& r, const Vec3<double>& t) {
    const Vec3<double> moment = cross(r.normal, t);
    tangential[r.a].force += t;
    tangential[r.a].torque -= r.arm_a * moment;
    if (r.b < 0) return;
    tangential[r.b].force -= t;
    tangential[r.b].torque -= r.arm_b * moment;
  }

  /// Rate of the gap (m/s) with the velocities v.
  double gap_rate(const Contact& r) const {
    return dot(r.normal, (*bodies_)[r.a].velocity - (r.b >= 0 ? (*bodies_)[r.b].velocity : r.point_velocity));
  }
  /// Takes the forces but the normal ones over, for gap_acceleration.
  void accelerate() {
    for (std::size_t b = 0; b < response.size(); ++b) acceleration_[b] = response[b].inverse * (response[b].free + tangential[b].force);
  }
  /// Acceleration of the gap (m/s^2) by all forces but the normal ones.
  double gap_acceleration(const Contact& r) const {
    return dot(r.normal, r.b >= 0 ? acceleration_[r.a] - acceleration_[r.b] : acceleration_[r.a]);
  }
  /// What a body adds to the change of its gaps (m): rate (s) times v, and scale (s^2) times the acceleration by all forces; after move().
  Vec3<double> shift(std::size_t b, double rate, double scale) const {
    return rate * (*bodies_)[b].velocity + (scale / interval_) * change[b].velocity;
  }
  /// As gap_acceleration, by all forces; after move().
  double whole_gap_acceleration(const Contact& r) const {
    const Vec3<double> gain = r.b >= 0 ? change[r.a].velocity - change[r.b].velocity : change[r.a].velocity;
    return dot(r.normal, gain) / interval_;
  }
  /// Response (1/kg) of the contact to a tangential force, the bodies shared out among their active contacts; after move().
  double tangential_response(const Row& r) const {
    const Moved& a = moved_[std::size_t(r.a)];
    const double w = a.inverse + r.arm_a * r.arm_a * a.spin_inverse;
    if (r.b < 0) return w;
    const Moved& b = moved_[std::size_t(r.b)];
    return w + (b.inverse + r.arm_b * r.arm_b * b.spin_inverse);
  }

  /// Takes all forces over; what surface_velocity reads are v' and omega' then.
  void move() {
    for (std::size_t b = 0; b < response.size(); ++b) {
      const BodyResponse& s = response[b];
      change[b].velocity = (interval_ * s.inverse) * (s.free + tangential[b].force + normal[b].force);
      change[b].spin = (interval_ * s.spin_inverse) * (s.torque + tangential[b].torque);
      const double contacts = normal[b].active;
      moved_[b] = {(*bodies_)[b].velocity + change[b].velocity, (*bodies_)[b].spin + change[b].spin, contacts * s.inverse,
                   contacts * s.spin_inverse};
    }
  }
  /// Velocities `part` of the way from v to v'; after move().
  void go_back(double part) {
    for (std::size_t b = 0; b < moved_.size(); ++b) {
      moved_[b].velocity = (*bodies_)[b].velocity + part * change[b].velocity;
      moved_[b].spin = (*bodies_)[b].spin + part * change[b].spin;
    }
  }

  /// Velocity of the surface of a relative to that of b (m/s), as move() or go_back() left the bodies.
  Vec3<double> surface_velocity(const Row& r) const {
    const Moved& a = moved_[std::size_t(r.a)];
    Vec3<double> v = a.velocity, spin = r.arm_a * a.spin;
    if (r.b >= 0) {
      const Moved& b = moved_[std::size_t(r.b)];
      v -= b.velocity;
      spin += r.arm_b * b.spin;
    } else {
      v -= r.point_velocity;
    }
    return v - cross(spin, r.normal);
  }

  /// Turn of the contact about its normal in the step (rad): the friction spring turns with the bodies.
  double twist(const Row& r, double dt) const {
    return contact_twist(r.normal, (*bodies_)[r.a].spin, r.b >= 0 ? (*bodies_)[r.b].spin : Vec3<double>{}, dt);
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
  std::vector<Vec3<double>> acceleration_;  ///< m/s^2, by all forces but the normal ones; see accelerate()
  std::vector<Moved> moved_;                ///< see move()
  double interval_ = 0.0;
};

}  // namespace impact
}  // namespace dembark
