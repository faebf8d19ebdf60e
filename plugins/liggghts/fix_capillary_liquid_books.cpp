// fix capillary/liquid: books per grain, against the bridges that are really there; grains and walls that come and go.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_capillary_liquid.h"
#include "fix_contact_history_mesh.h"
#include "fix_mesh_surface.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

using namespace LAMMPS_NS;
namespace capillary = dembark::capillary;

namespace {

// Books and bridges differ by the rounding of sums only; more than this part of them is a bridge that came or went unseen.
constexpr double rounding = 1e-11;

std::string words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

template <class Call>
void FixCapillaryLiquid::each_pair_bridge(Call call) const {
  PairGran *const pair = static_cast<PairGran *>(force->pair_match("gran", 0));
  if (!pair || !pair->list || !pair->list->listgranhistory) return;
  const auto [volume, imbalance] = places_.at(nullptr);
  const NeighList &list = *pair->list;
  const std::size_t stride = std::size_t(pair->dnum());
  for (int ii = 0; ii < list.inum; ++ii) {
    const int i = list.ilist[ii];
    const double *history = list.listgranhistory->firstdouble[i];
    for (int k = 0; k < list.numneigh[i]; ++k, history += stride)
      if (history[volume] > 0.0) call(i, list.firstneigh[i][k] & NEIGHMASK, history[volume], history[imbalance]);
  }
}

/// The volumes of all bridges of grain i to a wall, one a contact.
template <class Call>
void FixCapillaryLiquid::each_wall_bridge(const Wall &wall, int i, Call call) const {
  const int offset = places_.at(wall.fix).first;
  if (wall.history && wall.history->array_atom[i][offset] > 0.0) call(wall.history->array_atom[i][offset]);
  if (!wall.fix->is_mesh_wall()) return;
  for (int m = 0; m < wall.fix->n_meshes(); ++m)
    if (FixContactHistoryMesh *const history = wall.fix->mesh_list()[m]->contactHistory())
      for (int k = 0; k < history->nneighs(i); ++k)
        if (history->contacthistory(i, k)[offset] > 0.0) call(history->contacthistory(i, k)[offset]);
}

/// Walls that bridges may form to: those named in the arguments, and all others, dry.
void FixCapillaryLiquid::find_walls() {
  std::vector<Wall> now;
  for (int k = 0; k < modify->nfix; ++k) {
    FixWallGran *const fix = dynamic_cast<FixWallGran *>(modify->fix[k]);
    if (!fix || !fix->contact_match("cohesion", "capillary")) continue;
    Wall wall;
    wall.id = fix->id;
    for (const Wall &known : walls_)
      if (known.id == wall.id) wall = known;
    wall.fix = fix;
    now.push_back(wall);
  }
  for (const Wall &known : walls_) {
    if (std::any_of(now.begin(), now.end(), [&](const Wall &wall) { return wall.id == known.id; })) continue;
    if (known.named && !known.fix) refuse("there is no fix wall/gran " + known.id + " with cohesion capillary");
    // Its bridges fall back to the grains; its own liquid went with it.
    lost_ += known.pool;
    reference_ -= known.pool;
    const std::string line = "fix capillary/liquid: wall " + known.id + " is gone, and with it " + words(known.pool) + " m^3 of liquid";
    if (known.pool > 0.0 && comm->me == 0) error->warning(FLERR, line.c_str());
  }
  rearrange(now);
}

/// Books for other walls than before: by their IDs.
void FixCapillaryLiquid::rearrange(const std::vector<Wall> &walls) {
  std::vector<Wall> before = walls_;
  const std::size_t old_width = width();
  const std::vector<double> old = books_;
  walls_ = walls;
  books_.assign(std::size_t(atom->nmax) * width(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    const double *const from = &old[std::size_t(i) * old_width];
    book(i)[0] = from[0];
    for (std::size_t b = 0; b < before.size(); ++b) {
      const auto found = std::find_if(walls_.begin(), walls_.end(), [&](const Wall &wall) { return wall.id == before[b].id; });
      if (found != walls_.end()) book(i)[1 + (found - walls_.begin())] = from[1 + b];
      else if (from[1 + b] != 0.0) liquid()[i] += from[1 + b];
    }
  }
  wall_returned_.assign(walls_.size(), 0.0);
  wall_taken_.assign(walls_.size(), 0.0);
}

void FixCapillaryLiquid::setup_pre_force(int) {
  requests_.clear();
  for (Wall &wall : walls_)
    if (!wall.fix->is_mesh_wall())
      wall.history =
          static_cast<FixPropertyAtom *>(modify->find_fix_property(("history_" + wall.id).c_str(), "property/atom", "vector", 0, 0, style));
  after_new_list(false);
}

void FixCapillaryLiquid::setup(int) { totals_step_ = -1; }

void FixCapillaryLiquid::pre_force(int) {
  if (neighbor->ago == 0) after_new_list(true);
}

void FixCapillaryLiquid::after_new_list(bool in_run) {
  take_in();
  check_pairs(in_run);
  count_all();
  totals_step_ = -1;
}

/// New grains get their liquid.
void FixCapillaryLiquid::take_in() {
  double mine[2] = {0.0, 0.0}, all[2] = {0.0, 0.0};  // liquid, grains
  for (int i = 0; i < atom->nlocal; ++i) {
    double &own = liquid()[i];
    if (own == -1.0) {
      own = initial(i);
      mine[0] += own;
      mine[1] += 1.0;
    } else if (!(own >= 0.0) || !std::isfinite(own)) {
      const std::string line =
          "fix capillary/liquid: grain " + std::to_string(atom->tag[i]) + " has liquid " + words(own) + " m^3; it must be >= 0";
      error->one(FLERR, line.c_str());
    }
  }
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
  if (atoms_ < 0) return;  // all are new
  added_ += all[0];
  reference_ += all[0];
  atoms_ += static_cast<bigint>(all[1]);
}

/// Bridges that the list does not have any more (their partner left the box, or jumped further than the list looks) fall back: each
/// grain gets its own part.
void FixCapillaryLiquid::check_pairs(bool in_run) {
  std::vector<double> held(std::size_t(atom->nlocal), 0.0);
  each_pair_bridge([&](int i, int j, double volume, double imbalance) {
    held[i] += capillary::returned(volume, imbalance);
    if (j < atom->nlocal) held[j] += capillary::returned(volume, -imbalance);
  });
  for (int i = 0; i < atom->nlocal; ++i) {
    const double back = book(i)[0] - held[i], exact = rounding * std::max(book(i)[0], liquid()[i]);
    if (back < -exact) {
      const std::string line = "fix capillary/liquid: the bridges of grain " + std::to_string(atom->tag[i]) + " hold " +
                               words(-back / held[i]) + " more than was given to them; is the box smaller than two cut-offs?";
      error->one(FLERR, line.c_str());
    }
    // In a set-up rounding is left alone: a resumed run must not differ.
    if ((back > exact || in_run) && liquid()[i] + back >= 0.0) {
      liquid()[i] += back;
      book(i)[0] = held[i];
    }
  }
}

/// The engine moves, copies and drops the contacts with a mesh as grains pass from triangle to triangle, and forgets a primitive wall out
/// of reach: what fell out goes back as from a broken bridge, what was doubled is shared.
void FixCapillaryLiquid::check_walls() {
  for (std::size_t w = 0; w < walls_.size(); ++w)
    for (int i = 0; i < atom->nlocal; ++i) {
      double &booked = book(i)[1 + w];
      if (booked == 0.0) continue;
      double held = 0.0;
      each_wall_bridge(walls_[w], i, [&](double volume) { held += volume; });
      if (held > 0.0 && std::fabs(booked - held) <= rounding * held) continue;
      if (held > 0.0 && held > booked) {
        const double scale = std::max(booked, 0.0) / held;
        each_wall_bridge(walls_[w], i, [&](double &volume) { volume *= scale; });
        continue;
      }
      const double back = booked - held, to_wall = back * walls_[w].part;
      liquid()[i] = std::max(liquid()[i] + (back - to_wall), 0.0);
      wall_returned_[w] += to_wall;
      booked = held;
    }
}

double FixCapillaryLiquid::holdings() const {
  long double mine = 0.0L, all = 0.0L;
  for (int i = 0; i < atom->nlocal; ++i) {
    mine += liquid()[i];
    for (std::size_t k = 0; k < width(); ++k) mine += book(i)[k];
  }
  MPI_Allreduce(&mine, &all, 1, MPI_LONG_DOUBLE, MPI_SUM, world);
  for (const Wall &wall : walls_) all += wall.pool;
  return double(all);
}

/// What is there against what should be: less if grains left, else something is wrong.
void FixCapillaryLiquid::count_all() {
  const double now = holdings();
  bigint mine = atom->nlocal, grains = 0;
  MPI_Allreduce(&mine, &grains, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  const double missing = reference_ - now;
  if (atoms_ < 0) reference_ = now;
  else if (grains < atoms_) {
    lost_ += missing;
    reference_ = now;
  } else if (std::fabs(missing) > 1e-9 * std::max(now, reference_)) {
    if (!update->setupflag && update->ntimestep > update->firststep) {
      const std::string line = "fix capillary/liquid: " + words(missing / reference_) + " of the liquid is missing";
      error->all(FLERR, line.c_str());
    }
    added_ -= missing;  // by a command between two runs
    reference_ = now;
  }
  atoms_ = grains;
}

const FixCapillaryLiquid::Totals &FixCapillaryLiquid::totals() {
  if (totals_step_ == update->ntimestep) return totals_;
  long double mine[3] = {0.0L, 0.0L, 0.0L}, all[3];
  for (int i = 0; i < atom->nlocal; ++i) {
    mine[0] += std::max(liquid()[i], 0.0);
    for (std::size_t k = 0; k < width(); ++k) mine[1] += book(i)[k];
  }
  for (std::size_t w = 0; w < walls_.size(); ++w) {
    // Between two runs a wall may be gone already.
    if (modify->find_fix_id(walls_[w].id.c_str()) != walls_[w].fix) continue;
    for (int i = 0; i < atom->nlocal; ++i)
      if (book(i)[1 + w] > 0.0) each_wall_bridge(walls_[w], i, [&](double) { mine[2] += 1.0L; });
  }
  each_pair_bridge([&](int, int j, double, double) { mine[2] += j < atom->nlocal ? 1.0L : 0.5L; });
  MPI_Allreduce(mine, all, 3, MPI_LONG_DOUBLE, MPI_SUM, world);
  double walls = 0.0;
  for (const Wall &wall : walls_) walls += wall.pool;
  totals_ = {double(all[0]), double(all[1]), walls, double(all[2])};
  totals_step_ = update->ntimestep;
  return totals_;
}
