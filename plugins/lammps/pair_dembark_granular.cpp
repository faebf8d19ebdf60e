#include "pair_dembark_granular.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <typeinfo>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"

#include "contact_call.h"
#include "fix_capillary_liquid.h"

using namespace LAMMPS_NS;
using dembark::ContactBodies;
using dembark::ContactForce;
using dembark::ContactState;
using dembark_lammps::add;
using dembark_lammps::vector;

PairDembarkGranular::PairDembarkGranular(LAMMPS* lmp) : Pair(lmp), coefficients_(lmp), packs_(lmp, coefficients_) {
  single_enable = 1;
  restartinfo = 0;  // the script gives the coefficients again
  no_virial_fdotr_compute = 1;
  finitecutflag = 1;
  nondefault_history_transfer = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
  single_extra = single_numbers;
  svector = new double[single_numbers]();
  // Histories come before the fixes that the script defines: they are put in their place later, when their size is known.
  modify->add_fix(history_id() + "_PLACE all DUMMY");
}

PairDembarkGranular::~PairDembarkGranular() {
  delete[] svector;
  if (modify->nfix) modify->delete_fix(history_ ? history_id() : history_id() + "_PLACE");
  if (!allocated) return;
  memory->destroy(setflag);
  memory->destroy(cutsq);
}

std::string PairDembarkGranular::history_id() const { return "NEIGH_HISTORY_DEMBARK_" + std::to_string(instance_me); }

void PairDembarkGranular::settings(int narg, char** arg) {
  coefficients_.settings(narg, arg);
  if (history_ && coefficients_.layout().size() != layout_.size())
    coefficients_.fail("other options than before need histories of another size; write 'pair_style none' first");
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
  coefficients_.complete();
  neighbor->add_request(this, NeighConst::REQ_SIZE | NeighConst::REQ_HISTORY);
  if (!history_) {
    Fix* const made =
        modify->replace_fix(history_id() + "_PLACE", history_id() + " all NEIGH_HISTORY " + std::to_string(layout_.size()), 1);
    if (!std::strstr(typeid(*made).name(), "FixNeighHistory")) error->all(FLERR, "dembark: LAMMPS's fix NEIGH_HISTORY is not what it was");
    history_ = static_cast<dembark_lammps::NeighborHistory*>(made);
    history_->pair = this;
  }
  // A bridge keeps its history over the gap.
  beyond_contact = coefficients_.wet();
  const auto freeze = modify->get_fix_by_style("^freeze");
  freeze_bit_ = freeze.empty() ? 0 : freeze.front()->groupbit;
  liquid_ = layout_.imbalance ? dembark_lammps::find_liquid(modify) : nullptr;
  if (layout_.imbalance && !liquid_) coefficients_.fail("carried_liquid on needs the liquid: fix ID all capillary/liquid content C");
  // Lists of bonded atoms hold pairs that do not interact.
  tally_ = dembark_lammps::find_energy_tally(modify);
  packed_ = packs_.prepare(freeze_bit_, liquid_, tally_) && atom->molecular == Atom::ATOMIC;
  find_radii();
}

void PairDembarkGranular::find_radii() {
  largest_radius_.assign(std::size_t(atom->ntypes + 1), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    double& largest = largest_radius_[std::size_t(atom->type[i])];
    largest = std::max(largest, atom->radius[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, largest_radius_.data(), atom->ntypes + 1, MPI_DOUBLE, MPI_MAX, world);
  for (Fix* const fix : modify->get_fix_by_style("^(pour|deposit)"))
    for (int type = 1; type <= atom->ntypes; ++type) {
      int asked = type;
      if (const void* const radius = fix->extract("radius", asked))
        largest_radius_[std::size_t(type)] = std::max(largest_radius_[std::size_t(type)], *static_cast<const double*>(radius));
    }
}

double PairDembarkGranular::largest_radius() const { return *std::max_element(largest_radius_.begin(), largest_radius_.end()); }

double PairDembarkGranular::init_one(int i, int j) {
  if (!setflag[i][j]) coefficients_.fail("pair_coeff " + std::to_string(i) + " " + std::to_string(j) + " is missing");
  // No bridge is longer than the skin, and what lists pairs looks no further than this.
  const double reach = coefficients_.wet() ? neighbor->skin : 0.0;
  return largest_radius_[std::size_t(i)] + largest_radius_[std::size_t(j)] + reach;
}

void PairDembarkGranular::transfer_history(double* from, double* to, int, int) { layout_.swap_bodies(from, to); }

double PairDembarkGranular::mass(int i) const { return atom->mask[i] & freeze_bit_ ? INFINITY : atom->rmass[i]; }

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

void PairDembarkGranular::compute(int eflag, int vflag) {
  ev_init(eflag, vflag);
  if (history_->nlocal_neigh != atom->nlocal) error->one(FLERR, "dembark: LAMMPS's fix NEIGH_HISTORY is not what it was");
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
    packs_.step(*list, *history_);
    return;
  }
  double **const f = atom->f, **const torque = atom->torque;
  each_contact([&](int i, int j, int& touches, double* row) {
    const bool touched = touches;
    const dembark::ContactParameters& p = coefficients_(atom->type[i], atom->type[j]);
    const ContactBodies b = bodies(i, j);
    ContactState state;
    if (touched) layout_.load(row, state);
    const bool was_bridged = state.bridge_volume > 0.0;
    const ContactForce out = contact_step(p, b, update->dt, state, advance);
    dembark_lammps::check_normal(error, atom->tag, out.normal, i, j);
    if (advance) {
      if (state.bridge_volume > 0.0 && !was_bridged) {
        dembark_lammps::check_time_step(error, p.liquid, b, update->dt);
        dembark_lammps::check_reach(error, state.rupture_distance, neighbor->skin);
      }
      touches = out.interacting;
      const double before = was_bridged ? row[layout_.bridge_at()] : 0.0;
      layout_.store(row, state);
      if (liquid_) {
        if (!touched) row[layout_.imbalance_at()] = 0.0;
        if (out.overlap > 0.0 && !was_bridged) dembark_lammps::check_time_step(error, p.liquid, b, update->dt);
        liquid_->report({i, j, false}, atom->radius[i], atom->radius[j], p.liquid, out.overlap > 0.0, before, row + layout_.bridge_at(),
                        row + layout_.imbalance_at());
      }
    }
    if (!out.interacting) return;
    // Two frozen grains have no works.
    if (tally_ && !(atom->mask[i] & atom->mask[j] & freeze_bit_)) tally_->add(p, b, out, state, advance, i, j);
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
  svector[10] = out.capillary_force;
  svector[11] = state.bridge_volume;
  add(svector + 12, vector(atom->x[i]));
  add(svector + 15, vector(atom->x[j]));
  fforce = dot(out.force, b.separation) / rsq;
  return 0.0;
}
