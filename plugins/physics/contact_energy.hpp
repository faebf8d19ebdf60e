// Energies of a contact: what its springs hold, and the power of each part of its force, so that all works of a run add up.
//
// Both engines move bodies by leapfrog: v(n+1/2) = v(n-1/2) + dt F(n)/m, x(n+1) = x(n) + dt v(n+1/2). Then
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

#include "contact.hpp"

namespace dembark {

struct ContactEnergies {
  double normal_stored = 0.0;       ///< J, elastic energy at this overlap
  double tangential_stored = 0.0;   ///< J, k_t xi^2 / 2
  double normal_elastic = 0.0;      ///< W, power of the parts of the force on both bodies together
  double normal_viscous = 0.0;      ///< W, damping, and what `limit_force` cuts off
  double tangential_elastic = 0.0;  ///< W, spring and slip
  double tangential_viscous = 0.0;  ///< W
  double capillary = 0.0;           ///< W
  double liquid_viscous = 0.0;      ///< W, what the liquid of a bridge resists with

  double power() const { return normal_elastic + normal_viscous + tangential_elastic + tangential_viscous + capillary + liquid_viscous; }
};

/// Energies of a contact of which `contact_step` has returned `force` and left `displacement` (xi). `mean` are the bodies at the same
/// positions, with the velocities V(n) of (1).
inline ContactEnergies contact_energies(const ContactParameters& p, const ContactBodies& mean, const ContactForce& force, const Vec3<double>& displacement) {
  ContactEnergies out;
  const RelativeMotion motion = relative_motion(mean, force.normal, force.overlap);
  const double parting = motion.normal_velocity;
  const Vec3<double>& sliding = motion.tangential_velocity;
  out.capillary = -force.capillary_force * parting;
  out.liquid_viscous = force.viscous_normal * parting + dot(force.viscous_tangential, sliding);
  if (!(force.overlap > 0.0)) return out;

  const double effective_radius = reduced(mean.radius_1, mean.radius_2), effective_mass = reduced(mean.mass_1, mean.mass_2);
  // At rest there is no damping: what is left of the law is its spring.
  const NormalResponse<double> spring = p.normal_law == NormalLaw::hertz
      ? hertz(p.elasticity, effective_radius, effective_mass, force.overlap, 0.0)
      : hooke(HookeParameters(p.elasticity, p.characteristic_velocity), effective_radius, effective_mass, force.overlap, 0.0);
  out.normal_stored = (p.normal_law == NormalLaw::hertz ? 0.4 : 0.5) * spring.force * force.overlap;
  out.normal_elastic = spring.force * parting;
  out.normal_viscous = (force.normal_force - spring.force) * parting;

  const Vec3<double> held = -spring.tangential_stiffness * displacement;
  out.tangential_stored = 0.5 * spring.tangential_stiffness * dot(displacement, displacement);
  out.tangential_elastic = dot(held, sliding);
  out.tangential_viscous = dot(force.tangential - held, sliding);
  return out;
}

}  // namespace dembark
