#include "fix_energy_account.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "atom.h"
#include "domain.h"
#include "error.h"
#include "fix_gravity.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::contact_part_count;

namespace {

typedef dembark::Vec3<double> Vec3;

// Sums over the same atoms in another order differ by less.
constexpr double round_off = 1e-14;

Vec3 vector(const double *v) { return {v[0], v[1], v[2]}; }

}  // namespace

FixEnergyAccount::FixEnergyAccount(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg) {
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k] != this && std::strcmp(modify->fix[k]->style, style) == 0 && std::strcmp(modify->fix[k]->id, id) != 0)
      refuse("there can be one such fix only, and there is fix " + std::string(modify->fix[k]->id));
  if (std::strcmp(arg[1], "all") != 0) refuse("the group must be 'all': each contact has two sides");
  if (narg > 3) refuse("it has no keywords, and there is '" + std::string(arg[3]) + "'");
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = 17;
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
}

void *FixEnergyAccount::extract(const char *name, int &) {
  return std::strcmp(name, dembark_liggghts::energy_books_name) == 0 ? &books_ : nullptr;
}

/// Driven grains are to the others what walls are.
bool FixEnergyAccount::follows_forces(int i) const { return (atom->mask[i] & moving_) && !(atom->mask[i] & frozen_); }

/// Moment of inertia over m r^2, as in fix nve/sphere.
double FixEnergyAccount::shape() const { return domain->dimension == 2 ? 0.5 : 0.4; }

/// J, of this rank's grains that follow their forces. In long double, so that the order of the atoms does not show.
double FixEnergyAccount::kinetic() const {
  const double c = shape();
  long double sum = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!follows_forces(i)) continue;
    const Vec3 v = vector(atom->v[i]), spin = vector(atom->omega[i]);
    sum += 0.5 * atom->rmass[i] * (dot(v, v) + c * atom->radius[i] * atom->radius[i] * dot(spin, spin));
  }
  return double(sum);
}

/// P and Q of the whole forces.
void FixEnergyAccount::measure_all_forces(double &power, double &rate) const {
  const double c = shape();
  power = rate = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!follows_forces(i)) continue;
    const Vec3 force = vector(atom->f[i]), torque = vector(atom->torque[i]);
    const double mass = atom->rmass[i], inertia = c * mass * atom->radius[i] * atom->radius[i];
    power += dot(force, vector(atom->v[i])) + dot(torque, vector(atom->omega[i]));
    rate += dot(force, force) / mass + dot(torque, torque) / inertia;
  }
}

/// P and Q of all forces as they are, with the velocities as they are.
void FixEnergyAccount::measure_powers() {
  if (books_.size() != std::size_t(atom->nlocal))
    error->one(FLERR, "Fix energy/account: atoms came or went between the forces and the end of a step");
  const double c = shape();
  std::vector<Vec3> weights(gravities_.size());
  for (std::size_t g = 0; g < gravities_.size(); ++g) {
    double acceleration[3];
    gravities_[g]->get_gravity(acceleration);
    weights[g] = vector(acceleration);
  }
  Works power{}, rate{};
  for (int i = 0; i < atom->nlocal; ++i) {
    const dembark_liggghts::EnergyBooks::Loads &loads = books_.of(i);
    const Vec3 v = vector(atom->v[i]), spin = vector(atom->omega[i]);
    if (!follows_forces(i)) {
      for (std::size_t p = 0; p < contact_part_count; ++p) {
        const double taken = dot(loads[p].force, v) + dot(loads[p].torque, spin);
        power[p] += taken;
        power[walls] -= taken;
      }
      continue;
    }
    const double mass = atom->rmass[i], inertia = c * mass * atom->radius[i] * atom->radius[i];
    const Vec3 push = vector(atom->f[i]) * (1.0 / mass), turn = vector(atom->torque[i]) * (1.0 / inertia);
    for (std::size_t p = 0; p < contact_part_count; ++p) {
      power[p] += dot(loads[p].force, v) + dot(loads[p].torque, spin);
      rate[p] += dot(loads[p].force, push) + dot(loads[p].torque, turn);
    }
    for (std::size_t g = 0; g < gravities_.size(); ++g) {
      if (!(atom->mask[i] & gravities_[g]->groupbit)) continue;
      power[gravity] += mass * dot(weights[g], v);
      rate[gravity] += mass * dot(weights[g], push);
    }
  }
  measure_all_forces(power[all_forces], rate[all_forces]);
  for (std::size_t p = 0; p < contact_part_count; ++p) {
    power[p] -= books_.wall_power[p];
    power[walls] += books_.wall_power[p];
  }
  now_.power = power;
  now_.rate = rate;
}

/// The kick that ended with the velocities of the powers (sign -1), or that begins with them (1).
void FixEnergyAccount::kick(double sign) {
  const double half = 0.5 * update->dt, square = sign * 0.5 * half * half;
  for (std::size_t k = 0; k < works; ++k) now_.work[k] += half * now_.power[k] + square * now_.rate[k];
}

/// Adds a change (J) to a sum unless it is none but that of the order of summation. Collective.
void FixEnergyAccount::impose(double change, double of, double &sum) const {
  const double mine[] = {change, of};
  double all[2];
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  if (std::abs(all[0]) > round_off * std::abs(all[1])) sum += change;
}

/// What the input script changed before the run: velocities, or the overlaps of contacts. Collective.
void FixEnergyAccount::take_setup(State &state, bool &begun) const {
  const double kinetic_now = kinetic();
  if (begun) {
    impose(kinetic_now - state.kinetic, kinetic_now + state.kinetic, state.imposed);
    impose(books_.normal_stored - state.normal_stored, books_.normal_stored + state.normal_stored, state.first_stored);
  } else {
    state.first_kinetic = kinetic_now;
    state.first_stored = books_.normal_stored;
  }
  begun = true;
  state.kinetic = kinetic_now;
  state.normal_stored = books_.normal_stored;
  state.tangential_stored = books_.tangential_stored;
}

void FixEnergyAccount::setup_pre_force(int) {
  books_.clear(atom->nlocal);
  fresh_ = true;
  totalled_ = false;
}

/// What was changed since the velocities were last looked at, but by no force.
void FixEnergyAccount::note_changes() {
  const double kinetic_now = kinetic();
  now_.imposed += kinetic_now - now_.kinetic;
  now_.kinetic = kinetic_now;
}

void FixEnergyAccount::pre_initial_integrate() {
  double power, rate;
  measure_all_forces(power, rate);
  int same = power == now_.power[all_forces] && rate == now_.rate[all_forces];
  if (!fresh_) {
    note_changes();
    if (!same) measure_powers();
    return;
  }
  take_setup(now_, begun_);
  if (resumed_) {
    // The forces may have been put back to those of the restart file after the set-up; then its powers hold, whatever was booked since.
    int all = 0;
    MPI_Allreduce(&same, &all, 1, MPI_INT, MPI_MIN, world);
    resumed_ = all;
  }
  if (!resumed_) measure_powers();
  fresh_ = resumed_ = false;
}

void FixEnergyAccount::post_integrate() {
  kick(1.0);
  kinetic_before_ = kinetic();
}

void FixEnergyAccount::pre_force(int) {
  if (neighbor->ago == 0) {
    const double kinetic_now = kinetic();
    impose(kinetic_now - kinetic_before_, kinetic_now + kinetic_before_, now_.imposed);
  }
  books_.clear(atom->nlocal);
}

/// The grains have got their velocities: init() has seen to the order.
void FixEnergyAccount::final_integrate() {
  measure_powers();
  kick(-1.0);
  now_.kinetic = kinetic();
}

void FixEnergyAccount::end_of_step() {
  note_changes();
  now_.normal_stored = books_.normal_stored;
  now_.tangential_stored = books_.tangential_stored;
  shown_ = now_;
  totalled_ = false;
}

/// Of all ranks.
const std::array<double, FixEnergyAccount::state_size> &FixEnergyAccount::totals() {
  if (totalled_) return totals_;
  State mine = shown_;
  if (fresh_) {
    mine = now_;
    bool begun = begun_;
    take_setup(mine, begun);
  }
  MPI_Allreduce(&mine, totals_.data(), int(state_size), MPI_DOUBLE, MPI_SUM, world);
  totalled_ = !fresh_;
  return totals_;
}

double FixEnergyAccount::compute_vector(int n) {
  if (!begun_ && !fresh_) return 0.0;
  State all;
  std::memcpy(&all, totals().data(), sizeof all);
  double contacts = 0.0, sizes = 0.0;
  for (std::size_t k = 0; k < gravity; ++k) {
    contacts += all.work[k];
    sizes += std::abs(all.work[k]);
  }
  const double other = all.work[all_forces] - all.work[gravity] - contacts;
  const double balance = all.kinetic - all.first_kinetic - all.work[all_forces] - all.imposed;
  const double scale = all.first_kinetic + sizes + std::abs(all.work[gravity]) + std::abs(other) + std::abs(all.imposed);
  const double step_error = all.work[0] + all.normal_stored - all.first_stored;
  const double values[] = {all.kinetic, all.first_kinetic, all.work[gravity],     all.work[0],     all.work[1], all.work[2],
                           all.work[3], all.work[4],       all.work[5],           all.work[walls], other,       all.imposed,
                           balance,     all.normal_stored, all.tangential_stored, step_error,      scale};
  return values[n];
}

double FixEnergyAccount::memory_usage() { return double(books_.size() * sizeof(dembark_liggghts::EnergyBooks::Loads)); }
