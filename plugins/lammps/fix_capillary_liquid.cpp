#include "fix_capillary_liquid.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "error.h"
#include "force.h"
#include "group.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "utils.h"

#include "contact_call.h"
#include "fix_wall_dembark.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
namespace capillary = dembark::capillary;

FixCapillaryLiquid::FixCapillaryLiquid(LAMMPS* lmp, int narg, char** arg) : LiquidFix(lmp, narg, arg, "fix wall/dembark", "", true) {
  peratom_freq = 1;
  peratom_flag = 1;
  size_peratom_cols = 0;
  FixCapillaryLiquid::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; ++i) FixCapillaryLiquid::set_arrays(i);
}

FixCapillaryLiquid::~FixCapillaryLiquid() { memory->destroy(own_); }

/// volume GROUP V: the grains of a group own V (m^3) each.
int FixCapillaryLiquid::modify_param(int narg, char** arg) {
  if (std::strcmp(arg[0], "volume") != 0) return 0;
  const int group_index = narg > 1 ? group->find(arg[1]) : -1;
  if (group_index < 0 || narg < 3 || !utils::is_double(arg[2])) fail("fix_modify is written 'volume GROUP V', with V in m^3 a grain");
  const double volume = utils::numeric(FLERR, arg[2], false, lmp);
  if (!(volume >= 0.0)) fail("volume (m^3 a grain) must be >= 0");
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & group->bitmask[group_index]) own_[i] = volume;
  return 3;
}

void FixCapillaryLiquid::init() {
  LiquidFix::init();
  pair_ = dynamic_cast<PairDembarkGranular*>(force->pair_match(dembark_lammps::ContactCoefficients::style_name, 1));
  if (!pair_ || !pair_->coefficients().layout().imbalance) fail("it needs pair_style dembark/granular ... carried_liquid on");
  std::vector<std::string> names;
  walls_.clear();
  for (Fix* const fix : modify->get_fix_by_style("^wall/dembark$")) {
    names.emplace_back(fix->id);
    walls_.push_back(static_cast<FixWallDembark*>(fix));
  }
  take_walls(names);
  maxexchange = row_size();
}

int FixCapillaryLiquid::wall_number(const FixWallDembark* wall) const {
  return int(std::find(walls_.begin(), walls_.end(), wall) - walls_.begin());
}

void FixCapillaryLiquid::each_pair_bridge(const VisitPair& visit) const {
  if (!pair_ || !pair_->list) return;
  const dembark::HistoryLayout layout = pair_->coefficients().layout();
  const NeighList& list = *pair_->list;
  for (int ii = 0; ii < list.inum; ++ii) {
    const int i = list.ilist[ii];
    const double* row = pair_->history().firstvalue[i];
    for (int k = 0; k < list.numneigh[i]; ++k, row += layout.size())
      if (pair_->history().firstflag[i][k] && row[layout.cohesion_at()] > 0.0)
        visit(i, list.firstneigh[i][k] & NEIGHMASK, row[layout.cohesion_at()], row[layout.imbalance_at()]);
  }
}

void FixCapillaryLiquid::each_wall_bridge(int i, std::size_t wall, const VisitWall& visit) const { walls_[wall]->each_bridge(i, visit); }

bool FixCapillaryLiquid::wall_is_there(std::size_t wall) const {
  return wall < walls_.size() && modify->get_fix_by_id(ledger_.walls[wall].name) == walls_[wall];
}

void FixCapillaryLiquid::check_reach(const Request&, double rupture_distance) const {
  dembark_lammps::check_reach(error, rupture_distance, neighbor->skin);
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
  LiquidFix::grow_arrays(count);
}

FixCapillaryLiquid* dembark_lammps::find_liquid(Modify* modify) {
  const auto found = modify->get_fix_by_style("^capillary/liquid$");
  return found.empty() ? nullptr : static_cast<FixCapillaryLiquid*>(found.front());
}
