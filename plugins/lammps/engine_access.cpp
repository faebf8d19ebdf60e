#include "engine_access.h"

#include <algorithm>

namespace dembark_lammps {
namespace {

/// A pointer to a member may be named in an explicit instantiation, whatever access it has (C++17 [temp.spec]/6).
template <class Tag, typename Tag::Member member>
struct Access {
  friend typename Tag::Member access(Tag) { return member; }
};
struct BeginnersOfSteps {
  typedef int* LAMMPS_NS::Modify::* Member;
  friend Member access(BeginnersOfSteps);
};
template struct Access<BeginnersOfSteps, &LAMMPS_NS::Modify::list_initial_integrate>;

}  // namespace

void begin_steps_first(LAMMPS_NS::Modify* modify, const LAMMPS_NS::Fix* fix) {
  int *const first = modify->*access(BeginnersOfSteps()), *const end = first + modify->n_initial_integrate;
  const auto own = std::find_if(first, end, [&](int k) { return modify->fix[k] == fix; });
  if (own != end) std::rotate(first, own, own + 1);
}

}  // namespace dembark_lammps
