#include "fix_capillary_liquid.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include "dembark/normal_force.hpp"
#include "bridge_reach.h"

using namespace LAMMPS_NS;
using namespace FixConst;
namespace capillary = dembark::capillary;

namespace {

const char *const property_name = "capillaryLiquid";

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
  std::fill(books_.begin(), books_.end(), 0.0);
}

FixCapillaryLiquid::~FixCapillaryLiquid() {
  atom->delete_callback(id, 0);
  atom->delete_callback(id, 1);
}

void FixCapillaryLiquid::refuse(const std::string &what) {
  error->fix_error(FLERR, this, what.c_str());
  std::abort();  // fix_error() does not return
}

void FixCapillaryLiquid::parse(int narg, char **arg) {
  const auto number = [&](int k, const char *what) {
    if (k >= narg) refuse(std::string(what) + " is missing");
    char *end = nullptr;
    const double value = std::strtod(arg[k], &end);
    if (end == arg[k] || *end || !std::isfinite(value)) refuse(std::string(what) + " '" + arg[k] + "' is not a number");
    return value;
  };
  for (int k = 3; k < narg;) {
    const std::string word = arg[k];
    if (word == "content" || word == "volume") {
      if (content_ > 0.0 || volume_ >= 0.0) refuse("the liquid of a grain is given once: either content or volume");
      double &value = word == "content" ? content_ : volume_;
      value = number(k + 1, word.c_str());
      if (!(value >= 0.0)) refuse(word + (word == "content" ? " (liquid volume over grain volume)" : " (m^3 a grain)") + " must be >= 0");
      k += 2;
    } else if (word == "share") {
      const std::string kind = k + 1 < narg ? arg[k + 1] : "";
      if (kind != "cap" && kind != "fraction") refuse("share must be followed by cap or fraction");
      share_.kind = kind == "cap" ? capillary::ShareRule::Kind::cap : capillary::ShareRule::Kind::fraction;
      share_.factor = number(k + 2, "the number of share");
      if (const char *wrong = share_.error()) refuse(wrong);
      k += 3;
    } else if (word == "return") {
      const std::vector<std::string> names = capillary::return_names();
      const auto found = k + 1 < narg ? std::find(names.begin(), names.end(), arg[k + 1]) : names.end();
      if (found == names.end()) refuse("return must be followed by equal, radius or taken");
      return_ = static_cast<capillary::Return>(found - names.begin());
      k += 2;
    } else if (word == "max_bridge") {
      largest_ = number(k + 1, "max_bridge");
      if (!(largest_ > 0.0)) refuse("max_bridge (m^3) must be > 0");
      k += 2;
    } else if (word == "wall") {
      if (k + 4 >= narg)
        refuse("wall must be followed by the ID of a fix wall/gran, its liquid (m^3), the share it gives and the part it gets back");
      Wall wall;
      wall.id = arg[k + 1];
      wall.pool = number(k + 2, "the liquid of the wall");
      wall.share = number(k + 3, "the share of the wall");
      wall.part = number(k + 4, "the part of the wall");
      wall.named = true;
      if (!(wall.pool >= 0.0)) refuse("the liquid of wall " + wall.id + " (m^3) must be >= 0");
      if (!(wall.share >= 0.0 && wall.share <= 1.0)) refuse("the share that wall " + wall.id + " gives to a bridge must lie in 0...1");
      if (!(wall.part >= 0.0 && wall.part <= 1.0)) refuse("the part of a bridge that wall " + wall.id + " gets back must lie in 0...1");
      for (const Wall &other : walls_)
        if (other.id == wall.id) refuse("wall " + wall.id + " is given twice");
      walls_.push_back(wall);
      k += 5;
    } else refuse("keyword '" + word + "' is unknown; there are content, volume, share, return, max_bridge, wall");
  }
}

// The contact models work between these stages.
int FixCapillaryLiquid::setmask() { return PRE_FORCE | END_OF_STEP; }

void FixCapillaryLiquid::post_create() {
  // -1: a grain whose liquid is still to be reckoned from its radius.
  const char *words[] = {property_name, "all", "property/atom", property_name, "scalar", "yes", "no", "no", "-1."};
  property_ = static_cast<FixPropertyAtom *>(modify->find_fix_property(property_name, "property/atom", "scalar", 0, 0, style, false));
  if (property_) return;
  property_ = modify->add_fix_property_atom(9, const_cast<char **>(words), style);
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
  if (!places_.count(nullptr)) refuse("it needs pair_style gran ... cohesion capillary ... carried_liquid on");
  // The engine would set new arrays back in the middle of the set-up.
  just_created = 0;
  find_walls();
  totals_step_ = -1;
}

double *FixCapillaryLiquid::liquid() const { return property_->vector_atom; }

bool FixCapillaryLiquid::collecting() const { return !update->setupflag; }

int FixCapillaryLiquid::wall_number(const Fix *wall) const {
  for (std::size_t w = 0; w < walls_.size(); ++w)
    if (static_cast<const Fix *>(walls_[w].fix) == wall) return int(w);
  error->one(FLERR, "fix capillary/liquid: a wall was made after the run was set up");
  return -1;
}

double FixCapillaryLiquid::initial(int i) const {
  if (volume_ >= 0.0) return volume_;
  const double r = atom->radius[i];
  return content_ * (4.0 / 3.0) * dembark::pi * r * r * r;
}

double FixCapillaryLiquid::likely_bridge(double largest_radius) const {
  double mine = std::max(volume_, content_ * (4.0 / 3.0) * dembark::pi * largest_radius * largest_radius * largest_radius), all = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) mine = std::max(mine, liquid()[i]);
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
  const double share = std::max(2.0 * share_(1.0, 1.0), share_(1.0, capillary::flat<double>));
  // Liquid gathers on some grains: twice as much as at the start is foreseen.
  return std::min(largest_, 2.0 * all * std::min(share, 1.0));
}

void FixCapillaryLiquid::broke(int i, int j, double volume, double imbalance) {
  const double back_i = capillary::returned(volume, imbalance), back_j = capillary::returned(volume, -imbalance);
  liquid()[i] += back_i;
  book(i)[0] -= back_i;
  if (j >= atom->nlocal) return;
  liquid()[j] += back_j;
  book(j)[0] -= back_j;
}

void FixCapillaryLiquid::broke_wall(int i, int wall, double volume, double imbalance) {
  const double back = capillary::returned(volume, imbalance);
  liquid()[i] += back;
  book(i)[1 + wall] -= volume;
  wall_returned_[wall] += volume - back;
}

/// All that broke is back with the grains already. Walls get theirs, then what the step asked is granted from what is there.
void FixCapillaryLiquid::end_of_step() {
  check_walls();
  grant_all();
  for (const Request &request : requests_) form(request);
  requests_.clear();
  demands_.clear();
  settle_walls();
  totals_step_ = -1;
}

void FixCapillaryLiquid::grant_all() {
  const std::size_t n = walls_.size();
  demands_.resize(std::size_t(atom->nlocal));
  // What all ranks have to know: whether any pair asks, and of each wall what it got back and what is asked of it.
  std::vector<double> mine(1 + 2 * n, 0.0), all(1 + 2 * n, 0.0);
  for (const Request &r : requests_) {
    demands_.add(std::size_t(r.i), share_(r.radius_i, r.radius_j));
    if (r.j < 0) mine[1 + n + r.wall] += walls_[r.wall].share;
    else {
      mine[0] = 1.0;
      if (r.j < atom->nlocal) demands_.add(std::size_t(r.j), share_(r.radius_j, r.radius_i));
    }
  }
  std::copy_n(wall_returned_.begin(), n, mine.begin() + 1);
  // Reduced on one rank, so that the walls hold the same numbers on all of them.
  MPI_Reduce(mine.data(), all.data(), int(mine.size()), MPI_DOUBLE, MPI_SUM, 0, world);
  MPI_Bcast(all.data(), int(all.size()), MPI_DOUBLE, 0, world);
  wall_grants_.assign(n, 0.0);
  for (std::size_t w = 0; w < n; ++w) {
    walls_[w].pool += all[1 + w];
    wall_grants_[w] = walls_[w].share * capillary::grant(walls_[w].pool, all[1 + n + w]);
    wall_returned_[w] = 0.0;
  }
  if (all[0] == 0.0 && requests_.empty()) return;
  // -1: nothing was asked of this grain where it is owned.
  for (int i = 0; i < atom->nlocal; ++i) {
    const double demand = demands_.of(std::size_t(i));
    grants_[i] = demand > 0.0 ? capillary::grant(liquid()[i], demand) : -1.0;
  }
  if (all[0] != 0.0) comm->forward_comm_fix(this);
}

void FixCapillaryLiquid::form(const Request &r) {
  const double given_i = share_(r.radius_i, r.radius_j) * grants_[r.i];
  capillary::NewBridge<double> bridge;
  if (r.j < 0) bridge = capillary::form_wall_bridge(given_i, wall_grants_[r.wall], walls_[r.wall].part, return_, largest_);
  else {
    // Both owners have to see the contact in the same step.
    if (grants_[r.j] < 0.0) return;
    bridge = capillary::form_bridge(given_i, share_(r.radius_j, r.radius_i) * grants_[r.j], r.radius_i, r.radius_j, return_, largest_);
  }
  if (!(bridge.volume > 0.0)) return;
  const double rupture = r.force->rupture_distance(r.radius_i, r.radius_j, bridge.volume);
  dembark_liggghts::check_reach(neighbor, error, rupture, r.j < 0 ? r.radius_i : r.radius_i + r.radius_j, r.primitive_wall);
  r.bridge[0] = bridge.volume;
  r.bridge[1] = rupture;
  *r.imbalance = bridge.imbalance;
  liquid()[r.i] = capillary::remaining(liquid()[r.i], bridge.from_i);
  if (r.j < 0) {
    book(r.i)[1 + r.wall] += bridge.volume;
    wall_taken_[r.wall] += bridge.from_j;
    return;
  }
  book(r.i)[0] += capillary::returned(bridge.volume, bridge.imbalance);
  if (r.j >= atom->nlocal) return;
  liquid()[r.j] = capillary::remaining(liquid()[r.j], bridge.from_j);
  book(r.j)[0] += capillary::returned(bridge.volume, -bridge.imbalance);
}

void FixCapillaryLiquid::settle_walls() {
  const std::size_t n = walls_.size();
  if (std::all_of(wall_grants_.begin(), wall_grants_.end(), [](double grant) { return grant == 0.0; })) return;
  std::vector<double> all(n, 0.0);
  MPI_Reduce(wall_taken_.data(), all.data(), int(n), MPI_DOUBLE, MPI_SUM, 0, world);
  MPI_Bcast(all.data(), int(n), MPI_DOUBLE, 0, world);
  for (std::size_t w = 0; w < n; ++w) walls_[w].pool = capillary::remaining(walls_[w].pool, all[w]);
  std::fill(wall_taken_.begin(), wall_taken_.end(), 0.0);
}

int FixCapillaryLiquid::pack_comm(int n, int *list, double *buffer, int, int *) {
  for (int k = 0; k < n; ++k) buffer[k] = grants_[list[k]];
  return 1;
}

void FixCapillaryLiquid::unpack_comm(int n, int first, double *buffer) { std::copy_n(buffer, n, grants_.begin() + first); }

double FixCapillaryLiquid::compute_vector(int n) {
  const Totals &now = totals();
  const double held = now.grains + now.bridges + now.walls;
  const double values[] = {now.grains, now.bridges, now.walls, lost_, now.count, added_, held, held - reference_};
  return values[n];
}
