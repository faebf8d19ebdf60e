// What the pair style and the wall fix both do around dembark/contact.hpp.
#ifndef DEMBARK_CONTACT_CALL_H
#define DEMBARK_CONTACT_CALL_H

#include "error.h"

#include "shared_fix.h"

namespace dembark_lammps {

typedef dembark::Vec3<double> Vec3;

using dembark_family::add;
using dembark_family::vector;

inline void refuse_time_step(LAMMPS_NS::Error* error, double limit, double dt) {
  error->one(FLERR,
             "dembark: with viscous_liquid a bridge between these grains needs a timestep <= {:.3g}, not {:.3g}, or a larger minimum gap",
             limit, dt);
}

/// The run ends where a bridge that forms cannot be integrated with this time step (s).
inline void check_time_step(LAMMPS_NS::Error* error, const dembark::Liquid& liquid, const dembark::ContactBodies& b, double dt) {
  const double limit = liquid.stable_time_step(b.effective_radius(), b.effective_mass());
  if (dt > limit) refuse_time_step(error, limit, dt);
}

/// The run ends where a bridge that forms is longer than the lists of pairs look.
inline void check_reach(LAMMPS_NS::Error* error, double rupture_distance, double skin) {
  if (rupture_distance > skin)
    error->one(FLERR, "pair_style dembark/granular: a bridge reaches {:.3g} but the neighbor skin is {:.3g}; use neighbor {:.3g} bin",
               rupture_distance, skin, 1.01 * rupture_distance);
}

}  // namespace dembark_lammps

#endif
