// Entry of dembark's contact models into the tables of LIGGGHTS.
//
// To add a law: write its header like tangential_model_finnie_rabinowicz.h, and name it in granular_combinations_list.h.
#pragma once

namespace LAMMPS_NS {
class Force;
}

namespace dembark_liggghts {

/// Make the contact models and every combination of them that the documentation promises known to the library. Combinations
/// that are not compiled end the run with one line that lists what there is.
void register_contact_models();

/// Grains interact by one of our models, not by stock ones alone.
bool has_our_models(LAMMPS_NS::Force& force);

}  // namespace dembark_liggghts
