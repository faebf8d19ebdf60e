#include "fix_capillary_liquid.h"

#include <algorithm>
#include <string>

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

#include "bridge_reach.h"

using namespace LAMMPS_NS;
namespace capillary = dembark::capillary;

namespace {

const char *const property_name = "capillaryLiquid";

}  // namespace

FixCapillaryLiquid::FixCapillaryLiquid(LAMMPS *lmp, int narg, char **arg)
    : LiquidFix(lmp, narg, arg, "fix wall/gran", " with cohesion capillary", false) {
  grow_arrays(atom->nmax);
}

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
  LiquidFix::init();
  if (!offsets_.count(nullptr)) fail("it needs pair_style gran ... cohesion capillary ... carried_liquid on");
  // The engine would set new arrays back in the middle of the set-up.
  just_created = 0;
  find_walls();
}

void FixCapillaryLiquid::find_walls() {
  std::vector<std::string> names;
  walls_.clear();
  for (Fix *const each : fixes()) {
    FixWallGran *const fix = dynamic_cast<FixWallGran *>(each);
    if (!fix || !fix->contact_match("cohesion", "capillary")) continue;
    names.push_back(fix->id);
    walls_.push_back({fix});
  }
  take_walls(names);
}

double *FixCapillaryLiquid::volumes() const { return property_->vector_atom; }

bool FixCapillaryLiquid::collecting() const { return !update->setupflag; }

int FixCapillaryLiquid::wall_number(const Fix *wall) const {
  for (std::size_t w = 0; w < walls_.size(); ++w)
    if (static_cast<const Fix *>(walls_[w].fix) == wall) return int(w);
  return -1;
}

void FixCapillaryLiquid::look_for_liquid(double least_radius, double largest_radius) {
  wettest_ = {largest_radius};
  for (const double radius : {least_radius, largest_radius}) wettest_.add(radius, content_.of(radius));
  for (int i = 0; i < atom->nlocal; ++i) wettest_.add(atom->radius[i], grains().volume[i]);
  double mine[] = {wettest_.volume, wettest_.over_square};
  MPI_Allreduce(mine, &wettest_.volume, 1, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(mine + 1, &wettest_.over_square, 1, MPI_DOUBLE, MPI_MAX, world);
}

double FixCapillaryLiquid::likely_bridge(double radius, double other) const {
  return std::min(ledger_.largest_bridge, wettest_.likely_bridge(ledger_.share, ledger_.split, radius, other));
}

void FixCapillaryLiquid::each_pair_bridge(const VisitPair &visit) const {
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

void FixCapillaryLiquid::each_wall_bridge(int i, std::size_t number, const VisitWall &visit) const {
  const Wall &wall = walls_[number];
  const auto look = [&](double *contact) {
    if (contact[wall.at.volume] > 0.0) visit(contact[wall.at.volume], contact[wall.at.imbalance]);
  };
  if (wall.history) look(wall.history->array_atom[i]);
  if (!wall.fix->is_mesh_wall()) return;
  for (int m = 0; m < wall.fix->n_meshes(); ++m)
    if (FixContactHistoryMesh *const history = wall.fix->mesh_list()[m]->contactHistory())
      for (int k = 0; k < history->nneighs(i); ++k) look(history->contacthistory(i, k));
}

bool FixCapillaryLiquid::wall_is_there(std::size_t wall) const {
  return wall < walls_.size() && modify->find_fix_id(ledger_.walls[wall].name.c_str()) == walls_[wall].fix;
}

void FixCapillaryLiquid::check_reach(const Request &request, double rupture_distance) const {
  const double size = request.sides.wall ? request.radius : request.radius + request.other_radius;
  dembark_liggghts::check_reach(neighbor, error, rupture_distance, size, request.primitive_wall);
}

void FixCapillaryLiquid::setup_pre_force(int) {
  for (Wall &wall : walls_) {
    wall.at = offsets_.at(wall.fix);
    const std::string history = "history_" + std::string(wall.fix->id);
    if (!wall.fix->is_mesh_wall())
      wall.history = static_cast<FixPropertyAtom *>(modify->find_fix_property(history.c_str(), "property/atom", "vector", 0, 0, style));
  }
  LiquidFix::setup_pre_force(0);
}

int FixCapillaryLiquid::pack_comm(int n, int *list, double *buffer, int, int *) {
  for (int k = 0; k < n; ++k) buffer[k] = (*granted_)[list[k]];
  return 1;
}

void FixCapillaryLiquid::unpack_comm(int n, int first, double *buffer) { std::copy_n(buffer, n, granted_->begin() + first); }
