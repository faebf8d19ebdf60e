// LAMMPS's side of fix ID all capillary/liquid (liquid_fix.h), for pair_style dembark/granular ... carried_liquid on.
#ifndef DEMBARK_FIX_CAPILLARY_LIQUID_H
#define DEMBARK_FIX_CAPILLARY_LIQUID_H

#include <vector>

#include "liquid_fix.h"

namespace LAMMPS_NS {

class FixCapillaryLiquid : public dembark_family::LiquidFix {
 public:
  FixCapillaryLiquid(LAMMPS* lmp, int narg, char** arg);
  ~FixCapillaryLiquid() override;
  void init() override;
  int modify_param(int narg, char** arg) override;
  void grow_arrays(int count) override;
  int pack_forward_comm(int count, int* grains, double* buffer, int, int*) override;
  void unpack_forward_comm(int count, int first, double* buffer) override;

  /// The number of a wall in BridgeSides.
  int wall_number(const class FixWallDembark* wall) const;

 private:
  double* volumes() const override { return own_; }
  void each_pair_bridge(const VisitPair& visit) const override;
  void each_wall_bridge(int i, std::size_t wall, const VisitWall& visit) const override;
  bool wall_is_there(std::size_t wall) const override;
  void check_reach(const Request& request, double rupture_distance) const override;

  double* own_ = nullptr;  // of each grain, m^3
  class PairDembarkGranular* pair_ = nullptr;
  std::vector<class FixWallDembark*> walls_;  // by the ledger's numbers
};

}  // namespace LAMMPS_NS

namespace dembark_lammps {

/// The one fix capillary/liquid of the run, or nullptr.
LAMMPS_NS::FixCapillaryLiquid* find_liquid(LAMMPS_NS::Modify* modify);

}  // namespace dembark_lammps

#endif
