// What differs between the releases of LAMMPS for which the styles can be built.
#ifndef DEMBARK_LAMMPS_RELEASE_H
#define DEMBARK_LAMMPS_RELEASE_H

#include "domain.h"
#include "error.h"

namespace dembark_lammps {

/// Takes `apart` (m) to the nearest periodic image. Since 22 Jul 2025 LAMMPS wants to know who asks.
template <class Box>
auto nearest_image(const Box& box, double* apart, int) -> decltype(box.minimum_image(FLERR, apart)) {
  box.minimum_image(FLERR, apart);
}
template <class Box>
auto nearest_image(const Box& box, double* apart, long) -> decltype(box.minimum_image(apart)) {
  box.minimum_image(apart);
}
inline void nearest_image(const LAMMPS_NS::Domain* domain, double* apart) { nearest_image(*domain, apart, 0); }

}  // namespace dembark_lammps

#endif
