#include "atom_numbers.h"

#include <map>
#include <memory>
#include <string>

#include "atom.h"
#include "command.h"
#include "error.h"
#include "force.h"
#include "input.h"
#include "modify.h"
#include "update.h"

#include "contact_coefficients.h"
#include "deleted_atoms.h"
#include "shared_fix.h"

using namespace LAMMPS_NS;

namespace dembark_lammps {
namespace {

std::map<const LAMMPS*, dembark_family::DeletedAtoms> deleted_atoms;

std::string wrong_with_delete(const LAMMPS& lammps, int narg, char** arg) {
  return dembark_family::new_numbers_error(*lammps.atom, *lammps.update, narg, arg);
}

std::string wrong_with_reset(const LAMMPS& lammps, int, char**) {
  if (!lammps.update->first_update && lammps.update->ntimestep == 0) return "";
  return "reset_atoms id would give the atoms other numbers, by which contacts and logs know each other; do it before the first run";
}

std::string wrong_with_run(const LAMMPS& lammps, int, char**) { return deleted_atoms[&lammps].run_error(*lammps.atom, lammps.world); }

/// In front of a command of LAMMPS. A creator has no data of its own, so there is a class for each.
template <std::string (*wrong_with)(const LAMMPS&, int, char**)>
class Guarded : public Command {
 public:
  using Command::Command;

  void command(int narg, char** arg) override {
    const bool by_number = force->pair_match(ContactCoefficients::style_name, 0) || !modify->get_fix_by_style("^lcp/impact$").empty();
    const std::string wrong = by_number ? wrong_with(*lmp, narg, arg) : "";
    if (!wrong.empty()) error->all(FLERR, wrong);
    const auto original = [&] { std::unique_ptr<Command>(original_(lmp))->command(narg, arg); };
    if (wrong_with == &wrong_with_delete && by_number && update->first_update) return deleted_atoms[lmp].watch(*atom, world, original);
    original();
    if (wrong_with == &wrong_with_run) deleted_atoms[lmp].clear();
  }

  static void enter(Input& input, const char* name) {
    const auto found = input.command_map->find(name);
    if (found == input.command_map->end() || found->second == &create) return;
    original_ = found->second;
    found->second = &create;
  }

 private:
  static inline Input::CommandCreator original_ = nullptr;

  static Command* create(LAMMPS* lammps) { return new Guarded(lammps); }
};

}  // namespace

void keep_numbers(LAMMPS* lammps) {
  deleted_atoms[lammps].clear();
  Guarded<wrong_with_run>::enter(*lammps->input, "run");
  Guarded<wrong_with_delete>::enter(*lammps->input, "delete_atoms");
  Guarded<wrong_with_reset>::enter(*lammps->input, "RESET_ATOMS_ID");  // of the command reset_atoms id
}

}  // namespace dembark_lammps
