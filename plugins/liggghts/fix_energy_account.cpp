#include "fix_energy_account.h"

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_gravity.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "fix_wall_motion.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::EnergyBody;
using dembark::EnergyLedger;
using dembark::Powers;

namespace {

// Sums over the same atoms in another order differ by less.
constexpr double round_off = 1e-14;

/// Which model of a pair style or a wall has no parts that are known, or nothing.
template <class Host>
std::string unknown_model(Host &host) {
  if (!host.contact_match("tangential", "finnie_rabinowicz")) return "tangential finnie_rabinowicz";
  if (!host.contact_match("normal", "hertz") && !host.contact_match("normal", "hooke")) return "model hertz or hooke";
  if (!host.contact_match("surface", "default")) return "surface default";
  return "";
}

bool is(const Fix *fix, const char *style) { return std::strcmp(fix->style, style) == 0; }

dembark::Dofs dofs(const double *along, const double *about) { return {along[0], along[1], along[2], about[0], about[1], about[2]}; }

}  // namespace

FixEnergyAccount::FixEnergyAccount(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg) {
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k] != this && is(modify->fix[k], style) && std::strcmp(modify->fix[k]->id, id) != 0)
      refuse("there can be one such fix only, and there is fix " + std::string(modify->fix[k]->id));
  if (std::strcmp(arg[1], "all") != 0) refuse("the group must be 'all': each contact has two sides");
  if (narg > 3) refuse("it has no keywords, and there is '" + std::string(arg[3]) + "'");
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = int(dembark::energy_names.size()) - 1;
  extvector = 1;
}

void FixEnergyAccount::refuse(const std::string &what) {
  error->fix_error(FLERR, this, what.c_str());
  std::abort();  // fix_error() does not return
}

int FixEnergyAccount::setmask() { return PRE_INITIAL_INTEGRATE | POST_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE | END_OF_STEP; }

void FixEnergyAccount::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0) refuse("only run_style verlet is supported");
  check_models();
  check_motion();
  tally.driven.clear();
  for (int k = 0; k < modify->nfix; ++k)
    if (auto *const wall = dynamic_cast<FixWallMotion *>(modify->fix[k])) tally.driven.emplace_back(wall->mesh(), &wall->acceleration());
}

void FixEnergyAccount::check_models() {
  if (force->newton_pair) refuse("newton must be off: each rank tallies for the grains that it owns");
  if (force->ftm2v != 1.0 || force->mvv2e != 1.0 || force->nktv2p != 1.0) refuse("units must be si or cgs");
  if (!atom->sphere_flag || !atom->rmass || atom->superquadric_flag || atom->shapetype_flag)
    refuse("it accounts for spheres only: atom_style granular");
  PairGran *const pair = dynamic_cast<PairGran *>(force->pair);
  if (!pair) refuse("it needs pair_style gran model hertz|hooke tangential finnie_rabinowicz ...");
  const auto check = [this](const std::string &where, const std::string &missed) {
    if (!missed.empty()) refuse("the parts of the contact forces are known with " + missed + " only; " + where + " has another model");
  };
  check("the pair style", unknown_model(*pair));
  for (int k = 0; k < modify->nfix; ++k)
    if (FixWallGran *const wall = dynamic_cast<FixWallGran *>(modify->fix[k])) check("fix " + std::string(wall->id), unknown_model(*wall));
}

void FixEnergyAccount::check_motion() {
  moving_ = turning_ = frozen_ = 0;
  gravities_.clear();
  std::vector<Fix *> movers;
  for (int k = 0; k < modify->nfix; ++k) {
    Fix *const fix = modify->fix[k];
    const std::string named = "fix " + std::string(fix->id) + " (" + fix->style + ")";
    if (std::strncmp(fix->style, "rigid", 5) == 0 || std::strncmp(fix->style, "multisphere", 11) == 0)
      refuse("it accounts for single grains, and " + named + " moves bodies made of several");
    if (is(fix, "gravity")) gravities_.push_back(static_cast<FixGravity *>(fix));
    if (is(fix, "freeze")) frozen_ |= fix->groupbit;
    if (!fix->time_integrate) continue;
    const bool turns = is(fix, "nve/sphere");
    if (turns || is(fix, "nve")) {
      moving_ |= fix->groupbit;
      if (turns) turning_ |= fix->groupbit;
      if (k > modify->my_index(this)) refuse("it must come after " + named + ", which changes the velocities");
    } else if (!is(fix, "move") && !is(fix, "nve/noforce"))
      refuse(named + " moves atoms; only fix nve/sphere, fix nve, fix move and fix nve/noforce are accounted for");
    movers.push_back(fix);
  }
  if (!moving_) refuse("no grain follows its forces: it needs fix nve/sphere, or fix nve for grains that do not turn");
  for (std::size_t m = 0; m < movers.size(); ++m)
    for (std::size_t k = 0; k < m; ++k)
      for (int i = 0; i < atom->nlocal; ++i)
        if (atom->mask[i] & movers[k]->groupbit && atom->mask[i] & movers[m]->groupbit)
          error->one(FLERR, ("Fix energy/account (id " + std::string(id) + "): atom " + std::to_string(atom->tag[i]) +
                             " is moved by both fix " + movers[k]->id + " and fix " + movers[m]->id + "; make their groups disjoint")
                                .c_str());
}

/// Driven grains are to the others what walls are, and so is the spin of grains that do not turn.
inline dembark::BodyMotion FixEnergyAccount::motion(int i) const {
  // Moment of inertia as in fix nve/sphere.
  const double mass = atom->rmass[i];
  const double inertia = atom->mask[i] & turning_ ? (domain->dimension == 2 ? 0.5 : 0.4) * mass * atom->radius[i] * atom->radius[i] : 0.0;
  dembark::BodyMotion grain;
  if ((atom->mask[i] & moving_) && !(atom->mask[i] & frozen_)) grain.mass = {mass, mass, mass, inertia, inertia, inertia};
  grain.velocity = dofs(atom->v[i], atom->omega[i]);
  return grain;
}

inline EnergyBody FixEnergyAccount::body(int i) const {
  EnergyBody grain{motion(i)};
  dembark::Dofs weight{};
  for (std::size_t g = 0; g < gravities_.size(); ++g)
    if (atom->mask[i] & gravities_[g]->groupbit)
      for (int k = 0; k < 3; ++k) weight[k] += atom->rmass[i] * accelerations_[g][k];
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
    error->one(FLERR, "Fix energy/account: atoms came or went between the forces and the end of a step");
  now_.now = Powers();
  accelerations_.resize(gravities_.size());
  for (std::size_t g = 0; g < gravities_.size(); ++g) gravities_[g]->get_gravity(accelerations_[g].data());
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
void FixEnergyAccount::impose(double change, double of, double &sum) const {
  const double mine[] = {change, of};
  double all[2];
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  if (std::abs(all[0]) > round_off * std::abs(all[1])) sum += change;
}

/// The sums with what the input script changed before the run: velocities, or the overlaps of contacts. Collective.
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
  tally.clear(atom->nlocal, atom->x, update->dt);
  fresh_ = true;
}

/// What was changed since the velocities were last looked at, but by no force.
void FixEnergyAccount::note_changes() {
  const double kinetic_now = kinetic();
  now_.imposed += kinetic_now - now_.kinetic;
  now_.kinetic = kinetic_now;
}

void FixEnergyAccount::pre_initial_integrate() {
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
  tally.clear(atom->nlocal, atom->x, update->dt);
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

/// The energies in their order, without numerical damping, which LIGGGHTS has not. Collective.
double FixEnergyAccount::compute_vector(int n) {
  constexpr int numerical_damping = 4 + int(dembark::force_part_count);
  if (!begun_ && !fresh_) return 0.0;
  const EnergyLedger mine = fresh_ ? with_setup() : shown_;
  EnergyLedger all;
  MPI_Allreduce(&mine, &all, int(dembark::energy_ledger_size), MPI_DOUBLE, MPI_SUM, world);
  return all.energies()[n < numerical_damping ? n : n + 1];
}

/// Collective. The sums of each rank by themselves: added up otherwise, they would round otherwise.
void FixEnergyAccount::write_restart(FILE *file) {
  const int ranks = comm->nprocs;
  std::vector<double> all(comm->me == 0 ? std::size_t(ranks) * dembark::energy_ledger_size : 0);
  MPI_Gather(&now_, int(dembark::energy_ledger_size), MPI_DOUBLE, all.data(), int(dembark::energy_ledger_size), MPI_DOUBLE, 0, world);
  if (comm->me != 0) return;
  const double head[] = {double(begun_), double(ranks)};
  const int bytes = int(sizeof head + all.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(head, sizeof head, 1, file);
  fwrite(all.data(), sizeof(double), all.size(), file);
}

/// On another number of ranks the first has the sums of all.
void FixEnergyAccount::restart(char *buffer) {
  const double *const head = reinterpret_cast<double *>(buffer), *from = head + 2;
  begun_ = head[0] != 0.0;
  const int ranks = int(head[1]);
  resumed_ = ranks == comm->nprocs;
  std::array<double, dembark::energy_ledger_size> sum{};
  for (int r = 0; r < ranks; ++r)
    for (double &number : sum) {
      const double saved = *from++;
      if (resumed_ ? r == comm->me : comm->me == 0) number += saved;
    }
  std::memcpy(&now_, sum.data(), sizeof now_);
  shown_ = now_;
}

double FixEnergyAccount::memory_usage() { return double(tally.loads.size() * sizeof tally.loads[0]); }
