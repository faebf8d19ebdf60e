#include "fix_energy_account.h"

#include <cmath>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include "fix_order.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::EnergyBody;
using dembark::EnergyLedger;
using dembark::Powers;

namespace {

// Sums over the same atoms in another order differ by less.
constexpr double round_off = 1e-14;

bool is(const Fix* fix, const char* style) { return std::strcmp(fix->style, style) == 0; }

dembark::Dofs dofs(const double* along, const double* about) { return {along[0], along[1], along[2], about[0], about[1], about[2]}; }

}  // namespace

dembark_lammps::EnergyTally* dembark_lammps::find_energy_tally(const Modify* modify) {
  const auto found = modify->get_fix_by_style("^energy/account$");
  return found.empty() ? nullptr : &static_cast<FixEnergyAccount*>(found.front())->tally;
}

FixEnergyAccount::FixEnergyAccount(LAMMPS* lmp, int narg, char** arg) : Fix(lmp, narg, arg) {
  for (const Fix* const other : modify->get_fix_by_style("^energy/account$"))
    if (other != this && std::strcmp(other->id, id) != 0)
      fail(std::string("there can be one such fix only, and there is fix ") + other->id);
  if (std::strcmp(arg[1], "all") != 0) fail("the group must be 'all': each contact has two sides");
  if (narg > 3) fail(std::string("it has no keywords, and there is '") + arg[3] + "'");
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = int(dembark::energy_names.size()) - 1;
  extvector = 1;
}

void FixEnergyAccount::fail(const std::string& what) const { error->all(FLERR, std::string("fix ") + id + " energy/account: " + what); }

int FixEnergyAccount::setmask() { return INITIAL_INTEGRATE | POST_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE | END_OF_STEP; }

void FixEnergyAccount::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0) fail("only run_style verlet is supported");
  check_forces();
  check_motion();
}

void FixEnergyAccount::check_forces() const {
  if (force->newton_pair) fail("newton must be off: each rank tallies for the grains that it owns");
  if (force->ftm2v != 1.0 || force->mvv2e != 1.0 || force->nktv2p != 1.0) fail("units must be si or cgs");
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag) fail("it accounts for spheres only: atom_style sphere");
  if (!dynamic_cast<PairDembarkGranular*>(force->pair))
    fail("the parts of the contact forces are known of pair_style dembark/granular only");
  for (const Fix* const wall : modify->get_fix_by_style("^wall/gran"))
    fail(std::string("the parts of the contact forces are known of fix wall/dembark only, and there is fix ") + wall->id + " (" +
         wall->style + ")");
}

void FixEnergyAccount::check_motion() {
  moving_ = turning_ = frozen_ = 0;
  gravities_.clear();
  std::vector<const Fix*> movers;
  bool before = true;
  for (int k = 0; k < modify->nfix; ++k) {
    Fix* const fix = modify->fix[k];
    before = before && fix != this;
    const std::string named = std::string("fix ") + fix->id + " (" + fix->style + ")";
    if (fix->rigid_flag) fail("it accounts for single grains, and " + named + " moves bodies made of several");
    if (is(fix, "gravity")) {
      int dimension = 0;
      const void* const acceleration = fix->extract("gvec", dimension);
      if (!acceleration) fail(named + " does not tell its acceleration");
      gravities_.emplace_back(fix->groupbit, static_cast<const double*>(acceleration));
    }
    if (is(fix, "freeze")) frozen_ |= fix->groupbit;
    if (!fix->time_integrate) continue;
    const bool turns = is(fix, "nve/sphere");
    if (turns || is(fix, "nve")) {
      moving_ |= fix->groupbit;
      if (turns) turning_ |= fix->groupbit;
      if (!before) fail("it must come after " + named + ", which changes the velocities");
    } else if (!is(fix, "move") && !is(fix, "nve/noforce"))
      fail(named + " moves atoms; only fix nve/sphere, fix nve, fix move and fix nve/noforce are accounted for");
    movers.push_back(fix);
  }
  if (!moving_) fail("no grain follows its forces: it needs fix nve/sphere, or fix nve for grains that do not turn");
  for (std::size_t m = 0; m < movers.size(); ++m)
    for (std::size_t k = 0; k < m; ++k)
      for (int i = 0; i < atom->nlocal; ++i)
        if (atom->mask[i] & movers[k]->groupbit && atom->mask[i] & movers[m]->groupbit)
          error->one(FLERR, "fix {} energy/account: atom {} is moved by both fix {} and fix {}; make their groups disjoint", id,
                     atom->tag[i], movers[k]->id, movers[m]->id);
}

/// Driven grains are to the others what walls are, and so is the spin of grains that do not turn.
inline dembark::BodyMotion FixEnergyAccount::motion(int i) const {
  // Moment of inertia as in fix nve/sphere.
  const double mass = atom->rmass[i], inertia = atom->mask[i] & turning_ ? 0.4 * mass * atom->radius[i] * atom->radius[i] : 0.0;
  dembark::BodyMotion grain;
  if ((atom->mask[i] & moving_) && !(atom->mask[i] & frozen_)) grain.mass = {mass, mass, mass, inertia, inertia, inertia};
  grain.velocity = dofs(atom->v[i], atom->omega[i]);
  return grain;
}

inline EnergyBody FixEnergyAccount::body(int i) const {
  EnergyBody grain{motion(i)};
  dembark::Dofs weight{};
  for (const auto& [group, acceleration] : gravities_)
    if (atom->mask[i] & group)
      for (std::size_t k = 0; k < 3; ++k) weight[k] += atom->rmass[i] * acceleration[k];
  grain.set_forces(dofs(atom->f[i], atom->torque[i]), weight);
  return grain;
}

/// J, of this rank's grains that follow their forces. In long double, so that the order of the atoms does not show.
double FixEnergyAccount::kinetic() const {
  long double sum = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) sum += motion(i).kinetic();
  return double(sum);
}

/// Powers of all forces as they are, with the velocities as they are.
void FixEnergyAccount::measure_powers() {
  if (tally.loads.size() != std::size_t(atom->nlocal))
    error->one(FLERR, "fix energy/account: atoms came or went between the forces and the end of a step");
  now_.now = Powers();
  for (int i = 0; i < atom->nlocal; ++i) {
    const EnergyBody grain = body(i);
    now_.now.add_body(grain);
    now_.now.add_loads(grain, tally.loads[std::size_t(i)]);
  }
  for (std::size_t part = 0; part < dembark::contact_part_count; ++part) {
    now_.now.power[part] -= tally.wall_power[part];
    now_.now.power[Powers::walls] += tally.wall_power[part];
    now_.now.rate[part] -= tally.wall_rate[part];
    now_.now.rate[Powers::walls] += tally.wall_rate[part];
  }
}

/// Adds a change (J) to a sum unless it is none but that of the order of summation. Collective.
void FixEnergyAccount::impose(double change, double of, double& sum) const {
  const double mine[] = {change, of};
  double all[2];
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  if (std::abs(all[0]) > round_off * std::abs(all[1])) sum += change;
}

/// The sums with what the script changed before the run: velocities, or the overlaps of contacts. Collective.
EnergyLedger FixEnergyAccount::with_setup() const {
  EnergyLedger ledger = now_;
  ledger.kinetic = kinetic();
  ledger.set_stored(tally.normal_stored, tally.tangential_stored, tally.rolling_stored);
  if (begun_) {
    impose(ledger.kinetic - now_.kinetic, ledger.kinetic + now_.kinetic, ledger.imposed);
    impose(ledger.normal_stored - now_.normal_stored, ledger.normal_stored + now_.normal_stored, ledger.first_stored);
  } else {
    ledger.first_kinetic = ledger.kinetic;
    ledger.first_stored = ledger.normal_stored;
  }
  return ledger;
}

void FixEnergyAccount::setup_pre_force(int) {
  tally.clear(atom->nlocal);
  fresh_ = true;
}

void FixEnergyAccount::setup(int) { dembark_lammps::begin_steps_first(modify, this); }

/// What was changed since the velocities were last looked at, but by no force.
void FixEnergyAccount::note_changes() {
  const double kinetic_now = kinetic();
  now_.imposed += kinetic_now - now_.kinetic;
  now_.kinetic = kinetic_now;
}

/// Before anything of the step.
void FixEnergyAccount::initial_integrate(int) {
  Powers forces;
  for (int i = 0; i < atom->nlocal; ++i) forces.add_forces(motion(i), dofs(atom->f[i], atom->torque[i]));
  int same = forces.power[Powers::all] == now_.now.power[Powers::all] && forces.rate[Powers::all] == now_.now.rate[Powers::all];
  if (fresh_) {
    now_ = with_setup();
    // The forces may have been put back to those of the restart file after the set-up; then its powers hold, whatever was tallied since.
    same = same && resumed_;
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, world);
    begun_ = true;
    fresh_ = resumed_ = false;
  } else {
    note_changes();
  }
  if (!same) measure_powers();
}

void FixEnergyAccount::post_integrate() {
  now_.kick(0.5 * update->dt, 1);
  kinetic_before_ = kinetic();
}

void FixEnergyAccount::pre_force(int) {
  if (neighbor->ago == 0) {
    const double kinetic_now = kinetic();
    impose(kinetic_now - kinetic_before_, kinetic_now + kinetic_before_, now_.imposed);
  }
  tally.clear(atom->nlocal);
}

/// The grains have got their velocities: init() has seen to the order.
void FixEnergyAccount::final_integrate() {
  measure_powers();
  now_.kick(0.5 * update->dt, -1);
  now_.kinetic = kinetic();
}

void FixEnergyAccount::end_of_step() {
  note_changes();
  now_.set_stored(tally.normal_stored, tally.tangential_stored, tally.rolling_stored);
  shown_ = now_;
}

/// The energies in their order, without numerical damping, which LAMMPS has not. Collective.
double FixEnergyAccount::compute_vector(int n) {
  constexpr int numerical_damping = 4 + int(dembark::force_part_count);
  if (!begun_ && !fresh_) return 0.0;
  const EnergyLedger mine = fresh_ ? with_setup() : shown_;
  EnergyLedger all;
  MPI_Allreduce(&mine, &all, int(dembark::energy_ledger_size), MPI_DOUBLE, MPI_SUM, world);
  return all.energies()[std::size_t(n < numerical_damping ? n : n + 1)];
}

/// Collective. The sums of each rank by themselves: added up otherwise, they would round otherwise.
void FixEnergyAccount::write_restart(FILE* file) {
  const int ranks = comm->nprocs, size = int(dembark::energy_ledger_size);
  std::vector<double> all(comm->me == 0 ? std::size_t(ranks) * dembark::energy_ledger_size : 0);
  MPI_Gather(&now_, size, MPI_DOUBLE, all.data(), size, MPI_DOUBLE, 0, world);
  if (comm->me != 0) return;
  const double head[] = {double(begun_), double(ranks)};
  const int bytes = int(sizeof head + all.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(head, sizeof head, 1, file);
  fwrite(all.data(), sizeof(double), all.size(), file);
}

/// On another number of ranks the first has the sums of all.
void FixEnergyAccount::restart(char* buffer) {
  double head[2];
  std::memcpy(head, buffer, sizeof head);
  begun_ = head[0] != 0.0;
  const int ranks = int(head[1]);
  resumed_ = ranks == comm->nprocs;
  std::vector<double> saved(std::size_t(ranks) * dembark::energy_ledger_size);
  std::memcpy(saved.data(), buffer + sizeof head, saved.size() * sizeof(double));
  std::array<double, dembark::energy_ledger_size> sum{};
  for (std::size_t k = 0; k < saved.size(); ++k)
    if (const int rank = int(k / sum.size()); resumed_ ? rank == comm->me : comm->me == 0) sum[k % sum.size()] += saved[k];
  std::memcpy(static_cast<void*>(&now_), sum.data(), sizeof now_);
  shown_ = now_;
}

double FixEnergyAccount::memory_usage() { return double(tally.loads.size() * sizeof tally.loads[0]); }
