// Fixes that look at the state of a step after all its output, and before anything of the next: LAMMPS calls none there, so they come
// first among those that begin a step.
#ifndef DEMBARK_FIX_ORDER_H
#define DEMBARK_FIX_ORDER_H

#include <algorithm>

#include "fix.h"
#include "modify.h"

namespace dembark_lammps {

/// The lists of Modify are protected; a pointer to a member may be named in an explicit instantiation.
template <class Tag, typename Tag::Member member>
struct Access {
  friend typename Tag::Member access(Tag) { return member; }
};
struct BeginnersOfSteps {
  typedef int* LAMMPS_NS::Modify::* Member;
  friend Member access(BeginnersOfSteps);
};
template struct Access<BeginnersOfSteps, &LAMMPS_NS::Modify::list_initial_integrate>;

/// `fix` begins the steps of this run before all others that do so. Called in the set-up; the fix that is last to call it is the first.
inline void begin_steps_first(LAMMPS_NS::Modify* modify, const LAMMPS_NS::Fix* fix) {
  int *const first = modify->*access(BeginnersOfSteps()), *const end = first + modify->n_initial_integrate;
  const auto own = std::find_if(first, end, [&](int k) { return modify->fix[k] == fix; });
  if (own != end) std::rotate(first, own, own + 1);
}

}  // namespace dembark_lammps

#endif
