#include "fix_wall_dembark_kokkos.h"

#include <algorithm>
#include <string>

#include "atom_kokkos.h"
#include "atom_masks.h"
#include "error.h"
#include "force.h"
#include "memory_kokkos.h"
#include "update.h"

#include "contact_call.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
using dembark_lammps::FaceFinder;
using dembark_lammps::Fault;
using dembark_lammps::WallFace;

template <class DeviceType>
FixWallDembarkKokkos<DeviceType>::FixWallDembarkKokkos(LAMMPS* lmp, int narg, char** arg) : FixWallDembark(lmp, narg, arg) {
  kokkosable = 1;
  atomKK = static_cast<AtomKokkos*>(atom);
  execution_space = ExecutionSpaceFromDevice<DeviceType>::space;
  datamask_modify = F_MASK | TORQUE_MASK;
  datamask_read = X_MASK | V_MASK | OMEGA_MASK | TYPE_MASK | MASK_MASK | RMASS_MASK | RADIUS_MASK | datamask_modify;
  fault_ = dembark_lammps::FaultView<DeviceType>("dembark:fault");
  memory->destroy(force_);
  FixWallDembarkKokkos::grow_arrays(atom->nmax);
}

template <class DeviceType>
FixWallDembarkKokkos<DeviceType>::~FixWallDembarkKokkos() {
  memoryKK->destroy_kokkos(k_force_, force_);
}

template <class DeviceType>
bool FixWallDembarkKokkos<DeviceType>::knows(const LAMMPS& lmp, int narg, char** arg) {
  Region* const region = narg > 4 && std::string(arg[3]) == "region" ? lmp.domain->get_region_by_id(arg[4]) : nullptr;
  return region && !FaceFinder(*region, *lmp.domain).faces().empty();
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::init() {
  to_host();
  atomKK->sync(Host, TYPE_MASK | MASK_MASK | RADIUS_MASK);
  FixWallDembark::init();
  faces_ = FaceFinder(*surface_->region(), *domain).faces();
  if (faces_.empty()) fail("its region is now one that KOKKOS does not know; define the fix again");
  if (tally_ || layout_.imbalance) fail("fix energy/account and carried_liquid are not for KOKKOS; write 'suffix off' before this fix");
  maxexchange = std::max(maxexchange, 1 + int(faces_.size()) * slot_size());
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::to_host() {
  if (!on_device_) return;
  on_device_ = false;
  k_rows_.sync_host();
  const int size = layout_.size();
  for (int i = 0; i < count_; ++i) {
    std::vector<double>& slots = row(i);
    slots.clear();
    for (std::size_t k = 0; k < faces_.size(); ++k) {
      const int first = int(k) * (size + 1);
      if (k_rows_.h_view(i, first) == 0.0) continue;
      slots.push_back(faces_[k].number + 1);
      for (int n = 0; n < size; ++n) slots.push_back(k_rows_.h_view(i, first + 1 + n));
    }
    make_room(i);
  }
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::to_device() {
  if (on_device_) return;
  on_device_ = true;
  count_ = atom->nlocal;
  if (int(k_rows_.extent(0)) < count_ || int(k_rows_.extent(1)) != width())
    k_rows_ = DAT::tdual_float_2d("wall/dembark:rows", std::size_t(atom->nmax), std::size_t(width()));
  atomKK->sync(Host, TYPE_MASK | MASK_MASK);
  k_rows_.modify_host();
  const int size = layout_.size();
  for (int i = 0; i < count_; ++i) {
    if ((atom->mask[i] & groupbit) && !pair_->coefficients().is_complete(atom->type[i], wall_type_)) fail_alone(not_for(atom->type[i]));
    const std::vector<double>& slots = row(i);
    for (std::size_t k = 0; k < faces_.size(); ++k) {
      const int first = int(k) * (size + 1);
      k_rows_.h_view(i, first) = 0.0;
      for (std::size_t at = 0; at < slots.size(); at += std::size_t(slot_size())) {
        if (slots[at] != faces_[k].number + 1) continue;
        k_rows_.h_view(i, first) = 1.0;
        for (int n = 0; n < size; ++n) k_rows_.h_view(i, first + 1 + n) = slots[at + 1 + std::size_t(n)];
      }
    }
  }
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::post_force(int) {
  if (moving_) move();
  summed_ = -1;
  if (update->setupflag) laws_.assign(atom->ntypes, [this](int i, int j) { return pair_->coefficients()(i, j); });
  to_device();
  k_rows_.template sync<DeviceType>();

  dembark_lammps::WallKernel<DeviceType> kernel;
  kernel.see(*atomKK);
  kernel.force = atomKK->k_f.view<DeviceType>();
  kernel.torque = atomKK->k_torque.view<DeviceType>();
  kernel.wall_force = k_force_.template view<DeviceType>();
  kernel.rows = k_rows_.template view<DeviceType>();
  kernel.laws = laws_.reader();
  kernel.fault = fault_;
  kernel.layout = layout_;
  kernel.frame = frame_;
  kernel.face_count = int(faces_.size());
  std::copy(faces_.begin(), faces_.end(), kernel.faces);
  kernel.centre = origin();
  if (moving_) {
    kernel.spin = moving_->spin();
    kernel.velocity = moving_->velocity_at(moving_->centre());
  }
  kernel.dt = update->dt;
  kernel.wall_type = wall_type_;
  kernel.group = groupbit;
  kernel.frozen = pair_->freeze_bit();
  // The forces of the set-up are those of the present state, which stays.
  kernel.advance = !update->setupflag;
  dembark_lammps::WallTotals sums;
  Kokkos::parallel_reduce("dembark:wall", Kokkos::RangePolicy<DeviceType>(0, atom->nlocal), kernel, sums);
  std::copy_n(sums.value, totals_.size(), totals_.begin());
  k_rows_.template modify<DeviceType>();
  k_force_.template modify<DeviceType>();
  k_force_.sync_host();  // dumps and other fixes read it without a word

  const Fault fault = dembark_lammps::found(fault_);
  if (fault.kind != Fault::none) stop_at(fault);
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::stop_at(const Fault& fault) {
  atomKK->sync(Host, TAG_MASK);
  if (fault.kind == Fault::coincidence) refuse_coincidence(fault.i);
  dembark_lammps::refuse_time_step(error, fault.limit, update->dt);
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::grow_arrays(int count) {
  to_host();
  RowsFix::grow_arrays(count);
  k_force_.sync_host();
  memoryKK->grow_kokkos(k_force_, force_, count, 3, "wall/dembark:force");
  array_atom = force_;
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::copy_arrays(int from, int to, int mode) {
  to_host();
  FixWallDembark::copy_arrays(from, to, mode);
  k_force_.modify_host();
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::set_arrays(int i) {
  to_host();
  FixWallDembark::set_arrays(i);
  k_force_.modify_host();
}

template <class DeviceType>
int FixWallDembarkKokkos<DeviceType>::pack_exchange(int i, double* buffer) {
  to_host();
  return FixWallDembark::pack_exchange(i, buffer);
}

template <class DeviceType>
int FixWallDembarkKokkos<DeviceType>::unpack_exchange(int i, double* buffer) {
  to_host();
  return FixWallDembark::unpack_exchange(i, buffer);
}

template <class DeviceType>
int FixWallDembarkKokkos<DeviceType>::pack_restart(int i, double* buffer) {
  to_host();
  return FixWallDembark::pack_restart(i, buffer);
}

template <class DeviceType>
void FixWallDembarkKokkos<DeviceType>::unpack_restart(int i, int nth) {
  to_host();
  FixWallDembark::unpack_restart(i, nth);
}

template <class DeviceType>
int FixWallDembarkKokkos<DeviceType>::maxsize_restart() {
  to_host();
  return FixWallDembark::maxsize_restart();
}

namespace LAMMPS_NS {
template class FixWallDembarkKokkos<LMPDeviceType>;
}
