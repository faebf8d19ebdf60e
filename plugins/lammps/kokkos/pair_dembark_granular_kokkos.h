// pair_style dembark/granular/kk: the contacts of pair_dembark_granular.h in a Kokkos kernel.
#ifndef DEMBARK_PAIR_DEMBARK_GRANULAR_KOKKOS_H
#define DEMBARK_PAIR_DEMBARK_GRANULAR_KOKKOS_H

#include "contact_kernel.h"
#include "fix_neigh_history_dembark.h"
#include "pair_dembark_granular.h"

namespace LAMMPS_NS {

template <class DeviceType>
class PairDembarkGranularKokkos : public PairDembarkGranular {
 public:
  typedef DeviceType device_type;

  PairDembarkGranularKokkos(LAMMPS* lmp);
  ~PairDembarkGranularKokkos() override;
  void init_style() override;
  void compute(int eflag, int vflag) override;

 protected:
  std::string history_fix() const override;

 private:
  FixNeighHistoryDembark<DeviceType>* rows_ = nullptr;
  dembark_lammps::DeviceLaws<DeviceType> laws_;
  dembark_lammps::FaultView<DeviceType> fault_;
  DAT::tdual_efloat_1d k_eatom;
  DAT::tdual_virial_array k_vatom;

  void refuse_what_is_missing();
  template <int neighflag>
  void advance_contacts();
  void stop_at(const dembark_lammps::Fault& fault);
};

}  // namespace LAMMPS_NS

#endif
