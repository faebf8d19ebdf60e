#include "fix_integration_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "output.h"
#include "update.h"

#include "contact_call.h"
#include "fix_energy_account.h"
#include "fix_wall_dembark.h"
#include "lammps_release.h"
#include "nve_sphere.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::AccelerationHistory;
using dembark::MonitorAction;
using dembark::MonitorRun;
using dembark::ShadowImpact;
using dembark_lammps::vector;

namespace {

constexpr int numbers = dembark::monitor_history_numbers;

bool is(const Fix* fix, const char* style) { return std::strcmp(fix->style, style) == 0; }

}  // namespace

FixIntegrationMonitor::FixIntegrationMonitor(LAMMPS* lmp, int narg, char** arg)
    : Fix(lmp, narg, arg), run_(read({arg + std::min(3, narg), arg + narg})), monitor_(run_.monitor) {
  for (const Fix* const other : modify->get_fix_by_style("^integration/monitor$"))
    if (other != this && std::strcmp(other->id, id) != 0)
      fail(std::string("there can be one such fix only, and there is fix ") + other->id);
  restart_global = restart_peratom = create_attribute = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = MonitorRun::figures;
  extvector = 0;
  maxexchange = numbers;
  FixIntegrationMonitor::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
  for (int i = 0; i < atom->nlocal; ++i) FixIntegrationMonitor::set_arrays(i);
}

FixIntegrationMonitor::~FixIntegrationMonitor() {
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  memory->destroy(histories_);
}

void FixIntegrationMonitor::fail(const std::string& what) const {
  error->all(FLERR, std::string("fix ") + id + " integration/monitor: " + what);
}

MonitorRun FixIntegrationMonitor::read(const std::vector<std::string>& words) const {
  std::string told;
  try {
    return MonitorRun(words, world);
  } catch (const std::invalid_argument& wrong) {
    told = wrong.what();
  }
  fail(told);
}

int FixIntegrationMonitor::setmask() { return END_OF_STEP | (run_.impacts > 0 ? PRE_FORCE : 0); }

void FixIntegrationMonitor::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0) fail("only run_style verlet is supported");
  if (force->ftm2v != 1.0 || force->mvv2e != 1.0) fail("units must be si or cgs");
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag) fail("it judges spheres only: atom_style sphere");
  check_motion();
  check_contacts();
  const auto accounts = modify->get_fix_by_style("^energy/account$");
  account_ = accounts.empty() ? nullptr : static_cast<FixEnergyAccount*>(accounts.front());
  if (run_.mean_length) {
    double sum = 0.0, count = 0.0;
    for (int i = 0; i < atom->nlocal; ++i)
      if (atom->mask[i] & groupbit) {
        sum += 2.0 * atom->radius[i];
        count += 1.0;
      }
    if (!run_.measure_length(sum, count)) fail("there are no grains yet whose mean diameter could be taken; give 'length L' (m)");
  }
  run_.begin(update->dt, long(update->ntimestep));
  take_step();
}

void FixIntegrationMonitor::check_motion() {
  movers_ = frozen_ = 0;
  moving_.clear();
  gravities_.clear();
  for (int k = 0; k < modify->nfix; ++k) {
    Fix* const fix = modify->fix[k];
    if (fix->rigid_flag)
      fail(std::string("it judges single grains, and fix ") + fix->id + " (" + fix->style + ") moves bodies made of several");
    if (is(fix, "gravity")) {
      int dimension = 0;
      const void* const acceleration = fix->extract("gvec", dimension);
      if (!acceleration) fail(std::string("fix ") + fix->id + " (gravity) does not tell its acceleration");
      gravities_.emplace_back(fix->groupbit, static_cast<const double*>(acceleration));
    }
    if (is(fix, "freeze")) frozen_ |= fix->groupbit;
    if (is(fix, "nve/sphere")) moving_.emplace_back(fix->groupbit, static_cast<const dembark_lammps::NveSphere*>(fix)->inertia);
    if (is(fix, "nve")) moving_.emplace_back(fix->groupbit, INFINITY);  // its grains do not turn
  }
  if (moving_.empty()) fail("no grain follows its forces: it needs fix nve/sphere");
  for (const auto& [group, inertia] : moving_) movers_ |= group;
}

/// Without a pair style, or with one that only makes lists, there are no contacts to judge.
void FixIntegrationMonitor::check_contacts() {
  pair_ = dynamic_cast<PairDembarkGranular*>(force->pair);
  if (force->pair && !pair_ && std::strcmp(force->pair_style, "zero") != 0)
    fail("it knows the stiffness of pair_style dembark/granular only");
  walls_.clear();
  for (Fix* const wall : modify->get_fix_by_style("^wall/dembark$")) walls_.push_back(static_cast<FixWallDembark*>(wall));
  for (const Fix* const wall : modify->get_fix_by_style("^wall/gran"))
    fail(std::string("it knows the stiffness of fix wall/dembark only, and there is fix ") + wall->id + " (" + wall->style + ")");
  if (run_.impacts == 0) return;
  if (!pair_) fail("impacts are those of pair_style dembark/granular, which must come first");
  if (force->newton_pair) fail("impacts needs newton off: the rank that owns the grain with the lower number sees its impacts");
  if (atom->map_style == Atom::MAP_NONE) fail("impacts needs 'atom_modify map array'");
}

/// kg; infinite of grains that do not follow their forces.
double FixIntegrationMonitor::mass(int i) const {
  const int mask = atom->mask[i];
  return (mask & movers_) && !(mask & frozen_) ? atom->rmass[i] : INFINITY;
}

void FixIntegrationMonitor::end_of_step() {
  const long n = long(update->ntimestep);
  if (monitor_.settings.keeps(n)) take_bodies(n);
  if (monitor_.settings.samples(n)) {
    if (pair_) {
      take_pairs();
      take_walls();
    }
    for (const std::string& found : run_.new_findings(n, "atom")) {
      if (monitor_.settings.action == MonitorAction::stop) fail(found);
      if (comm->me == 0) error->warning(FLERR, "fix {} integration/monitor: {}", id, found);
    }
  }
  run_.end_step(n);
  take_step();
}

void FixIntegrationMonitor::take_bodies(long n) {
  double **const f = atom->f, **const torque = atom->torque;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit) || std::isinf(mass(i))) continue;
    const auto moved = std::find_if(moving_.begin(), moving_.end(), [&](const auto& group) { return atom->mask[i] & group.first; });
    const double radius = atom->radius[i], per_mass = 1.0 / atom->rmass[i], per_inertia = per_mass / (moved->second * radius * radius);
    AccelerationHistory history;
    std::memcpy(static_cast<void*>(&history), histories_[i], sizeof history);
    monitor_.take(history,
                  {f[i][0] * per_mass, f[i][1] * per_mass, f[i][2] * per_mass, torque[i][0] * per_inertia, torque[i][1] * per_inertia,
                   torque[i][2] * per_inertia},
                  radius, long(atom->tag[i]), n, update->dt);
    std::memcpy(histories_[i], &history, sizeof history);
  }
}

/// `radius_j` infinite: a wall.
void FixIntegrationMonitor::take_contact(int i, int j, double radius_j, int type_j, double overlap) {
  const double own = dembark::reduced(mass(i), j < 0 ? INFINITY : mass(j));
  if (std::isinf(own)) return;
  const dembark::ContactParameters& p = pair_->coefficients()(atom->type[i], type_j);
  const double stiffness = p.respond(dembark::reduced(atom->radius[i], radius_j), own, overlap, 0.0).normal_stiffness;
  monitor_.take_contact(own, stiffness, update->dt, long(atom->tag[i]), j < 0 ? dembark::monitor_wall : long(atom->tag[j]));
}

void FixIntegrationMonitor::take_pairs() {
  const NeighList* const list = pair_->list;
  for (int ii = 0; list && ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    for (int k = 0; k < list->numneigh[i]; ++k) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      const dembark::Vec3<double> apart = vector(atom->x[i]) - vector(atom->x[j]);
      const double reach = atom->radius[i] + atom->radius[j], squared = dot(apart, apart);
      if (squared < reach * reach && ((atom->mask[i] | atom->mask[j]) & groupbit))
        take_contact(i, j, atom->radius[j], atom->type[j], reach - std::sqrt(squared));
    }
  }
}

void FixIntegrationMonitor::take_walls() {
  for (FixWallDembark* const wall : walls_)
    for (int i = 0; i < atom->nlocal; ++i)
      if (atom->mask[i] & wall->groupbit && atom->mask[i] & groupbit)
        for (const double overlap : wall->overlaps(i)) take_contact(i, -1, INFINITY, wall->type(), overlap);
}

/// Positions are of the step here and velocities of half a step before, of owned atoms as of their images on other ranks.
void FixIntegrationMonitor::pre_force(int) {
  const long n = long(update->ntimestep);
  run_.shadows.follow(update->dt, monitor_, [this](const ShadowImpact& shadow) {
    const int i = atom->map(tagint(shadow.one)), j = atom->map(tagint(shadow.two));
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
bool FixIntegrationMonitor::weight(int i, int j, dembark::Vec3<double>& acceleration) const {
  acceleration = {};
  for (const auto& [group, gravity] : gravities_) {
    const bool acts = atom->mask[i] & group;
    if (acts != bool(atom->mask[j] & group)) return false;
    if (acts) acceleration += vector(gravity);
  }
  return true;
}

dembark::ContactBodies FixIntegrationMonitor::bodies(int i, int j) const {
  dembark::ContactBodies b;
  double apart[3];
  for (int k = 0; k < 3; ++k) apart[k] = atom->x[i][k] - atom->x[j][k];
  dembark_lammps::nearest_image(domain, apart);
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
  const NeighList* const list = pair_->list;
  for (int ii = 0; list && ii < list->inum; ++ii)
    for (int k = 0; k < list->numneigh[list->ilist[ii]]; ++k) {
      int i = list->ilist[ii], j = list->firstneigh[i][k] & NEIGHMASK;
      if (atom->tag[j] < atom->tag[i]) std::swap(i, j);
      if (i >= atom->nlocal || !(atom->mask[i] & atom->mask[j] & groupbit)) continue;
      const dembark::Vec3<double> apart = vector(atom->x[i]) - vector(atom->x[j]);
      const double reach = atom->radius[i] + atom->radius[j];
      dembark::Vec3<double> gravity;
      if (dot(apart, apart) >= reach * reach || !weight(i, j, gravity) ||
          !dembark::picked(long(atom->tag[i]), long(atom->tag[j]), n, run_.impacts))
        continue;
      ShadowImpact shadow;
      if (shadow.begin(pair_->coefficients()(atom->type[i], atom->type[j]), bodies(i, j), long(atom->tag[i]), long(atom->tag[j]),
                       update->dt))
        mine.push_back(shadow);
    }
  run_.shadows.add(mine);
}

/// As `fix dt/reset` does it. Accelerations of steps of another length are no history.
void FixIntegrationMonitor::take_step() {
  if (update->dt == run_.step()) return;
  update->update_time();
  update->dt = run_.step();
  update->dt_default = 0;
  if (force->pair) force->pair->reset_dt();
  for (int k = 0; k < modify->nfix; ++k) modify->fix[k]->reset_dt();
  output->reset_dt();
  for (int i = 0; i < atom->nlocal; ++i) FixIntegrationMonitor::set_arrays(i);
}

/// Collective.
double FixIntegrationMonitor::compute_vector(int n) {
  if (n != MonitorRun::energy_error) return run_.figure(n, long(update->ntimestep));
  if (!account_) return 0.0;
  const double step_error = account_->compute_vector(15), turned_over = account_->compute_vector(16);
  return turned_over > 0.0 ? step_error / turned_over : 0.0;
}

/// Collective.
void FixIntegrationMonitor::write_restart(FILE* file) {
  const std::vector<double> saved = run_.saved();
  if (comm->me != 0) return;
  const int bytes = int(saved.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(saved.data(), sizeof(double), saved.size(), file);
}

void FixIntegrationMonitor::restart(char* buffer) { run_.restore(buffer); }

void FixIntegrationMonitor::grow_arrays(int count) { memory->grow(histories_, count, numbers, "integration/monitor:histories"); }

void FixIntegrationMonitor::copy_arrays(int from, int to, int) { std::copy_n(histories_[from], numbers, histories_[to]); }

void FixIntegrationMonitor::set_arrays(int i) { std::fill_n(histories_[i], numbers, 0.0); }

int FixIntegrationMonitor::pack_exchange(int i, double* buffer) {
  std::copy_n(histories_[i], numbers, buffer);
  return numbers;
}

int FixIntegrationMonitor::unpack_exchange(int i, double* buffer) {
  std::copy_n(buffer, numbers, histories_[i]);
  return numbers;
}

int FixIntegrationMonitor::pack_restart(int i, double* buffer) {
  buffer[0] = numbers + 1;
  std::copy_n(histories_[i], numbers, buffer + 1);
  return numbers + 1;
}

void FixIntegrationMonitor::unpack_restart(int i, int nth) {
  const double* values = atom->extra[i];
  for (int k = 0; k < nth; ++k) values += int(values[0]);
  std::copy_n(values + 1, numbers, histories_[i]);
}

double FixIntegrationMonitor::memory_usage() { return double(atom->nmax) * numbers * sizeof(double); }
