#include "engine_access.h"

#include <algorithm>
#include <cmath>

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
struct VariableTexts {
  typedef char*** LAMMPS_NS::Variable::* Member;
  friend Member access(VariableTexts);
};
template struct Access<VariableTexts, &LAMMPS_NS::Variable::data>;

struct RegionAxis {
  typedef double (LAMMPS_NS::Region::*Member)[3];
  friend Member access(RegionAxis);
};
template struct Access<RegionAxis, &LAMMPS_NS::Region::axis>;

struct RestartedFixes {
  typedef char** LAMMPS_NS::Modify::* Member;
  friend Member access(RestartedFixes);
};
template struct Access<RestartedFixes, &LAMMPS_NS::Modify::id_restart_peratom>;
struct TakenUp {
  typedef int* LAMMPS_NS::Modify::* Member;
  friend Member access(TakenUp);
};
template struct Access<TakenUp, &LAMMPS_NS::Modify::used_restart_peratom>;

}  // namespace

bool left_in_restart_file(const LAMMPS_NS::Modify* modify, const std::string& prefix) {
  char** const ids = modify->*access(RestartedFixes());
  const int* const taken = modify->*access(TakenUp());
  for (int k = 0; k < modify->nfix_restart_peratom; ++k)
    if (!taken[k] && std::string(ids[k]).rfind(prefix, 0) == 0) return true;
  return false;
}

void begin_steps_first(LAMMPS_NS::Modify* modify, const LAMMPS_NS::Fix* fix) {
  int *const first = modify->*access(BeginnersOfSteps()), *const end = first + modify->n_initial_integrate;
  const auto own = std::find_if(first, end, [&](int k) { return modify->fix[k] == fix; });
  if (own != end) std::rotate(first, own, own + 1);
}

std::vector<std::pair<std::string, std::string>> formulas(LAMMPS_NS::Variable* variables) {
  std::vector<std::pair<std::string, std::string>> all;
  for (int k = 0; k < variables->nvar; ++k)
    if (variables->equalstyle(k) || variables->atomstyle(k) || variables->vectorstyle(k))
      all.emplace_back(variables->names[k], (variables->*access(VariableTexts()))[k][0]);
  return all;
}

double axis_length(const LAMMPS_NS::Region* region) {
  const auto& axis = region->*access(RegionAxis());
  return std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
}

}  // namespace dembark_lammps
