// What the pair style and the walls tally for fix energy/account: the parts of all contact forces, added up by the grain on which they act.
//
// A work needs the mean velocity of the step (dembark/contact_energy.hpp), which is known only when all forces of a grain are. So forces
// and torques are kept, part by part, from their computation to the end of the step. Each rank tallies for the grains that it owns.
#ifndef DEMBARK_ENERGY_TALLY_H
#define DEMBARK_ENERGY_TALLY_H

#include <array>
#include <vector>

#include "modify.h"

#include "dembark/contact_energy.hpp"

namespace dembark_lammps {

struct EnergyTally {
  std::vector<std::array<dembark::Dofs, dembark::contact_part_count>> loads;  ///< on each grain
  /// W and W/s, of each part on the grains, were they moved as the wall is: with its velocity and acceleration of the moment.
  std::array<double, dembark::contact_part_count> wall_power{}, wall_rate{};
  double normal_stored = 0.0, tangential_stored = 0.0, rolling_stored = 0.0;  ///< J

  /// Begins anew for the forces of a moment, of this many owned grains.
  void clear(int grains) {
    loads.assign(std::size_t(grains), {});
    wall_power = wall_rate = {};
    normal_stored = tangential_stored = rolling_stored = 0.0;
  }

  /// A contact of grains i and j, with the state that its step has left. Of a pair that two ranks compute each tallies half of what is
  /// stored. In the set-up (`advance` false) the state stays, and the forces are those of one that a step of no duration leaves.
  DEMBARK_COLD void add_pair(const dembark::ContactParameters& p, const dembark::ContactBodies& b, const dembark::ContactForce& out,
                             const dembark::ContactState& state, bool advance, int i, int j) {
    const dembark::ContactParts parts = parts_of(p, b, out, state, advance);
    const dembark::ContactLevers levers(out.normal, relative_motion(b, out.normal, out.overlap));
    const bool owned = std::size_t(j) < loads.size();
    for (std::size_t k = 0; k < parts.count; ++k) {
      dembark::add(loads[std::size_t(i)][k], levers.on_one(k, parts.load[k]));
      if (owned) dembark::add(loads[std::size_t(j)][k], levers.on_two(k, parts.load[k]));
    }
    store(parts, owned ? 1.0 : 0.5);
  }

  /// A contact of grain i with a wall, whose surface has the velocities in `b`, half a step of these accelerations before those of the
  /// moment (m/s^2 at the contact, rad/s^2).
  DEMBARK_COLD void add_wall(const dembark::ContactParameters& p, const dembark::ContactBodies& b, const dembark::ContactForce& out,
                             const dembark::ContactState& state, bool advance, int i, double dt,
                             const dembark::Vec3<double>& acceleration = {}, const dembark::Vec3<double>& angular_acceleration = {}) {
    const dembark::ContactParts parts = parts_of(p, b, out, state, advance);
    const dembark::ContactLevers levers(out.normal, relative_motion(b, out.normal, out.overlap));
    for (std::size_t k = 0; k < parts.count; ++k) {
      const bool is_force = k < dembark::force_part_count;
      const dembark::Vec3<double>& change = is_force ? acceleration : angular_acceleration;
      dembark::add(loads[std::size_t(i)][k], levers.on_one(k, parts.load[k]));
      wall_power[k] += dot(parts.load[k], (is_force ? b.velocity_2 : b.wall_spin) + 0.5 * dt * change);
      wall_rate[k] += dot(parts.load[k], change);
    }
    store(parts, 1.0);
  }

 private:
  static dembark::ContactParts parts_of(const dembark::ContactParameters& p, const dembark::ContactBodies& b,
                                        const dembark::ContactForce& out, const dembark::ContactState& state, bool advance) {
    if (advance) return contact_parts(p, b, out, state);
    dembark::ContactState left = state;
    contact_step(p, b, 0.0, left);
    return contact_parts(p, b, out, left);
  }

  void store(const dembark::ContactParts& parts, double share) {
    normal_stored += share * parts.normal_stored;
    tangential_stored += share * parts.tangential_stored;
    rolling_stored += share * parts.rolling_stored;
  }
};

/// That of the fix, or nullptr.
EnergyTally* find_energy_tally(const LAMMPS_NS::Modify* modify);

}  // namespace dembark_lammps

#endif
