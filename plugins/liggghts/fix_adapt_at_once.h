// fix adapt of diameters, when our models compute contacts: copies of grains across the borders of ranks and of a periodic box have the new
// radii in the same step. Stock LIGGGHTS sends them with the positions, before they change, so that the two sides of a contact across a
// border know different radii, and their forces are not opposite.
#ifndef DEMBARK_FIX_ADAPT_AT_ONCE_H
#define DEMBARK_FIX_ADAPT_AT_ONCE_H

#include "comm.h"
#include "fix_adapt.h"
#include "force.h"
#include "update.h"

#include "granular_combinations.h"

namespace LAMMPS_NS {

class FixAdaptAtOnce : public FixAdapt {
 public:
  using FixAdapt::FixAdapt;
  void setup_pre_force(int vflag) override {
    FixAdapt::setup_pre_force(vflag);
    send();
  }
  void pre_force(int vflag) override {
    FixAdapt::pre_force(vflag);
    if (nevery > 0 && update->ntimestep % nevery == 0) send();
  }

 private:
  /// With the positions, as grains that change their size are sent anyway.
  void send() {
    if (diamflag && dembark_liggghts::has_our_models(*force)) comm->forward_comm();
  }
};

}  // namespace LAMMPS_NS

#endif
