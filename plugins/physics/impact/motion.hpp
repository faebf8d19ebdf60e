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
  Vec3<double> axis{};        ///< of a capsule, unit
  double axial = 0.0;         ///< 1/I about it less that across it, 1/(kg m^2)

  /// rad/s^2
  Vec3<double> turned_by(const Vec3<double>& moment) const {
    if (axial == 0.0) return spin_inverse * moment;
    return spin_inverse * moment + (axial * dot(moment, axis)) * axis;
  }
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
  std::vector<Vec3<double>> normal_torque;  ///< N m; empty where no contact has a lever
  std::vector<ContactWrench> tangential;
  std::vector<Velocity> change;  ///< v' - v, omega' - omega; see move()
  std::vector<int> damped;       ///< bodies with lambda > 0, in the order of the contacts

  /// Begins a step; `bodies` must outlive it. Throws std::invalid_argument with one line about the body that is wrong.
  void begin(const std::vector<Body>& bodies, double dt, double kick) {
    bodies_ = &bodies;
    interval_ = kick * dt;
    response.resize(bodies.size());
    levers_ = std::any_of(bodies.begin(), bodies.end(), has_length);
    normal.assign(bodies.size(), NormalSum());
    normal_torque.assign(levers_ ? bodies.size() : 0, Vec3<double>());
    angular_.resize(normal_torque.size());
    tangential.assign(bodies.size(), ContactWrench());
    change.resize(bodies.size());
    moved_.resize(bodies.size());
    acceleration_.resize(bodies.size());
    damped.clear();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      check(bodies[b]);
      response[b] = {1.0 / bodies[b].mass, 1.0 / bodies[b].inertia, 0.0, bodies[b].force, bodies[b].torque};
      if (!levers_ || !has_length(bodies[b])) continue;
      response[b].axis = bodies[b].half_axis * (1.0 / norm(bodies[b].half_axis));
      response[b].axial = 1.0 / bodies[b].axial_inertia - response[b].spin_inverse;
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

  void clear_normal() {
    std::fill(normal.begin(), normal.end(), NormalSum());
    std::fill(normal_torque.begin(), normal_torque.end(), Vec3<double>());
  }
  void add_normal(const Row& r, double force) {
    normal[r.a].force += force * r.normal;
    ++normal[r.a].active;
    if (r.lever) {
      normal_torque[r.a] += force * r.moment_a;
      if (r.b >= 0) normal_torque[r.b] -= force * r.moment_b;
    }
    if (r.b < 0) return;
    normal[r.b].force -= force * r.normal;
    ++normal[r.b].active;
  }
  void clear_tangential() { std::fill(tangential.begin(), tangential.end(), ContactWrench()); }
  void add_tangential(const Row& r, const Vec3<double>& t) {
    const Vec3<double> moment = cross(r.normal, t);
    tangential[r.a].force += t;
    tangential[r.a].torque -= r.arm_a * moment;
    if (r.lever) {
      tangential[r.a].torque += cross(r.offset_a, t);
      if (r.b >= 0) tangential[r.b].torque -= cross(r.offset_b, t);
    }
    if (r.b < 0) return;
    tangential[r.b].force -= t;
    tangential[r.b].torque -= r.arm_b * moment;
  }

  /// Rate of the gap (m/s) with the velocities v.
  double gap_rate(const Contact& r) const {
    const double rate = dot(r.normal, (*bodies_)[r.a].velocity - (r.b >= 0 ? (*bodies_)[r.b].velocity : r.point_velocity));
    return r.lever ? rate + swing(r, (*bodies_)[r.a].spin, r.b >= 0 ? (*bodies_)[r.b].spin : Vec3<double>()) : rate;
  }
  /// Takes the forces but the normal ones over, for gap_acceleration.
  void accelerate() {
    for (std::size_t b = 0; b < response.size(); ++b) acceleration_[b] = response[b].inverse * (response[b].free + tangential[b].force);
    for (std::size_t b = 0; b < angular_.size(); ++b) angular_[b] = response[b].turned_by(response[b].torque + tangential[b].torque);
  }
  /// Acceleration of the gap (m/s^2) by all forces but the normal ones.
  double gap_acceleration(const Contact& r) const {
    const double linear = dot(r.normal, r.b >= 0 ? acceleration_[r.a] - acceleration_[r.b] : acceleration_[r.a]);
    return r.lever ? linear + swing(r, angular_[r.a], r.b >= 0 ? angular_[r.b] : Vec3<double>()) : linear;
  }
  /// What a body adds to the change of any gap at most (m): rate (s) times v, and scale (s^2) times the acceleration by all forces; after
  /// move().
  double shift(std::size_t b, double rate, double scale) const {
    const Body& body = (*bodies_)[b];
    const double linear = norm(rate * body.velocity + (scale / interval_) * change[b].velocity);
    return levers_ ? linear + norm(body.half_axis) * norm(rate * body.spin + (scale / interval_) * change[b].spin) : linear;
  }
  /// As gap_acceleration, by all forces; after move().
  double whole_gap_acceleration(const Contact& r) const {
    const Vec3<double> gain = r.b >= 0 ? change[r.a].velocity - change[r.b].velocity : change[r.a].velocity;
    const double linear = dot(r.normal, gain);
    return (r.lever ? linear + swing(r, change[r.a].spin, r.b >= 0 ? change[r.b].spin : Vec3<double>()) : linear) / interval_;
  }
  /// Response (1/kg) of the contact to a tangential force, the bodies shared out among their active contacts; after move(). Where it
  /// depends on the direction of the force, the largest, which bounds the others.
  double tangential_response(const Row& r) const {
    if (r.lever) return largest_response(r);
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
      if (levers_) change[b].spin = interval_ * s.turned_by(s.torque + tangential[b].torque + normal_torque[b]);
      else change[b].spin = (interval_ * s.spin_inverse) * (s.torque + tangential[b].torque);
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
    if (r.lever) v += cross(a.spin, r.offset_a);
    if (r.b >= 0) {
      const Moved& b = moved_[std::size_t(r.b)];
      v -= b.velocity;
      spin += r.arm_b * b.spin;
      if (r.lever) v -= cross(b.spin, r.offset_b);
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
  /// Rate of a gap (m/s) by these spins (rad/s), or its acceleration by angular accelerations.
  static double swing(const Contact& r, const Vec3<double>& a, const Vec3<double>& b) {
    return dot(r.normal, cross(a, r.offset_a) - cross(b, r.offset_b));
  }

  /// See tangential_response(): of the 2 x 2 matrix in the plane of the contact.
  double largest_response(const Row& r) const {
    const Vec3<double> n = r.normal;
    Vec3<double> t = std::fabs(n.x) < 0.6 ? cross(n, {1.0, 0.0, 0.0}) : cross(n, {0.0, 1.0, 0.0});
    t *= 1.0 / norm(t);
    const Vec3<double> u = cross(n, t);
    double tt = 0.0, tu = 0.0, uu = 0.0;
    const auto add = [&](int body, const Vec3<double>& arm) {
      const BodyResponse& s = response[std::size_t(body)];
      const double contacts = normal[std::size_t(body)].active;
      const Vec3<double> by_t = cross(arm, t), by_u = cross(arm, u), turned_t = s.turned_by(by_t), turned_u = s.turned_by(by_u);
      tt += contacts * (s.inverse + dot(by_t, turned_t));
      tu += contacts * dot(by_u, turned_t);
      uu += contacts * (s.inverse + dot(by_u, turned_u));
    };
    add(r.a, r.offset_a - r.arm_a * n);
    if (r.b >= 0) add(r.b, r.offset_b + r.arm_b * n);
    const double half = 0.5 * (tt - uu);
    return 0.5 * (tt + uu) + std::sqrt(half * half + tu * tu);
  }

  static void check(const Body& b) {
    const char* wrong = nullptr;
    if (!(b.mass > 0.0)) wrong = "mass must be > 0 kg";
    else if (!(b.inertia > 0.0)) wrong = "inertia must be > 0 kg m^2";
    else if (!(b.radius >= 0.0) || std::isinf(b.radius)) wrong = "radius must be >= 0 m and finite";
    else if (b.id < 0) wrong = "ids must be >= 0";
    else if (has_length(b) && !(b.axial_inertia > 0.0 && std::isinf(b.axial_inertia) == std::isinf(b.inertia)))
      wrong = "inertia about the axis must be > 0 kg m^2, and infinite where that across it is";
    else {
      const Vec3<double> sum = b.position + b.velocity + b.spin + b.force + b.torque + b.half_axis;
      if (!std::isfinite(sum.x + sum.y + sum.z)) wrong = "position, velocity, spin, force and torque must be finite numbers";
    }
    if (wrong) throw std::invalid_argument("body " + std::to_string(b.id) + ": " + wrong);
  }

  const std::vector<Body>* bodies_ = nullptr;
  std::vector<Vec3<double>> acceleration_;  ///< m/s^2, by all forces but the normal ones; see accelerate()
  std::vector<Moved> moved_;                ///< see move()
  std::vector<Vec3<double>> angular_;       ///< rad/s^2, likewise; empty where no contact has a lever
  bool levers_ = false;                     ///< a body is a capsule
  double interval_ = 0.0;
};

}  // namespace impact
}  // namespace dembark
