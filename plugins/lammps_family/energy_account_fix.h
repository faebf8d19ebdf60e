// fix ID all energy/account: kinetic energy, and the works of gravity and of all parts of the contact forces, summed so that they balance
// to round-off at any time step (dembark/energy_ledger.hpp).
//
// Of the two kicks of velocity Verlet, which the velocities v(n) divide, the first is tallied at the end of step n, the second in the next
// step, or with the forces of a set-up in between.
#ifndef DEMBARK_ENERGY_ACCOUNT_FIX_H
#define DEMBARK_ENERGY_ACCOUNT_FIX_H

#include <string_view>

#include "shared_fix.h"

#include "dembark/contact_tally.hpp"
#include "dembark/energy_ledger.hpp"

namespace dembark_family {

class EnergyAccountFix : public GrainFix {
 public:
  /// `tally`: where the engine's contacts are tallied.
  EnergyAccountFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg, dembark::ContactTally& tally);

  void init() override;
  void setup_pre_force(int) override;
  void post_integrate() override;
  void pre_force(int) override;
  void final_integrate() override;
  void end_of_step() override;
  double compute_vector(int n) override;
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  double memory_usage() override;

  /// Where its vector has an energy: they are in their order, but for numerical damping, which these engines have not.
  static constexpr int place(std::string_view energy) {
    int k = 0;
    for (const std::string_view one : dembark::energy_names) {
      if (one == energy) break;
      k += one != "numerical_damping";
    }
    return k;
  }

 protected:
  /// Before anything of a step, and after all output of the step before.
  void begin_step();

 private:
  /// Ends the run where there are contacts whose parts are not known.
  virtual void check_contacts() = 0;
  void check_motion();
  dembark::BodyMotion motion(int i) const;
  dembark::EnergyBody body(int i) const;
  double kinetic() const;
  void note_changes();
  void measure_powers();
  dembark::EnergyLedger with_setup() const;
  void impose(double change, double of, double& sum) const;

  dembark::ContactTally& tally_;
  dembark::EnergyLedger now_, shown_;  // of this rank; shown_: at the end of the last step, or of the set-up
  bool begun_ = false;                 // the first_ values are there
  bool fresh_ = false;                 // forces are those of a set-up
  bool resumed_ = false;               // powers come from a restart file, for its forces
  double kinetic_before_ = 0.0;        // J, with the atoms before they are exchanged
  // Bits of groups, and their accelerations by gravity (m/s^2) now.
  std::vector<std::pair<int, dembark::Vec3<double>>> gravity_accelerations_;
};

}  // namespace dembark_family

#endif
