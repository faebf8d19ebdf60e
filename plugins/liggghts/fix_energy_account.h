// LIGGGHTS's side of fix ID all energy/account (energy_account_fix.h).
#ifdef FIX_CLASS

FixStyle(energy/account,FixEnergyAccount)

#else

#ifndef LMP_FIX_ENERGY_ACCOUNT_H
#define LMP_FIX_ENERGY_ACCOUNT_H

#include <utility>
#include <vector>

#include "contact_interface.h"
#include "modify.h"

#include "dembark/motion/wall_work.hpp"
#include "contact_data.h"
#include "energy_account_fix.h"

namespace dembark_liggghts {

/// What the contact models tally.
struct EnergyTally : dembark::ContactTally {
  const LAMMPS_NS::Atom *atom = nullptr;
  int frozen = 0;  ///< bit of grains that never move: two of them have no works
  /// Meshes whose acceleration is known. Others have that of the step before: none.
  std::vector<std::pair<const LAMMPS_NS::AbstractMesh *, const dembark::WallAcceleration *>> driven;

  /// The parts of a contact's force, and what its springs hold; `motion` has the lever arms. Forces that move no grain are not tallied.
  DEMBARK_COLD void add(const LIGGGHTS::ContactModels::SurfacesCloseData &d, const dembark::Vec3<double> &normal,
                        const dembark::ContactParts &parts, const dembark::RelativeMotion &motion) {
    if (!d.computeflag || (!d.is_wall && atom->mask[d.i] & atom->mask[d.j] & frozen)) return;
    const dembark::ContactLevers levers(normal, motion);
    if (!d.is_wall) return add_pair(parts, levers, d.i, d.j);
    // Where the force acts, from the surface.
    const dembark::Vec3<double> spin = wall_spin(d), within = vector(d.delta) + levers.one;
    WallMotion wall{vector(d.v_j) + cross(spin, within), spin};
    for (const auto &[mesh, acceleration] : driven)
      if (mesh == d.mesh) {
        wall.acceleration = acceleration->at(vector(atom->x[d.i]) + levers.one);
        wall.angular_acceleration = acceleration->angular;
      }
    add_wall(parts, levers, d.i, wall, d.area_ratio);
  }
};

}  // namespace dembark_liggghts

namespace LAMMPS_NS {

class FixEnergyAccount : public dembark_family::EnergyAccountFix {
 public:
  FixEnergyAccount(class LAMMPS *, int, char **);

  int setmask();
  void init();
  void pre_initial_integrate() { begin_step(); }

  dembark_liggghts::EnergyTally tally;

 private:
  void check_contacts();
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
