// fix ID group integration/monitor speed V ...: how wrong the steps of a run are (dembark/integration/monitor.hpp).
//
// At the end of a step the forces are still those of its positions, and the accelerations of the three steps before lie in a property of
// the atoms, which goes with them to other processes and into restart files.
#ifdef FIX_CLASS

FixStyle(integration/monitor,FixIntegrationMonitor)

#else

#ifndef LMP_FIX_INTEGRATION_MONITOR_H
#define LMP_FIX_INTEGRATION_MONITOR_H

#include <string>
#include <vector>

#include "fix.h"

#include "dembark/integration/monitor_run.hpp"
#include "model_properties.h"

namespace LAMMPS_NS {

class FixIntegrationMonitor : public Fix {
 public:
  FixIntegrationMonitor(class LAMMPS *, int, char **);

  int setmask();
  void post_create();
  void pre_delete(bool);
  void init();
  void setup_pre_force(int);
  void pre_force(int);
  void end_of_step();
  double compute_vector(int);
  void write_restart(FILE *);
  void restart(char *);

 private:
  [[noreturn]] void refuse(const std::string &what);
  dembark::MonitorRun read(const std::vector<std::string> &words);
  void check_motion();
  void read_models();
  double mass(int i) const;
  void take_bodies(long n);
  void take_pairs();
  void take_walls();
  void take_wall(class FixWallGran &wall, int i, double distance);
  void take_contact(int i, int j, double radius_j, int type_j, double overlap);
  bool weight(int i, int j, dembark::Vec3<double> &acceleration) const;
  dembark::ContactBodies bodies(int i, int j) const;
  void begin_impacts(long n);
  void tell();
  void take_step();

  dembark::MonitorRun run_;
  dembark::StepMonitor &monitor_;
  bool contacts_ = true;
  char *property_ = nullptr;  // id of the fix that keeps the accelerations
  class FixPropertyAtom *histories_ = nullptr;
  int moving_ = 0, frozen_ = 0;  // bits of groups
  bool hertz_ = true;
  double characteristic_velocity_ = 0.0;
  dembark_liggghts::PairTable<double> moduli_;  // E*, Pa, by types
  std::vector<class FixWallGran *> walls_;
  class FixEnergyAccount *account_ = nullptr;
  std::vector<class FixGravity *> gravities_;
};

}  // namespace LAMMPS_NS

#endif
#endif
