// fix ID all energy/account: kinetic energy, and the works of gravity and of all parts of the contact forces, summed so that they balance
// to round-off at any time step (dembark/energy_ledger.hpp).
//
// Of the two kicks of velocity Verlet, which the velocities v(n) divide, the first is tallied at the end of step n, the second in the next
// step, or with the forces of a set-up in between.
#ifdef FIX_CLASS

FixStyle(energy/account,FixEnergyAccount)

#else

#ifndef LMP_FIX_ENERGY_ACCOUNT_H
#define LMP_FIX_ENERGY_ACCOUNT_H

#include <array>
#include <string>
#include <vector>

#include "fix.h"

#include "energy_tally.h"
#include "dembark/energy_ledger.hpp"

namespace LAMMPS_NS {

class FixEnergyAccount : public Fix {
 public:
  FixEnergyAccount(class LAMMPS *, int, char **);

  int setmask();
  void init();
  void setup_pre_force(int);
  void pre_initial_integrate();
  void post_integrate();
  void pre_force(int);
  void final_integrate();
  void end_of_step();
  double compute_vector(int);
  void *extract(const char *, int &);
  void write_restart(FILE *);
  void restart(char *);
  double memory_usage();

 private:
  [[noreturn]] void refuse(const std::string &what);
  void check_models();
  void check_motion();
  dembark::BodyMotion motion(int i) const;
  dembark::EnergyBody body(int i) const;
  double kinetic() const;
  void note_changes();
  void measure_powers();
  dembark::EnergyLedger with_setup() const;
  void impose(double change, double of, double &sum) const;

  dembark_liggghts::EnergyTally tally_;
  dembark::EnergyLedger now_, shown_;  // of this rank; shown_: at the end of the last step, or of the set-up
  bool begun_ = false;                 // the first_ values are there
  bool fresh_ = false;                 // forces are those of a set-up
  bool resumed_ = false;               // powers come from a restart file, for its forces
  double kinetic_before_ = 0.0;        // J, with the atoms before they are exchanged
  int moving_ = 0, frozen_ = 0;        // bits of groups
  std::vector<class FixGravity *> gravities_;
  std::vector<std::array<double, 3>> accelerations_;  // of these
};

}  // namespace LAMMPS_NS

#endif
#endif
