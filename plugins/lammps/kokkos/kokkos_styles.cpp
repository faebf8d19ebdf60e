#include "kokkos_styles.h"

#include "error.h"
#include "lammps.h"

#include "fix_wall_dembark_kokkos.h"
#include "pair_dembark_granular_kokkos.h"

using LAMMPS_NS::LAMMPS;

namespace dembark_lammps {

void* create_kokkos_pair(void* lammps) {
  return static_cast<LAMMPS_NS::Pair*>(new LAMMPS_NS::PairDembarkGranularKokkos<LMPDeviceType>(static_cast<LAMMPS*>(lammps)));
}

void* create_kokkos_history(void* lammps, int narg, char** arg) {
  return static_cast<LAMMPS_NS::Fix*>(new LAMMPS_NS::FixNeighHistoryDembark<LMPDeviceType>(static_cast<LAMMPS*>(lammps), narg, arg));
}

void* create_kokkos_wall(void* lammps, int narg, char** arg) {
  typedef LAMMPS_NS::FixWallDembarkKokkos<LMPDeviceType> OnDevice;
  LAMMPS* const host = static_cast<LAMMPS*>(lammps);
  LAMMPS_NS::Fix* const fix =
      OnDevice::knows(*host, narg, arg) ? new OnDevice(host, narg, arg) : new LAMMPS_NS::FixWallDembark(host, narg, arg);
  return fix;
}

}  // namespace dembark_lammps
