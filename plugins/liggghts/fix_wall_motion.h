// fix ID group wall/motion mesh M HARMONIC|...: moves a mesh as dembark/motion/prescribed_motion.hpp says, exact to the step, and adds up
// what the wall does to the grains.
//
// Forces of step n are computed from the grains' velocities v(n-1/2). The mesh has its own of that time, [x(n) - x(n-1)] / dt.
#ifdef FIX_CLASS

FixStyle(wall/motion,FixWallMotion)

#else

#ifndef LMP_FIX_WALL_MOTION_H
#define LMP_FIX_WALL_MOTION_H

#include <string>

#include "shared_fix.h"
#include "modify.h"

#include "dembark/motion/prescribed_motion.hpp"
#include "dembark/motion/wall_work.hpp"

namespace LAMMPS_NS {

class FixWallMotion : public dembark_family::SharedFix {
 public:
  FixWallMotion(class LAMMPS *, int, char **);

  void post_create();
  void pre_delete(bool);
  int setmask();
  void init();
  void setup_pre_force(int);
  void setup(int);
  void initial_integrate(int);
  void pre_force(int);
  void end_of_step();
  double compute_vector(int);
  void write_restart(FILE *);
  void restart(char *);

  const class AbstractMesh *mesh() const { return mesh_; }
  /// Whether there are walls that call add_load(): those of liggghts-dembark's combinations of contact models.
  static inline bool walls_tell_loads = false;
  /// Adds a force on a grain of this rank, N, and the torque about its centre, N m.
  void add_load(const double *centre, const dembark::Vec3<double> &force, const dembark::Vec3<double> &torque);
  /// Of the mesh, at the time of the forces.
  const dembark::WallAcceleration &acceleration() const { return acceleration_; }

 private:
  void set_velocities(const dembark::WallStep &step);
  void check_reach();
  void check_turn();
  dembark::WallLoad whole_load();
  void arrive(double t);

  std::string mesh_id_, words_;
  class AbstractMesh *mesh_ = nullptr;
  dembark::PrescribedMotion motion_;
  dembark::MotionClock clock_;
  dembark::WallState state_;  // now
  dembark::WallAcceleration acceleration_;
  dembark::WallLoad load_;  // of this rank
  dembark::WallSums sums_;
  bool resumed_ = false;    // the last step of `sums_` is that of a restart file
  bool knows_load_ = true;  // the contact models tell their forces
};

}  // namespace LAMMPS_NS

namespace dembark_liggghts {

/// The fix that moves a mesh, or nullptr.
LAMMPS_NS::FixWallMotion *find_wall_motion(LAMMPS_NS::Modify *modify, const LAMMPS_NS::AbstractMesh *mesh);

}  // namespace dembark_liggghts

#endif
#endif
