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
#include <utility>
#include <vector>

#include "contact_interface.h"
#include "fix.h"
#include "modify.h"

#include "dembark/energy_ledger.hpp"
#include "dembark/motion/wall_work.hpp"
#include "contact_data.h"

namespace dembark_liggghts {

/// What the contact models tally: the parts of all contact forces, added up by the grain on which they act. A work needs the mean velocity
/// of the step (dembark/contact_energy.hpp), which is known only when all forces of a grain are. So forces and torques are kept, part by
/// part, from their computation to the end of the step. Each rank tallies for the grains that it owns.
struct EnergyTally {
  std::vector<std::array<dembark::Dofs, dembark::contact_part_count>> loads;  ///< on each grain
  /// W and W/s, of each part on the grains, were they moved as the wall is: with its velocity and acceleration of the moment.
  std::array<double, dembark::contact_part_count> wall_power{}, wall_rate{};
  double normal_stored = 0.0, tangential_stored = 0.0, rolling_stored = 0.0;  ///< J

  /// Meshes whose acceleration is known. Others have that of the step before: none.
  std::vector<std::pair<const LAMMPS_NS::AbstractMesh *, const dembark::WallAcceleration *>> driven;

  /// Begins anew for the forces of a moment: of this many owned grains, at these places (m), in a step of `dt` s.
  void clear(int grains, double *const *positions, double dt) {
    positions_ = positions;
    half_step_ = 0.5 * dt;
    loads.assign(std::size_t(grains), {});
    wall_power = wall_rate = {};
    normal_stored = tangential_stored = rolling_stored = 0.0;
  }

  /// The parts of a contact's force, and what its springs hold; `motion` has the lever arms. Of a pair that two ranks
  /// compute each tallies half of the latter. Forces that move no grain are not tallied.
  DEMBARK_COLD void add(const LIGGGHTS::ContactModels::SurfacesCloseData &d, const dembark::Vec3<double> &normal,
                        const dembark::ContactParts &parts, const dembark::RelativeMotion &motion) {
    if (!d.computeflag) return;
    const dembark::ContactLevers levers(normal, motion);
    const bool owned = !d.is_wall && std::size_t(d.j) < loads.size();
    const double scale = d.is_wall ? d.area_ratio : 1.0, stored = d.is_wall || owned ? scale : 0.5;
    for (std::size_t p = 0; p < parts.count; ++p) {
      const dembark::Vec3<double> load = scale * parts.load[p];
      dembark::add(loads[std::size_t(d.i)][p], levers.on_one(p, load));
      if (owned) dembark::add(loads[std::size_t(d.j)][p], levers.on_two(p, load));
      if (d.is_wall) add_wall(d, p, load);
    }
    normal_stored += stored * parts.normal_stored;
    tangential_stored += stored * parts.tangential_stored;
    rolling_stored += stored * parts.rolling_stored;
  }

 private:
  /// The engine has the velocity of the half step before; that of the moment is half a step of acceleration on.
  void add_wall(const LIGGGHTS::ContactModels::SurfacesCloseData &d, std::size_t part, const dembark::Vec3<double> &load) {
    const bool is_force = part < dembark::force_part_count;
    dembark::Vec3<double> change;
    for (const auto &[mesh, acceleration] : driven)
      if (mesh == d.mesh) change = is_force ? acceleration->at(vector(positions_[d.i]) - vector(d.delta)) : acceleration->angular;
    wall_power[part] += dot(load, (is_force ? vector(d.v_j) : wall_spin(d)) + half_step_ * change);
    wall_rate[part] += dot(load, change);
  }

  double *const *positions_ = nullptr;
  double half_step_ = 0.0;
};

}  // namespace dembark_liggghts

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
  void write_restart(FILE *);
  void restart(char *);
  double memory_usage();

  dembark_liggghts::EnergyTally tally;

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

  dembark::EnergyLedger now_, shown_;  // of this rank; shown_: at the end of the last step, or of the set-up
  bool begun_ = false;                 // the first_ values are there
  bool fresh_ = false;                 // forces are those of a set-up
  bool resumed_ = false;               // powers come from a restart file, for its forces
  double kinetic_before_ = 0.0;        // J, with the atoms before they are exchanged
  int moving_ = 0, frozen_ = 0;        // bits of groups
  int turning_ = 0;                    // of those of moving_ whose spin follows torques
  std::vector<class FixGravity *> gravities_;
  std::vector<std::array<double, 3>> accelerations_;  // of these
};

}  // namespace LAMMPS_NS

namespace dembark_liggghts {

/// The tally of the fix, or nullptr.
inline EnergyTally *find_energy_tally(LAMMPS_NS::Modify *modify) {
  auto *const fix = static_cast<LAMMPS_NS::FixEnergyAccount *>(modify->find_fix_style("energy/account", 0));
  return fix ? &fix->tally : nullptr;
}

}  // namespace dembark_liggghts

#endif
#endif
