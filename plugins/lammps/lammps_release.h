// What differs between the releases of LAMMPS for which the styles can be built; DEMBARK_LAMMPS_DATE says which it is.
#ifndef DEMBARK_LAMMPS_RELEASE_H
#define DEMBARK_LAMMPS_RELEASE_H

#include "domain.h"
#include "error.h"

namespace dembark_lammps {

/// Takes `apart` (m) to the nearest periodic image. The later release wants to know who asks.
inline void nearest_image(const LAMMPS_NS::Domain* domain, double* apart) {
#if DEMBARK_LAMMPS_DATE < 20250722
  domain->minimum_image(apart);
#else
  domain->minimum_image(FLERR, apart);
#endif
}

}  // namespace dembark_lammps

#endif
