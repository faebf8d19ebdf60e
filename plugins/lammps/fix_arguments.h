// Arguments of fixes of LAMMPS, which keep them in classes that no package of LAMMPS declares.
#ifndef DEMBARK_FIX_ARGUMENTS_H
#define DEMBARK_FIX_ARGUMENTS_H

#include <string>
#include <vector>

#include "fix.h"

namespace dembark_lammps {

/// From now on, arguments of fixes ave/time and wall/gran are remembered when these are made.
void watch_fixes(LAMMPS_NS::LAMMPS* lammps);
/// Whether `fix` was made with this word; also if it was made before it could be watched.
bool may_have_argument(LAMMPS_NS::LAMMPS* lammps, const LAMMPS_NS::Fix& fix, const std::string& word);

}  // namespace dembark_lammps

#endif
