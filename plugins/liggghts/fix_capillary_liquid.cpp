#include "fix_capillary_liquid.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_contact_history_mesh.h"
#include "fix_mesh_surface.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "dembark/normal_force.hpp"
#include "bridge_reach.h"

using namespace LAMMPS_NS;
using namespace FixConst;
namespace capillary = dembark::capillary;

namespace {

const char *const property_name = "capillaryLiquid";

std::string words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

FixCapillaryLiquid::FixCapillaryLiquid(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg) {
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k] != this && std::strcmp(modify->fix[k]->style, style) == 0)
      refuse("there can be one such fix only, and there is fix " + std::string(modify->fix[k]->id));
  if (std::strcmp(arg[1], "all") != 0) refuse("the group must be 'all': every grain owns its liquid");
  parse(narg, arg);
  restart_global = restart_peratom = create_attribute = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = 8;
  extvector = 1;
  comm_forward = 1;
  grow_arrays(atom->nmax);
  atom->add_callback(0);
  atom->add_callback(1);
  // Reduced on one rank, so that the walls hold the same numbers on all of them.
  ledger_.sum_over_processes = [this](std::vector<long double> &sums) {
    std::vector<long double> mine(sums);
    MPI_Reduce(mine.data(), sums.data(), int(sums.size()), MPI_LONG_DOUBLE, MPI_SUM, 0, world);
    MPI_Bcast(sums.data(), int(sums.size()), MPI_LONG_DOUBLE, 0, world);
  };
  ledger_.copy_to_others = [this](std::vector<double> &grants) {
    granted_ = &grants;
    comm->forward_comm_fix(this);
  };
}

FixCapillaryLiquid::~FixCapillaryLiquid() {
  atom->delete_callback(id, 0);
  atom->delete_callback(id, 1);
}

void FixCapillaryLiquid::refuse(const std::string &what) {
  error->fix_error(FLERR, this, what.c_str());
  std::abort();  // fix_error() does not return
}

void FixCapillaryLiquid::stop(const std::string &what) {
  error->one(FLERR, ("fix capillary/liquid: " + what).c_str());
  std::abort();  // one() does not return
}

void FixCapillaryLiquid::parse(int narg, char **arg) {
  int k = 3;
  const auto number = [&](const std::string &what) {
    if (k >= narg) refuse(what + " is missing");
    char *end = nullptr;
    const double value = std::strtod(arg[k], &end);
    if (end == arg[k] || *end || !std::isfinite(value)) refuse(what + " '" + arg[k] + "' is not a number");
    ++k;
    return value;
  };
  const auto name = [&] { return k < narg ? std::string(arg[k++]) : ""; };
  while (k < narg) {
    const std::string word = arg[k++];
    if (word == "content" || word == "volume") {
      if (content_ > 0.0 || volume_ >= 0.0) refuse("the liquid of a grain is given once: either content or volume");
      double &value = word == "content" ? content_ : volume_;
      value = number(word);
      if (!(value >= 0.0)) refuse(word + (word == "content" ? " (liquid volume over grain volume)" : " (m^3 a grain)") + " must be >= 0");
    } else if (word == "share") {
      if (!ledger_.share.set_kind(name())) refuse("share must be followed by cap or fraction");
      ledger_.share.factor = number("the number of share");
      if (const char *wrong = ledger_.share.error()) refuse(wrong);
    } else if (word == "return") {
      if (!capillary::choose(capillary::return_names(), name(), ledger_.split)) refuse("return must be followed by equal, radius or taken");
    } else if (word == "max_bridge") {
      ledger_.largest_bridge = number(word);
      if (!(ledger_.largest_bridge > 0.0)) refuse("max_bridge (m^3) must be > 0");
    } else if (word == "wall") {
      if (k + 3 >= narg)
        refuse("wall must be followed by the ID of a fix wall/gran, its liquid (m^3), the share it gives and the part it gets back");
      capillary::LiquidWall wall{name()};
      if (ledger_.wall(wall.name)) refuse("wall " + wall.name + " is given twice");
      wall.pool = number("the liquid of the wall");
      wall.share = number("the share of the wall");
      wall.part = number("the part of the wall");
      if (const char *wrong = wall.error()) refuse("wall " + wall.name + ": " + wrong);
      ledger_.walls.push_back(wall);
      unmet_.push_back(wall.name);
    } else refuse("keyword '" + word + "' is unknown; there are content, volume, share, return, max_bridge, wall");
  }
}

// The contact models work between these stages.
int FixCapillaryLiquid::setmask() { return PRE_FORCE | END_OF_STEP; }

void FixCapillaryLiquid::post_create() {
  const char *arguments[] = {property_name, "all", "property/atom", property_name, "scalar", "yes", "no", "no", "-1."};
  static_assert(capillary::GrainLiquid::unset == -1.0, "the default of the property above");
  property_ = static_cast<FixPropertyAtom *>(modify->find_fix_property(property_name, "property/atom", "scalar", 0, 0, style, false));
  if (property_) return;
  property_ = modify->add_fix_property_atom(9, const_cast<char **>(arguments), style);
  if (!property_->recent_restart)
    for (int i = 0; i < atom->nlocal; ++i) property_->set_arrays(i);
  property_->just_created = 0;  // it has its values: `set` may follow
}

void FixCapillaryLiquid::pre_delete(bool unfix) {
  if (unfix && property_) modify->delete_fix(property_name);
}

void FixCapillaryLiquid::init() {
  if (force->newton_pair) refuse("newton must be off: each rank settles the contacts of the grains that it owns");
  if (std::strcmp(update->integrate_style, "verlet") != 0) refuse("only run_style verlet is supported");
  if (!offsets_.count(nullptr)) refuse("it needs pair_style gran ... cohesion capillary ... carried_liquid on");
  // The engine would set new arrays back in the middle of the set-up.
  just_created = 0;
  find_walls();
}

/// Walls that bridges may form to: those named in the arguments, and all others, dry.
void FixCapillaryLiquid::find_walls() {
  std::vector<std::string> names;
  walls_.clear();
  for (int k = 0; k < modify->nfix; ++k) {
    FixWallGran *const fix = dynamic_cast<FixWallGran *>(modify->fix[k]);
    if (!fix || !fix->contact_match("cohesion", "capillary")) continue;
    names.push_back(fix->id);
    walls_.push_back({fix});
  }
  const auto there = [&](const std::string &name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  for (const std::string &name : unmet_)
    if (!there(name)) refuse("there is no fix wall/gran " + name + " with cohesion capillary");
  unmet_.clear();
  for (const capillary::LiquidWall &wall : ledger_.walls) {
    const std::string line = "fix capillary/liquid: wall " + wall.name + " is gone, and with it " + words(wall.pool) + " m^3 of liquid";
    if (!there(wall.name) && wall.pool > 0.0 && comm->me == 0) error->warning(FLERR, line.c_str());
  }
  ledger_.change_walls(names, grains());
}

capillary::GrainLiquid FixCapillaryLiquid::grains() const { return {property_->vector_atom, atom->nlocal}; }

bool FixCapillaryLiquid::collecting() const { return !update->setupflag; }

int FixCapillaryLiquid::wall_number(const Fix *wall) const {
  for (std::size_t w = 0; w < walls_.size(); ++w)
    if (static_cast<const Fix *>(walls_[w].fix) == wall) return int(w);
  return -1;
}

double FixCapillaryLiquid::initial(double radius) const {
  return volume_ >= 0.0 ? volume_ : content_ * (4.0 / 3.0) * dembark::pi * radius * radius * radius;
}

void FixCapillaryLiquid::look_for_liquid(double least_radius, double largest_radius) {
  wettest_ = {largest_radius};
  for (const double radius : {least_radius, largest_radius}) wettest_.add(radius, initial(radius));
  for (int i = 0; i < atom->nlocal; ++i) wettest_.add(atom->radius[i], grains().volume[i]);
  double mine[] = {wettest_.volume, wettest_.over_square};
  MPI_Allreduce(mine, &wettest_.volume, 1, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(mine + 1, &wettest_.over_square, 1, MPI_DOUBLE, MPI_MAX, world);
}

double FixCapillaryLiquid::likely_bridge(double radius, double other) const {
  return std::min(ledger_.largest_bridge, wettest_.likely_bridge(ledger_.share, ledger_.split, radius, other));
}

template <class Visit>
void FixCapillaryLiquid::each_pair_bridge(Visit visit) const {
  PairGran *const pair = static_cast<PairGran *>(force->pair_match("gran", 0));
  if (!pair || !pair->list || !pair->list->listgranhistory) return;
  const Offsets at = offsets_.at(nullptr);
  const NeighList &list = *pair->list;
  const std::size_t stride = std::size_t(pair->dnum());
  for (int ii = 0; ii < list.inum; ++ii) {
    const int i = list.ilist[ii];
    const double *history = list.listgranhistory->firstdouble[i];
    for (int k = 0; k < list.numneigh[i]; ++k, history += stride)
      if (history[at.volume] > 0.0) visit(i, list.firstneigh[i][k] & NEIGHMASK, history[at.volume], history[at.imbalance]);
  }
}

template <class Visit>
void FixCapillaryLiquid::each_wall_bridge(const Wall &wall, int i, Visit visit) const {
  const auto look = [&](double *contact) {
    if (contact[wall.at.volume] > 0.0) visit(contact[wall.at.volume], contact[wall.at.imbalance]);
  };
  if (wall.history) look(wall.history->array_atom[i]);
  if (!wall.fix->is_mesh_wall()) return;
  for (int m = 0; m < wall.fix->n_meshes(); ++m)
    if (FixContactHistoryMesh *const history = wall.fix->mesh_list()[m]->contactHistory())
      for (int k = 0; k < history->nneighs(i); ++k) look(history->contacthistory(i, k));
}

void FixCapillaryLiquid::setup_pre_force(int) {
  requests_.clear();
  broken_.clear();
  for (Wall &wall : walls_) {
    wall.at = offsets_.at(wall.fix);
    const std::string history = "history_" + std::string(wall.fix->id);
    if (!wall.fix->is_mesh_wall())
      wall.history = static_cast<FixPropertyAtom *>(modify->find_fix_property(history.c_str(), "property/atom", "vector", 0, 0, style));
  }
  after_new_list();
}

void FixCapillaryLiquid::pre_force(int) {
  if (neighbor->ago == 0) after_new_list();
}

/// Grains have come, left or gone to other ranks, and the lists may have lost bridges to partners that left or jumped out of reach.
void FixCapillaryLiquid::after_new_list() {
  const int wrong = ledger_.admit(grains(), [this](int i) { return initial(atom->radius[i]); });
  if (wrong >= 0)
    stop("grain " + std::to_string(atom->tag[wrong]) + " has liquid " + words(grains().volume[wrong]) + " m^3; it must be >= 0");
  double excess = 0.0;
  const int full = ledger_.reconcile_pairs(grains(), [this](auto visit) { each_pair_bridge(visit); }, excess);
  if (full >= 0)
    stop("the bridges of grain " + std::to_string(atom->tag[full]) + " hold " + words(excess) +
         " more than was given to them; is the box smaller than two cut-offs?");
  const double missing = ledger_.audit(grains(), !update->setupflag && update->ntimestep > update->firststep);
  if (missing != 0.0) error->all(FLERR, ("fix capillary/liquid: " + words(missing) + " of the liquid is missing").c_str());
}

void FixCapillaryLiquid::end_of_step() {
  ledger_.give_back(broken_, grains());
  ledger_.reconcile_walls(grains(), [this](int i, std::size_t wall, auto visit) { each_wall_bridge(walls_[wall], i, visit); });
  ledger_.form(requests_, grains(), [this](const Request &r, const capillary::NewBridge<double> &bridge) {
    const double rupture = r.force->rupture_distance(r.radius, r.other_radius, bridge.volume);
    const double size = r.sides.wall ? r.radius : r.radius + r.other_radius;
    dembark_liggghts::check_reach(neighbor, error, rupture, size, r.primitive_wall);
    r.bridge[0] = bridge.volume;
    r.bridge[1] = rupture;
    *r.imbalance = bridge.imbalance;
  });
}

/// Number of all bridges. Collective.
double FixCapillaryLiquid::count_bridges() const {
  double mine = 0.0, all = 0.0;
  each_pair_bridge([&](int, int j, double, double) { mine += j < atom->nlocal ? 1.0 : 0.5; });
  for (std::size_t w = 0; w < walls_.size(); ++w) {
    const capillary::LiquidWall &wall = ledger_.walls[w];
    // Between two runs a wall may be gone already.
    if (modify->find_fix_id(wall.name.c_str()) != walls_[w].fix) continue;
    for (int i = 0; i < atom->nlocal; ++i)
      if (wall.of_grain[i] + wall.own[i] > 0.0) each_wall_bridge(walls_[w], i, [&](double, double) { mine += 1.0; });
  }
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

double FixCapillaryLiquid::compute_vector(int n) {
  const capillary::LiquidLedger::Totals now = ledger_.totals(grains());
  const double count = n == 4 ? count_bridges() : 0.0;
  const double values[] = {now.grains, now.bridges,   now.walls,  ledger_.lost,
                           count,      ledger_.added, now.held(), now.held() - ledger_.expected};
  return values[n];
}

int FixCapillaryLiquid::pack_comm(int n, int *list, double *buffer, int, int *) {
  for (int k = 0; k < n; ++k) buffer[k] = (*granted_)[list[k]];
  return 1;
}

void FixCapillaryLiquid::unpack_comm(int n, int first, double *buffer) { std::copy_n(buffer, n, granted_->begin() + first); }

void FixCapillaryLiquid::grow_arrays(int n) { ledger_.resize(std::size_t(n)); }

void FixCapillaryLiquid::copy_arrays(int i, int j, int) {
  std::vector<double> row(ledger_.numbers());
  pack_exchange(i, row.data());
  unpack_exchange(j, row.data());
}

void FixCapillaryLiquid::set_arrays(int i) {
  ledger_.each_number(i, [](double &number) { number = 0.0; });
}

int FixCapillaryLiquid::pack_exchange(int i, double *buffer) {
  ledger_.each_number(i, [&](double number) { *buffer++ = number; });
  return int(ledger_.numbers());
}

int FixCapillaryLiquid::unpack_exchange(int i, double *buffer) {
  ledger_.each_number(i, [&](double &number) { number = *buffer++; });
  return int(ledger_.numbers());
}

int FixCapillaryLiquid::pack_restart(int i, double *buffer) {
  buffer[0] = size_restart(i);
  return 1 + pack_exchange(i, buffer + 1);
}

/// Of walls that the file does not know nothing is there.
void FixCapillaryLiquid::unpack_restart(int i, int nth) {
  const double *from = atom->extra[i];
  for (int k = 0; k < nth; ++k) from += static_cast<int>(*from);
  const double *const end = from + static_cast<int>(*from);
  ledger_.each_number(i, [&](double &number) {
    if (++from < end) number = *from;
  });
}

int FixCapillaryLiquid::size_restart(int) { return 1 + int(ledger_.numbers()); }

int FixCapillaryLiquid::maxsize_restart() { return size_restart(0); }

void FixCapillaryLiquid::write_restart(FILE *file) {
  if (comm->me != 0) return;
  const std::string saved = ledger_.saved(false);
  const int bytes = int(saved.size() + 1);
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(saved.c_str(), 1, saved.size() + 1, file);
}

/// The walls of the file, with what they held; init() finds their fixes. What the arguments say of a wall, but for its liquid, holds.
void FixCapillaryLiquid::restart(char *buffer) try {
  const std::vector<capillary::LiquidWall> given = ledger_.walls;
  ledger_.restore(buffer);
  for (capillary::LiquidWall &wall : ledger_.walls) wall.share = wall.part = 0.0;
  for (const capillary::LiquidWall &wall : given) {
    capillary::LiquidWall *const same = ledger_.wall(wall.name);
    if (same) *same = {wall.name, same->pool, wall.share, wall.part};
    else ledger_.walls.push_back(wall);
  }
  ledger_.resize(std::size_t(atom->nmax));
} catch (const std::exception &wrong) {
  refuse(wrong.what());
}

double FixCapillaryLiquid::memory_usage() { return double((ledger_.numbers() + 2) * std::size_t(atom->nmax) * sizeof(double)); }
