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

class EnergyTally {
 public:
  typedef dembark::Vec3<double> Vec3;
  typedef LIGGGHTS::ContactModels::SurfacesCloseData Contact;
  struct Load {
    Vec3 force, torque;
  };
  typedef std::array<Load, dembark::contact_part_count> Loads;

  std::array<double, dembark::contact_part_count> wall_power{};  ///< W, of each part on the grains, were they moved as the wall is
  double normal_stored = 0.0, tangential_stored = 0.0;           ///< J

  /// Begins anew for the forces of a moment, with this many owned grains.
  void clear(int grains) {
    loads_.assign(std::size_t(grains), {});
    wall_power.fill(0.0);
    normal_stored = tangential_stored = 0.0;
  }

  std::size_t size() const { return loads_.size(); }
  const Loads& of(int i) const { return loads_[std::size_t(i)]; }

  /// The parts of a contact's force, and what its springs hold; `motion` has the lever arms. Of a pair that two ranks
  /// compute each tallies half of the latter. Forces that move no grain are not tallied.
  DEMBARK_COLD void add(const Contact& d, const Vec3& normal, const dembark::ContactParts& parts, const dembark::RelativeMotion& motion) {
    if (!d.computeflag) return;
    const bool owned = !d.is_wall && std::size_t(d.j) < loads_.size();
    const double scale = d.is_wall ? d.area_ratio : 1.0, stored = d.is_wall || owned ? scale : 0.5;
    for (std::size_t p = 0; p < dembark::contact_part_count; ++p) {
      const Vec3 &force = parts.force[p], moment = cross(normal, force);
      Load& on_i = loads_[std::size_t(d.i)][p];
      on_i.force += scale * force;
      on_i.torque -= (scale * motion.arm_1) * moment;
      if (d.is_wall) wall_power[p] += scale * dot(force, {d.v_j[0], d.v_j[1], d.v_j[2]});
      if (!owned) continue;
      Load& on_j = loads_[std::size_t(d.j)][p];
      on_j.force -= force;
      on_j.torque -= motion.arm_2 * moment;
    }
    normal_stored += stored * parts.normal_stored;
    tangential_stored += stored * parts.tangential_stored;
  }

 private:
  std::vector<Loads> loads_;
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
