// The attraction of a contact: one seat for liquid bridges and for the adhesion of dry surfaces.
//
// A law gives an attraction (N) along the normal in addition to the normal law, at any overlap or gap, and may hold a contact over a gap:
// then the contact keeps up to which gap. An engine asks cohesion_step() in each step for pairs that touch or are held. A new law is a name
// in CohesionLaw, its formula in a header, its rows in the table of parameters, and a line in cohesion_step() and, where it holds contacts,
// in holds() and cohesion_reach().
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "../capillary/bridge.hpp"
#include "../capillary/viscous.hpp"
#include "adhesion.hpp"

namespace dembark {

enum class CohesionLaw { none, bridge, constant, dmt, jkr };
/// Their names, in their order.
inline std::vector<std::string> cohesion_names() { return {"none", "bridge", "constant", "dmt", "jkr"}; }

/// Liquid of a contact; no bridge ever forms when `force` is null or the volume is zero.
struct Liquid {
  const capillary::BridgeForce* force = nullptr;  ///< built for the contact's mean contact angle
  double surface_tension = 0.0;                   ///< N/m
  double bridge_volume = 0.0;                     ///< m^3, of each bridge that forms
  capillary::ViscousLiquid viscous{};

  /// Largest time step (s) with which a bridge between these bodies can be integrated.
  DEMBARK_FUNCTION double stable_time_step(double effective_radius, double effective_mass) const {
    return viscous.on() ? capillary::viscous_time_step(viscous, 2.0 * effective_radius, effective_mass) : INFINITY;
  }
};

struct Cohesion {
  CohesionLaw law = CohesionLaw::none;
  Liquid liquid{};                ///< of bridges
  double cohesive_force = 0.0;    ///< N, of the constant law
  double work_of_adhesion = 0.0;  ///< J/m^2, of DMT and JKR

  DEMBARK_FUNCTION bool on() const { return law != CohesionLaw::none; }
  /// Whether a contact may be held over a gap, and the engine has to keep its state.
  DEMBARK_FUNCTION bool holds() const { return law == CohesionLaw::bridge || law == CohesionLaw::jkr; }
};

/// What a law of cohesion knows of two bodies. Radii in m, infinite for a wall.
struct CohesionContact {
  double radius_1, radius_2;
  double gap;                       ///< m, negative: they overlap
  bool touching;                    ///< gap < 0, as the engine has decided
  double effective_youngs_modulus;  ///< E*, Pa, for JKR
};

/// What a contact keeps.
struct CohesionState {
  double bridge_volume = 0.0;     ///< m^3, of a bridge
  double rupture_distance = 0.0;  ///< m, the gap up to which the contact is held; 0 = it is not held

  DEMBARK_FUNCTION bool held() const { return rupture_distance > 0.0; }
};

/// The gap (m) up to which a contact that has formed is held; `bridge_volume` m^3.
DEMBARK_FUNCTION inline double cohesion_reach(const Cohesion& cohesion, double radius_1, double radius_2, double effective_youngs_modulus,
                                              double bridge_volume) {
  if (cohesion.law == CohesionLaw::bridge) return cohesion.liquid.force->rupture_distance(radius_1, radius_2, bridge_volume);
  if (cohesion.law != CohesionLaw::jkr) return 0.0;
  return jkr_rupture_distance(cohesion.work_of_adhesion, reduced(radius_1, radius_2), effective_youngs_modulus);
}

/// Attraction (N, > 0) in this step; a contact forms when the surfaces touch and ends beyond its rupture distance.
DEMBARK_FUNCTION inline double cohesion_step(const Cohesion& cohesion, const CohesionContact& c, CohesionState& state) {
  const double radius = reduced(c.radius_1, c.radius_2), work = cohesion.work_of_adhesion;
  switch (cohesion.law) {
    case CohesionLaw::none: break;
    // These two keep nothing: whatever another law left ends here.
    case CohesionLaw::constant: state = {}; return c.touching ? cohesion.cohesive_force : 0.0;
    case CohesionLaw::dmt: state = {}; return c.touching ? dmt_pull_off(work, radius) : 0.0;
    case CohesionLaw::jkr:
      if (c.touching) state.rupture_distance = cohesion_reach(cohesion, c.radius_1, c.radius_2, c.effective_youngs_modulus, 0.0);
      if (state.held() && c.gap <= state.rupture_distance) return jkr_attraction(work, radius, c.effective_youngs_modulus, -c.gap);
      break;
    case CohesionLaw::bridge: {
      const Liquid& liquid = cohesion.liquid;
      if (!liquid.force) break;
      if (!(state.bridge_volume > 0.0)) {
        if (!c.touching || !(liquid.bridge_volume > 0.0)) return 0.0;
        state.bridge_volume = liquid.bridge_volume;
        state.rupture_distance = cohesion_reach(cohesion, c.radius_1, c.radius_2, c.effective_youngs_modulus, state.bridge_volume);
      }
      if (!(c.gap > state.rupture_distance))
        return liquid.force->force(c.radius_1, c.radius_2, c.gap, state.bridge_volume, liquid.surface_tension);
    }
  }
  state = {};
  return 0.0;
}

}  // namespace dembark
