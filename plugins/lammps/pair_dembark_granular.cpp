#include "pair_dembark_granular.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <typeinfo>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"

#include "contact_call.h"
#include "double_contacts.h"
#include "engine_access.h"
#include "fix_capillary_liquid.h"

using namespace LAMMPS_NS;
using dembark::ContactBodies;
using dembark::ContactForce;
using dembark::ContactState;
using dembark_lammps::add;
using dembark_lammps::vector;

namespace {

constexpr const char* other_release =
    "is another one than in the releases of LAMMPS that dembark knows; take one that docs/how-to/lammps_build.md names";

}  // namespace

PairDembarkGranular::PairDembarkGranular(LAMMPS* lmp) : Pair(lmp), coefficients_(lmp) {
  single_enable = 1;
  restartinfo = 0;  // the script gives the coefficients again
  no_virial_fdotr_compute = 1;
  finitecutflag = 1;
  nondefault_history_transfer = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
  single_extra = single_numbers;
  svector = new double[single_numbers]();
  comm_forward = 1;
  // Restart files know histories by this name: it counts the styles that are there, not all that ever were.
  const auto taken = [this](const std::string& name) {
    const auto& fixes = modify->get_fix_list();
    return std::any_of(fixes.begin(), fixes.end(), [&](const Fix* fix) { return std::string(fix->id).rfind(name, 0) == 0; });
  };
  int number = 1;
  do history_name_ = "NEIGH_HISTORY_DEMBARK_" + std::to_string(number++) + "_";
  while (taken(history_name_));
  // Histories come before the fixes that the script defines: they are put in their place later, when their size is known.
  modify->add_fix(history_name_ + "PLACE all DUMMY", 0);
}

PairDembarkGranular::~PairDembarkGranular() {
  delete[] svector;
  if (modify->nfix) modify->delete_fix(history_ ? std::string(history_->id) : history_name_ + "PLACE");
  if (!allocated) return;
  memory->destroy(setflag);
  memory->destroy(cutsq);
}

void PairDembarkGranular::settings(int narg, char** arg) {
  coefficients_.settings(narg, arg);
  if (history_ && coefficients_.layout().code() != layout_.code())
    coefficients_.fail("other options than before need other histories; write 'pair_style none' first");
  layout_ = coefficients_.layout();
}

void PairDembarkGranular::coeff(int narg, char** arg) {
  if (!allocated) {
    const int rows = atom->ntypes + 1;
    allocated = 1;
    memory->create(setflag, rows, rows, "pair:setflag");
    memory->create(cutsq, rows, rows, "pair:cutsq");
    for (int i = 0; i < rows; ++i) std::fill_n(setflag[i], rows, 0);
  }
  for (const auto& [i, j] : coefficients_.coeff(narg, arg)) setflag[i][j] = 1;
}

void PairDembarkGranular::init_style() {
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    coefficients_.fail("the atoms need atom_style sphere");
  if (!comm->ghost_velocity) coefficients_.fail("ghost atoms need velocities: comm_modify vel yes");
  check_run();
  coefficients_.begin();
  neighbor->add_request(this, NeighConst::REQ_SIZE | NeighConst::REQ_HISTORY);
  if (!history_) {
    // Without the suffix of an accelerator: that fix would be of another class.
    Fix* const made = modify->replace_fix(history_name_ + "PLACE", history_name_ + history_fix(), 0);
    if (dembark_lammps::left_in_restart_file(modify, history_name_))
      coefficients_.fail(
          "the restart file has histories of contacts that were computed with other options; take the same options, or begin without "
          "histories: from a data file");
    if (!std::strstr(typeid(*made).name(), "FixNeighHistory")) coefficients_.fail("fix NEIGH_HISTORY " + std::string(other_release));
    history_ = static_cast<dembark_lammps::NeighborHistory*>(made);
    history_->pair = this;
  }
  // A bridge keeps its history over the gap.
  beyond_contact = coefficients_.holds();
  const auto freeze = modify->get_fix_by_style("^freeze");
  freeze_bit_ = freeze.empty() ? 0 : freeze.front()->groupbit;
  liquid_ = layout_.imbalance ? dembark_lammps::find_liquid(modify) : nullptr;
  if (layout_.imbalance && !liquid_) coefficients_.fail("carried_liquid on needs the liquid: fix ID all capillary/liquid content C");
  energies_ = dembark_lammps::find_energy_tally(modify);
  rigid_.clear();
  for (Fix* const fix : modify->get_fix_list())
    if (fix->rigid_flag) rigid_.push_back(fix);
  const dembark::ContactParameters& any = coefficients_(1, 1);
  // Lists of bonded atoms hold pairs that do not interact.
  packed_ = any.normal_law == dembark::NormalLaw::hertz && !any.cohesion.liquid.viscous.on() && asked() && atom->molecular == Atom::ATOMIC;
  const auto place = [](bool there, int at) { return there ? at : -1; };
  begin(*atom,
        {0, place(layout_.cohesion, layout_.cohesion_at()), place(layout_.rings, layout_.rings_at()),
         place(layout_.rolling, layout_.rolling_at()), layout_.imbalance_at()},
        freeze_bit_, liquid_, energies_);
  find_radii();
  history_->force_reneighbor = grains_grow_;
  history_->next_reneighbor = -1;
}

std::string PairDembarkGranular::history_fix() const {
  return "LAYOUT" + std::to_string(layout_.code()) + " all NEIGH_HISTORY " + std::to_string(layout_.size());
}

void PairDembarkGranular::check_run() {
  for (const std::string& wrong : {dembark_family::units_error(*force, *update), dembark_family::run_style_error(*update)})
    if (!wrong.empty()) coefficients_.fail(wrong);
  if (update->whichflag == 2)
    coefficients_.fail(
        "contacts have no energy that minimize could lower; let grains come to rest in a run, with fix viscous or nve/limit");
}

void PairDembarkGranular::find_radii() {
  largest_radius_.assign(std::size_t(atom->ntypes + 1), 0.0);
  const auto take = [this](int type, double radius) {
    double& largest = largest_radius_[std::size_t(type)];
    largest = std::max(largest, radius);
  };
  for (int i = 0; i < atom->nlocal; ++i) take(atom->type[i], atom->radius[i]);
  MPI_Allreduce(MPI_IN_PLACE, largest_radius_.data(), atom->ntypes + 1, MPI_DOUBLE, MPI_MAX, world);
  grains_grow_ = false;
  for (Fix* const fix : modify->get_fix_list()) {
    grains_grow_ |= fix->diam_flag != 0;
    // Fixes that insert grains answer with the largest radius of a type.
    for (int type = 1; type <= atom->ntypes; ++type) {
      int asked = type;
      const void* const radius = fix->extract("radius", asked);
      if (radius && (asked == 0 || asked == type)) take(type, *static_cast<const double*>(radius));
    }
  }
  for (int type = 1; type <= atom->ntypes; ++type) take(type, coefficients_.largest_radius(type));
}

/// When the pairs are listed: the lists look no further than for grains of the radii that were known before the run.
void PairDembarkGranular::check_radii() {
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->radius[i] > largest_radius_[std::size_t(atom->type[i])]) {
      const int type = atom->type[i];
      error->one(
          FLERR,
          "pair_style dembark/granular: the radius of grain {} is {:.6g}, and the lists of pairs of this run look for grains of type "
          "{} up to {:.6g}; say before the run how large they become: pair_coeff {} {} largest_radius R",
          atom->tag[i], atom->radius[i], type, largest_radius_[std::size_t(type)], type, type);
    }
}

/// When the pairs are listed.
void PairDembarkGranular::refuse_double_contacts() const {
  const std::string wrong = dembark_family::double_contact_error(*list, history_->firstflag, *atom, *domain, force->newton_pair != 0,
                                                                 2.0 * largest_radius() + reach());
  if (!wrong.empty()) error->one(FLERR, "pair_style dembark/granular: " + wrong);
}

/// Where grains grow: lists are made anew before two of them can meet that are in none. LAMMPS looks at displacements only.
void PairDembarkGranular::watch_growth() {
  if (neighbor->ago == 0) {
    listed_.resize(std::size_t(atom->nlocal));
    for (int i = 0; i < atom->nlocal; ++i) listed_[std::size_t(i)] = {vector(atom->x[i]), atom->radius[i]};
  }
  double most = 0.0;
  for (std::size_t i = 0; i < listed_.size(); ++i)
    most = std::max(most, norm(vector(atom->x[i]) - listed_[i].place) + atom->radius[i] - listed_[i].radius);
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, world);
  // Half of what may be gone, for it is the next step that makes them.
  if (most > 0.25 * neighbor->skin) history_->next_reneighbor = update->ntimestep + 1;
}

double PairDembarkGranular::largest_radius() const { return *std::max_element(largest_radius_.begin(), largest_radius_.end()); }

double PairDembarkGranular::init_one(int i, int j) {
  if (!setflag[i][j]) coefficients_.fail("pair_coeff " + std::to_string(i) + " " + std::to_string(j) + " is missing");
  const double one = largest_radius_[std::size_t(i)], other = largest_radius_[std::size_t(j)];
  coefficients_.complete(i, j, std::max(one, other));
  return one + other + reach();
}

double PairDembarkGranular::reach() const { return coefficients_.holds() ? neighbor->skin : 0.0; }

void PairDembarkGranular::transfer_history(double* from, double* to, int, int) { layout_.swap_bodies(from, to); }

/// What a force on a grain moves is its rigid body. Collective.
void PairDembarkGranular::take_body_masses() {
  masses_.assign(std::size_t(atom->nlocal + atom->nghost), 0.0);
  std::copy_n(atom->rmass, atom->nlocal, masses_.begin());
  for (Fix* const fix : rigid_) {
    int dimension = 0;
    const int* const body = static_cast<const int*>(fix->extract("body", dimension));
    const double* const mass = static_cast<const double*>(fix->extract("masstotal", dimension));
    for (int i = 0; i < atom->nlocal; ++i) {
      if (!(atom->mask[i] & fix->groupbit)) continue;
      if (!body)
        error->one(FLERR, "pair_style dembark/granular: fix {} ({}) does not say the masses of its bodies, and damping needs them", fix->id,
                   fix->style);
      if (body[i] >= 0) masses_[std::size_t(i)] = mass[body[i]];
    }
  }
  comm->forward_comm(this);
}

int PairDembarkGranular::pack_forward_comm(int count, int* grains, double* buffer, int, int*) {
  for (int k = 0; k < count; ++k) buffer[k] = masses_[std::size_t(grains[k])];
  return count;
}

void PairDembarkGranular::unpack_forward_comm(int count, int first, double* buffer) { std::copy_n(buffer, count, masses_.begin() + first); }

double PairDembarkGranular::mass(int i) const { return atom->mask[i] & freeze_bit_ ? INFINITY : masses()[i]; }

ContactBodies PairDembarkGranular::bodies(int i, int j) const {
  return dembark_family::grain_pair(*atom, i, j, vector(atom->x[i]) - vector(atom->x[j]), mass(i), mass(j));
}

/// Calls visit(i, j, touches, row) for each listed pair that may act: grains whose surfaces meet, or that have a history.
template <class Visit>
void PairDembarkGranular::each_contact(Visit visit) {
  double** const x = atom->x;
  const double* const radius = atom->radius;
  const int size = layout_.size();
  for (int ii = 0; ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    int* const touches = history_->firstflag[i];
    for (int jj = 0; jj < list->numneigh[i]; ++jj) {
      const int listed = list->firstneigh[i][jj], j = listed & NEIGHMASK;
      const double dx = x[i][0] - x[j][0], dy = x[i][1] - x[j][1], dz = x[i][2] - x[j][2], sum = radius[i] + radius[j];
      if (dx * dx + dy * dy + dz * dz >= sum * sum && !touches[jj]) continue;
      if (force->special_lj[sbmask(listed)] == 0.0) continue;
      visit(i, j, touches[jj], history_->firstvalue[i] + size * jj);
    }
  }
}

void PairDembarkGranular::tally(int i, int j, const ContactBodies& b, const ContactForce& out) {
  const auto &d = b.separation, &f = out.force;
  ev_tally_xyz(i, j, atom->nlocal, force->newton_pair, 0.0, 0.0, f.x, f.y, f.z, d.x, d.y, d.z);
}

void PairDembarkGranular::refuse_coincidence(int i, int j) const {
  error->one(FLERR, "pair_style dembark/granular: grains {} and {} are at the same place", atom->tag[i], atom->tag[j]);
}

void PairDembarkGranular::check_reach(int, int, double rupture_distance) const {
  dembark_lammps::check_reach(error, rupture_distance, neighbor->skin);
}

void PairDembarkGranular::advance_packs() {
  const int owned = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  dembark::PairStep step = describe(*list, atom->ntypes, masses(), owned, update->dt, true, true);
  step.stride = layout_.size();
  step.flags = history_->firstflag;
  step.histories = history_->firstvalue;
  step.contact_flags = step.bridge_flag = 1;
  PackedContacts::compute_packs(step);
}

void PairDembarkGranular::compute(int eflag, int vflag) {
  ev_init(eflag, vflag);
  if (history_->nlocal_neigh != atom->nlocal)
    error->one(FLERR, "pair_style dembark/granular: fix NEIGH_HISTORY has histories of {} grains, and there are {}: it {}",
               history_->nlocal_neigh, atom->nlocal, other_release);
  if (neighbor->ago == 0) {
    check_radii();
    refuse_double_contacts();
    if (!rigid_.empty()) take_body_masses();
  }
  if (grains_grow_) watch_growth();
  // The forces of the set-up are those of the present state, which stays.
  const bool advance = !update->setupflag;
  if (advance && packed_) {
    // Whether the virial is asked for must not change the run by round-off: contacts advance in packs in any case.
    if (vflag_either)
      each_contact([&](int i, int j, int touched, const double* row) {
        ContactState state;
        if (touched) layout_.load(row, state);
        const ContactBodies b = bodies(i, j);
        const ContactForce out = contact_step(coefficients_(atom->type[i], atom->type[j]), b, update->dt, state, true);
        if (out.interacting) tally(i, j, b, out);
      });
    if (list->inum > 0) advance_packs();
    return;
  }
  double **const f = atom->f, **const torque = atom->torque;
  each_contact([&](int i, int j, int& touches, double* row) {
    const bool touched = touches;
    const dembark::ContactParameters& p = coefficients_(atom->type[i], atom->type[j]);
    const ContactBodies b = bodies(i, j);
    ContactState state;
    if (touched) layout_.load(row, state);
    const bool was_held = state.cohesion.held();
    const double before = state.cohesion.bridge_volume;
    const ContactForce out = contact_step(p, b, update->dt, state, advance);
    if (dembark::has_no_direction(out.normal)) refuse_coincidence(i, j);
    // The set-up looks at all of them: the skin may be a new one.
    if (state.cohesion.held() && !(advance && was_held)) check_reach(i, j, state.cohesion.rupture_distance);
    if (advance) {
      // In every step: a run may go on with a longer one.
      if (state.cohesion.held() || (liquid_ && out.overlap > 0.0)) dembark_lammps::check_time_step(error, p.cohesion.liquid, b, update->dt);
      touches = out.interacting;
      layout_.store(row, state);
      if (liquid_) {
        if (!touched) row[layout_.imbalance_at()] = 0.0;
        liquid_->report({i, j, false}, atom->radius[i], atom->radius[j], p.cohesion.liquid, out.overlap > 0.0, before,
                        row + layout_.cohesion_at(), row + layout_.imbalance_at());
      }
    }
    if (!out.interacting) return;
    // Two frozen grains have no works.
    if (energies_ && !(atom->mask[i] & atom->mask[j] & freeze_bit_)) energies_->add(p, b, out, state, advance, i, j);
    add(f[i], out.force);
    add(torque[i], out.torque_1);
    if (force->newton_pair || j < atom->nlocal) {
      add(f[j], out.force, -1.0);
      add(torque[j], out.torque_2);
    }
    if (evflag) tally(i, j, b, out);
  });
}

double PairDembarkGranular::single(int i, int j, int itype, int jtype, double rsq, double, double, double& fforce) {
  // Where the pair stands in the list: with either grain first.
  ContactState state;
  for (const auto& [first, other] : {std::pair(i, j), std::pair(j, i)}) {
    if (first >= atom->nlocal) continue;
    const int* const neighbors = list->firstneigh[first];
    for (int jj = 0; jj < list->numneigh[first]; ++jj) {
      if ((neighbors[jj] & NEIGHMASK) != other || !history_->firstflag[first][jj]) continue;
      std::vector<double> row(std::size_t(layout_.size()));
      const double* const stored = history_->firstvalue[first] + layout_.size() * jj;
      if (first == i) std::copy_n(stored, row.size(), row.data());
      else layout_.swap_bodies(stored, row.data());
      layout_.load(row.data(), state);
    }
  }
  const ContactBodies b = bodies(i, j);
  std::fill_n(svector, single_numbers, 0.0);
  const ContactForce out = contact_step(coefficients_(itype, jtype), b, update->dt, state, false);
  const dembark_lammps::Vec3 tangential = out.tangential + out.viscous_tangential;
  add(svector, out.force);
  add(svector + 3, tangential);
  add(svector + 6, out.rolling);
  svector[9] = out.overlap;
  svector[10] = out.cohesive_force;
  svector[11] = state.cohesion.bridge_volume;
  add(svector + 12, vector(atom->x[i]));
  add(svector + 15, vector(atom->x[j]));
  fforce = dot(out.force, b.separation) / rsq;
  return 0.0;
}
