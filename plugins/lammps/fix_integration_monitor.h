// fix ID group integration/monitor speed V ...: how wrong the steps of a run are (dembark/integration/monitor.hpp).
//
// At the end of a step the forces are still those of its positions. The accelerations of the three steps before lie beside the atoms.
#ifndef DEMBARK_FIX_INTEGRATION_MONITOR_H
#define DEMBARK_FIX_INTEGRATION_MONITOR_H

#include <string>
#include <utility>
#include <vector>

#include "fix.h"

#include "dembark/integration/monitor_run.hpp"

namespace LAMMPS_NS {

class FixIntegrationMonitor : public Fix {
 public:
  FixIntegrationMonitor(LAMMPS* lmp, int narg, char** arg);
  ~FixIntegrationMonitor() override;
  int setmask() override;
  void init() override;
  void pre_force(int) override;
  void end_of_step() override;
  double compute_vector(int n) override;
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  void grow_arrays(int count) override;
  void copy_arrays(int from, int to, int) override;
  void set_arrays(int i) override;
  int pack_exchange(int i, double* buffer) override;
  int unpack_exchange(int i, double* buffer) override;
  int pack_restart(int i, double* buffer) override;
  void unpack_restart(int i, int nth) override;
  int size_restart(int) override { return dembark::monitor_history_numbers + 1; }
  int maxsize_restart() override { return dembark::monitor_history_numbers + 1; }
  double memory_usage() override;

 private:
  [[noreturn]] void fail(const std::string& what) const;
  dembark::MonitorRun read(const std::vector<std::string>& words) const;
  void check_motion();
  void check_contacts();
  double mass(int i) const;
  void take_bodies(long n);
  void take_contact(int i, int j, double radius_j, int type_j, double overlap);
  void take_pairs();
  void take_walls();
  bool weight(int i, int j, dembark::Vec3<double>& acceleration) const;
  dembark::ContactBodies bodies(int i, int j) const;
  void begin_impacts(long n);
  void take_step();

  dembark::MonitorRun run_;
  dembark::StepMonitor& monitor_;
  double** histories_ = nullptr;
  std::vector<std::pair<int, double>> moving_;            // bits of groups that follow their forces, and moments of inertia over m r^2
  int movers_ = 0, frozen_ = 0;                           // bits of groups
  std::vector<std::pair<int, const double*>> gravities_;  // bits of the groups, and accelerations, m/s^2
  class PairDembarkGranular* pair_ = nullptr;
  std::vector<class FixWallDembark*> walls_;
  class FixEnergyAccount* account_ = nullptr;
};

}  // namespace LAMMPS_NS

#endif
