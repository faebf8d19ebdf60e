#include "kokkos_styles.h"

#include "error.h"
#include "lammps.h"

#include "pair_dembark_granular_kokkos.h"

using LAMMPS_NS::LAMMPS;

namespace dembark_lammps {

void* create_kokkos_pair(void* lammps) {
  return static_cast<LAMMPS_NS::Pair*>(new LAMMPS_NS::PairDembarkGranularKokkos<LMPDeviceType>(static_cast<LAMMPS*>(lammps)));
}

void* create_kokkos_history(void* lammps, int narg, char** arg) {
  return static_cast<LAMMPS_NS::Fix*>(new LAMMPS_NS::FixNeighHistoryDembark<LMPDeviceType>(static_cast<LAMMPS*>(lammps), narg, arg));
}

}  // namespace dembark_lammps
