// LAMMPS's side of fix ID group lcp/impact (impact_fix.h).
#ifndef DEMBARK_FIX_LCP_IMPACT_H
#define DEMBARK_FIX_LCP_IMPACT_H

#include "impact_fix.h"

namespace LAMMPS_NS {

class FixLcpImpact : public dembark_family::ImpactFix {
 public:
  FixLcpImpact(LAMMPS* lmp, int narg, char** arg) : ImpactFix(lmp, narg, arg, nullptr) {}
};

}  // namespace LAMMPS_NS

#endif
