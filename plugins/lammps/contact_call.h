// What the pair style and the wall fix both do around dembark/contact.hpp.
#ifndef DEMBARK_CONTACT_CALL_H
#define DEMBARK_CONTACT_CALL_H

#include "error.h"

#include "dembark/contact.hpp"

namespace dembark_lammps {

typedef dembark::Vec3<double> Vec3;

inline Vec3 vector(const double* v) { return {v[0], v[1], v[2]}; }

DEMBARK_HOT void add(double* to, const Vec3& v, double scale = 1.0) {
  to[0] += scale * v.x;
  to[1] += scale * v.y;
  to[2] += scale * v.z;
}

/// The run ends where a bridge that forms cannot be integrated with this time step (s).
inline void check_time_step(LAMMPS_NS::Error* error, const dembark::Liquid& liquid, const dembark::ContactBodies& b, double dt) {
  const double limit = liquid.stable_time_step(b.effective_radius(), b.effective_mass());
  if (dt > limit)
    error->one(
        FLERR,
        "dembark: with viscous_liquid a bridge between these grains needs a timestep <= {:.3g} s, not {:.3g} s, or a larger minimum gap",
        limit, dt);
}

/// The run ends where a bridge that forms is longer than the lists of pairs look.
inline void check_reach(LAMMPS_NS::Error* error, double rupture_distance, double skin) {
  if (rupture_distance > skin)
    error->one(FLERR, "pair_style dembark/granular: a bridge reaches {:.3g} m but the neighbor skin is {:.3g} m; use neighbor {:.3g} bin",
               rupture_distance, skin, 1.01 * rupture_distance);
}

}  // namespace dembark_lammps

#endif
