#include "fix_nve_sph_coupled.h"

#include "atom.h"
#include "comm.h"
#include "fix_property_atom.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include "fix_sph_body.h"
#include "pair_sph_coupled.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::sph::Energies;
using dembark::sph::Vector;
using dembark_family::vector;

FixNveSphCoupled::FixNveSphCoupled(LAMMPS *lmp, int narg, char **arg) : SharedFix(lmp, narg, arg) {
  if (narg != 3) fail("it takes no keywords: all numbers stand in pair_style sph/coupled");
  if (!PairSphCoupled::find(force)) fail(PairSphCoupled::missing);
  time_integrate = 1;
  restart_global = 1;
  vector_flag = 1;
  size_vector = 9;
  global_freq = 1;
  extvector = 0;
}

/// Shifts wait for the next step: they go with the atoms and into restart files.
void FixNveSphCoupled::post_create() {
  if (!PairSphCoupled::find(force)->fluid().displaces()) return;
  const char *words[] = {"sph_shift", "all", "property/atom", "sph_shift", "vector", "yes", "no", "no", "0.", "0.", "0."};
  shifts_ = modify->add_fix_property_atom(11, const_cast<char **>(words), style);
}

void FixNveSphCoupled::pre_delete(bool unfixed) {
  if (unfixed && shifts_) modify->delete_fix(shifts_->id);
}

/// Before forces it does nothing but in the set-up.
int FixNveSphCoupled::setmask() { return INITIAL_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE; }

void FixNveSphCoupled::init() {
  pair_ = PairSphCoupled::find(force);
  if (!pair_) fail(PairSphCoupled::missing);
  if (bool(shifts_) != pair_->fluid().displaces()) fail("it must come after pair_style sph/coupled ... shifting or xsph");
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

void FixNveSphCoupled::initial_integrate(int) {
  const dembark::sph::Settings &fluid = pair_->fluid();
  const double dt = update->dt, factor = 0.5 * dt / fluid.mass();
  double *const *const by = shifts();
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    Vector x = vector(atom->x[i]), v = vector(atom->v[i]);
    dembark::sph::first_half(x, v, factor * vector(atom->f[i]), by ? vector(by[i]) : Vector{}, dt);
    if (!slower_than_sound(fluid, v))
      fail_alone("the fluid blew up: at step " + std::to_string(update->ntimestep) + " atom " + std::to_string(atom->tag[i]) + " " +
                 too_fast(fluid, v));
    atom->x[i][0] = x.x, atom->x[i][1] = x.y, atom->x[i][2] = x.z;
    atom->v[i][0] = v.x, atom->v[i][1] = v.y, atom->v[i][2] = v.z;
  }
}

void FixNveSphCoupled::final_integrate() {
  const double factor = 0.5 * update->dt / pair_->fluid().mass();
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & groupbit) dembark_family::add(atom->v[i], vector(atom->f[i]), factor);
}

double **FixNveSphCoupled::shifts() const { return shifts_ ? shifts_->array_atom : nullptr; }

/// Kinetic, potential and compression energy of the fluid, energy of bodies, of the contact potential; lost by viscosity, diffusion and at
/// walls, done by walls and loads. Collective.
double FixNveSphCoupled::compute_vector(int n) {
  if (!pair_) return 0.0;
  if (summed_ != update->ntimestep) {
    const Energies e = pair_->energies();
    const double mine[] = {e.kinetic, e.potential, e.compression, 0.0, e.contact, e.viscous, e.diffusive, e.boundary, 0.0};
    MPI_Allreduce(mine, totals_, 9, MPI_DOUBLE, MPI_SUM, world);
    for (int k = 0; k < 3; ++k) totals_[5 + k] += saved_[k];
    const Vector &g = pair_->fluid().gravity;
    for (Fix *const fix : fixes()) {
      const auto *const solid = dynamic_cast<FixSphBody *>(fix);
      if (!solid) continue;
      const dembark::sph::Body &body = solid->body();
      totals_[3] += body.energy(g);
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
  checked([&] {
    dembark_family::SavedPart part(buffer);
    part.read(saved_, 3);
    part.end();
  });
  first_ = false;
}
