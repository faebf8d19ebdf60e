// One contact: kinematics, normal force, Finnie-Rabinowicz friction, rolling resistance and cohesion, for two spheres or a sphere and a
// wall.
//
// contact_step() is the contact as YADE, LAMMPS and Python have it. Its order stands in contact_order.hpp, which packs of contacts follow
// too. LIGGGHTS computes contacts model by model and calls parts of it: surface_forces(), cohesion_step() and bridge_resistance(),
// assemble() and add_couple().
//
// Conventions: the unit normal points from body 2 to body 1; forces are those on body 1. A wall is body 2 with an infinite radius
// and an infinite mass; its position and velocity are those of its surface at the contact, and it turns by `wall_spin`. Lever arms reach
// to the middle of the overlap, r - delta/2 (LIGGGHTS-PUBLIC 3.8.0, `surface default`), -delta/2 from the surface of a wall, and to the
// middle of the gap of a bridge that resists sliding. Cohesion does not change the springs: the tangential spring and the area of contact
// are those of the normal law at the same overlap, and the limit of friction follows the normal law without the attraction.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cohesion/cohesion.hpp"
#include "contact_order.hpp"
#include "finnie_rabinowicz.hpp"
#include "message_text.hpp"
#include "normal_force.hpp"
#include "partial_slip.hpp"
#include "rolling_resistance.hpp"
#include "vec3.hpp"

namespace dembark {

/// The friction of a contact. A second law makes this a structure of all, with the choice among them.
typedef FinnieRabinowicz Friction;

/// Whether packs compute this friction; they leave any other to contact_friction(), contact by contact.
DEMBARK_FUNCTION inline bool packs_know(const Friction& friction) { return friction.presliding != Presliding::exponential; }

struct ContactParameters {
  NormalLaw normal_law = NormalLaw::hertz;
  HertzParameters elasticity{};          ///< E*, G* (Hertz only) and damping
  double characteristic_velocity = 1.0;  ///< m/s, Hooke only
  bool tangential_damping = true;
  bool limit_force = false;  ///< no attraction by damping: F >= 0
  Friction friction{};
  Cohesion cohesion{};
  RollingResistance rolling{};

  /// The normal law, as it is without the switches above. Two frozen bodies, whose effective mass is infinite, have no impact that damping
  /// or Hooke's stiffness could follow from: between them there is Hertz's spring alone.
  DEMBARK_FUNCTION NormalResponse<double> respond(double effective_radius, double effective_mass, double overlap,
                                                  double normal_velocity) const {
    const bool frozen = std::isinf(effective_mass);
    if (normal_law == NormalLaw::hertz || frozen)
      return hertz(elasticity, effective_radius, frozen ? 0.0 : effective_mass, overlap, normal_velocity);
    return hooke(elasticity, characteristic_velocity, effective_radius, effective_mass, overlap, normal_velocity);
  }
  /// The spring's force grows with this power of the overlap.
  DEMBARK_FUNCTION double spring_exponent(double effective_mass) const {
    return normal_law == NormalLaw::hertz || std::isinf(effective_mass) ? 1.5 : 1.0;
  }
};

/// What an engine stores per contact, from touching to the end of contact and bridge.
struct ContactState {
  FrictionState<double> friction{};
  CohesionState cohesion{};
  SlipRings rings{};             ///< for Presliding::partial_slip
  Vec3<double> rolling_angle{};  ///< rad, for RollingModel::elastic_plastic
};

/// The two bodies as an engine sees them. `separation` = position of 1 minus position of 2 (minus the nearest wall point),
/// already mapped to the nearest periodic image.
struct ContactBodies {
  Vec3<double> separation{};
  Vec3<double> velocity_1{}, velocity_2{};
  Vec3<double> angular_velocity_1{}, angular_velocity_2{};
  double radius_1 = 0.0, radius_2 = INFINITY;
  double mass_1 = 0.0, mass_2 = INFINITY;
  Vec3<double> wall_spin{};  ///< rad/s, how a wall turns that is body 2

  DEMBARK_FUNCTION double effective_radius() const { return reduced(radius_1, radius_2); }
  DEMBARK_FUNCTION double effective_mass() const { return reduced(mass_1, mass_2); }
  DEMBARK_FUNCTION Vec3<double> spin_2() const { return angular_velocity_2 + wall_spin; }
  DEMBARK_FUNCTION ContactPair<double> pair() const {
    return {separation, velocity_1 - velocity_2, angular_velocity_1, spin_2(), radius_1, std::isinf(radius_2) ? 0.0 : radius_2};
  }
};

struct ContactForce {
  bool interacting = false;                                   ///< touching, or held over a gap: the engine has to keep the contact
  Vec3<double> normal{};                                      ///< unit, from 2 to 1
  double overlap = 0.0;                                       ///< m, negative = gap
  double normal_force = 0.0;                                  ///< N, repulsive force of the normal law, without cohesion
  double cohesive_force = 0.0;                                ///< N, of a bridge or of adhesion, positive = attractive
  Vec3<double> tangential{};                                  ///< N, on body 1, friction
  double normal_stiffness = 0.0, tangential_stiffness = 0.0;  ///< N/m, of the springs at this overlap; 0 apart
  double viscous_normal = 0.0;                                ///< N, of the liquid, on body 1 along the normal
  Vec3<double> viscous_tangential{};                          ///< N, of the liquid, on body 1
  Vec3<double> force{};                                       ///< N, on body 1, everything; body 2 gets its negative
  Vec3<double> torque_1{}, torque_2{};                        ///< N m, about the centres; of a wall about its surface at the contact
  Vec3<double> rolling{};                                     ///< N m, couple of rolling resistance on body 1, a part of its torque
};

typedef SurfaceMotion<double> RelativeMotion;

DEMBARK_FUNCTION inline RelativeMotion relative_motion(const ContactBodies& b, const Vec3<double>& normal, double overlap) {
  const ContactPair<double> pair = b.pair();
  return surface_motion(normal, pair.velocity, pair.radius_1 - 0.5 * overlap, pair.spin_1, pair.radius_2 - 0.5 * overlap, pair.spin_2);
}

/// Friction of touching surfaces (N, on body 1): the spring turns with the pair by `twist` (rad, of contact_twist), then it sticks or
/// slips. `rings`: for Presliding::partial_slip, else not used.
DEMBARK_FUNCTION inline Vec3<double> contact_friction(const Friction& law, const Vec3<double>& normal, double twist,
                                                      const NormalResponse<double>& response, const Vec3<double>& velocity, double dt,
                                                      FrictionState<double>& state, SlipRings* rings) {
  const double limiting = response.limiting_force(law.friction_limit == FrictionLimit::elastic);
  if (law.presliding == Presliding::partial_slip)
    return partial_slip_step(law, normal, twist, limiting, response.tangential_stiffness, response.tangential_damping,
                             response.contact_area, velocity, dt, state, *rings);
  state.displacement = rotate_to_plane(state.displacement, normal, twist);
  return friction_step(law, limiting, response.tangential_stiffness, response.tangential_damping, response.contact_area, velocity, dt,
                       state);
}

/// What the liquid of a bridge of `volume` (m^3) resists with, into `out`.
DEMBARK_FUNCTION inline void bridge_resistance(const Liquid& liquid, const ContactBodies& b, double volume, const RelativeMotion& motion,
                                               ContactForce& out) {
  const auto resistance = capillary::viscous_resistance(liquid.viscous, 2.0 * b.effective_radius(), -out.overlap, volume);
  out.viscous_normal = -resistance.normal * motion.normal_velocity;
  out.viscous_tangential = -resistance.tangential * motion.tangential_velocity;
}

/// Force and torques of the parts that `out` has.
DEMBARK_FUNCTION inline void assemble(const RelativeMotion& motion, ContactForce& out) {
  const double along_normal = out.normal_force - out.cohesive_force + out.viscous_normal;
  const Assembly<double> all = assembled(out.normal, along_normal, out.tangential + out.viscous_tangential);
  out.torque_1 = -motion.arm_1 * all.moment;
  out.torque_2 = -motion.arm_2 * all.moment;
  out.force = all.force;
}

/// The couple of rolling resistance, into what is assembled.
DEMBARK_FUNCTION inline void add_couple(const Vec3<double>& couple, ContactForce& out) {
  out.rolling = couple;
  out.torque_1 += couple;
  out.torque_2 -= couple;
}

/// The laws of one contact along its surfaces, for surface_forces().
struct SurfaceLaws {
  const Friction& friction_law;
  const RollingResistance& resistance;
  double effective_radius, inertia;  ///< m; kg m^2, of the relative spin, used by rolling resistance only
  double dt;                         ///< s
  ContactState& state;
  ContactForce& out;

  DEMBARK_HOT Vec3<double> friction(const Vec3<double>& normal, double twist, const NormalResponse<double>& response,
                                    const Vec3<double>& velocity) {
    return contact_friction(friction_law, normal, twist, response, velocity, dt, state.friction, &state.rings);
  }
  DEMBARK_HOT void roll(const Vec3<double>& normal, double twist, const NormalResponse<double>& response, const Vec3<double>& spin) {
    if (resistance.on())
      out.rolling =
          rolling_step(resistance, {normal, twist, effective_radius, inertia, response.force, response.tangential_stiffness, spin}, dt,
                       state.rolling_angle);
  }
};

/// All laws of one contact, for contact_order().
struct ContactLaws : SurfaceLaws {
  const ContactParameters& p;
  const ContactBodies& b;

  DEMBARK_FUNCTION ContactLaws(const ContactParameters& parameters, const ContactBodies& bodies, double step, ContactState& now,
                               ContactForce& force)
      : SurfaceLaws{parameters.friction,
                    parameters.rolling,
                    bodies.effective_radius(),
                    parameters.rolling.on() ? relative_inertia(bodies.mass_1, bodies.radius_1, bodies.mass_2, bodies.radius_2) : 0.0,
                    step,
                    now,
                    force},
        p(parameters),
        b(bodies) {}

  DEMBARK_HOT bool touches(double overlap) const { return overlap > 0.0; }
  DEMBARK_HOT NormalResponse<double> respond(double overlap, double normal_velocity) const {
    return adjusted(p.respond(effective_radius, b.effective_mass(), overlap, normal_velocity), p.limit_force, p.tangential_damping);
  }
  DEMBARK_HOT double attract(double overlap) {
    return cohesion_step(p.cohesion, {b.radius_1, b.radius_2, -overlap, touches(overlap), p.elasticity.effective_youngs_modulus},
                         state.cohesion);
  }
  DEMBARK_HOT void act(const Vec3<double>& normal, double overlap, const RelativeMotion& motion, const NormalResponse<double>& response,
                       const Vec3<double>& friction, double attraction) {
    out.normal = normal;
    out.overlap = overlap;
    out.normal_force = response.force;
    out.cohesive_force = attraction;
    out.tangential = friction;
    out.normal_stiffness = response.normal_stiffness;
    out.tangential_stiffness = response.tangential_stiffness;
    const double volume = state.cohesion.bridge_volume;
    if (p.cohesion.liquid.viscous.on() && volume > 0.0) bridge_resistance(p.cohesion.liquid, b, volume, motion, out);
    if (!touches(overlap)) {
      state.friction = {};
      state.rolling_angle = {};
      if (friction_law.presliding == Presliding::partial_slip) state.rings = {};
    }
    assemble(motion, out);
    if (resistance.on()) add_couple(out.rolling, out);
    out.interacting = touches(overlap) || state.cohesion.held();
  }
};

/// One step of one contact. `dt` in s. Coincident centres, and a centre on a wall, have no normal: it and the force are no numbers, and an
/// engine ends its run.
DEMBARK_FUNCTION inline ContactForce contact_step(const ContactParameters& p, const ContactBodies& b, double dt, ContactState& state) {
  ContactForce out;
  ContactLaws laws(p, b, dt, state, out);
  contact_order(b.pair(), dt, laws);
  return out;
}

/// With `update` false (the set-up of a run) forces are those of the present state, which stays as it is.
DEMBARK_FUNCTION inline ContactForce contact_step(const ContactParameters& p, const ContactBodies& b, double dt, ContactState& state,
                                                  bool update) {
  if (update) return contact_step(p, b, dt, state);
  ContactState scratch = state;
  return contact_step(p, b, 0.0, scratch);
}

}  // namespace dembark
