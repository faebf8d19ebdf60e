// The fix NEIGH_HISTORY of LAMMPS, which keeps rows of numbers for the pairs of a neighbour list.
#ifndef DEMBARK_NEIGHBOR_HISTORY_H
#define DEMBARK_NEIGHBOR_HISTORY_H

#include "fix.h"
#include "pair.h"

namespace dembark_lammps {

/// The first members of LAMMPS's FixNeighHistory, whose header no package of LAMMPS holds. Pair style dembark/granular checks that they
/// are.
struct NeighborHistory : LAMMPS_NS::Fix {
  int nlocal_neigh;       ///< owned atoms when the list was built
  int nall_neigh;         ///< the same with ghosts
  int use_bit_flag;       ///< take flags of touching pairs from the bits of the list
  int** firstflag;        ///< of each atom: 1 for pairs that have a history
  double** firstvalue;    ///< of each atom: the rows of its pairs, one after the other
  LAMMPS_NS::Pair* pair;  ///< whose list it is
};

}  // namespace dembark_lammps

#endif
