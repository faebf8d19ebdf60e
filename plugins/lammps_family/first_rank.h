// Impacts under MPI: the first rank gathers what all have, solves, and hands the forces out. Forces are the same to the bit however many
// ranks there are, and whatever each of them would compute.
#ifndef DEMBARK_FIRST_RANK_H
#define DEMBARK_FIRST_RANK_H

#include <mpi.h>

#include <cstddef>
#include <exception>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "dembark/archive.hpp"

namespace dembark_family {

/// All members are collective.
class FirstRank {
 public:
  explicit FirstRank(MPI_Comm world) : world_(world) {
    MPI_Comm_size(world, &ranks_);
    MPI_Comm_rank(world, &rank_);
  }

  bool is_here() const { return rank_ == 0; }

  /// What all ranks have to the first, in the order of ranks. T: plain data.
  template <class T>
  void gather(std::vector<T>& own, std::vector<T>& all) {
    if (ranks_ == 1) return all.swap(own);
    const int count = int(own.size());
    counts_.resize(std::size_t(ranks_));
    offsets_.assign(std::size_t(ranks_), 0);
    MPI_Gather(&count, 1, MPI_INT, counts_.data(), 1, MPI_INT, 0, world_);
    if (is_here()) {
      std::partial_sum(counts_.begin(), counts_.end() - 1, offsets_.begin() + 1);
      all.resize(std::size_t(offsets_.back()) + std::size_t(counts_.back()));
    }
    const DataType<T> type;
    MPI_Gatherv(own.data(), count, type.of, all.data(), counts_.data(), offsets_.data(), type.of, 0, world_);
  }

  /// The way back of the last gather(): `all` of the first rank to `own`, which has the size that it had there.
  template <class T>
  void scatter(std::vector<T>& all, std::vector<T>& own) {
    if (ranks_ == 1) return own.swap(all);
    const DataType<T> type;
    MPI_Scatterv(all.data(), counts_.data(), offsets_.data(), type.of, own.data(), int(own.size()), type.of, 0, world_);
  }

  /// Runs `work` on the first rank, and makes its `record` that of all. What went wrong there, on all ranks: one line, or nothing.
  template <class Record>
  std::string run(const std::function<void()>& work, Record& record) {
    std::string wrong;
    try {
      if (is_here()) work();
    } catch (const std::exception& e) {
      wrong = e.what();
    }
    if (ranks_ == 1) return wrong;
    std::vector<double> shared = dembark::to_numbers(record);
    shared.push_back(double(wrong.size()));
    MPI_Bcast(shared.data(), int(shared.size()), MPI_DOUBLE, 0, world_);
    wrong.resize(std::size_t(shared.back()));
    shared.pop_back();
    dembark::from_numbers(shared, record);
    if (!wrong.empty()) MPI_Bcast(wrong.data(), int(wrong.size()), MPI_CHAR, 0, world_);
    return wrong;
  }

 private:
  /// Counted in values: of bytes there may be more than an int holds.
  template <class T>
  struct DataType {
    MPI_Datatype of;
    DataType() {
      MPI_Type_contiguous(int(sizeof(T)), MPI_BYTE, &of);
      MPI_Type_commit(&of);
    }
    ~DataType() { MPI_Type_free(&of); }
    DataType(const DataType&) = delete;
    DataType& operator=(const DataType&) = delete;
  };

  MPI_Comm world_;
  int ranks_ = 1, rank_ = 0;
  std::vector<int> counts_, offsets_;  ///< of the last gather, on the first rank
};

}  // namespace dembark_family

#endif
