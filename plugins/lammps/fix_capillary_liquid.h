// LAMMPS adapter of liquid that grains and walls own, for pair_style dembark/granular ... carried_liquid on.
//
//   fix ID all capillary/liquid [content C | volume V] [share cap|fraction C] [return equal|radius|taken] [max_bridge V]
//       [wall WALL-ID POOL SHARE PART] ...
//
// Pairs and walls report, during a step, which touching contacts have no bridge and which bridges broke; at the end of the step the ledger
// (dembark/capillary/liquid_ledger.hpp) settles all of them.
#ifndef DEMBARK_FIX_CAPILLARY_LIQUID_H
#define DEMBARK_FIX_CAPILLARY_LIQUID_H

#include <string>
#include <vector>

#include "fix.h"

#include "dembark/capillary/liquid_ledger.hpp"
#include "dembark/contact.hpp"

namespace LAMMPS_NS {

class FixCapillaryLiquid : public Fix {
 public:
  FixCapillaryLiquid(LAMMPS* lmp, int narg, char** arg);
  ~FixCapillaryLiquid() override;
  int setmask() override;
  void init() override;
  void setup_pre_force(int vflag) override;
  void pre_force(int vflag) override;
  void end_of_step() override;
  double compute_vector(int n) override;
  int modify_param(int narg, char** arg) override;
  double memory_usage() override;

  void grow_arrays(int count) override;
  void copy_arrays(int from, int to, int) override;
  void set_arrays(int i) override;
  int pack_exchange(int i, double* buffer) override;
  int unpack_exchange(int i, double* buffer) override;
  int pack_restart(int i, double* buffer) override;
  void unpack_restart(int i, int nth) override;
  int size_restart(int) override { return 1 + row_size(); }
  int maxsize_restart() override { return 1 + row_size(); }
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  int pack_forward_comm(int count, int* grains, double* buffer, int, int*) override;
  void unpack_forward_comm(int count, int first, double* buffer) override;

  /// The number of a wall in BridgeSides.
  int wall_number(const class FixWallDembark* wall) const;
  /// After a step of a contact: `before` is its bridge's volume (m^3) before it, `bridge` its volume and rupture distance (m) now,
  /// `imbalance` as in NewBridge; where these stand until the end of the step.
  void report(const dembark::capillary::BridgeSides& sides, double radius, double other_radius, const dembark::Liquid& law, bool touching,
              double before, double* bridge, double* imbalance);

 private:
  struct Request : dembark::capillary::BridgeRequest {
    double *bridge, *imbalance;
    const dembark::capillary::BridgeForce* force;
  };

  [[noreturn]] void fail(const std::string& what) const;
  void parse(int narg, char** arg);
  void find_walls();
  void after_new_list();
  double count_bridges() const;
  dembark::capillary::GrainLiquid grains() const;
  double initial(double radius) const;
  int row_size() const { return 1 + int(ledger_.numbers()); }
  template <class Visit>
  void each_pair_bridge(Visit visit) const;

  dembark::capillary::LiquidLedger ledger_;
  double content_ = 0.0, volume_ = -1.0;
  double* own_ = nullptr;  // of each grain, m^3
  class PairDembarkGranular* pair_ = nullptr;
  std::vector<class FixWallDembark*> walls_;  // by the ledger's numbers
  std::vector<std::string> unmet_;            // names of walls in the arguments that no run has found yet
  std::vector<Request> requests_;
  std::vector<dembark::capillary::BrokenBridge> broken_;
  std::vector<double>* granted_ = nullptr;  // what is being copied to other ranks
};

}  // namespace LAMMPS_NS

namespace dembark_lammps {

/// The one fix capillary/liquid of the run, or nullptr.
LAMMPS_NS::FixCapillaryLiquid* find_liquid(LAMMPS_NS::Modify* modify);

}  // namespace dembark_lammps

#endif
