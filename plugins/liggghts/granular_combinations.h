// Entry of dembark's contact models and computes into the tables of LIGGGHTS.
//
// To add a law: write its header like tangential_model_finnie_rabinowicz.h, and give it a line in register_contact_models().
#pragma once

namespace LAMMPS_NS {
class LAMMPS;
}

namespace dembark_liggghts {

/// Make the contact models and every combination of them that the documentation promises known to the library. Combinations
/// that are not compiled end the run with one line that lists what there is.
void register_contact_models();

/// Replace the stock computes that do not know of contacts over a gap.
void register_computes(LAMMPS_NS::LAMMPS* lammps);

}  // namespace dembark_liggghts
