// What the table of styles knows of those for KOKKOS, whose headers need Kokkos.
#ifndef DEMBARK_KOKKOS_STYLES_H
#define DEMBARK_KOKKOS_STYLES_H

namespace dembark_lammps {

void* create_kokkos_pair(void* lammps);
void* create_kokkos_history(void* lammps, int narg, char** arg);
/// The style without suffix for surfaces that a device does not know.
void* create_kokkos_wall(void* lammps, int narg, char** arg);

}  // namespace dembark_lammps

#endif
