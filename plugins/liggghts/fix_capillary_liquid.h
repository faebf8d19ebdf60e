// fix ID all capillary/liquid [content C | volume V] [share cap|fraction C] [return equal|radius|taken] [max_bridge V]
//     [wall WALL-ID POOL SHARE PART] ...: liquid that grains and walls own, for cohesion capillary with carried_liquid on.
//
// The contact models report, during a step, which touching contacts have no bridge and which bridges broke; at the end of the step the
// ledger (dembark/capillary/liquid_ledger.hpp) settles all of them. A grain's liquid is the property capillaryLiquid.
#ifdef FIX_CLASS

FixStyle(capillary/liquid,FixCapillaryLiquid)

#else

#ifndef LMP_FIX_CAPILLARY_LIQUID_H
#define LMP_FIX_CAPILLARY_LIQUID_H

#include <map>
#include <string>
#include <vector>

#include "fix.h"

#include "dembark/capillary/bridge.hpp"
#include "dembark/capillary/liquid_ledger.hpp"

namespace LAMMPS_NS {

class FixCapillaryLiquid : public Fix {
 public:
  /// `bridge`: where volume and rupture distance go, `imbalance`: as in NewBridge.
  struct Request : dembark::capillary::BridgeRequest {
    double *bridge, *imbalance;
    const dembark::capillary::BridgeForce *force;
    bool primitive_wall;
  };

  FixCapillaryLiquid(class LAMMPS *, int, char **);
  ~FixCapillaryLiquid();

  int setmask();
  void post_create();
  void pre_delete(bool);
  void init();
  void setup_pre_force(int);
  void pre_force(int);
  void end_of_step();
  double compute_vector(int);

  void grow_arrays(int);
  void copy_arrays(int, int, int);
  void set_arrays(int);
  int pack_exchange(int, double *);
  int unpack_exchange(int, double *);
  int pack_restart(int, double *);
  void unpack_restart(int, int);
  int size_restart(int);
  int maxsize_restart();
  void write_restart(FILE *);
  void restart(char *);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);
  double memory_usage();

  /// False while a set-up computes forces: then nothing may form or break.
  bool collecting() const;
  /// Where the models of a wall, or of the pairs (nullptr), keep volume and imbalance among the numbers of a contact.
  void place(const class Fix *wall, int volume, int imbalance) { offsets_[wall] = {volume, imbalance}; }
  /// The number of a wall in BridgeSides.
  int wall_number(const class Fix *wall) const;
  void request_bridge(const Request &request) { requests_.push_back(request); }
  void bridge_broke(const dembark::capillary::BrokenBridge &bridge) { broken_.push_back(bridge); }
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

  [[noreturn]] void refuse(const std::string &what);
  [[noreturn]] void stop(const std::string &what);
  void parse(int narg, char **arg);
  void find_walls();
  void after_new_list();
  double count_bridges() const;
  dembark::capillary::GrainLiquid grains() const;
  double initial(double radius) const;
  template <class Visit>
  void each_pair_bridge(Visit visit) const;
  template <class Visit>
  void each_wall_bridge(const Wall &wall, int i, Visit visit) const;

  dembark::capillary::LiquidLedger ledger_;
  double content_ = 0.0, volume_ = -1.0;
  dembark::capillary::WettestGrains wettest_{};
  std::vector<Wall> walls_;         // by the ledger's numbers
  std::vector<std::string> unmet_;  // names of walls in the arguments that no run has found yet
  std::map<const class Fix *, Offsets> offsets_;
  class FixPropertyAtom *property_ = nullptr;
  std::vector<Request> requests_;
  std::vector<dembark::capillary::BrokenBridge> broken_;
  std::vector<double> *granted_ = nullptr;  // what is being copied to other ranks
};

}  // namespace LAMMPS_NS

#endif
#endif
