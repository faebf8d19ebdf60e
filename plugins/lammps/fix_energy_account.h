// fix ID all energy/account: kinetic energy, and the works of gravity and of all parts of the contact forces, summed so that they balance
// to round-off at any time step (dembark/energy_ledger.hpp).
//
// Of the two kicks of velocity Verlet, which the velocities v(n) divide, the first is tallied at the end of step n, the second in the next
// step, or with the forces of a set-up in between.
#ifndef DEMBARK_FIX_ENERGY_ACCOUNT_H
#define DEMBARK_FIX_ENERGY_ACCOUNT_H

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "fix.h"

#include "dembark/energy_ledger.hpp"
#include "energy_tally.h"

namespace LAMMPS_NS {

class FixEnergyAccount : public Fix {
 public:
  FixEnergyAccount(LAMMPS* lmp, int narg, char** arg);
  int setmask() override;
  void init() override;
  void setup_pre_force(int) override;
  void setup(int) override;
  void initial_integrate(int) override;
  void post_integrate() override;
  void pre_force(int) override;
  void final_integrate() override;
  void end_of_step() override;
  double compute_vector(int n) override;
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  double memory_usage() override;

  dembark_lammps::EnergyTally tally;

 private:
  [[noreturn]] void fail(const std::string& what) const;
  void check_forces() const;
  void check_motion();
  dembark::BodyMotion motion(int i) const;
  dembark::EnergyBody body(int i) const;
  double kinetic() const;
  void note_changes();
  void measure_powers();
  dembark::EnergyLedger with_setup() const;
  void impose(double change, double of, double& sum) const;

  dembark::EnergyLedger now_, shown_;                     // of this rank; shown_: at the end of the last step, or of the set-up
  bool begun_ = false;                                    // the first_ values are there
  bool fresh_ = false;                                    // forces are those of a set-up
  bool resumed_ = false;                                  // powers come from a restart file, for its forces
  double kinetic_before_ = 0.0;                           // J, with the atoms before they are exchanged
  int moving_ = 0, frozen_ = 0;                           // bits of groups
  int turning_ = 0;                                       // of those of moving_ whose spin follows torques
  std::vector<std::pair<int, const double*>> gravities_;  // bits of the groups, and accelerations, m/s^2
};

}  // namespace LAMMPS_NS

#endif
