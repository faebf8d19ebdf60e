// LIGGGHTS's side of fix ID all capillary/liquid (liquid_fix.h), for cohesion capillary with carried_liquid on. A grain's liquid is the
// property capillaryLiquid.
#ifdef FIX_CLASS

FixStyle(capillary/liquid,FixCapillaryLiquid)

#else

#ifndef LMP_FIX_CAPILLARY_LIQUID_H
#define LMP_FIX_CAPILLARY_LIQUID_H

#include <map>
#include <vector>

#include "liquid_fix.h"

namespace LAMMPS_NS {

class FixCapillaryLiquid : public dembark_family::LiquidFix {
 public:
  FixCapillaryLiquid(class LAMMPS *, int, char **);

  void post_create();
  void pre_delete(bool);
  void init();
  void setup_pre_force(int);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);

  /// False while a set-up computes forces: then nothing may form or break.
  bool collecting() const;
  /// Where the models of a wall, or of the pairs (nullptr), keep volume and imbalance among the numbers of a contact.
  void place(const class Fix *wall, int volume, int imbalance) { offsets_[wall] = {volume, imbalance}; }
  /// The number of a wall in BridgeSides.
  int wall_number(const class Fix *wall) const;
  /// Volume (m^3) of a bridge that a grain of `radius` (m) may well form with one of `other`, infinite for a wall.
  double likely_bridge(double radius, double other) const;
  /// Has to come before: looks how wet grains of these radii are, or will be. Collective.
  void look_for_liquid(double least_radius, double largest_radius);

 private:
  struct Offsets {
    int volume = 0, imbalance = 0;
  };
  struct Wall {
    class FixWallGran *fix;
    class FixPropertyAtom *history = nullptr;  // of the contacts with a primitive wall
    Offsets at{};
  };

  void find_walls();
  double *volumes() const;
  void each_pair_bridge(const VisitPair &visit) const;
  void each_wall_bridge(int i, std::size_t wall, const VisitWall &visit) const;
  bool wall_is_there(std::size_t wall) const;
  void check_reach(const Request &request, double rupture_distance) const;

  dembark::capillary::WettestGrains wettest_{};
  std::vector<Wall> walls_;  // by the ledger's numbers
  std::map<const class Fix *, Offsets> offsets_;
  class FixPropertyAtom *property_ = nullptr;
};

}  // namespace LAMMPS_NS

#endif
#endif
