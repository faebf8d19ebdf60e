// Friction on top of the normal forces: the Finnie-Rabinowicz law with a trial force that stays stable at any stiffness.
//
// The spring xi ends the step where the bodies are after it, xi' = xi + tau v', and v' depends on the force itself,
// v' = v + kick tau w T, w the response of the contact to a tangential force (1/kg). Spring and dash-pot in parallel, as in the normal
// direction, T = -k xi' - c (xi' - xi) / tau, give while the contact sticks
//     T = T_0 - k' (tau v - kick tau^2 w (T* - T_0)),   k' = K / (1 + K kick tau^2 w),   K = k + c / tau,   T_0 = -k xi,
// where v already holds the forces T* of the last sweep. k' stays below 1/(kick tau^2 w) however stiff the contact is. Several contacts on
// a body share its mass: w counts it as many times as the body has contacts, so that sweeps over all contacts at once converge for any
// number of them (the split response exceeds the coupled one), and a single sweep is stable. Slip takes T back to the limit of the
// law; what is left in the spring is xi' = (c xi / tau - T) / K.
#pragma once

#include <cstddef>
#include <vector>

#include "../constants.hpp"
#include "../finnie_rabinowicz.hpp"
#include "assembly.hpp"
#include "history.hpp"
#include "motion.hpp"
#include "normal_forces.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// Area (m^2) that the interface's shear strength counts on: as given, or the circle pi R* N / s of the springs' approach N / s; a point of
/// several has its share.
inline double friction_area(const Row& row, double normal_force) {
  if (row.law->contact_area > 0.0) return row.share * row.law->contact_area;
  return row.share * (pi * row.radius * normal_force / row.stiffness);
}

/// One sweep of one contact.
///
/// normal_force  N > 0, N           response   w, 1/kg, split among the contacts of each body
/// velocity      tangential velocity of a relative to b at the contact, m/s, with the forces of the last sweep
/// last          T*, N, of the last sweep     start   T_0 = -k xi, N, at the begin of the step, in the contact plane
/// state         slip at the begin of the step; gets slip and elastic displacement at its end
///
/// Returns the force on a (N).
inline Vec3<double> friction_sweep(const Row& row, double normal_force, double response, const Vec3<double>& velocity,
                                   const Vec3<double>& last, const Vec3<double>& start, double dt, double kick,
                                   FrictionState<double>& state) {
  const double ratio = row.law->tangential_stiffness_ratio, inertia = kick * dt * dt * response;
  const double give = row.compliance / ratio, soft = 1.0 / (give + inertia);  // 1 / K, k'
  state.displacement = start * -(give + inertia);
  const Vec3<double> effective = velocity - (inertia / dt) * (last - start);
  const bool limited = row.law->friction.interface_shear_strength < unlimited_strength;
  const double area = limited ? friction_area(row, normal_force) : 0.0;
  const Vec3<double> force = friction_step(row.law->friction, normal_force, soft, 0.0, area, effective, dt, state);
  state.displacement = (force + (row.viscous / row.stiffness) * start) * -give;
  return force;
}

/// The friction forces of all contacts of a step.
class FrictionForces {
 public:
  std::vector<Vec3<double>> force;           ///< N, on a
  std::vector<FrictionState<double>> state;  ///< after the step

  static bool acts(const Row& row) { return row.law->friction.static_friction > 0.0; }

  /// Begins with the springs as the last step left them, turned with the bodies. False if there is no friction.
  bool begin(const std::vector<Row>& rows, double dt, double kick, Motion& motion) {
    dt_ = dt;
    kick_ = kick;
    bool any = false;
    motion.clear_tangential();
    start_.assign(rows.size(), Vec3<double>());
    state.resize(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!acts(rows[i])) continue;
      any = true;
      if (!rows[i].before->active) continue;
      const Vec3<double> turned = rotate_to_plane(rows[i].before->friction.displacement, rows[i].normal, motion.twist(rows[i], dt));
      start_[i] = -tangential_stiffness(rows[i]) * turned;
      motion.add_tangential(rows[i], start_[i]);
    }
    force = start_;
    return any;
  }

  /// All of them once, from the velocities with those of the last sweep. False if nothing changed.
  bool sweep(const std::vector<Row>& rows, const Unknowns& normal, Motion& motion) {
    trial_.assign(rows.size(), Vec3<double>());
    bool changed = false;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& r = rows[i];
      state[i] = {};
      if (normal.active[i] && acts(r)) {
        state[i].slip = r.before->friction.slip;
        Vec3<double> velocity = motion.surface_velocity(r);
        velocity -= dot(velocity, r.normal) * r.normal;
        trial_[i] = friction_sweep(r, normal.z[Eigen::Index(i)], motion.tangential_response(r), velocity, force[i], start_[i], dt_, kick_,
                                   state[i]);
      }
      changed = changed || trial_[i].x != force[i].x || trial_[i].y != force[i].y || trial_[i].z != force[i].z;
    }
    if (!changed) return false;
    force.swap(trial_);
    motion.clear_tangential();
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (normal.active[i]) motion.add_tangential(rows[i], force[i]);
    return true;
  }

 private:
  double dt_ = 0.0, kick_ = 1.0;
  std::vector<Vec3<double>> start_, trial_;
};

}  // namespace impact
}  // namespace dembark
