#include "fix_energy_account.h"

#include <string>

#include "fix_wall_gran.h"
#include "force.h"
#include "modify.h"
#include "pair_gran.h"

#include "fix_wall_motion.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

/// Which model of a pair style or a wall has no parts that are known, or nothing.
template <class Host>
std::string unknown_model(Host &host) {
  if (!host.contact_match("tangential", "finnie_rabinowicz")) return "tangential finnie_rabinowicz";
  if (!host.contact_match("normal", "hertz") && !host.contact_match("normal", "hooke")) return "model hertz or hooke";
  if (!host.contact_match("surface", "default")) return "surface default";
  return "";
}

}  // namespace

FixEnergyAccount::FixEnergyAccount(LAMMPS *lmp, int narg, char **arg) : EnergyAccountFix(lmp, narg, arg, tally) {}

int FixEnergyAccount::setmask() { return PRE_INITIAL_INTEGRATE | POST_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE | END_OF_STEP; }

void FixEnergyAccount::init() {
  EnergyAccountFix::init();
  tally.atom = atom;
  tally.frozen = static_cast<PairGran *>(force->pair)->freeze_group_bit();
  tally.driven.clear();
  for (Fix *const fix : fixes())
    if (auto *const wall = dynamic_cast<FixWallMotion *>(fix)) tally.driven.emplace_back(wall->mesh(), &wall->acceleration());
}

void FixEnergyAccount::check_contacts() {
  PairGran *const pair = dynamic_cast<PairGran *>(force->pair);
  if (!pair) fail("it needs pair_style gran model hertz|hooke tangential finnie_rabinowicz ...");
  const auto check = [this](const std::string &where, const std::string &missed) {
    if (!missed.empty()) fail("the parts of the contact forces are known with " + missed + " only; " + where + " has another model");
  };
  check("the pair style", unknown_model(*pair));
  for (Fix *const fix : fixes())
    if (FixWallGran *const wall = dynamic_cast<FixWallGran *>(fix)) check("fix " + std::string(wall->id), unknown_model(*wall));
}
