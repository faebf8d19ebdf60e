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

struct RadiusRange {
  double least = INFINITY, largest = 0.0;  // m
  bool empty() const { return !(least <= largest); }
};

/// Radii of the grains of each type (the first is that of no type), those that fixes will insert included. Collective.
inline std::vector<RadiusRange> radius_ranges(const LAMMPS_NS::Atom& atom, const LAMMPS_NS::Modify& modify, MPI_Comm world, int types) {
  std::vector<RadiusRange> all(std::size_t(types + 1));
  const auto include = [&](int type, double least, double largest) {
    RadiusRange& range = all[std::size_t(type)];
    range = {std::min(range.least, least), std::max(range.largest, largest)};
  };
  for (int i = 0; i < atom.nlocal; ++i)
    if (atom.type[i] <= types) include(atom.type[i], atom.radius[i], atom.radius[i]);
  for (int k = 0; k < modify.nfix; ++k)
    for (int type = 1; type <= types; ++type)
      if (const double least = modify.fix[k]->min_rad(type); least > 0.0)
        include(type, least, std::max(least, modify.fix[k]->max_rad(type)));
  for (RadiusRange& range : all) {
    MPI_Allreduce(MPI_IN_PLACE, &range.least, 1, MPI_DOUBLE, MPI_MIN, world);
    MPI_Allreduce(MPI_IN_PLACE, &range.largest, 1, MPI_DOUBLE, MPI_MAX, world);
  }
  return all;
}

/// The contact distance factor f with which pairs (`wall` null) or the grains at a wall are kept as far as they are held:
/// `reach(i, j, radius, other radius)` (m). Pairs are kept to (f - 1) (r_i + r_j), grains at walls to (f - 1) r_i. The smallest or the
/// largest grains need the largest factor.
template <class Reach>
double cohesion_distance_factor(int types, const std::vector<RadiusRange>& ranges, const LAMMPS_NS::FixWallGran* wall, Reach reach) {
  double factor = 1.0;
  const auto include = [&](int i, int j, double radius, double other) {
    factor = std::max(factor, 1.0 + 1.001 * reach(i, j, radius, other) / (wall ? radius : radius + other));
  };
  for (int i = 1; i <= types; ++i)
    for (int j = 1; j <= types; ++j) {
      const RadiusRange &own = ranges[std::size_t(i)], &other = ranges[std::size_t(j)];
      if (own.empty() || (wall ? j != wall->atom_type_wall() : other.empty())) continue;
      for (const double radius : {own.least, own.largest})
        for (const double partner : {other.least, other.largest}) include(i, j, radius, wall ? INFINITY : partner);
    }
  return factor;
}

/// Ends the run with one line where a bridge would be longer than the lists look. `size`: r_i + r_j, r_i against a wall.
inline void check_reach(LAMMPS_NS::Neighbor* neighbor, LAMMPS_NS::Error* error, double rupture_distance, double size, bool primitive_wall) {
  // The engine keeps the grains near a primitive wall within the skin only.
  const bool beyond_skin = primitive_wall && rupture_distance > neighbor->skin;
  const double reach = (neighbor->contactDistanceFactor - 1.0) * size;
  if (!beyond_skin && rupture_distance <= reach) return;
  char line[256];
  if (beyond_skin)
    snprintf(line, sizeof line,
             "cohesion: a bridge or held contact with a primitive wall reaches %g but the neighbour skin is %g; use neighbor %.3g bin",
             rupture_distance, neighbor->skin, 1.01 * rupture_distance);
  else
    snprintf(line, sizeof line,
             "cohesion: a bridge or held contact reaches %g but neighbours are kept to %g only; use neigh_modify "
             "contact_distance_factor %.3g",
             rupture_distance, reach, (1.0 + rupture_distance / size) * 1.01);
  error->one(FLERR, line);
}

}  // namespace dembark_liggghts

#endif
