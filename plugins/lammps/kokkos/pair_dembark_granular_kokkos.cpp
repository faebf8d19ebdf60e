#include "pair_dembark_granular_kokkos.h"

#include <string>

#include "atom_kokkos.h"
#include "atom_masks.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "kokkos.h"
#include "memory_kokkos.h"
#include "modify.h"
#include "neigh_list_kokkos.h"
#include "neigh_request.h"
#include "neighbor.h"
#include "update.h"

#include "contact_call.h"

using namespace LAMMPS_NS;
using dembark_lammps::Fault;

template <class DeviceType>
PairDembarkGranularKokkos<DeviceType>::PairDembarkGranularKokkos(LAMMPS* lmp) : PairDembarkGranular(lmp) {
  kokkosable = 1;
  single_enable = 0;  // the histories are the device's
  if (!lmp->kokkos) error->all(FLERR, "pair_style dembark/granular/kk: LAMMPS runs without KOKKOS; start it with '-k on'");
  atomKK = static_cast<AtomKokkos*>(atom);
  execution_space = ExecutionSpaceFromDevice<DeviceType>::space;
  datamask_modify = F_MASK | TORQUE_MASK | ENERGY_MASK | VIRIAL_MASK;
  datamask_read = X_MASK | V_MASK | OMEGA_MASK | TYPE_MASK | MASK_MASK | RMASS_MASK | RADIUS_MASK | datamask_modify;
  fault_ = dembark_lammps::FaultView<DeviceType>("dembark:fault");
}

template <class DeviceType>
PairDembarkGranularKokkos<DeviceType>::~PairDembarkGranularKokkos() {
  memoryKK->destroy_kokkos(k_eatom, eatom);
  memoryKK->destroy_kokkos(k_vatom, vatom);
}

template <class DeviceType>
std::string PairDembarkGranularKokkos<DeviceType>::history_fix() const {
  // With a number more than the host's, and a name that a restart file of the host's does not have.
  return "KOKKOS_LAYOUT" + std::to_string(layout_.code()) + " all NEIGH_HISTORY/DEMBARK/KK " + std::to_string(layout_.size() + 1);
}

template <class DeviceType>
void PairDembarkGranularKokkos<DeviceType>::refuse_what_is_missing() {
  const auto refuse = [this](const std::string& what) {
    error->all(FLERR, "pair_style dembark/granular/kk: " + what + "; use pair_style dembark/granular, which has no suffix");
  };
  if (layout_.imbalance) refuse("carried_liquid is not for KOKKOS");
  for (Fix* const fix : modify->get_fix_list()) {
    const std::string style = fix->style;
    const std::string name = "fix " + std::string(fix->id) + " (" + style + ") ";
    for (const char* const host : {"capillary/liquid", "energy/account", "integration/monitor", "lcp/impact", "resume/exact"})
      if (style == host) refuse(name + "is not for KOKKOS");
    if (fix->rigid_flag) refuse(name + "moves rigid bodies, which is not for KOKKOS");
    if (fix->diam_flag) refuse(name + "lets grains grow, which is not for KOKKOS");
  }
  // Other lists hand each contact to two threads, and fix neigh/history/kk keeps one history of it.
  if (lmp->kokkos->neighflag == FULL)
    error->all(FLERR, "pair_style dembark/granular/kk needs half lists of neighbors; use package kokkos neigh half");
  if (force->newton_pair) error->all(FLERR, "pair_style dembark/granular/kk needs 'newton off' (or package kokkos newton off)");
}

template <class DeviceType>
void PairDembarkGranularKokkos<DeviceType>::init_style() {
  refuse_what_is_missing();
  atomKK->sync(Host, TYPE_MASK | RADIUS_MASK);
  PairDembarkGranular::init_style();
  rows_ = dynamic_cast<FixNeighHistoryDembark<DeviceType>*>(modify->get_fix_by_id(history().id));
  NeighRequest* const request = neighbor->find_request(this);
  request->set_kokkos_host(std::is_same_v<DeviceType, LMPHostType> && !std::is_same_v<DeviceType, LMPDeviceType>);
  request->set_kokkos_device(std::is_same_v<DeviceType, LMPDeviceType>);
}

template <class DeviceType>
void PairDembarkGranularKokkos<DeviceType>::compute(int eflag, int vflag) {
  ev_init(eflag, vflag, 0);
  if (eflag_atom) {
    memoryKK->destroy_kokkos(k_eatom, eatom);
    memoryKK->create_kokkos(k_eatom, eatom, maxeatom, "pair:eatom");
  }
  if (vflag_atom) {
    memoryKK->destroy_kokkos(k_vatom, vatom);
    memoryKK->create_kokkos(k_vatom, vatom, maxvatom, "pair:vatom");
  }
  if (neighbor->ago == 0) {
    atomKK->sync(Host, TYPE_MASK | RADIUS_MASK | TAG_MASK);
    check_radii();
  }
  if (update->setupflag) laws_.assign(atom->ntypes, [this](int i, int j) { return coefficients_(i, j); });
  atomKK->sync(execution_space, datamask_read);
  if (lmp->kokkos->neighflag == HALF) advance_contacts<HALF>();
  else advance_contacts<HALFTHREAD>();
  atomKK->modified(execution_space, eflag || vflag ? datamask_modify : F_MASK | TORQUE_MASK);
  if (vflag_atom) {
    k_vatom.template modify<DeviceType>();
    k_vatom.template sync<LMPHostType>();
  }
  const Fault fault = dembark_lammps::found(fault_);
  if (fault.kind != Fault::none) stop_at(fault);
}

template <class DeviceType>
template <int neighflag>
void PairDembarkGranularKokkos<DeviceType>::advance_contacts() {
  dembark_lammps::ContactKernel<DeviceType, neighflag> kernel;
  kernel.see(*atomKK);
  kernel.force = atomKK->k_f.view<DeviceType>();
  kernel.torque = atomKK->k_torque.view<DeviceType>();
  if (vflag_atom) kernel.atom_virials = k_vatom.template view<DeviceType>();
  auto* const pairs = static_cast<NeighListKokkos<DeviceType>*>(list);
  kernel.neighbors = pairs->d_neighbors;
  kernel.grains = pairs->d_ilist;
  kernel.neighbor_counts = pairs->d_numneigh;
  rows_->k_firstflag.template sync<DeviceType>();
  rows_->k_firstvalue.template sync<DeviceType>();
  kernel.flags = rows_->k_firstflag.template view<DeviceType>();
  kernel.rows = rows_->k_firstvalue.template view<DeviceType>();
  kernel.laws = laws_.reader();
  kernel.fault = fault_;
  kernel.layout = layout_;
  kernel.dt = update->dt;
  kernel.skin = neighbor->skin;
  for (int k = 0; k < 4; ++k) kernel.special[k] = force->special_lj[k];
  kernel.own = atom->nlocal;
  kernel.frozen = freeze_bit_;
  // The forces of the set-up are those of the present state, which stays.
  kernel.advance = !update->setupflag;
  kernel.global_virial = vflag_global;
  kernel.each_virial = vflag_atom;
  const Kokkos::RangePolicy<DeviceType> grains(0, list->inum);
  if (vflag_either) {
    EV_FLOAT sums;
    Kokkos::parallel_reduce("dembark:contacts", grains, kernel, sums);
    for (int k = 0; k < 6; ++k) virial[k] += sums.v[k];
  } else Kokkos::parallel_for("dembark:contacts", grains, kernel);
  rows_->k_firstflag.template modify<DeviceType>();
  rows_->k_firstvalue.template modify<DeviceType>();
}

template <class DeviceType>
void PairDembarkGranularKokkos<DeviceType>::stop_at(const Fault& fault) {
  atomKK->sync(Host, TAG_MASK);
  if (fault.kind == Fault::coincidence) refuse_coincidence(fault.i, fault.j);
  if (fault.kind == Fault::reach) check_reach(fault.i, fault.j, fault.limit);
  dembark_lammps::refuse_time_step(error, fault.limit, update->dt);
}

namespace LAMMPS_NS {
template class PairDembarkGranularKokkos<LMPDeviceType>;
}
