// LAMMPS's side of fix ID all energy/account (energy_account_fix.h).
#ifndef DEMBARK_FIX_ENERGY_ACCOUNT_H
#define DEMBARK_FIX_ENERGY_ACCOUNT_H

#include "energy_account_fix.h"
#include "energy_tally.h"

namespace LAMMPS_NS {

class FixEnergyAccount : public dembark_family::EnergyAccountFix {
 public:
  FixEnergyAccount(LAMMPS* lmp, int narg, char** arg) : EnergyAccountFix(lmp, narg, arg, tally) {}
  int setmask() override;
  void setup(int) override;
  void initial_integrate(int) override { begin_step(); }

  dembark_lammps::EnergyTally tally;

 private:
  void check_contacts() override;
};

}  // namespace LAMMPS_NS

#endif
