// The fix nve/sphere of LAMMPS, which moves and turns spheres, or with its keyword `disc` solid cylinders.
#ifndef DEMBARK_NVE_SPHERE_H
#define DEMBARK_NVE_SPHERE_H

#include "fix.h"

namespace dembark_lammps {

/// The first members of LAMMPS's FixNVE and FixNVESphere, whose headers no package of LAMMPS holds.
struct Nve : LAMMPS_NS::Fix {
  double dtv, dtf;
  double* step_respa;
  int mass_require;
};
struct NveSphere : Nve {
  double inertia;  ///< over m r^2: 2/5, or with `disc` 1/2
};

}  // namespace dembark_lammps

#endif
