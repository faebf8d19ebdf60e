// Whether the neighbour lists of LIGGGHTS look as far as a bridge reaches.
#ifndef DEMBARK_BRIDGE_REACH_H
#define DEMBARK_BRIDGE_REACH_H

#include <cstdio>

#include "error.h"
#include "neighbor.h"

namespace dembark_liggghts {

/// Ends the run with one line where a bridge would be longer than the lists look. `size`: r_i + r_j, r_i against a wall.
inline void check_reach(LAMMPS_NS::Neighbor* neighbor, LAMMPS_NS::Error* error, double rupture_distance, double size, bool primitive_wall) {
  char line[256];
  if (primitive_wall && rupture_distance > neighbor->skin) {
    // The engine keeps the grains near a primitive wall within the skin only.
    snprintf(line, sizeof line,
             "cohesion capillary: a bridge to a primitive wall reaches %g m but the neighbour skin is %g m; use neighbor %.3g bin",
             rupture_distance, neighbor->skin, 1.01 * rupture_distance);
    error->one(FLERR, line);
  }
  const double reach = (neighbor->contactDistanceFactor - 1.0) * size;
  if (rupture_distance <= reach) return;
  const double needed = 1.0 + rupture_distance / size;
  snprintf(line, sizeof line,
           "cohesion capillary: a bridge reaches %g m but neighbours are kept to %g m only; use neigh_modify contact_distance_factor %.3g",
           rupture_distance, reach, needed * 1.01);
  error->one(FLERR, line);
}

}  // namespace dembark_liggghts

#endif
