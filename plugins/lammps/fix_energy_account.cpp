#include "fix_energy_account.h"

#include <string>

#include "force.h"
#include "modify.h"

#include "engine_access.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
using namespace FixConst;

dembark_lammps::EnergyTally* dembark_lammps::find_energy_tally(const Modify* modify) {
  const auto found = modify->get_fix_by_style("^energy/account$");
  return found.empty() ? nullptr : &static_cast<FixEnergyAccount*>(found.front())->tally;
}

int FixEnergyAccount::setmask() { return INITIAL_INTEGRATE | POST_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE | END_OF_STEP; }

void FixEnergyAccount::setup(int) { dembark_lammps::begin_steps_first(modify, this); }

void FixEnergyAccount::check_contacts() {
  if (!dynamic_cast<PairDembarkGranular*>(force->pair))
    fail("the parts of the contact forces are known of pair_style dembark/granular only");
  for (const Fix* const wall : modify->get_fix_by_style("^wall/gran"))
    fail(std::string("the parts of the contact forces are known of fix wall/dembark only, and there is fix ") + wall->id + " (" +
         wall->style + ")");
}
