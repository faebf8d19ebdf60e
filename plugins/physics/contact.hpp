// One whole contact: kinematics, normal force, Finnie-Rabinowicz friction and liquid bridge, for two spheres or a sphere and a
// wall. YADE and Python call this; LIGGGHTS does the kinematics and the normal force itself, with the same formulas, and calls the
// laws one by one.
//
// Conventions: the unit normal points from body 2 to body 1; forces are those on body 1. A wall is body 2 with an infinite radius
// and an infinite mass; its velocity is that of its surface at the contact. Lever arms reach to the middle of the overlap,
// r - delta/2 (LIGGGHTS-PUBLIC 3.8.0, `surface default`), and to the middle of the gap of a bridge that resists sliding.
#pragma once

#include <cmath>

#include "capillary/bridge.hpp"
#include "capillary/viscous.hpp"
#include "finnie_rabinowicz.hpp"
#include "kinematics.hpp"
#include "normal_force.hpp"
#include "vec3.hpp"

namespace dembark {

enum class NormalLaw { hertz, hooke };

/// Liquid of a contact; no bridge ever forms when `force` is null or the volume is zero.
struct Liquid {
  const capillary::BridgeForce* force = nullptr;  ///< built for the contact's mean contact angle
  double surface_tension = 0.0;                   ///< N/m
  double bridge_volume = 0.0;                     ///< m^3, of each bridge that forms
  capillary::ViscousLiquid viscous{};
};

struct ContactParameters {
  NormalLaw normal_law = NormalLaw::hertz;
  HertzParameters elasticity{};          ///< E*, G* (Hertz only) and damping
  double characteristic_velocity = 1.0;  ///< m/s, Hooke only
  bool tangential_damping = true;
  bool limit_force = false;  ///< no attraction by damping: F >= 0
  FinnieRabinowicz friction{};
  Liquid liquid{};
};

/// What an engine stores per contact, from touching to the end of contact and bridge.
struct ContactState {
  FrictionState<double> friction{};
  double bridge_volume = 0.0;     ///< m^3; 0 = no bridge
  double rupture_distance = 0.0;  ///< m, of the bridge that is there
};

/// The two bodies as an engine sees them. `separation` = position of 1 minus position of 2 (minus the nearest wall point),
/// already mapped to the nearest periodic image.
struct ContactBodies {
  Vec3<double> separation{};
  Vec3<double> velocity_1{}, velocity_2{};
  Vec3<double> angular_velocity_1{}, angular_velocity_2{};
  double radius_1 = 0.0, radius_2 = INFINITY;
  double mass_1 = 0.0, mass_2 = INFINITY;
};

struct ContactForce {
  bool interacting = false;             ///< touching, or held by a bridge: the engine has to keep the contact
  Vec3<double> normal{};                ///< unit, from 2 to 1
  double overlap = 0.0;                 ///< m, negative = gap
  double normal_force = 0.0;            ///< N, repulsive force of the normal law, without the bridge
  double capillary_force = 0.0;         ///< N, positive = attractive
  Vec3<double> tangential{};            ///< N, on body 1, friction
  double viscous_normal = 0.0;          ///< N, of the liquid, on body 1 along the normal
  Vec3<double> viscous_tangential{};    ///< N, of the liquid, on body 1
  Vec3<double> force{};                 ///< N, on body 1, everything; body 2 gets its negative
  Vec3<double> torque_1{}, torque_2{};  ///< N m
};

/// Motion of body 1 against body 2 at the contact.
struct RelativeMotion {
  double normal_velocity = 0.0;        ///< m/s, > 0 when parting
  Vec3<double> tangential_velocity{};  ///< m/s, of the surfaces
  double arm_1 = 0.0, arm_2 = 0.0;     ///< m, from the centres to the middle of overlap or gap; 0 for a wall
};

inline RelativeMotion relative_motion(const ContactBodies& b, const Vec3<double>& normal, double overlap) {
  const double arm_1 = b.radius_1 - 0.5 * overlap, arm_2 = std::isinf(b.radius_2) ? 0.0 : b.radius_2 - 0.5 * overlap;
  const ContactMotion<double> motion =
      contact_motion(normal, b.velocity_1 - b.velocity_2, arm_1 * b.angular_velocity_1 + arm_2 * b.angular_velocity_2);
  return {motion.normal, motion.tangential, arm_1, arm_2};
}

/// One step of one contact. `dt` in s. With `update` false (the set-up of a run) forces are those of the present state, which
/// stays as it is.
inline ContactForce contact_step(const ContactParameters& p, const ContactBodies& b, double dt, ContactState& stored, bool update = true) {
  ContactForce out;
  const bool wall = std::isinf(b.radius_2);
  const double distance = norm(b.separation);
  out.overlap = b.radius_1 + (wall ? 0.0 : b.radius_2) - distance;
  // Coincident centres have no direction; any will do to drive them apart.
  out.normal = distance > 0.0 ? b.separation * (1.0 / distance) : Vec3<double>{0.0, 0.0, 1.0};

  ContactState scratch = stored;
  ContactState& state = update ? stored : scratch;
  const bool touching = out.overlap > 0.0;
  const double bridge_radius = 2.0 * reduced(b.radius_1, b.radius_2);

  if (!p.liquid.force) state.bridge_volume = state.rupture_distance = 0.0;  // the liquid was switched off
  else if (touching || state.bridge_volume > 0.0) {
    if (!(state.bridge_volume > 0.0) && p.liquid.bridge_volume > 0.0) {
      state.bridge_volume = p.liquid.bridge_volume;
      state.rupture_distance = p.liquid.force->rupture_distance(b.radius_1, b.radius_2, state.bridge_volume);
    }
    if (state.bridge_volume > 0.0) {
      if (-out.overlap > state.rupture_distance) state.bridge_volume = state.rupture_distance = 0.0;
      else out.capillary_force = p.liquid.force->force(b.radius_1, b.radius_2, -out.overlap, state.bridge_volume, p.liquid.surface_tension);
    }
  }

  const bool viscous = p.liquid.viscous.on() && state.bridge_volume > 0.0;
  RelativeMotion motion;
  if (touching || viscous) motion = relative_motion(b, out.normal, out.overlap);

  if (viscous) {
    const auto resistance = capillary::viscous_resistance(p.liquid.viscous, bridge_radius, -out.overlap, state.bridge_volume);
    out.viscous_normal = -resistance.normal * motion.normal_velocity;
    out.viscous_tangential = -resistance.tangential * motion.tangential_velocity;
  }

  if (touching) {
    const double effective_radius = reduced(b.radius_1, b.radius_2), effective_mass = reduced(b.mass_1, b.mass_2);
    NormalResponse<double> response = p.normal_law == NormalLaw::hertz
                                          ? hertz(p.elasticity, effective_radius, effective_mass, out.overlap, motion.normal_velocity)
                                          : hooke(HookeParameters(p.elasticity, p.characteristic_velocity), effective_radius,
                                                  effective_mass, out.overlap, motion.normal_velocity);
    if (p.limit_force && response.force < 0.0) response.force = 0.0;
    out.normal_force = response.force;

    const double step = update ? dt : 0.0;
    const double twist = 0.5 * dot(b.angular_velocity_1 + b.angular_velocity_2, out.normal) * step;
    state.friction.displacement = rotate_to_plane(state.friction.displacement, out.normal, twist);
    out.tangential =
        friction_step(p.friction, response.force, response.tangential_stiffness, p.tangential_damping ? response.tangential_damping : 0.0,
                      response.contact_area, motion.tangential_velocity, step, state.friction);
  } else {
    state.friction = {};
  }

  const Vec3<double> along_surface = out.tangential + out.viscous_tangential, moment = cross(out.normal, along_surface);
  out.torque_1 = -motion.arm_1 * moment;
  out.torque_2 = -motion.arm_2 * moment;
  out.force = (out.normal_force - out.capillary_force + out.viscous_normal) * out.normal + along_surface;
  out.interacting = touching || state.bridge_volume > 0.0;
  return out;
}

}  // namespace dembark
