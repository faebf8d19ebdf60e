// Every law of a contact, stepped along a path that touches, slips, grows, shrinks and parts: what a device has to compile and compute.
#pragma once

#include "dembark/contact_energy.hpp"
#include "dembark/contact_history.hpp"

namespace dembark::tests {

constexpr int bridge_models = 6, results_of_path = 12;

/// The bodies in a step of the path.
DEMBARK_FUNCTION inline ContactBodies bodies_on_path(int step, bool wall, bool unequal) {
  const double t = 0.05 * step;
  ContactBodies b;
  b.radius_1 = 1e-3, b.mass_1 = 1e-5;
  if (!wall) b.radius_2 = unequal ? 1.7e-3 : 1e-3, b.mass_2 = 3e-5;
  const double distance = (wall ? b.radius_1 : b.radius_1 + b.radius_2) - 4e-6 * std::sin(t) - 1e-6 * std::sin(7.0 * t);
  const double turn = 0.02 * t;
  b.separation = {distance * std::cos(turn), distance * std::sin(turn), 0.0};
  b.velocity_1 = {-0.01 * std::cos(t), 0.02 * std::sin(0.7 * t), 0.01};
  b.angular_velocity_1 = {3.0, 20.0 * std::cos(t), -5.0};
  if (wall) b.wall_spin = {0.0, 1.0, 0.0};
  else b.angular_velocity_2 = {-1.0, 2.0, 10.0};
  return b;
}

/// Adds forces, torques, energies and works of 80 steps of one contact to the results.
DEMBARK_FUNCTION inline void follow_path(const ContactParameters& p, bool wall, bool unequal, double* results) {
  HistoryLayout layout;
  layout.cohesion = layout.rings = layout.rolling = true;
  double row[128] = {}, swapped[128];
  for (int step = 0; step < 80; ++step) {
    const ContactBodies b = bodies_on_path(step, wall, unequal);
    ContactState state;
    layout.load(row, state);
    const ContactForce force = contact_step(p, b, 1e-5, state, step % 20 != 19);
    const ContactParts parts = contact_parts(p, b, force, state);
    layout.store(row, state);
    layout.swap_bodies(row, swapped);
    const ContactLevers levers(force.normal, relative_motion(b, force.normal, force.overlap));
    const SixVector moves = six_vector(b.velocity_1, b.angular_velocity_1), rests = six_vector({}, b.spin_2());
    SixVector loads{};
    for (std::size_t k = 0; k < parts.count; ++k)
      add(loads, parts.load[k], k < force_part_count ? cross(levers.one, parts.load[k]) : parts.load[k]);
    const double values[results_of_path] = {force.force.x,
                                            force.force.y,
                                            force.force.z,
                                            force.torque_1.y,
                                            force.torque_2.z,
                                            force.rolling.x,
                                            parts.normal_stored,
                                            parts.tangential_stored,
                                            parts.rolling_stored,
                                            state.friction.dissipated_energy,
                                            dot(loads, moves) + dot(levers.on_two(0, parts.load[0]), rests),
                                            norm(levers.velocity(moves, rests)) + swapped[0]};
    for (int k = 0; k < results_of_path; ++k) results[k] += values[k];
  }
}

/// The laws in turn, each with all choices of the others that lie near: `visit(parameters, wall, unequal)`.
template <class Visit>
DEMBARK_FUNCTION inline void each_law(const capillary::BridgeForce* bridges, Visit visit) {
  for (int normal = 0; normal < 2; ++normal)
    for (int presliding = 0; presliding < 3; ++presliding)
      for (int kind = 0; kind < 8; ++kind) {
        ContactParameters p;
        p.normal_law = normal ? NormalLaw::hooke : NormalLaw::hertz;
        p.elasticity.effective_youngs_modulus = 5e7;
        p.elasticity.effective_shear_modulus = 2e7;
        p.elasticity.damping = -0.2;
        p.friction.presliding = static_cast<Presliding>(presliding);
        p.friction.static_friction = kind & 1 ? 0.6 : 0.4;
        p.friction.kinetic_friction = 0.4;
        if (kind & 2) p.friction.interface_shear_strength = 2e5;
        if (kind & 4) p.friction.healing_time = 1e-4;
        p.friction.friction_limit = kind & 1 ? FrictionLimit::elastic : FrictionLimit::total;
        p.limit_force = kind & 2;
        p.tangential_damping = !(kind & 4);
        p.rolling.model = static_cast<RollingModel>(kind % 3);
        p.rolling.friction = 0.1;
        p.rolling.damping_ratio = 0.3;
        visit(p, kind & 1, kind & 2);
      }
  for (int model = 0; model < bridge_models; ++model)
    for (int kind = 0; kind < 4; ++kind) {
      ContactParameters p;
      p.elasticity.effective_youngs_modulus = 5e7;
      p.elasticity.effective_shear_modulus = 2e7;
      p.elasticity.damping = -0.2;
      Liquid& liquid = p.cohesion.liquid;
      p.cohesion.law = CohesionLaw::bridge;
      liquid.force = bridges + model;
      liquid.surface_tension = 0.07;
      liquid.bridge_volume = kind == 3 ? 1e-19 : 1e-12;
      if (kind & 1) liquid.viscous.viscosity = 1e-3, liquid.viscous.minimum_gap = 1e-6;
      visit(p, kind == 1, kind == 2);
    }
  for (const CohesionLaw law : {CohesionLaw::constant, CohesionLaw::dmt, CohesionLaw::jkr}) {
    ContactParameters p;
    p.elasticity.effective_youngs_modulus = 5e7;
    p.elasticity.effective_shear_modulus = 2e7;
    p.elasticity.damping = -0.2;
    p.cohesion.law = law;
    p.cohesion.cohesive_force = 1e-4;
    p.cohesion.work_of_adhesion = 0.05;
    visit(p, law == CohesionLaw::dmt, law == CohesionLaw::jkr);
  }
}
constexpr int law_count = 2 * 3 * 8 + bridge_models * 4 + 3;

/// `bridges`: one of each model, in their order; `results`: law_count rows of results_of_path numbers, which begin as zeros.
DEMBARK_FUNCTION inline void follow_every_law(const capillary::BridgeForce* bridges, double* results) {
  each_law(bridges, [&results](const ContactParameters& p, bool wall, bool unequal) {
    follow_path(p, wall, unequal, results);
    results += results_of_path;
  });
}

}  // namespace dembark::tests
