// A wall that moves as dembark/motion/prescribed_motion.hpp says, and what it does to the grains: of fix wall/motion in LIGGGHTS and of fix
// wall/dembark in LAMMPS, which bring the surface and the forces.
//
// Forces of step n are computed from the grains' velocities v(n-1/2). The wall has its own of that time, [x(n) - x(n-1)] / dt.
#ifndef DEMBARK_MOVING_WALL_H
#define DEMBARK_MOVING_WALL_H

#include <string>
#include <vector>

#include "shared_fix.h"

#include "dembark/motion/prescribed_motion.hpp"
#include "dembark/motion/wall_work.hpp"

namespace dembark_family {

/// What is wrong is thrown as std::invalid_argument or std::runtime_error.
class MovingWall {
  typedef dembark::Vec3<double> Vec3;

 public:
  /// Of its vector: displacement, angle, velocity, rate, acceleration, angular acceleration; then power, work, impulse.
  static constexpr int state_numbers = 12, all_numbers = 17;

  explicit MovingWall(const std::vector<std::string>& words);

  const dembark::PrescribedMotion& motion() const { return motion_; }
  /// Now, and how its velocity changes now.
  const dembark::WallState& state() const { return state_; }
  const dembark::WallAcceleration& acceleration() const { return acceleration_; }
  Vec3 centre() const { return motion_.centre(state_); }
  /// rad/s and m/s, of the step that led here.
  Vec3 spin() const { return step_.rate * motion_.axis(); }
  Vec3 velocity_at(const Vec3& place) const { return step_.velocity + cross(spin(), place - centre()); }
  double power(const dembark::WallLoad& load) const { return wall_power(load, state_, motion_.axis()); }
  double number(int k) const;

  /// Before a run. Displacements are from where the wall stands when the motion is run first; a restart file has the time of that.
  void begin(const LAMMPS_NS::Update& update);
  /// s, of a step of `dt` (s) and those behind it.
  double time(LAMMPS_NS::bigint step, double dt) { return clock_.time(long(step), dt); }
  /// Where it is at `now` (s), after the step of `dt` (s) from `before` (s) on.
  void arrive(double before, double now, double dt);
  /// Work and impulse up to now: `load`, on all grains, is about the centre.
  void begin_sums(const dembark::WallLoad& load);
  void end_step(const dembark::WallLoad& load, double dt) { sums_.step(dt, power(load), load.force); }
  /// Where the run takes triangles out of the box, with the bounds of both, or nothing. `middles`: theirs on this rank, with the wall as it
  /// is `at`. Directions that are periodic or shrink do not count. Collective.
  std::string outside(const std::vector<Vec3>& middles, const dembark::WallState& at, const LAMMPS_NS::Update& update,
                      const LAMMPS_NS::Domain& box, MPI_Comm world);

  /// For restart files: the words of the motion come first, of a wall that stands there are none.
  Pieces pieces() const;
  static void expect(SavedPart& saved, const std::string& words);
  void restore(SavedPart& saved);

 private:
  std::string words_;
  dembark::PrescribedMotion motion_;
  dembark::MotionClock clock_;
  dembark::WallState state_;
  dembark::WallStep step_;
  dembark::WallAcceleration acceleration_;
  dembark::WallSums sums_;
  bool resumed_ = false;  // the last step of `sums_` is that of a restart file
};

}  // namespace dembark_family

#endif
