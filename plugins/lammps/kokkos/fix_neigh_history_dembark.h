// LAMMPS's fix neigh/history/kk with two faults mended, both in the release of 4 Feb 2025:
// - each rank has room for as many contacts of a grain as its own grains had, so that a grain that comes from another rank may have more;
// - a restart file is read into pages that the device's arrays do not see.
#ifndef DEMBARK_FIX_NEIGH_HISTORY_DEMBARK_H
#define DEMBARK_FIX_NEIGH_HISTORY_DEMBARK_H

#include <vector>

#include "atom.h"
#include "fix_neigh_history_kokkos.h"

namespace LAMMPS_NS {

template <class DeviceType>
class FixNeighHistoryDembark : public FixNeighHistoryKokkos<DeviceType> {
  typedef FixNeighHistoryKokkos<DeviceType> Base;

 public:
  using Base::Base;

  void pre_exchange() override {
    Base::pre_exchange();
    int most = this->maxpartner;
    MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_INT, MPI_MAX, this->world);
    make_room(most);
  }

  void unpack_restart(int i, int nth) override {
    const double* row = this->atom->extra[i];
    for (int k = 0; k < nth; ++k) row += static_cast<int>(*row);
    const int count = static_cast<int>(row[1]);
    make_room(count);
    // As unpack_exchange() reads them: all tags, then all numbers.
    std::vector<double> packed{double(count)};
    const double* const pairs = row + 2;
    for (int k = 0; k < count; ++k) packed.push_back(static_cast<double>(ubuf(pairs[k * (this->dnum + 1)]).i));
    for (int k = 0; k < count; ++k) {
      const double* const numbers = pairs + k * (this->dnum + 1) + 1;
      packed.insert(packed.end(), numbers, numbers + this->dnum);
    }
    Base::unpack_exchange(i, packed.data());
  }

 private:
  void make_room(int partners) {
    if (partners <= this->maxpartner) return;
    this->maxpartner = partners;
    this->grow_arrays(this->atom->nmax);
    this->maxexchange = (this->dnum + 1) * partners + 2;
  }
};

}  // namespace LAMMPS_NS

#endif
