#include "monitor_fix.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "neigh_list.h"
#include "neighbor.h"

#include "energy_account_fix.h"

using namespace LAMMPS_NS;
using dembark::MonitorRun;
using dembark::ShadowImpact;
using dembark::Vec3;

namespace dembark_family {

MonitorFix::MonitorFix(LAMMPS* lmp, int narg, char** arg)
    : GrainFix(lmp, narg, arg), run_(checked([&] { return dembark::MonitorCommand::read({arg + std::min(3, narg), arg + narg}); })) {
  only_one();
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = int(MonitorRun::figure_names.size());
  extvector = 0;
  // In the order of the ranks, so that all have the same bits.
  run_.merge_processes = [this](dembark::MonitorTally& tally) {
    std::vector<dembark::MonitorTally> each(std::size_t(comm->nprocs), dembark::MonitorTally{});
    MPI_Allgather(&tally, int(sizeof tally), MPI_BYTE, each.data(), int(sizeof tally), MPI_BYTE, world);
    tally = {};
    for (const dembark::MonitorTally& one : each) tally.merge(one);
  };
}

int MonitorFix::setmask() { return FixConst::END_OF_STEP | (run_.impacts > 0 ? FixConst::PRE_FORCE : 0); }

void MonitorFix::init() {
  only_verlet();
  only_coherent_units();
  only_spheres("it judges");
  if (run_.impacts > 0) only_constant_box("it integrates impacts again in");
  find_movers("it judges");
  want_movers();
  find_contacts();
  account_ = fix_of_style("energy/account");
  if (run_.mean_length) {
    double mine[] = {0.0, 0.0}, all[2];  // sum and number of the diameters
    for (int i = 0; i < atom->nlocal; ++i)
      if (atom->mask[i] & groupbit) {
        mine[0] += 2.0 * atom->radius[i];
        mine[1] += 1.0;
      }
    MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
    checked([&] { run_.measure_length(all[0], all[1]); });
  }
  run_.begin(update->dt, long(update->ntimestep));
  take_step();
}

/// kg; infinite of grains that do not follow their forces.
double MonitorFix::mass(int i) const { return follows_forces(i) ? atom->rmass[i] : INFINITY; }

void MonitorFix::end_of_step() {
  const long n = long(update->ntimestep);
  if (run_.monitor.settings.keeps(n)) take_bodies(n);
  if (run_.monitor.settings.samples(n)) {
    if (has_contacts()) {
      take_pairs();
      take_walls();
    }
    for (const std::string& found : run_.new_findings(n, "atom")) {
      if (run_.monitor.settings.action == dembark::MonitorAction::stop) fail(found);
      warn(found);
    }
  }
  run_.end_step(n);
  take_step();
}

void MonitorFix::take_bodies(long n) {
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit) || !follows_forces(i)) continue;
    const double *const f = atom->f[i], *const torque = atom->torque[i], inertia_factor = inertia(i);
    const double radius = atom->radius[i], per_mass = 1.0 / atom->rmass[i];
    const double per_inertia = inertia_factor > 0.0 ? per_mass / (inertia_factor * radius * radius) : 0.0;
    dembark::AccelerationHistory past;
    std::memcpy(static_cast<void*>(&past), history(i), sizeof past);
    run_.monitor.take(
        past,
        {f[0] * per_mass, f[1] * per_mass, f[2] * per_mass, torque[0] * per_inertia, torque[1] * per_inertia, torque[2] * per_inertia},
        radius, long(atom->tag[i]), n, update->dt);
    std::memcpy(history(i), &past, sizeof past);
  }
}

void MonitorFix::take_contact(int i, int j, double radius_j, int type_j, double overlap) {
  const double own = dembark::reduced(mass(i), j < 0 ? INFINITY : mass(j));
  if (std::isinf(own)) return;
  const double spring = stiffness(atom->type[i], type_j, dembark::reduced(atom->radius[i], radius_j), own, overlap);
  run_.monitor.take_contact(own, spring, update->dt, long(atom->tag[i]), j < 0 ? dembark::monitor_wall : long(atom->tag[j]));
}

void MonitorFix::take_pairs() {
  const NeighList* const list = pairs();
  for (int ii = 0; list && ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    for (int k = 0; k < list->numneigh[i]; ++k) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      const Vec3<double> apart = vector(atom->x[i]) - vector(atom->x[j]);
      const double reach = atom->radius[i] + atom->radius[j], squared = dot(apart, apart);
      if (squared < reach * reach && ((atom->mask[i] | atom->mask[j]) & groupbit))
        take_contact(i, j, atom->radius[j], atom->type[j], reach - std::sqrt(squared));
    }
  }
}

void MonitorFix::pre_force(int) {
  const long n = long(update->ntimestep);
  run_.shadows.follow(update->dt, run_.monitor, [this](const ShadowImpact& shadow) {
    const int i = atom->map(tagint(shadow.one)), j = atom->map(tagint(shadow.two));
    dembark::ShadowImpacts::Meeting now;
    now.here = i >= 0 && i < atom->nlocal;
    now.judged = now.here && j >= 0 && weight(i, j, now.gravity);
    if (now.judged) now.bodies = bodies(i, j);
    return now;
  });
  // Atoms have changed their ranks.
  if (neighbor->ago == 0 || run_.monitor.settings.samples(n)) drop_impacts();
  if (run_.monitor.settings.samples(n)) begin_impacts(n);
}

/// m/s^2. False where it is not the same for both.
bool MonitorFix::weight(int i, int j, Vec3<double>& acceleration) const {
  acceleration = {};
  for (const Gravity& gravity : gravities_) {
    const bool acts = atom->mask[i] & gravity.group;
    if (acts != bool(atom->mask[j] & gravity.group)) return false;
    if (acts) acceleration += gravity.acceleration();
  }
  return true;
}

dembark::ContactBodies MonitorFix::bodies(int i, int j) const {
  double apart[3];
  for (int k = 0; k < 3; ++k) apart[k] = atom->x[i][k] - atom->x[j][k];
  nearest_image(apart);
  return grain_pair(*atom, i, j, vector(apart), mass(i), mass(j));
}

/// Collective. Of pairs that two ranks have, the one that owns the lower number takes the impact.
void MonitorFix::begin_impacts(long n) {
  std::vector<ShadowImpact> mine;
  const NeighList* const list = pairs();
  for (int ii = 0; list && ii < list->inum; ++ii)
    for (int k = 0; k < list->numneigh[list->ilist[ii]]; ++k) {
      int i = list->ilist[ii], j = list->firstneigh[i][k] & NEIGHMASK;
      if (atom->tag[j] < atom->tag[i]) std::swap(i, j);
      if (i >= atom->nlocal || !(atom->mask[i] & atom->mask[j] & groupbit)) continue;
      const Vec3<double> apart = vector(atom->x[i]) - vector(atom->x[j]);
      const double reach = atom->radius[i] + atom->radius[j];
      const long one = long(atom->tag[i]), two = long(atom->tag[j]);
      Vec3<double> gravity;
      if (dot(apart, apart) >= reach * reach || !weight(i, j, gravity) || !dembark::picked(one, two, n, run_.impacts)) continue;
      ShadowImpact shadow;
      if (shadow.begin(parameters(atom->type[i], atom->type[j]), bodies(i, j), one, two, update->dt, {inertia(i), inertia(j)}))
        mine.push_back(shadow);
    }
  const int own = int(mine.size() * sizeof(ShadowImpact));
  std::vector<int> counts(std::size_t(comm->nprocs), 0), offsets(std::size_t(comm -> nprocs), 0);
  MPI_Allgather(&own, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (std::size_t r = 1; r < counts.size(); ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<ShadowImpact> all(std::size_t(offsets.back() + counts.back()) / sizeof(ShadowImpact));
  if (all.empty()) return;
  MPI_Allgatherv(mine.data(), own, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE, world);
  run_.shadows.add(all);
}

/// Those that have ended on any rank. Collective.
void MonitorFix::drop_impacts() {
  std::vector<int>& over = run_.shadows.over;
  if (over.empty()) return;
  MPI_Allreduce(MPI_IN_PLACE, over.data(), int(over.size()), MPI_INT, MPI_MAX, world);
  run_.shadows.drop();
}

/// Accelerations of steps of another length are no history.
void MonitorFix::take_step() {
  if (update->dt == run_.step()) return;
  set_time_step(run_.step());
  clear_histories();
}

/// Collective.
double MonitorFix::compute_vector(int n) {
  if (n != MonitorRun::energy_error) return run_.figure(n, long(update->ntimestep));
  if (!account_) return 0.0;
  const double step_error = account_->compute_vector(EnergyAccountFix::place("step_error"));
  const double turned_over = account_->compute_vector(EnergyAccountFix::place("scale"));
  return turned_over > 0.0 ? step_error / turned_over : 0.0;
}

/// Collective.
void MonitorFix::write_restart(FILE* file) {
  drop_impacts();
  const MonitorRun::State mine = run_.state();
  std::vector<MonitorRun::State> all(std::size_t(comm->nprocs), MonitorRun::State{});
  MPI_Gather(&mine, int(sizeof mine), MPI_BYTE, all.data(), int(sizeof mine), MPI_BYTE, 0, world);
  if (comm->me != 0) return;
  const std::vector<double> saved = run_.saved(all);
  write_part(file, {{saved.data(), saved.size() * sizeof(double)}});
}

void MonitorFix::restart(char* buffer) {
  checked([&] { run_.restore(SavedPart(buffer).rest<double>(), comm->me, comm->nprocs); });
}

}  // namespace dembark_family
