// LIGGGHTS's side of fix ID group integration/monitor (monitor_fix.h). The accelerations of the steps before are a property of the atoms,
// which goes with them to other processes and into restart files.
#ifdef FIX_CLASS

FixStyle(integration/monitor,FixIntegrationMonitor)

#else

#ifndef LMP_FIX_INTEGRATION_MONITOR_H
#define LMP_FIX_INTEGRATION_MONITOR_H

#include <vector>

#include "monitor_fix.h"
#include "model_properties.h"

namespace LAMMPS_NS {

class FixIntegrationMonitor : public dembark_family::MonitorFix {
 public:
  FixIntegrationMonitor(class LAMMPS *lmp, int narg, char **arg) : MonitorFix(lmp, narg, arg) {}

  void post_create();
  void pre_delete(bool);
  void setup_pre_force(int);

 private:
  void find_contacts();
  bool has_contacts() const;
  const NeighList *pairs() const;
  void take_walls();
  double stiffness(int type_i, int type_j, double radius, double mass, double overlap) const;
  dembark::ContactParameters parameters(int type_i, int type_j) const;
  double *history(int i);
  void clear_histories();

  char *property_ = nullptr;  // id of the fix that keeps the accelerations
  class FixPropertyAtom *histories_ = nullptr;
  class PairGran *pair_ = nullptr;
  bool hertz_ = true;
  double characteristic_velocity_ = 0.0;
  dembark_liggghts::PairTable<double> moduli_;  // E*, Pa, by types
  std::vector<class FixWallGran *> walls_;
};

}  // namespace LAMMPS_NS

#endif
#endif
