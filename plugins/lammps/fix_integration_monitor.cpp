#include "fix_integration_monitor.h"

#include <cmath>
#include <cstring>

#include "force.h"
#include "modify.h"
#include "neigh_list.h"

#include "fix_wall_dembark.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;

/// Without a pair style, or with one that only makes lists, there are no contacts to judge.
void FixIntegrationMonitor::find_contacts() {
  pair_ = dynamic_cast<PairDembarkGranular*>(force->pair);
  if (force->pair && !pair_ && std::strcmp(force->pair_style, "zero") != 0)
    fail("it knows the stiffness of pair_style dembark/granular only");
  walls_.clear();
  for (Fix* const wall : modify->get_fix_by_style("^wall/dembark$")) walls_.push_back(static_cast<FixWallDembark*>(wall));
  for (const Fix* const wall : modify->get_fix_by_style("^wall/gran"))
    fail(std::string("it knows the stiffness of fix wall/dembark only, and there is fix ") + wall->id + " (" + wall->style + ")");
  if (run_.impacts == 0) return;
  if (!pair_) fail("impacts are those of pair_style dembark/granular, which must come first");
  if (force->newton_pair) fail("impacts needs newton off: the rank that owns the grain with the lower number sees its impacts");
  if (atom->map_style == Atom::MAP_NONE) fail("impacts needs 'atom_modify map array'");
}

const NeighList* FixIntegrationMonitor::pairs() const { return pair_->list; }

double FixIntegrationMonitor::stiffness(int type_i, int type_j, double radius, double mass, double overlap) const {
  return pair_->coefficients()(type_i, type_j).respond(radius, mass, overlap, 0.0).normal_stiffness;
}

dembark::ContactParameters FixIntegrationMonitor::parameters(int type_i, int type_j) const { return pair_->coefficients()(type_i, type_j); }

void FixIntegrationMonitor::take_walls() {
  for (FixWallDembark* const wall : walls_)
    for (int i = 0; i < atom->nlocal; ++i)
      if (atom->mask[i] & wall->groupbit && atom->mask[i] & groupbit)
        for (const double overlap : wall->overlaps(i)) take_contact(i, -1, INFINITY, wall->type(), overlap);
}

void FixIntegrationMonitor::clear_histories() {
  for (int i = 0; i < atom->nlocal; ++i) set_arrays(i);
}
