// Energies of a contact: what its springs hold, and the power of each part of its force, so that all works of a run add up.
//
// All engines move bodies by v(n+1/2) = v(n-1/2) + dt F(n)/m, x(n+1) = x(n) + dt v(n+1/2): YADE by leapfrog, LIGGGHTS and LAMMPS by
// velocity Verlet, which has the same velocities at half steps. Then
//
//   m/2 v(n+1/2)^2 - m/2 v(n-1/2)^2 = F(n) . V(n) dt,   V(n) = [v(n-1/2) + v(n+1/2)] / 2,                                  (1)
//
// is no approximation. Works that are summed as F(n) . V(n) dt, and likewise torques with the mean spin, therefore balance the kinetic
// energy of the half steps to round-off at any step, with any force law, and so does every part of F(n): the parts of a contact are
// summed with its relative velocity made of V(n). What is *not* exact at a finite step is the work of a spring beside the energy that
// it holds: sum F(n) . [x(n+1) - x(n-1)] / 2 is the trapezoidal rule for the integral of F dx, with an error of second order in dt.
//
// A tangential spring whose stiffness follows the overlap, k_t = 8 G* sqrt(R* delta), is no potential: while xi stays, k_t xi^2 / 2
// grows with delta though no tangential work is done. Its stored energy and its work differ by slip and by that.
#pragma once

#include <array>

#include "contact.hpp"

namespace dembark {

/// Of a body along x, y, z and about them: velocities and spins, forces and torques, masses and moments of inertia.
typedef std::array<double, 6> SixVector;

DEMBARK_FUNCTION inline SixVector six_vector(const Vec3<double>& along, const Vec3<double>& about) {
  return {along.x, along.y, along.z, about.x, about.y, about.z};
}

DEMBARK_HOT double dot(const SixVector& a, const SixVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
}

/// Number by number: a loop would be vectorized, and wide loads of what has just been written by halves stall.
DEMBARK_HOT void add(SixVector& to, const Vec3<double>& along, const Vec3<double>& about) {
  to[0] += along.x;
  to[1] += along.y;
  to[2] += along.z;
  to[3] += about.x;
  to[4] += about.y;
  to[5] += about.z;
}

/// What the force of a contact is made of.
enum class ContactPart {
  normal_elastic,      ///< normal spring
  normal_viscous,      ///< normal damping, and what `limit_force` cuts off
  tangential_elastic,  ///< tangential spring, slip included
  tangential_viscous,  ///< tangential damping
  cohesive,            ///< liquid bridge or adhesion
  liquid_viscous,      ///< what the liquid of a bridge resists with
  rolling_elastic,     ///< spring of rolling resistance, yielding included
  rolling_viscous,     ///< its dashpot, or a constant torque
};
constexpr std::size_t contact_part_count = 8;
constexpr std::size_t force_part_count = 6;  ///< the parts from here on are couples

/// The parts of a contact's force on body 1 (N; body 2 gets the negatives) and what its springs hold. Their sum is the force; the torques
/// of a part are those of the contact, -arm n x force, with the lever arms of relative_motion(). Couples (N m) stand behind the forces.
struct ContactParts {
  std::array<Vec3<double>, contact_part_count> load{};
  std::size_t count = force_part_count;  ///< without rolling resistance there are no couples
  double normal_stored = 0.0;            ///< J, elastic energy at this overlap
  double tangential_stored = 0.0;        ///< J, k_t xi^2 / 2; with partial slip the sum over the rings
  double rolling_stored = 0.0;           ///< J, k_r theta^2 / 2

  DEMBARK_FUNCTION Vec3<double>& operator[](ContactPart part) { return load[static_cast<std::size_t>(part)]; }
  DEMBARK_FUNCTION const Vec3<double>& operator[](ContactPart part) const { return load[static_cast<std::size_t>(part)]; }
};

/// Where the force of a contact acts: lever arms (m) from the positions of its bodies.
struct ContactLevers {
  Vec3<double> one{}, two{};

  ContactLevers() = default;
  DEMBARK_FUNCTION ContactLevers(const Vec3<double>& normal, const RelativeMotion& motion)
      : one(-motion.arm_1 * normal), two(motion.arm_2 * normal) {}
  /// Forces and torques on bodies 1 and 2 by this force on body 1.
  DEMBARK_FUNCTION SixVector on_one(const Vec3<double>& force) const { return six_vector(force, cross(one, force)); }
  DEMBARK_FUNCTION SixVector on_two(const Vec3<double>& force) const { return six_vector(-force, cross(force, two)); }
  /// The same by a part, force or couple.
  DEMBARK_FUNCTION SixVector on_one(std::size_t part, const Vec3<double>& load) const {
    return part < force_part_count ? on_one(load) : six_vector({}, load);
  }
  DEMBARK_FUNCTION SixVector on_two(std::size_t part, const Vec3<double>& load) const {
    return part < force_part_count ? on_two(load) : six_vector({}, -load);
  }
  /// m/s, of body 1 against body 2.
  DEMBARK_FUNCTION Vec3<double> velocity(const SixVector& v, const SixVector& w) const {
    return Vec3<double>{v[0] - w[0], v[1] - w[1], v[2] - w[2]} + cross({v[3], v[4], v[5]}, one) - cross({w[3], w[4], w[5]}, two);
  }
};

/// Springs and dash-pots of a touching contact. `spring`: N, what the normal law gives at rest, which grows with overlap^exponent;
/// `normal_force`: N, what it gave; `stiffness`: k_t; `tangential`: N, on body 1; `displacement`: xi after the step, of `rings` where the
/// contact slips in parts.
DEMBARK_FUNCTION inline void split_touching(ContactParts& parts, const Vec3<double>& normal, double overlap, double spring, double exponent,
                                            double normal_force, double stiffness, const Vec3<double>& tangential,
                                            const Vec3<double>& displacement, const SlipRings* rings) {
  const Vec3<double> elastic = -stiffness * displacement;
  parts[ContactPart::normal_elastic] = spring * normal;
  parts[ContactPart::normal_viscous] = (normal_force - spring) * normal;
  parts[ContactPart::tangential_elastic] = elastic;
  parts[ContactPart::tangential_viscous] = tangential - elastic;
  parts.normal_stored = spring * overlap / (1.0 + exponent);
  parts.tangential_stored = rings ? stored_energy(*rings, stiffness) : 0.5 * stiffness * dot(displacement, displacement);
}

/// Spring and dashpot of rolling resistance. `couple`: N m, on body 1; `angle`: theta after the step; `stiffness`: k_r.
DEMBARK_FUNCTION inline void split_rolling(ContactParts& parts, const Vec3<double>& couple, const Vec3<double>& angle, double stiffness) {
  const Vec3<double> elastic = -stiffness * angle;
  parts.count = contact_part_count;
  parts[ContactPart::rolling_elastic] = elastic;
  parts[ContactPart::rolling_viscous] = couple - elastic;
  parts.rolling_stored = 0.5 * stiffness * dot(angle, angle);
}

/// Attraction, and what the liquid of a bridge resists with.
DEMBARK_FUNCTION inline void split_cohesion(ContactParts& parts, const ContactForce& force) {
  parts[ContactPart::cohesive] = -force.cohesive_force * force.normal;
  parts[ContactPart::liquid_viscous] = force.viscous_normal * force.normal + force.viscous_tangential;
}

/// The parts of `force`, which `contact_step` has returned when it left `state`. Of the bodies only radii and masses count.
DEMBARK_FUNCTION inline ContactParts contact_parts(const ContactParameters& p, const ContactBodies& bodies, const ContactForce& force,
                                                   const ContactState& state) {
  ContactParts parts;
  split_cohesion(parts, force);
  if (!(force.overlap > 0.0)) return parts;

  // At rest there is no damping: what is left of the law is its spring.
  const NormalResponse<double> spring = p.respond(bodies.effective_radius(), bodies.effective_mass(), force.overlap, 0.0);
  split_touching(parts, force.normal, force.overlap, spring.force, p.spring_exponent(bodies.effective_mass()), force.normal_force,
                 spring.tangential_stiffness, force.tangential, state.friction.displacement,
                 p.friction.presliding == Presliding::partial_slip ? &state.rings : nullptr);
  if (p.rolling.on())
    split_rolling(parts, force.rolling, state.rolling_angle, rolling_stiffness(spring.tangential_stiffness, bodies.effective_radius()));
  return parts;
}

}  // namespace dembark
