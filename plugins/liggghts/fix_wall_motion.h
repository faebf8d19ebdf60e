// fix ID group wall/motion mesh M HARMONIC|...: moves a mesh as dembark/motion/prescribed_motion.hpp says, exact to the step, and adds up
// what the wall does to the grains.
#ifdef FIX_CLASS

FixStyle(wall/motion,FixWallMotion)

#else

#ifndef LMP_FIX_WALL_MOTION_H
#define LMP_FIX_WALL_MOTION_H

#include <memory>
#include <string>

#include "modify.h"

#include "moving_wall.h"

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
  const dembark::WallAcceleration &acceleration() const { return wall_->acceleration(); }

 private:
  void set_velocities();
  void check_reach();
  void check_turn();
  dembark::WallLoad total_load();

  std::string mesh_id_;
  class AbstractMesh *mesh_ = nullptr;
  std::unique_ptr<dembark_family::MovingWall> wall_;
  dembark::WallLoad load_;  // of this rank
  bool knows_load_ = true;  // the contact models tell their forces
};

}  // namespace LAMMPS_NS

namespace dembark_liggghts {

/// The fix that moves a mesh, or nullptr.
LAMMPS_NS::FixWallMotion *find_wall_motion(LAMMPS_NS::Modify *modify, const LAMMPS_NS::AbstractMesh *mesh);

}  // namespace dembark_liggghts

#endif
#endif
