#include "energy_account_fix.h"

#include <array>
#include <cmath>
#include <cstring>

#include "neighbor.h"

using namespace LAMMPS_NS;
using dembark::EnergyBody;
using dembark::EnergyLedger;
using dembark::Powers;

namespace dembark_family {
namespace {

// Sums over the same atoms in another order differ by less.
constexpr double round_off = 1e-14;

dembark::SixVector six(const double* along, const double* about) { return {along[0], along[1], along[2], about[0], about[1], about[2]}; }

}  // namespace

EnergyAccountFix::EnergyAccountFix(LAMMPS* lmp, int narg, char** arg, dembark::ContactTally& tally)
    : GrainFix(lmp, narg, arg), tally_(tally) {
  only_one();
  if (std::strcmp(arg[1], "all") != 0) fail("the group must be 'all': each contact has two sides");
  if (narg > 3) fail(std::string("it has no keywords, and there is '") + arg[3] + "'");
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = int(dembark::energy_names.size()) - 1;
  extvector = 1;
}

void EnergyAccountFix::init() {
  only_verlet();
  if (force->newton_pair) fail("newton must be off: each rank tallies for the grains that it owns");
  only_coherent_units();
  only_constant_box("it accounts for works in");
  only_spheres("it accounts for");
  check_contacts();
  check_motion();
}

void EnergyAccountFix::check_motion() {
  find_movers("it accounts for");
  std::vector<const Fix*> movers;
  bool before = true;
  for (const Fix* const fix : fixes()) {
    before = before && fix != this;
    if (!fix->time_integrate) continue;
    const std::string named = std::string("fix ") + fix->id + " (" + fix->style + ")";
    if (is(*fix, "nve/sphere") || is(*fix, "nve")) {
      if (!before) fail("it must come after " + named + ", which changes the velocities");
    } else if (!is(*fix, "move") && !is(*fix, "nve/noforce"))
      fail(named + " moves atoms; only fix nve/sphere, fix nve, fix move and fix nve/noforce are accounted for");
    movers.push_back(fix);
  }
  want_movers();
  for (std::size_t m = 0; m < movers.size(); ++m)
    for (std::size_t k = 0; k < m; ++k)
      for (int i = 0; i < atom->nlocal; ++i)
        if (atom->mask[i] & movers[k]->groupbit && atom->mask[i] & movers[m]->groupbit)
          fail_alone("atom " + std::to_string(atom->tag[i]) + " is moved by both fix " + movers[k]->id + " and fix " + movers[m]->id +
                     "; make their groups disjoint");
}

/// Driven grains are to the others what walls are, and so is the spin of grains that do not turn.
inline dembark::BodyMotion EnergyAccountFix::motion(int i) const {
  dembark::BodyMotion grain;
  if (follows_forces(i)) {
    const double mass = atom->rmass[i], inertial = inertia(i) * mass * atom->radius[i] * atom->radius[i];
    grain.mass = {mass, mass, mass, inertial, inertial, inertial};
  }
  grain.velocity = six(atom->v[i], atom->omega[i]);
  return grain;
}

inline EnergyBody EnergyAccountFix::body(int i) const {
  EnergyBody grain{motion(i)};
  dembark::Vec3<double> weight;
  for (const auto& [group, acceleration] : gravity_accelerations_)
    if (atom->mask[i] & group) weight += atom->rmass[i] * acceleration;
  grain.set_forces(six(atom->f[i], atom->torque[i]), dembark::six_vector(weight, {}));
  return grain;
}

/// J, of this rank's grains that follow their forces. In long double, so that the order of the atoms does not show.
double EnergyAccountFix::kinetic() const {
  long double sum = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) sum += motion(i).kinetic();
  return double(sum);
}

/// Powers of all forces as they are, with the velocities as they are.
void EnergyAccountFix::measure_powers() {
  if (const std::size_t before = tally_.loads.size(); before != std::size_t(atom->nlocal))
    fail_alone("in step " + std::to_string(update->ntimestep) + " a rank had " + std::to_string(before) +
               " atoms when forces were computed and " + std::to_string(atom->nlocal) +
               " after it; create and delete atoms between runs, or by fixes that do so before the forces of a step");
  now_.now = Powers();
  gravity_accelerations_.clear();
  for (const Gravity& gravity : gravities_) gravity_accelerations_.emplace_back(gravity.group, gravity.acceleration());
  for (int i = 0; i < atom->nlocal; ++i) {
    const EnergyBody grain = body(i);
    now_.now.add_body(grain);
    now_.now.add_loads(grain, tally_.loads[std::size_t(i)], tally_.present);
  }
  tally_.add_walls(now_.now);
}

/// Adds a change (J) to a sum unless it is none but that of the order of summation. Collective.
void EnergyAccountFix::impose(double change, double of, double& sum) const {
  const double mine[] = {change, of};
  double all[2];
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  if (std::abs(all[0]) > round_off * std::abs(all[1])) sum += change;
}

/// The sums with what the script changed before the run: velocities, or the overlaps of contacts. Collective.
EnergyLedger EnergyAccountFix::with_setup() const {
  EnergyLedger ledger = now_;
  ledger.kinetic = kinetic();
  ledger.set_stored(tally_.normal_stored, tally_.tangential_stored, tally_.rolling_stored);
  if (begun_) {
    impose(ledger.kinetic - now_.kinetic, ledger.kinetic + now_.kinetic, ledger.imposed);
    impose(ledger.normal_stored - now_.normal_stored, ledger.normal_stored + now_.normal_stored, ledger.first_stored);
  } else {
    ledger.first_kinetic = ledger.kinetic;
    ledger.first_stored = ledger.normal_stored;
  }
  return ledger;
}

void EnergyAccountFix::setup_pre_force(int) {
  tally_.clear(atom->nlocal, update->dt);
  fresh_ = true;
}

/// What was changed since the velocities were last looked at, but by no force.
void EnergyAccountFix::note_changes() {
  const double kinetic_now = kinetic();
  now_.imposed += kinetic_now - now_.kinetic;
  now_.kinetic = kinetic_now;
}

void EnergyAccountFix::begin_step() {
  Powers forces;
  for (int i = 0; i < atom->nlocal; ++i) forces.add_forces(motion(i), six(atom->f[i], atom->torque[i]));
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

void EnergyAccountFix::post_integrate() {
  now_.kick(0.5 * update->dt, 1);
  kinetic_before_ = kinetic();
}

void EnergyAccountFix::pre_force(int) {
  if (neighbor->ago == 0) {
    const double kinetic_now = kinetic();
    impose(kinetic_now - kinetic_before_, kinetic_now + kinetic_before_, now_.imposed);
  }
  tally_.clear(atom->nlocal, update->dt);
}

/// The grains have got their velocities: init() has seen to the order.
void EnergyAccountFix::final_integrate() {
  measure_powers();
  now_.kick(0.5 * update->dt, -1);
  now_.kinetic = kinetic();
}

void EnergyAccountFix::end_of_step() {
  note_changes();
  now_.set_stored(tally_.normal_stored, tally_.tangential_stored, tally_.rolling_stored);
  shown_ = now_;
}

/// Collective.
double EnergyAccountFix::compute_vector(int n) {
  if (!begun_ && !fresh_) return 0.0;
  const EnergyLedger mine = fresh_ ? with_setup() : shown_;
  EnergyLedger all;
  MPI_Allreduce(&mine, &all, int(dembark::energy_ledger_size), MPI_DOUBLE, MPI_SUM, world);
  return all.energies()[std::size_t(n < place("numerical_damping") ? n : n + 1)];
}

/// Collective. The sums of each rank by themselves: added up otherwise, they would round otherwise.
void EnergyAccountFix::write_restart(FILE* file) {
  constexpr int size = int(dembark::energy_ledger_size);
  std::vector<double> all(comm->me == 0 ? std::size_t(comm->nprocs) * dembark::energy_ledger_size : 0);
  MPI_Gather(&now_, size, MPI_DOUBLE, all.data(), size, MPI_DOUBLE, 0, world);
  if (comm->me != 0) return;
  const double head[] = {double(begun_), double(comm->nprocs)};
  write_part(file, {{head, sizeof head}, {all.data(), all.size() * sizeof(double)}});
}

/// On another number of ranks the first has the sums of all.
void EnergyAccountFix::restart(char* buffer) {
  constexpr std::size_t size = dembark::energy_ledger_size;
  std::vector<double> saved;
  checked([&] {
    SavedPart part(buffer);
    double head[2];
    part.read(head, 2);
    begun_ = head[0] != 0.0;
    resumed_ = int(head[1]) == comm->nprocs;
    saved.resize(std::size_t(head[1]) * size);
    part.read(saved.data(), saved.size());
    part.end();
  });
  std::array<double, size> sum{};
  for (std::size_t k = 0; k < saved.size(); ++k)
    if (const int rank = int(k / size); resumed_ ? rank == comm->me : comm->me == 0) sum[k % size] += saved[k];
  std::memcpy(static_cast<void*>(&now_), sum.data(), sizeof now_);
  shown_ = now_;
}

double EnergyAccountFix::memory_usage() { return double(tally_.loads.size() * sizeof tally_.loads[0]); }

}  // namespace dembark_family
