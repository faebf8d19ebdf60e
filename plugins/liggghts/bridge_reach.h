// How far the neighbour lists of LIGGGHTS look, and have to look for bridges.
#ifndef DEMBARK_BRIDGE_REACH_H
#define DEMBARK_BRIDGE_REACH_H

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "atom.h"
#include "error.h"
#include "fix_wall_gran.h"
#include "modify.h"
#include "neighbor.h"

#include "dembark/contact.hpp"
#include "model_properties.h"

namespace dembark_liggghts {

/// Least radius (m) of the grains of each type (the first is that of no type), those that fixes will insert included; infinite where there
/// are none. Collective.
inline std::vector<double> least_radii(const LAMMPS_NS::Atom& atom, const LAMMPS_NS::Modify& modify, MPI_Comm world, int types) {
  std::vector<double> mine(std::size_t(types + 1), INFINITY), all(mine.size());
  for (int i = 0; i < atom.nlocal; ++i)
    if (atom.type[i] <= types) mine[std::size_t(atom.type[i])] = std::min(mine[std::size_t(atom.type[i])], atom.radius[i]);
  for (int k = 0; k < modify.nfix; ++k)
    for (int type = 1; type <= types; ++type)
      if (const double radius = modify.fix[k]->min_rad(type); radius > 0.0)
        mine[std::size_t(type)] = std::min(mine[std::size_t(type)], radius);
  MPI_Allreduce(mine.data(), all.data(), types + 1, MPI_DOUBLE, MPI_MIN, world);
  return all;
}

/// The contact distance factor f with which pairs (`wall` null) or the grains at a wall are kept up to the rupture of their bridges, of
/// `volume` (m^3) where that is > 0: pairs are kept to (f - 1) (r_i + r_j), grains at walls to (f - 1) r_i. The smallest grains need the
/// largest factor.
inline double bridge_distance_factor(const PairTable<dembark::Liquid>& liquids, const std::vector<double>& radii,
                                     const LAMMPS_NS::FixWallGran* wall, double volume) {
  double factor = 1.0;
  for (int i = 1; i <= liquids.types(); ++i)
    for (int j = 1; j <= liquids.types(); ++j) {
      const double radius = radii[std::size_t(i)], other = wall ? INFINITY : radii[std::size_t(j)];
      if (std::isinf(radius) || (wall ? j != wall->atom_type_wall() : std::isinf(other))) continue;
      const dembark::Liquid& liquid = liquids(i, j);
      const double rupture = liquid.force->rupture_distance(radius, other, volume > 0.0 ? volume : liquid.bridge_volume);
      factor = std::max(factor, 1.0 + 1.001 * rupture / (wall ? radius : radius + other));
    }
  return factor;
}

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
  snprintf(line, sizeof line,
           "cohesion capillary: a bridge reaches %g m but neighbours are kept to %g m only; use neigh_modify contact_distance_factor %.3g",
           rupture_distance, reach, (1.0 + rupture_distance / size) * 1.01);
  error->one(FLERR, line);
}

}  // namespace dembark_liggghts

#endif
