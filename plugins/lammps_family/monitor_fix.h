// fix ID group integration/monitor speed V ...: how wrong the steps of a run are (dembark/integration/monitor.hpp).
//
// At the end of a step the forces are still those of its positions, and the accelerations of the three steps before lie beside the atoms.
// Impacts are integrated anew (dembark/integration/shadow_impact.hpp): before the forces of a step, positions are of the step and
// velocities of half a step before, of owned atoms as of their images on other ranks.
#ifndef DEMBARK_MONITOR_FIX_H
#define DEMBARK_MONITOR_FIX_H

#include "shared_fix.h"

#include "dembark/integration/monitor_run.hpp"

namespace dembark_family {

class MonitorFix : public GrainFix {
 public:
  MonitorFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg);

  int setmask() override;
  void init() override;
  void pre_force(int) override;
  void end_of_step() override;
  double compute_vector(int n) override;
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;

 protected:
  static constexpr int history_numbers = dembark::monitor_history_numbers;

  /// `radius_j` infinite: a wall, `j` < 0.
  void take_contact(int i, int j, double radius_j, int type_j, double overlap);

  dembark::MonitorRun run_;

 private:
  /// Finds the pair style and the walls whose contacts are to be judged, or ends the run.
  virtual void find_contacts() = 0;
  /// The pairs, of which there may be none. False: there is no pair style, and nothing touches anything.
  virtual bool has_contacts() const = 0;
  virtual const LAMMPS_NS::NeighList* pairs() const = 0;
  virtual void take_walls() = 0;
  /// N/m, of a normal spring. `radius` (m) and `mass` (kg) are the effective ones.
  virtual double stiffness(int type_i, int type_j, double radius, double mass, double overlap) const = 0;
  virtual dembark::ContactParameters parameters(int type_i, int type_j) const = 0;
  /// The numbers of an owned atom.
  virtual double* history(int i) = 0;
  virtual void clear_histories() = 0;

  double mass(int i) const;
  void take_bodies(long n);
  void take_pairs();
  bool weight(int i, int j, dembark::Vec3<double>& acceleration) const;
  dembark::ContactBodies bodies(int i, int j) const;
  void begin_impacts(long n);
  void drop_impacts();
  void take_step();

  Fix* account_ = nullptr;
};

}  // namespace dembark_family

#endif
