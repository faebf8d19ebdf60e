// What packs of contacts (dembark/pairs) take of the engine's grains and of the pairs in its neighbour list.
#ifndef DEMBARK_PAIR_GRAINS_H
#define DEMBARK_PAIR_GRAINS_H

#include "atom.h"
#include "neigh_list.h"

#include "dembark/pairs/pair_step.hpp"

namespace dembark_family {

/// `list` must hold a grain.
inline void describe_pairs(dembark::PairStep& step, const LAMMPS_NS::Atom& atom, const LAMMPS_NS::NeighList& list) {
  step.x = atom.x[0];
  step.v = atom.v[0];
  step.omega = atom.omega[0];
  step.radius = atom.radius;
  step.mass = atom.rmass;
  step.type = atom.type;
  step.mask = atom.mask;
  step.f = atom.f[0];
  step.torque = atom.torque[0];
  step.count = list.inum;
  step.grains = list.ilist;
  step.numneigh = list.numneigh;
  step.neighbors = list.firstneigh;
  step.number_bits = NEIGHMASK;
}

}  // namespace dembark_family

#endif
