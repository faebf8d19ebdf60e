// A fix that keeps a row of numbers for each atom, which goes with it to other ranks and into restart files. Rows have lengths of their
// own.
#ifndef DEMBARK_ROWS_FIX_H
#define DEMBARK_ROWS_FIX_H

#include <algorithm>
#include <string>
#include <vector>

#include "shared_fix.h"

namespace dembark_lammps {

/// `Base`: a shared fix.
template <class Base>
class RowsFix : public Base {
 public:
  using Base::Base;
  ~RowsFix() override {
    if (!made_) return;  // a constructor did not come to its end
    this->atom->delete_callback(this->id, Base::on_growth);
    this->atom->delete_callback(this->id, Base::on_restart);
  }
  RowsFix(const RowsFix&) = delete;
  RowsFix& operator=(const RowsFix&) = delete;

  void grow_arrays(int count) override { rows_.resize(std::size_t(count)); }
  void copy_arrays(int from, int to, int) override { row(to) = row(from); }
  void set_arrays(int i) override { row(i).assign(std::size_t(width_), 0.0); }
  int pack_exchange(int i, double* buffer) override {
    buffer[0] = numbers(i);
    std::copy(row(i).begin(), row(i).end(), buffer + 1);
    return numbers(i);
  }
  int unpack_exchange(int i, double* buffer) override {
    row(i).assign(buffer + 1, buffer + int(buffer[0]));
    make_room(i);
    return numbers(i);
  }
  int pack_restart(int i, double* buffer) override { return RowsFix::pack_exchange(i, buffer); }
  void unpack_restart(int i, int nth) override {
    const double* const saved = this->restart_row(i, nth);
    if (int(saved[0]) != width_ + 1)
      this->fail_alone("the restart file keeps " + std::to_string(int(saved[0]) - 1) + " numbers an atom, not " + std::to_string(width_) +
                       ": it was written with other options of this fix");
    std::copy_n(saved + 1, width_, row(i).begin());
  }
  int size_restart(int i) override { return numbers(i); }
  /// Collective.
  int maxsize_restart() override {
    int mine = 1, most = 1;
    for (int i = 0; i < this->atom->nlocal; ++i) mine = std::max(mine, size_restart(i));
    MPI_Allreduce(&mine, &most, 1, MPI_INT, MPI_MAX, this->world);
    return most;
  }
  double memory_usage() override {
    double bytes = double(rows_.size() * sizeof rows_[0]);
    for (const std::vector<double>& one : rows_) bytes += double(one.capacity() * sizeof(double));
    return bytes;
  }

 protected:
  /// By the constructor. `width`: numbers of a new row.
  void make_rows(int width) {
    made_ = true;
    width_ = width;
    this->maxexchange = width + 1;
    this->create_attribute = this->restart_peratom = this->maxexchange_dynamic = 1;
    this->grow_arrays(this->atom->nmax);
    this->atom->add_callback(Base::on_growth);
    this->atom->add_callback(Base::on_restart);
    for (int i = 0; i < this->atom->nlocal; ++i) this->set_arrays(i);
  }

  std::vector<double>& row(int i) { return rows_[std::size_t(i)]; }
  /// After row i has grown.
  void make_room(int i) { this->maxexchange = std::max(this->maxexchange, numbers(i)); }

 private:
  std::vector<std::vector<double>> rows_;
  bool made_ = false;
  int width_ = 0;

  int numbers(int i) { return 1 + int(row(i).size()); }
};

}  // namespace dembark_lammps

#endif
