// compute pair/gran/local, with the contacts that a bridge holds over a gap.
//
// The stock compute fills its table with every pair that has a force and then announces as many rows as there are overlapping
// pairs: with bridges the last rows, real contacts among them, are cut off. This one announces the rows that were filled. Same name,
// same columns.
#ifndef DEMBARK_COMPUTE_PAIR_GRAN_LOCAL_BRIDGES_H
#define DEMBARK_COMPUTE_PAIR_GRAN_LOCAL_BRIDGES_H

#include "compute_pair_gran_local.h"

namespace LAMMPS_NS {

class ComputePairGranLocalBridges : public ComputePairGranLocal {
 public:
  ComputePairGranLocalBridges(LAMMPS* lmp, int& iarg, int narg, char** arg) : ComputePairGranLocal(lmp, iarg, narg, arg) {}
  void compute_local() {
    ComputePairGranLocal::compute_local();
    size_local_rows = ipair;
  }
};

}  // namespace LAMMPS_NS

#endif
