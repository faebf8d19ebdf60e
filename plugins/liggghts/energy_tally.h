// What the contact models tally for fix energy/account: the parts of all contact forces, added up by the grain on which they act.
//
// A work needs the mean velocity of the step (dembark/contact_energy.hpp), which is known only when all forces of a grain are. So forces
// and torques are kept, part by part, from their computation to the end of the step. Each rank tallies for the grains that it owns.
#ifndef DEMBARK_ENERGY_TALLY_H
#define DEMBARK_ENERGY_TALLY_H

#include <array>
#include <vector>

#include "contact_interface.h"
#include "fix.h"
#include "modify.h"

#include "dembark/contact_energy.hpp"

namespace dembark_liggghts {

struct EnergyTally {
  std::vector<std::array<dembark::Dofs, dembark::contact_part_count>> loads;  ///< on each grain
  std::array<double, dembark::contact_part_count> wall_power{};  ///< W, of each part on the grains, were they moved as the wall is
  double normal_stored = 0.0, tangential_stored = 0.0;           ///< J

  /// Begins anew for the forces of a moment, with this many owned grains.
  void clear(int grains) {
    loads.assign(std::size_t(grains), {});
    wall_power = {};
    normal_stored = tangential_stored = 0.0;
  }

  /// The parts of a contact's force, and what its springs hold; `motion` has the lever arms. Of a pair that two ranks
  /// compute each tallies half of the latter. Forces that move no grain are not tallied.
  DEMBARK_COLD void add(const LIGGGHTS::ContactModels::SurfacesCloseData& d, const dembark::Vec3<double>& normal,
                        const dembark::ContactParts& parts, const dembark::RelativeMotion& motion) {
    if (!d.computeflag) return;
    const dembark::ContactLevers levers(normal, motion);
    const bool owned = !d.is_wall && std::size_t(d.j) < loads.size();
    const double scale = d.is_wall ? d.area_ratio : 1.0, stored = d.is_wall || owned ? scale : 0.5;
    for (std::size_t p = 0; p < dembark::contact_part_count; ++p) {
      const dembark::Vec3<double> force = scale * parts.force[p];
      dembark::add(loads[std::size_t(d.i)][p], levers.on_one(force));
      if (owned) dembark::add(loads[std::size_t(d.j)][p], levers.on_two(force));
      if (d.is_wall) wall_power[p] += dot(force, {d.v_j[0], d.v_j[1], d.v_j[2]});
    }
    normal_stored += stored * parts.normal_stored;
    tangential_stored += stored * parts.tangential_stored;
  }
};

constexpr const char* energy_tally_name = "energy tally";

/// The tally of the fix, or nullptr.
inline EnergyTally* find_energy_tally(LAMMPS_NS::Modify* modify) {
  int none = 0;
  LAMMPS_NS::Fix* const fix = modify->find_fix_style("energy/account", 0);
  return fix ? static_cast<EnergyTally*>(fix->extract(energy_tally_name, none)) : nullptr;
}

}  // namespace dembark_liggghts

#endif
