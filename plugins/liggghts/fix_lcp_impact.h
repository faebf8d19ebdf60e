// LIGGGHTS's side of fix ID group lcp/impact (impact_fix.h): walls that are meshes.
#ifdef FIX_CLASS

FixStyle(lcp/impact,FixLcpImpact)

#else

#ifndef LMP_FIX_LCP_IMPACT_H
#define LMP_FIX_LCP_IMPACT_H

#include <vector>

#include "impact_fix.h"

namespace LAMMPS_NS {

class FixLcpImpact : public dembark_family::ImpactFix {
 public:
  FixLcpImpact(class LAMMPS *lmp, int narg, char **arg) : ImpactFix(lmp, narg, arg, "the ID of a fix mesh/surface") {}

 private:
  void find_walls();
  void gather_walls(double dt);
  void take_walls(double dt);

  std::vector<class FixMeshSurface *> mesh_fix_;      // of each mesh
  std::vector<std::vector<dembark::Triangle>> mesh_;  // on the first rank: of each mesh as it is now, empty where it stands
};

}  // namespace LAMMPS_NS

#endif
#endif
