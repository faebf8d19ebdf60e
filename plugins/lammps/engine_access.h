// Private and protected members of LAMMPS that dembark's styles use, all of them, each with the reason why there is no other way.
#ifndef DEMBARK_ENGINE_ACCESS_H
#define DEMBARK_ENGINE_ACCESS_H

#include <string>
#include <utility>
#include <vector>

#include "fix.h"
#include "modify.h"
#include "region.h"
#include "variable.h"

namespace dembark_lammps {

/// `fix` begins the steps of this run before all others that do so, and looks at the state of a step after all its output, and before
/// anything of the next: LAMMPS calls no fix there by itself. Called in the set-up; the fix that is last to call it is the first. The lists
/// of Modify are protected.
void begin_steps_first(LAMMPS_NS::Modify* modify, const LAMMPS_NS::Fix* fix);

/// Whether the restart file that was read has numbers of atoms of a fix whose name begins so, and no fix has taken them: LAMMPS drops them
/// with the first run. What Modify keeps of the file is protected.
bool left_in_restart_file(const LAMMPS_NS::Modify* modify, const std::string& prefix);
/// Names and formulas of variables of styles equal, atom and vector. Their texts are private.
std::vector<std::pair<std::string, std::string>> formulas(LAMMPS_NS::Variable* variables);
/// Length of the axis about which a region rotates, as the script gives it: LAMMPS turns the region about the unit vector, but its angular
/// velocity is as many times too large. The axis is private.
double axis_length(const LAMMPS_NS::Region* region);

}  // namespace dembark_lammps

#endif
