// A contact of LIGGGHTS in the terms of dembark/contact.hpp, and what both contact models need beside it.
#ifndef DEMBARK_CONTACT_DATA_H
#define DEMBARK_CONTACT_DATA_H

#include <cmath>
#include <cstdio>
#include <string>

#include "atom.h"
#include "contact_interface.h"
#include "error.h"
#include "fix_mesh_surface.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "tri_mesh.h"

#include "dembark/contact.hpp"
#include "dembark/contact_history.hpp"
#include "double_contacts.h"
#include "shared_fix.h"

namespace dembark_liggghts {

typedef dembark::Vec3<double> Vec3;

using dembark_family::vector;

/// How a wall turns (rad/s), by the velocities of its triangle's corners: of a mesh that is rotated, or whose surface turns in its place
/// (`surface_ang_vel`). Others do not turn.
inline Vec3 wall_spin(const LIGGGHTS::ContactModels::SurfacesCloseData& d) {
  if (!d.mesh || !(d.mesh->isRotating() || (d.fix_mesh && d.fix_mesh->surfaceVel()))) return {};
  auto* const velocities = d.mesh->prop().getElementProperty<LAMMPS_NS::MultiVectorContainer<double, 3, 3>>("v");
  if (!velocities) return {};
  double corner[3][3];
  for (int k = 0; k < 3; ++k) d.mesh->node(d.j, k, corner[k]);
  const auto from_first = [](const auto& row, int k) { return vector(row[k]) - vector(row[0]); };
  double** const v = velocities->begin()[d.j];
  return dembark::triangle_spin(from_first(corner, 1), from_first(corner, 2), from_first(v, 1), from_first(v, 2));
}

/// The two bodies but for their masses, which the models do not ask for.
inline dembark::ContactBodies bodies(const LIGGGHTS::ContactModels::SurfacesCloseData& d, double* const* omega) {
  dembark::ContactBodies b;
  b.velocity_1 = vector(d.v_i);
  b.velocity_2 = vector(d.v_j);
  b.angular_velocity_1 = vector(omega[d.i]);
  b.radius_1 = d.radi;
  if (d.is_wall) {
    b.wall_spin = wall_spin(d);
    return b;
  }
  b.angular_velocity_2 = vector(omega[d.j]);
  b.radius_2 = d.radj;
  return b;
}

/// Adds an assembled force to what acts on the two bodies.
inline void add_force(const dembark::ContactForce& f, const LIGGGHTS::ContactModels::SurfacesCloseData& d,
                      LIGGGHTS::ContactModels::ForceData& on_i, LIGGGHTS::ContactModels::ForceData& on_j) {
  using dembark_family::add;
  const double scale = d.is_wall ? d.area_ratio : 1.0;
  add(on_i.delta_F, f.force, scale);
  add(on_i.delta_torque, f.torque_1, scale);
  if (d.is_wall) return;
  add(on_j.delta_F, f.force, -1.0);
  add(on_j.delta_torque, f.torque_2);
}

using dembark::load_friction;
using dembark::load_rings;
using dembark::ring_numbers;
using dembark::store_friction;
using dembark::store_rings;

/// Adds the numbers of partial slip to a history; returns where they begin. "1": the sign turns when the engine swaps the grains of a pair.
inline int add_rings(LIGGGHTS::IContactHistorySetup& host) {
  int first = 0;
  for (int k = 0; k < ring_numbers; ++k) {
    const int at = host.add_history_value("slip_ring_" + std::to_string(k + 1), k < dembark::SlipRings::count ? "1" : "0");
    if (k == 0) first = at;
  }
  return first;
}

/// The rolling spring: three numbers, its angle.
inline void store(double* history, const Vec3& angle) {
  history[0] = angle.x;
  history[1] = angle.y;
  history[2] = angle.z;
}

/// Inertia (kg m^2) of the relative spin of two grains of these masses (kg). Frozen ones are of infinite mass, as in the normal models.
inline double pair_inertia(const LAMMPS_NS::Atom& atom, const LAMMPS_NS::PairGran& pair, int i, double mass_i, int j, double mass_j) {
  const auto mass = [&](int k, double its) { return atom.mask[k] & pair.freeze_group_bit() ? INFINITY : its; };
  return dembark::relative_inertia(mass(i, mass_i), atom.radius[i], mass(j, mass_j), atom.radius[j]);
}

/// Calls `end(i, j, history)` for all pairs with one of `flags` that are farther apart than the contact distance factor allows. Of a
/// pair that jumps so far in one step the engine's loop tells the models nothing, and its contact would go on when it touches again.
template <class End>
void end_parted_pairs(LAMMPS_NS::PairGran& pair, const LAMMPS_NS::Atom& atom, double distance_factor, int flags, End end) {
  const LAMMPS_NS::NeighList* const list = pair.list;
  if (!list || !list->listgranhistory) return;
  for (int n = 0; n < list->inum; ++n) {
    const int i = list->ilist[n];
    int* const flag = list->listgranhistory->firstneigh[i];
    for (int k = 0; k < list->numneigh[i]; ++k) {
      if (!(flag[k] & flags)) continue;
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      const Vec3 apart = vector(atom.x[i]) - vector(atom.x[j]);
      const double reach = distance_factor * (atom.radius[i] + atom.radius[j]);
      if (dot(apart, apart) < reach * reach) continue;
      end(i, j, list->listgranhistory->firstdouble[i] + pair.dnum() * k);
      flag[k] &= ~flags;
    }
  }
}

/// When the pairs are listed.
inline void refuse_double_contacts(LAMMPS_NS::PairGran& pair, const LAMMPS_NS::Atom& atom, const LAMMPS_NS::Neighbor& neighbor,
                                   const LAMMPS_NS::Domain& domain, LAMMPS_NS::Error* error) {
  const LAMMPS_NS::NeighList* const list = pair.list;
  if (neighbor.ago != 0 || !list || !list->listgranhistory) return;
  const std::string wrong =
      dembark_family::double_contact_error(*list, list->listgranhistory->firstneigh, atom, domain, false, neighbor.cutneighmax);
  if (!wrong.empty()) error->one(FLERR, ("pair_style gran: " + wrong).c_str());
}

/// The run ends when two centres lie on each other: there is no normal, and the engine's own models would give no number. `j` < 0: a wall.
DEMBARK_COLD inline void refuse_coincidence(LAMMPS_NS::Error* error, const int* tag, int i, int j) {
  char line[160];
  if (j < 0)
    snprintf(line, sizeof line, "the centre of atom %d lies on a wall: it has no normal; take a smaller time step or another start",
             tag[i]);
  else snprintf(line, sizeof line, "atoms %d and %d have the same centre: their contact has no normal; place them apart", tag[i], tag[j]);
  error->one(FLERR, line);
}

}  // namespace dembark_liggghts

#endif
