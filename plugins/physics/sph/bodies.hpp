// Rigid bodies in the fluid: pose, motion under given or computed forces, and the velocity and acceleration of their points.
//
// Steps are those of the fluid, kick - drift - kick: v += dt/2 a, x += dt v, forces at x, v += dt/2 a. Of Euler's equations
// I dw/dt + w x (I w) = T, in the frame of the principal axes, kicks take the torque, I dw = dt/2 T, and the drift turns the body freely
// with the angular momentum that it has: by turns about its axes x, y, z, y, x of 1/2, 1/2, 1, 1/2, 1/2 of the step, each at the rate l/I
// of its axis (A. Dullweber, B. Leimkuhler & R. McLachlan, J. Chem. Phys. 107 (1997) 5840). That keeps the angular momentum to round-off
// and is of second order; energies stay about what they were for any time. A body with three equal moments, or with an axis that does not
// turn, goes on with the spin it has, which is exact.
//
// Units SI; in the plane masses and forces are those of a metre of depth, and bodies turn about z.
//
// Driven bodies belong to an engine that moves them under the forces they get here. Before the step from t to t + dt they are given their
// places at t + dt, their mean velocities on the way there and their accelerations at t (DrivenMotion): those that kick - drift - kick
// itself has.
#pragma once

#include <cmath>

#include "vector.hpp"

namespace dembark::sph {

/// Unit quaternion of a rotation from a body's frame into space.
struct Rotation {
  double w = 1.0, x = 0.0, y = 0.0, z = 0.0;

  Vector operator()(const Vector& v) const {
    const Vector axis{x, y, z}, t = 2.0 * cross(axis, v);
    return v + w * t + cross(axis, t);
  }
  Rotation inverse() const { return {w, -x, -y, -z}; }
  /// This rotation followed by one about `angle` (rad), in space.
  Rotation turned(const Vector& angle) const {
    const double size = norm(angle), s = size > 1e-8 ? std::sin(0.5 * size) / size : 0.5 - size * size / 48.0, c = std::cos(0.5 * size);
    const Vector a = s * angle;
    Rotation r{c * w - a.x * x - a.y * y - a.z * z, c * x + a.x * w + a.y * z - a.z * y, c * y + a.y * w + a.z * x - a.x * z,
               c * z + a.z * w + a.x * y - a.y * x};
    const double scale = 1.0 / std::sqrt(r.w * r.w + r.x * r.x + r.y * r.y + r.z * r.z);
    r.w *= scale, r.x *= scale, r.y *= scale, r.z *= scale;
    return r;
  }
};

struct Body {
  bool free = false;                           ///< moves under its forces; else as its velocities and accelerations say
  bool driven = false;                         ///< not free, and placed before each step by others, who move it under its forces
  double mass = 0.0;                           ///< kg, of free ones > 0
  Vector inertia{};                            ///< kg m^2, principal moments; inf = does not turn about that axis
  Vector position{};                           ///< m, of its centre of mass
  Vector velocity{}, spin{};                   ///< m/s, rad/s
  Rotation orientation{};                      ///< its frame is that of the principal axes
  Vector force{}, torque{};                    ///< N, N m about the centre: of the fluid
  Vector film{}, film_torque{};                ///< of films in slits; part of `force` in the solver
  Vector load{}, load_torque{};                ///< N, N m: of anything else but gravity
  Vector acceleration{}, spin_acceleration{};  ///< m/s^2, rad/s^2

  /// Of a point at `arm` from the centre.
  Vector velocity_at(const Vector& arm) const { return velocity + cross(spin, arm); }
  Vector acceleration_at(const Vector& arm) const { return acceleration + cross(spin_acceleration, arm) + cross(spin, cross(spin, arm)); }

  /// First half of a step of dt (s), up to where forces are computed. Returns power(), of this half of the step.
  double first_half(double dt) {
    kick(0.5 * dt);
    const double now = power();
    drift(dt);
    return now;
  }
  /// Second half, by the accelerations of the new forces.
  double second_half(double dt) {
    const double now = power();
    kick(0.5 * dt);
    return now;
  }
  void kick(double dt) {
    if (driven) return;
    velocity += dt * acceleration;
    spin += dt * (free ? turning() : spin_acceleration);
  }
  void drift(double dt) {
    if (driven) return;
    position += dt * velocity;
    if (spin.x == 0.0 && spin.y == 0.0 && spin.z == 0.0) return;
    if (precesses()) turn_freely(dt);
    else orientation = orientation.turned(dt * spin);
  }
  /// Accelerations of a free body from its forces.
  void accelerate(const Vector& gravity) {
    if (!free) return;
    acceleration = gravity + (1.0 / mass) * (force + load);
    spin_acceleration = turning();
    if (!precesses()) return;
    const Vector s = orientation.inverse()(spin), gyroscopic = cross(scaled(s), s);
    spin_acceleration += orientation({gyroscopic.x / inertia.x, gyroscopic.y / inertia.y, gyroscopic.z / inertia.z});
  }
  /// W, that a moved wall, or what acts on a free body but gravity and the fluid, puts in.
  double power() const { return dot(film + (free ? load : -force), velocity) + dot(film_torque + (free ? load_torque : -torque), spin); }
  /// J, of a free body; 0 of others.
  double energy(const Vector& gravity) const { return free ? kinetic_energy() - mass * dot(gravity, position) : 0.0; }
  /// J, of translation and rotation.
  double kinetic_energy() const {
    if (!free) return 0.0;
    const Vector s = orientation.inverse()(spin);
    const auto part = [](double inertia_, double spin_) { return spin_ == 0.0 ? 0.0 : 0.5 * inertia_ * spin_ * spin_; };
    return 0.5 * mass * dot(velocity, velocity) + part(inertia.x, s.x) + part(inertia.y, s.y) + part(inertia.z, s.z);
  }

 private:
  /// Whether the spin of a free body changes without a torque. An axis that does not turn has none: the others lose nothing to it.
  bool precesses() const {
    return free && std::isfinite(inertia.x + inertia.y + inertia.z) && !(inertia.x == inertia.y && inertia.y == inertia.z);
  }
  /// Moments times a vector of the body's frame.
  Vector scaled(const Vector& v) const { return {inertia.x * v.x, inertia.y * v.y, inertia.z * v.z}; }
  /// rad/s^2, by the torques alone.
  Vector turning() const {
    const Vector t = orientation.inverse()(torque + load_torque);
    const auto about = [](double moment, double inertia_) { return std::isinf(inertia_) ? 0.0 : moment / inertia_; };
    return orientation({about(t.x, inertia.x), about(t.y, inertia.y), about(t.z, inertia.z)});
  }
  void turn_freely(double dt) {
    Vector l = scaled(orientation.inverse()(spin));
    const auto turn = [&](double Vector::* axis, double time) {
      Vector angle{};
      angle.*axis = time * (l.*axis / inertia.*axis);
      orientation = orientation.turned(orientation(angle));
      l = Rotation{}.turned(-1.0 * angle)(l);
    };
    turn(&Vector::x, 0.5 * dt);
    turn(&Vector::y, 0.5 * dt);
    turn(&Vector::z, dt);
    turn(&Vector::y, 0.5 * dt);
    turn(&Vector::x, 0.5 * dt);
    spin = orientation({l.x / inertia.x, l.y / inertia.y, l.z / inertia.z});
  }
};

/// How an engine has moved a driven body since the fluid's last step, in one step of its own or several.
struct DrivenMotion {
  Vector displacement{}, turn{};  ///< m, rad
  Vector velocity{}, spin{};      ///< m/s, rad/s, as the fluid's last step began

  /// A step of dt (s) of the engine at these velocities.
  void add(double dt, const Vector& v, const Vector& w) {
    displacement += dt * v;
    turn += dt * w;
  }
  /// Before a step of dt (s) of the fluid: the body, which has place and velocities as the engine has them now, gets those of the step.
  void drive(Body& body, double dt) {
    const Vector v = body.velocity, w = body.spin;
    body.acceleration = (1.0 / dt) * (v - velocity);
    body.spin_acceleration = (1.0 / dt) * (w - spin);
    body.velocity = (1.0 / dt) * displacement;
    body.spin = (1.0 / dt) * turn;
    *this = {{}, {}, v, w};
  }
};

}  // namespace dembark::sph
