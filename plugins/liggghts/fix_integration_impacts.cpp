// Impacts of fix integration/monitor that are integrated anew (dembark/integration/shadow_impact.hpp).
//
// Before the forces of a step, positions are of the step and velocities of half a step before, of owned atoms as of their images on other
// ranks.
#include "fix_integration_monitor.h"

#include <utility>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_gravity.h"
#include "force.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "contact_data.h"
#include "pair_parameters.h"

using namespace LAMMPS_NS;
using dembark::ShadowImpact;
using dembark_liggghts::vector;

void FixIntegrationMonitor::setup_pre_force(int) {
  if (!dembark_liggghts::PairParameters::known)
    refuse(
        "impacts are integrated anew for pair_style gran model hertz tangential finnie_rabinowicz only, without viscous or carried liquid");
  if (atom->map_style == 0) refuse("impacts needs 'atom_modify map array'");
}

void FixIntegrationMonitor::pre_force(int) {
  const long n = long(update->ntimestep);
  run_.shadows.follow(update->dt, monitor_, [this](const ShadowImpact &shadow) {
    const int i = atom->map(int(shadow.one)), j = atom->map(int(shadow.two));
    dembark::ShadowImpacts::Meeting now;
    now.here = i >= 0 && i < atom->nlocal;
    now.judged = now.here && j >= 0 && weight(i, j, now.gravity);
    if (now.judged) now.bodies = bodies(i, j);
    return now;
  });
  // Atoms have changed their ranks.
  if (neighbor->ago == 0 || monitor_.settings.samples(n)) run_.shadows.drop();
  if (monitor_.settings.samples(n)) begin_impacts(n);
}

/// m/s^2. False where it is not the same for both.
bool FixIntegrationMonitor::weight(int i, int j, dembark::Vec3<double> &acceleration) const {
  acceleration = {};
  for (FixGravity *const gravity : gravities_) {
    const bool acts = atom->mask[i] & gravity->groupbit;
    if (acts != bool(atom->mask[j] & gravity->groupbit)) return false;
    double a[3];
    gravity->get_gravity(a);
    if (acts) acceleration += vector(a);
  }
  return true;
}

dembark::ContactBodies FixIntegrationMonitor::bodies(int i, int j) const {
  dembark::ContactBodies b;
  double apart[3];
  for (int k = 0; k < 3; ++k) apart[k] = atom->x[i][k] - atom->x[j][k];
  domain->minimum_image(apart);
  b.separation = vector(apart);
  b.velocity_1 = vector(atom->v[i]);
  b.velocity_2 = vector(atom->v[j]);
  b.angular_velocity_1 = vector(atom->omega[i]);
  b.angular_velocity_2 = vector(atom->omega[j]);
  b.radius_1 = atom->radius[i];
  b.radius_2 = atom->radius[j];
  b.mass_1 = mass(i);
  b.mass_2 = mass(j);
  return b;
}

/// Collective. Of pairs that two ranks have, the one that owns the lower number takes the impact.
void FixIntegrationMonitor::begin_impacts(long n) {
  std::vector<ShadowImpact> mine;
  const NeighList *const list = static_cast<PairGran *>(force->pair)->list;
  for (int ii = 0; list && ii < list->inum; ++ii)
    for (int k = 0; k < list->numneigh[list->ilist[ii]]; ++k) {
      int i = list->ilist[ii], j = list->firstneigh[i][k] & NEIGHMASK;
      if (atom->tag[j] < atom->tag[i]) std::swap(i, j);
      if (i >= atom->nlocal) continue;
      const double a = atom->x[i][0] - atom->x[j][0], b = atom->x[i][1] - atom->x[j][1], c = atom->x[i][2] - atom->x[j][2];
      const double reach = atom->radius[i] + atom->radius[j];
      dembark::Vec3<double> gravity;
      if (a * a + b * b + c * c >= reach * reach || !(atom->mask[i] & atom->mask[j] & groupbit) || !weight(i, j, gravity) ||
          !dembark::picked(atom->tag[i], atom->tag[j], n, run_.impacts))
        continue;
      ShadowImpact shadow;
      if (shadow.begin(dembark_liggghts::PairParameters::known->parameters(atom->type[i], atom->type[j]), bodies(i, j), atom->tag[i],
                       atom->tag[j], update->dt))
        mine.push_back(shadow);
    }
  run_.shadows.add(mine);
}
