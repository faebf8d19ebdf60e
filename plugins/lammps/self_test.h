// Whether the styles compute what the laws say in the LAMMPS that has loaded them.
#ifndef DEMBARK_SELF_TEST_H
#define DEMBARK_SELF_TEST_H

#include <string>

#include "lammps.h"

#include "lammps_plugin.h"

namespace dembark_lammps {

/// A RegisterStyle that writes into LAMMPS's tables.
void enter(PluginStyle* style, void* lammps);

/// Ten contacts in a LAMMPS of this process alone, over three steps: forces and torques of the pair style against those of
/// dembark/contact.hpp. Returns what is wrong, or nothing. `initialize` is lammpsplugin_init.
std::string self_test(void (*initialize)(void*, void*, void*));

}  // namespace dembark_lammps

#endif
