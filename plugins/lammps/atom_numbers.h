// Numbers of atoms, by which histories of pairs, and logs, are found again.
#ifndef DEMBARK_ATOM_NUMBERS_H
#define DEMBARK_ATOM_NUMBERS_H

#include "lammps.h"

namespace dembark_lammps {

/// From now on, delete_atoms and reset_atoms end with an error where they would change numbers that contacts or logs have.
void keep_numbers(LAMMPS_NS::LAMMPS* lammps);

}  // namespace dembark_lammps

#endif
