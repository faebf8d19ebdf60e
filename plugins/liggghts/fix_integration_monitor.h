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

#include "dembark/integration/monitor.hpp"
#include "dembark/integration/shadow_impact.hpp"
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
  /// What goes on over runs and restarts, the same on all ranks but for the tallies.
  struct State {
    dembark::MonitorTally run{}, row{};
    double step = 0.0;     // s, of the deck
    double next_row = -1;  // its step
    int level = 0;         // the step in use is that of the deck over 2^level
    int said = 0;          // bits of the kinds of findings that were told
  };

  [[noreturn]] void refuse(const std::string &what);
  double number(int &k, int narg, char **arg);
  long whole(int &k, int narg, char **arg);
  void check_motion();
  void read_models();
  double mass(int i) const;
  void take_bodies(long n);
  void take_pairs();
  void take_walls();
  void take_wall(class FixWallGran &wall, int i, double distance);
  void take_contact(int i, int j, double radius_j, int type_j, double overlap);
  dembark::MonitorTally merged(bool whole_run) const;
  bool weight(int i, int j, dembark::Vec3<double> &acceleration) const;
  dembark::ContactBodies bodies(int i, int j) const;
  void begin_impacts(long n);
  void follow_impacts();
  void drop_impacts();
  void act();
  void end_row();
  void set_step(int level);

  dembark::StepMonitor monitor_;
  bool mean_length_ = true, contacts_ = true;
  long rows_ = 0, impacts_ = 0;
  State state_;
  char *property_ = nullptr;  // id of the fix that keeps the accelerations
  class FixPropertyAtom *histories_ = nullptr;
  int moving_ = 0, frozen_ = 0;  // bits of groups
  bool hertz_ = true;
  double characteristic_velocity_ = 0.0;
  dembark_liggghts::PairTable<double> moduli_;  // E*, Pa, by types
  std::vector<class FixWallGran *> walls_;
  class FixEnergyAccount *account_ = nullptr;
  std::vector<class FixGravity *> gravities_;
  std::vector<dembark::ShadowImpact> shadows_;  // the same on all ranks
  std::vector<int> over_;                       // which of them have ended, as far as this rank knows
  bigint merged_at_ = -1;
  dembark::MonitorTally merged_;
};

}  // namespace LAMMPS_NS

#endif
#endif
