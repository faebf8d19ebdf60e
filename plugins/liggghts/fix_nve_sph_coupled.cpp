#include "fix_nve_sph_coupled.h"

#include <algorithm>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "fix_property_atom.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include "fix_sph_body.h"
#include "dembark/keyword_reader.hpp"
#include "pair_sph_coupled.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::keywords::text;
using dembark::sph::Energies;

FixNveSphCoupled::FixNveSphCoupled(LAMMPS *lmp, int narg, char **arg) : SharedFix(lmp, narg, arg) {
  if (narg != 3) fail("it takes no keywords: all numbers stand in pair_style sph/coupled");
  if (!PairSphCoupled::find(force)) fail("it wants pair_style sph/coupled, alone or in hybrid/overlay, before it");
  time_integrate = 1;
  restart_global = 1;
  vector_flag = 1;
  size_vector = 9;
  global_freq = 1;
  extvector = 0;
}

/// Shifts wait for the next step: they go with the atoms and into restart files.
void FixNveSphCoupled::post_create() {
  if (PairSphCoupled::find(force)->fluid().shifting.coefficient <= 0.0) return;
  const char *words[] = {"sph_shift", "all", "property/atom", "sph_shift", "vector", "yes", "no", "no", "0.", "0.", "0."};
  shifts_ = modify->add_fix_property_atom(11, const_cast<char **>(words), style);
}

void FixNveSphCoupled::pre_delete(bool unfixed) {
  if (unfixed && shifts_) modify->delete_fix(shifts_->id);
}

int FixNveSphCoupled::setmask() { return INITIAL_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE; }

void FixNveSphCoupled::init() {
  pair_ = PairSphCoupled::find(force);
  if (!pair_) fail("it wants pair_style sph/coupled, alone or in hybrid/overlay");
  if (bool(shifts_) != (pair_->fluid().shifting.coefficient > 0.0)) fail("it must come after pair_style sph/coupled ... shifting");
  double count = 0.0, all = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) count += (atom->mask[i] & groupbit) != 0;
  MPI_Allreduce(&count, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  if (all == 0.0) fail("its group has no atoms: there is no fluid");
}

/// Of atoms with a radius the engine takes ghosts within half of the cutoff and half of the skin, which would do for grains that touch.
double FixNveSphCoupled::extend_cut_ghost() {
  return (atom->radius ? 2.0 : 1.0) * dembark::sph::support * PairSphCoupled::find(force)->fluid().h();
}

void FixNveSphCoupled::setup_pre_force(int) {
  pair_->begin(first_);
  first_ = false;
  summed_ = -1;
}

void FixNveSphCoupled::kick() {
  const double factor = 0.5 * update->dt / pair_->fluid().mass();
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & groupbit)
      for (int k = 0; k < 3; ++k) atom->v[i][k] += factor * atom->f[i][k];
}

void FixNveSphCoupled::initial_integrate(int) {
  kick();
  const double dt = update->dt, sound = pair_->fluid().state.sound_speed;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    const double *const v = atom->v[i], *const by = shifts_ ? shifts_->array_atom[i] : nullptr;
    const double squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    // As a speed that is no number compares, too.
    if (!(squared <= sound * sound))
      fail_alone("the fluid blew up: at step " + std::to_string(update->ntimestep) + " atom " + std::to_string(atom->tag[i]) +
                 " moves at " + text(std::sqrt(squared)) + " m/s, faster than sound (" + text(sound) +
                 " m/s); take a larger sound_speed, a shorter step or thicker walls");
    for (int k = 0; k < 3; ++k) atom->x[i][k] += dt * v[k] + (by ? by[k] : 0.0);
  }
}

void FixNveSphCoupled::pre_force(int) { pair_->advance(update->dt, shifts_ ? shifts_->array_atom : nullptr); }

void FixNveSphCoupled::final_integrate() { kick(); }

/// Kinetic, potential and compression energy of the fluid, energy of bodies, of the contact potential; lost by viscosity, diffusion and at
/// walls, done by walls and loads. Collective.
double FixNveSphCoupled::compute_vector(int n) {
  if (!pair_) return 0.0;
  if (summed_ != update->ntimestep) {
    const Energies e = pair_->energies();
    const double mine[] = {e.kinetic, e.potential, e.compression, 0.0, e.contact, e.viscous, e.diffusive, e.boundary, 0.0};
    MPI_Allreduce(mine, totals_, 9, MPI_DOUBLE, MPI_SUM, world);
    for (int k = 0; k < 3; ++k) totals_[5 + k] += saved_[k];
    const dembark::sph::Vector &g = pair_->fluid().gravity;
    for (Fix *const fix : fixes()) {
      const auto *const solid = dynamic_cast<FixSphBody *>(fix);
      if (!solid) continue;
      const dembark::sph::Body &body = solid->body();
      if (body.free) totals_[3] += body.kinetic_energy() - body.mass * dot(g, body.position);
      totals_[8] += solid->work();
    }
    summed_ = update->ntimestep;
  }
  return totals_[n];
}

void FixNveSphCoupled::write_restart(FILE *file) {
  summed_ = -1;
  compute_vector(0);
  if (comm->me == 0) write_part(file, {{totals_ + 5, sizeof saved_}});
}

void FixNveSphCoupled::restart(char *buffer) {
  std::memcpy(saved_, buffer, sizeof saved_);
  first_ = false;
}
