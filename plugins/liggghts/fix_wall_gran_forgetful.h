// fix wall/gran with a primitive wall, when its contact models are ours: a grain beyond the list of those near the wall has no contact.
// Stock LIGGGHTS ends contacts of listed grains only: one that leaves the list between two steps would keep its bridge or held contact,
// and its friction spring, and have them again when it comes back, at whatever distance.
#ifndef DEMBARK_FIX_WALL_GRAN_FORGETFUL_H
#define DEMBARK_FIX_WALL_GRAN_FORGETFUL_H

#include <algorithm>
#include <vector>

#include "atom.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "primitive_wall.h"

namespace LAMMPS_NS {

class FixWallGranForgetful : public FixWallGran {
 public:
  using FixWallGran::FixWallGran;
  void pre_force(int vflag) override {
    const bool new_list = rebuildPrimitiveNeighlist_;
    FixWallGran::pre_force(vflag);
    if (new_list && fix_history_primitive_ && dnum() > 0 && has_our_models()) forget();
  }

 private:
  bool has_our_models() {
    return contact_match("tangential", "finnie_rabinowicz") || contact_match("cohesion", "capillary") ||
           contact_match("cohesion", "adhesion");
  }

  /// Carried liquid goes back at the end of the step, when its ledger misses the bridge.
  void forget() {
    std::vector<bool> listed(std::size_t(atom->nlocal), false);
    int *list = nullptr;
    const int count = primitiveWall_->getNeighbors(list);
    for (int k = 0; k < count; ++k) listed[std::size_t(list[k])] = true;
    for (int i = 0; i < atom->nlocal; ++i)
      if (!listed[std::size_t(i)]) std::fill_n(fix_history_primitive_->array_atom[i], dnum(), 0.0);
  }
};

}  // namespace LAMMPS_NS

#endif
