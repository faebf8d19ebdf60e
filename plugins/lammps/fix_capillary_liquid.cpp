#include "fix_capillary_liquid.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <utility>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include "contact_call.h"
#include "fix_wall_dembark.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
namespace capillary = dembark::capillary;

FixCapillaryLiquid::FixCapillaryLiquid(LAMMPS* lmp, int narg, char** arg) : Fix(lmp, narg, arg) {
  if (const Fix* const other = dembark_lammps::find_liquid(modify); other && other != this)
    fail(std::string("there can be one such fix only, and there is fix ") + other->id);
  if (igroup != 0) fail("the group must be 'all': every grain owns its liquid");
  parse(narg, arg);
  restart_global = restart_peratom = create_attribute = 1;
  nevery = global_freq = peratom_freq = 1;
  vector_flag = peratom_flag = 1;
  size_vector = 8;
  size_peratom_cols = 0;
  extvector = 1;
  comm_forward = 1;
  FixCapillaryLiquid::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
  for (int i = 0; i < atom->nlocal; ++i) FixCapillaryLiquid::set_arrays(i);
  // Reduced on one rank, so that the walls hold the same numbers on all of them.
  ledger_.sum_over_processes = [this](std::vector<long double>& sums) {
    std::vector<long double> mine(sums);
    MPI_Reduce(mine.data(), sums.data(), int(sums.size()), MPI_LONG_DOUBLE, MPI_SUM, 0, world);
    MPI_Bcast(sums.data(), int(sums.size()), MPI_LONG_DOUBLE, 0, world);
  };
  ledger_.copy_to_others = [this](std::vector<double>& grants) {
    granted_ = &grants;
    comm->forward_comm(this);
  };
}

FixCapillaryLiquid::~FixCapillaryLiquid() {
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  memory->destroy(own_);
}

void FixCapillaryLiquid::fail(const std::string& what) const { error->all(FLERR, std::string("fix ") + id + " capillary/liquid: " + what); }

void FixCapillaryLiquid::parse(int narg, char** arg) {
  int k = 3;
  const auto number = [&](const std::string& what) {
    if (k >= narg) fail(what + " is missing");
    if (!utils::is_double(arg[k])) fail(what + " '" + arg[k] + "' is not a number");
    return utils::numeric(FLERR, arg[k++], false, lmp);
  };
  const auto name = [&] { return k < narg ? std::string(arg[k++]) : std::string(); };
  while (k < narg) {
    const std::string word = arg[k++];
    if (word == "content" || word == "volume") {
      if (content_ > 0.0 || volume_ >= 0.0) fail("the liquid of a grain is given once: either content or volume");
      double& value = word == "content" ? content_ : volume_;
      value = number(word);
      if (!(value >= 0.0)) fail(word + (word == "content" ? " (liquid volume over grain volume)" : " (m^3 a grain)") + " must be >= 0");
    } else if (word == "share") {
      if (!ledger_.share.set_kind(name())) fail("share must be followed by cap or fraction");
      ledger_.share.factor = number("the number of share");
      if (const char* wrong = ledger_.share.error()) fail(wrong);
    } else if (word == "return") {
      if (!capillary::choose(capillary::return_names(), name(), ledger_.split)) fail("return must be followed by equal, radius or taken");
    } else if (word == "max_bridge") {
      ledger_.largest_bridge = number(word);
      if (!(ledger_.largest_bridge > 0.0)) fail("max_bridge (m^3) must be > 0");
    } else if (word == "wall") {
      if (k + 3 >= narg)
        fail("wall must be followed by the ID of a fix wall/dembark, its liquid (m^3), the share it gives and the part it gets back");
      capillary::LiquidWall wall{name()};
      if (ledger_.wall(wall.name)) fail("wall " + wall.name + " is given twice");
      wall.pool = number("the liquid of the wall");
      wall.share = number("the share of the wall");
      wall.part = number("the part of the wall");
      if (const char* wrong = wall.error()) fail("wall " + wall.name + ": " + wrong);
      ledger_.walls.push_back(wall);
      unmet_.push_back(wall.name);
    } else fail("keyword '" + word + "' is unknown; there are content, volume, share, return, max_bridge, wall");
  }
}

/// volume GROUP V: the grains of a group own V (m^3) each.
int FixCapillaryLiquid::modify_param(int narg, char** arg) {
  if (std::strcmp(arg[0], "volume") != 0) return 0;
  const int its = narg > 1 ? group->find(arg[1]) : -1;
  if (its < 0 || narg < 3 || !utils::is_double(arg[2])) fail("fix_modify is written 'volume GROUP V', with V in m^3 a grain");
  const double volume = utils::numeric(FLERR, arg[2], false, lmp);
  if (!(volume >= 0.0)) fail("volume (m^3 a grain) must be >= 0");
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & group->bitmask[its]) own_[i] = volume;
  return 3;
}

// Pairs and walls work between these stages.
int FixCapillaryLiquid::setmask() { return FixConst::PRE_FORCE | FixConst::END_OF_STEP; }

void FixCapillaryLiquid::init() {
  if (force->newton_pair) fail("newton must be off: each rank settles the contacts of the grains that it owns");
  pair_ = dynamic_cast<PairDembarkGranular*>(force->pair_match(dembark_lammps::ContactCoefficients::style_name, 1));
  if (!pair_ || !pair_->coefficients().layout().imbalance) fail("it needs pair_style dembark/granular ... carried_liquid on");
  find_walls();
  maxexchange = row_size();
}

/// Walls that bridges may form to: those named in the arguments, and all others, dry.
void FixCapillaryLiquid::find_walls() {
  std::vector<std::string> names;
  walls_.clear();
  for (Fix* const fix : modify->get_fix_by_style("^wall/dembark$")) {
    names.emplace_back(fix->id);
    walls_.push_back(static_cast<FixWallDembark*>(fix));
  }
  const auto there = [&](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  for (const std::string& name : unmet_)
    if (!there(name)) fail("there is no fix wall/dembark " + name);
  unmet_.clear();
  for (const capillary::LiquidWall& wall : ledger_.walls)
    if (!there(wall.name) && wall.pool > 0.0 && comm->me == 0)
      error->warning(FLERR, "fix capillary/liquid: wall {} is gone, and with it {:.3g} m^3 of liquid", wall.name, wall.pool);
  ledger_.change_walls(names, grains());
}

capillary::GrainLiquid FixCapillaryLiquid::grains() const { return {own_, atom->nlocal}; }

int FixCapillaryLiquid::wall_number(const FixWallDembark* wall) const {
  return int(std::find(walls_.begin(), walls_.end(), wall) - walls_.begin());
}

double FixCapillaryLiquid::initial(double radius) const {
  return volume_ >= 0.0 ? volume_ : content_ * (4.0 / 3.0) * dembark::pi * radius * radius * radius;
}

void FixCapillaryLiquid::report(const capillary::BridgeSides& sides, double radius, double other_radius, const dembark::Liquid& law,
                                bool touching, double before, double* bridge, double* imbalance) {
  if (bridge[0] > 0.0) return;
  if (before > 0.0) broken_.push_back({sides, before, std::exchange(*imbalance, 0.0)});
  if (!touching) return;
  Request request;
  request.sides = sides;
  request.radius = radius;
  request.other_radius = other_radius;
  request.bridge = bridge;
  request.imbalance = imbalance;
  request.force = law.force;
  requests_.push_back(request);
}

template <class Visit>
void FixCapillaryLiquid::each_pair_bridge(Visit visit) const {
  if (!pair_->list) return;
  const dembark::HistoryLayout layout = pair_->coefficients().layout();
  const NeighList& list = *pair_->list;
  for (int ii = 0; ii < list.inum; ++ii) {
    const int i = list.ilist[ii];
    const double* row = pair_->history().firstvalue[i];
    for (int k = 0; k < list.numneigh[i]; ++k, row += layout.size())
      if (pair_->history().firstflag[i][k] && row[layout.bridge_at()] > 0.0)
        visit(i, list.firstneigh[i][k] & NEIGHMASK, row[layout.bridge_at()], row[layout.imbalance_at()]);
  }
}

void FixCapillaryLiquid::setup_pre_force(int) {
  requests_.clear();
  broken_.clear();
  after_new_list();
}

void FixCapillaryLiquid::pre_force(int) {
  if (neighbor->ago == 0) after_new_list();
}

/// Grains have come, left or gone to other ranks, and the lists may have lost bridges to partners that left or jumped out of reach.
void FixCapillaryLiquid::after_new_list() {
  const int wrong = ledger_.admit(grains(), [this](int i) { return initial(atom->radius[i]); });
  if (wrong >= 0) error->one(FLERR, "fix capillary/liquid: grain {} has liquid {:.3g} m^3; it must be >= 0", atom->tag[wrong], own_[wrong]);
  double excess = 0.0;
  const int full = ledger_.reconcile_pairs(grains(), [this](auto visit) { each_pair_bridge(visit); }, excess);
  if (full >= 0)
    error->one(
        FLERR,
        "fix capillary/liquid: the bridges of grain {} hold {:.3g} more than was given to them; is the box smaller than two cut-offs?",
        atom->tag[full], excess);
  const double missing = ledger_.audit(grains(), !update->setupflag && update->ntimestep > update->firststep);
  if (missing != 0.0) error->all(FLERR, "fix capillary/liquid: {:.3g} of the liquid is missing", missing);
}

void FixCapillaryLiquid::end_of_step() {
  ledger_.give_back(broken_, grains());
  ledger_.reconcile_walls(grains(), [this](int i, std::size_t wall, auto visit) { walls_[wall]->each_bridge(i, visit); });
  ledger_.form(requests_, grains(), [this](const Request& r, const capillary::NewBridge<double>& bridge) {
    const double rupture = r.force->rupture_distance(r.radius, r.other_radius, bridge.volume);
    dembark_lammps::check_reach(error, rupture, neighbor->skin);
    r.bridge[0] = bridge.volume;
    r.bridge[1] = rupture;
    *r.imbalance = bridge.imbalance;
  });
}

/// Number of all bridges. Collective.
double FixCapillaryLiquid::count_bridges() const {
  double mine = 0.0, all = 0.0;
  each_pair_bridge([&](int, int j, double, double) { mine += j < atom->nlocal ? 1.0 : 0.5; });
  for (FixWallDembark* const wall : walls_)
    for (int i = 0; i < atom->nlocal; ++i) wall->each_bridge(i, [&](double, double) { mine += 1.0; });
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

int FixCapillaryLiquid::pack_forward_comm(int count, int* grains, double* buffer, int, int*) {
  for (int k = 0; k < count; ++k) buffer[k] = (*granted_)[std::size_t(grains[k])];
  return count;
}

void FixCapillaryLiquid::unpack_forward_comm(int count, int first, double* buffer) {
  std::copy_n(buffer, count, granted_->begin() + first);
}

void FixCapillaryLiquid::grow_arrays(int count) {
  memory->grow(own_, count, "capillary/liquid:own");
  vector_atom = own_;
  ledger_.resize(std::size_t(count));
}

void FixCapillaryLiquid::copy_arrays(int from, int to, int) {
  std::vector<double> row(static_cast<std::size_t>(row_size()));
  FixCapillaryLiquid::pack_exchange(from, row.data());
  FixCapillaryLiquid::unpack_exchange(to, row.data());
}

void FixCapillaryLiquid::set_arrays(int i) {
  own_[i] = capillary::GrainLiquid::unset;
  ledger_.each_number(i, [](double& number) { number = 0.0; });
}

int FixCapillaryLiquid::pack_exchange(int i, double* buffer) {
  *buffer++ = own_[i];
  ledger_.each_number(i, [&](double number) { *buffer++ = number; });
  return row_size();
}

int FixCapillaryLiquid::unpack_exchange(int i, double* buffer) {
  own_[i] = *buffer++;
  ledger_.each_number(i, [&](double& number) { number = *buffer++; });
  return row_size();
}

int FixCapillaryLiquid::pack_restart(int i, double* buffer) {
  buffer[0] = 1 + row_size();
  return 1 + FixCapillaryLiquid::pack_exchange(i, buffer + 1);
}

/// Of walls that the file does not know nothing is there.
void FixCapillaryLiquid::unpack_restart(int i, int nth) {
  const double* from = atom->extra[i];
  for (int k = 0; k < nth; ++k) from += int(from[0]);
  const double* const end = from + int(from[0]);
  own_[i] = *++from;
  ledger_.each_number(i, [&](double& number) {
    if (++from < end) number = *from;
  });
}

void FixCapillaryLiquid::write_restart(FILE* file) {
  if (comm->me != 0) return;
  const std::string saved = ledger_.saved(false);
  const int bytes = int(saved.size() + 1);
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(saved.c_str(), 1, saved.size() + 1, file);
}

/// The walls of the file, with what they held; init() finds their fixes. What the arguments say of a wall, but for its liquid, holds.
void FixCapillaryLiquid::restart(char* buffer) try {
  const std::vector<capillary::LiquidWall> given = ledger_.walls;
  ledger_.restore(buffer);
  for (capillary::LiquidWall& wall : ledger_.walls) wall.share = wall.part = 0.0;
  for (const capillary::LiquidWall& wall : given) {
    capillary::LiquidWall* const same = ledger_.wall(wall.name);
    if (same) *same = {wall.name, same->pool, wall.share, wall.part};
    else ledger_.walls.push_back(wall);
  }
  ledger_.resize(std::size_t(atom->nmax));
} catch (const std::exception& wrong) {
  fail(wrong.what());
}

double FixCapillaryLiquid::memory_usage() { return double((ledger_.numbers() + 3) * std::size_t(atom->nmax) * sizeof(double)); }

FixCapillaryLiquid* dembark_lammps::find_liquid(Modify* modify) {
  const auto found = modify->get_fix_by_style("^capillary/liquid$");
  return found.empty() ? nullptr : static_cast<FixCapillaryLiquid*>(found.front());
}
