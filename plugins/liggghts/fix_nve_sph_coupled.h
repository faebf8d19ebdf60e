// fix ID group nve/sph/coupled: the group is the fluid of pair_style sph/coupled; moves it and keeps its energies.
#ifdef FIX_CLASS

FixStyle(nve/sph/coupled,FixNveSphCoupled)

#else

#ifndef LMP_FIX_NVE_SPH_COUPLED_H
#define LMP_FIX_NVE_SPH_COUPLED_H

#include <string>

#include "shared_fix.h"

namespace LAMMPS_NS {

class FixNveSphCoupled : public dembark_family::SharedFix {
 public:
  FixNveSphCoupled(class LAMMPS *, int, char **);

  void post_create();
  void pre_delete(bool);
  int setmask();
  void init();
  double extend_cut_ghost();
  void setup_pre_force(int);
  void initial_integrate(int);
  void final_integrate();
  double compute_vector(int);
  void write_restart(FILE *);
  void restart(char *);

  /// m, of each atom; nullptr: without shifting and XSPH.
  double **shifts() const;

 private:
  class PairSphCoupled *pair_ = nullptr;
  class FixPropertyAtom *shifts_ = nullptr;
  bool first_ = true;     // no run was before, in this process or that of a restart file
  double saved_[3] = {};  // losses of all ranks before a restart
  double totals_[9] = {};
  bigint summed_ = -1;  // step of totals_
};

}  // namespace LAMMPS_NS

#endif
#endif
