// What the pair style and the walls tally for fix energy/account.
#ifndef DEMBARK_ENERGY_TALLY_H
#define DEMBARK_ENERGY_TALLY_H

#include "modify.h"

#include "dembark/contact_tally.hpp"
#include "dembark/motion/wall_work.hpp"

namespace dembark_lammps {

struct EnergyTally : dembark::ContactTally {
  /// A contact of grains i and j, with the state that its step has left. In the set-up (`advance` false) the state stays, and the forces
  /// are those of one that a step of no duration leaves.
  DEMBARK_COLD void add(const dembark::ContactParameters& p, const dembark::ContactBodies& b, const dembark::ContactForce& out,
                        const dembark::ContactState& state, bool advance, int i, int j) {
    add_pair(parts_of(p, b, out, state, advance), levers(b, out), i, j);
  }

  /// A contact of grain i at x (m) with a wall, which has the velocities in `b` and this acceleration.
  DEMBARK_COLD void add(const dembark::ContactParameters& p, const dembark::ContactBodies& b, const dembark::ContactForce& out,
                        const dembark::ContactState& state, bool advance, int i, const dembark::Vec3<double>& x,
                        const dembark::WallAcceleration& acceleration) {
    const dembark::ContactLevers arms = levers(b, out);
    add_wall(parts_of(p, b, out, state, advance), arms, i,
             {b.velocity_2 + cross(b.wall_spin, arms.two), b.wall_spin, acceleration.at(x + arms.one), acceleration.angular});
  }

 private:
  static dembark::ContactLevers levers(const dembark::ContactBodies& b, const dembark::ContactForce& out) {
    return {out.normal, relative_motion(b, out.normal, out.overlap)};
  }
  static dembark::ContactParts parts_of(const dembark::ContactParameters& p, const dembark::ContactBodies& b,
                                        const dembark::ContactForce& out, const dembark::ContactState& state, bool advance) {
    if (advance) return contact_parts(p, b, out, state);
    dembark::ContactState left = state;
    contact_step(p, b, 0.0, left);
    return contact_parts(p, b, out, left);
  }
};

/// That of the fix, or nullptr.
EnergyTally* find_energy_tally(const LAMMPS_NS::Modify* modify);

}  // namespace dembark_lammps

#endif
