// Two grains that touch each other twice, across a short periodic box. Histories know a partner by its number: of the two contacts each
// would go on with the history of the other.
#ifndef DEMBARK_DOUBLE_CONTACTS_H
#define DEMBARK_DOUBLE_CONTACTS_H

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "atom.h"
#include "domain.h"
#include "neigh_list.h"

namespace dembark_family {

/// What is wrong, or nothing. `flags`: of each pair of the list, whether it has a history. `range` (m): how far two centres may act on each
/// other.
inline std::string double_contact_error(const LAMMPS_NS::NeighList& list, const int* const* flags, const LAMMPS_NS::Atom& atom,
                                        const LAMMPS_NS::Domain& domain, bool newton, double range) {
  bool long_enough = !domain.triclinic;
  for (int k = 0; k < domain.dimension; ++k) long_enough = long_enough && !(domain.periodicity[k] && domain.prd[k] < 2.0 * range);
  if (long_enough) return "";
  // With newton off both owners list a pair across a border, so only those of one of them are compared.
  std::vector<std::pair<long long, long long>> contacts;
  for (int n = 0; n < list.inum; ++n) {
    const int i = list.ilist[n];
    for (int k = 0; k < list.numneigh[i]; ++k) {
      if (!flags[i][k]) continue;
      const long long one = atom.tag[i], two = atom.tag[list.firstneigh[i][k] & NEIGHMASK];
      contacts.emplace_back(newton ? std::min(one, two) : one, newton ? std::max(one, two) : two);
    }
  }
  std::sort(contacts.begin(), contacts.end());
  const auto same = std::adjacent_find(contacts.begin(), contacts.end());
  if (same == contacts.end()) return "";
  return "grain " + std::to_string(same->first) + " touches grain " + std::to_string(same->second) +
         " and an image of it, and their histories cannot be distinguished; take a periodic box longer than two diameters";
}

}  // namespace dembark_family

#endif
