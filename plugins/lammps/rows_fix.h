// A fix that keeps a row of numbers for each atom, which goes with it to other ranks and into restart files.
#ifndef DEMBARK_ROWS_FIX_H
#define DEMBARK_ROWS_FIX_H

#include <algorithm>
#include <string>

#include "memory.h"

#include "shared_fix.h"

namespace dembark_lammps {

/// `Base`: a shared fix.
template <class Base>
class RowsFix : public Base {
 public:
  using Base::Base;
  ~RowsFix() override {
    if (!rows_) return;  // a constructor did not come to its end
    this->atom->delete_callback(this->id, Base::on_growth);
    this->atom->delete_callback(this->id, Base::on_restart);
    this->memory->destroy(rows_);
  }
  RowsFix(const RowsFix&) = delete;
  RowsFix& operator=(const RowsFix&) = delete;

  void grow_arrays(int count) override { this->memory->grow(rows_, count, width_, "dembark:rows"); }
  void copy_arrays(int from, int to, int) override { std::copy_n(rows_[from], width_, rows_[to]); }
  void set_arrays(int i) override { std::fill_n(rows_[i], width_, 0.0); }
  int pack_exchange(int i, double* buffer) override {
    std::copy_n(rows_[i], width_, buffer);
    return width_;
  }
  int unpack_exchange(int i, double* buffer) override {
    std::copy_n(buffer, width_, rows_[i]);
    return width_;
  }
  int pack_restart(int i, double* buffer) override {
    buffer[0] = width_ + 1;
    std::copy_n(rows_[i], width_, buffer + 1);
    return width_ + 1;
  }
  void unpack_restart(int i, int nth) override {
    const double* const row = this->restart_row(i, nth);
    if (int(row[0]) != width_ + 1)
      this->fail_alone("the restart file keeps " + std::to_string(int(row[0]) - 1) + " numbers an atom, not " + std::to_string(width_) +
                       ": it was written with another pair_style or other options of this fix");
    std::copy_n(row + 1, width_, rows_[i]);
  }
  int size_restart(int) override { return width_ + 1; }
  int maxsize_restart() override { return width_ + 1; }
  double memory_usage() override { return double(this->atom->nmax) * width_ * sizeof(double); }

 protected:
  /// By the constructor of the class that knows how many numbers there are.
  void make_rows(int width) {
    width_ = this->maxexchange = width;
    this->create_attribute = this->restart_peratom = 1;
    this->grow_arrays(this->atom->nmax);
    this->atom->add_callback(Base::on_growth);
    this->atom->add_callback(Base::on_restart);
    for (int i = 0; i < this->atom->nlocal; ++i) this->set_arrays(i);
  }

  double** rows_ = nullptr;

 private:
  int width_ = 0;
};

}  // namespace dembark_lammps

#endif
