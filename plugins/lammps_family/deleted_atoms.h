// Numbers of atoms that a script has deleted since the last run. Engines give the next free number to new atoms, which is that of a deleted
// one where it was the highest, and histories of pairs, and logs, are found again by number.
#ifndef DEMBARK_DELETED_ATOMS_H
#define DEMBARK_DELETED_ATOMS_H

#include <mpi.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "atom.h"

namespace dembark_family {

class DeletedAtoms {
 public:
  /// After a run, in which contacts of atoms that are not there have ended.
  void clear() { gone_.clear(); }

  /// Around the command that deletes. Collective.
  template <class Deletion>
  void watch(const LAMMPS_NS::Atom& atom, MPI_Comm world, const Deletion& deletion) {
    const std::vector<long long> before = numbers(atom);
    deletion();
    const std::vector<long long> after = numbers(atom);
    std::vector<long long> own;
    std::set_difference(before.begin(), before.end(), after.begin(), after.end(), std::back_inserter(own));
    int ranks = 0, count = int(own.size());
    MPI_Comm_size(world, &ranks);
    std::vector<int> counts(std::size_t(ranks), 0), offsets(std::size_t(ranks), 0);
    MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
    for (std::size_t r = 1; r < counts.size(); ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
    std::vector<long long> all(std::size_t(offsets.back() + counts.back()));
    MPI_Allgatherv(own.data(), count, MPI_LONG_LONG, all.data(), counts.data(), offsets.data(), MPI_LONG_LONG, world);
    gone_.insert(gone_.end(), all.begin(), all.end());
    std::sort(gone_.begin(), gone_.end());
  }

  /// What is wrong with a run that begins now, or nothing. Collective.
  std::string run_error(const LAMMPS_NS::Atom& atom, MPI_Comm world) const {
    if (gone_.empty()) return "";
    long long mine = 0, any = 0;
    for (const long long number : numbers(atom))
      if (std::binary_search(gone_.begin(), gone_.end(), number)) mine = number;
    MPI_Allreduce(&mine, &any, 1, MPI_LONG_LONG, MPI_MAX, world);
    if (any == 0) return "";
    return "atom " + std::to_string(any) +
           " has the number of one that was deleted after the last run, and would take over its contacts; write 'run 0' between "
           "delete_atoms and what makes new atoms";
  }

 private:
  std::vector<long long> gone_;  // ascending

  static std::vector<long long> numbers(const LAMMPS_NS::Atom& atom) {
    std::vector<long long> own(atom.tag, atom.tag + atom.nlocal);
    std::sort(own.begin(), own.end());
    return own;
  }
};

}  // namespace dembark_family

#endif
