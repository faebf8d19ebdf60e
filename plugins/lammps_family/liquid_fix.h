// fix ID all capillary/liquid [content C | volume V] [share cap|fraction C] [return equal|radius|taken] [max_bridge V]
//     [wall WALL-ID POOL SHARE PART] ...: liquid that grains and walls own.
//
// Contacts report, during a step, which touching ones have no bridge and which bridges broke; at the end of the step the ledger
// (dembark/capillary/liquid_ledger.hpp) settles all of them.
#ifndef DEMBARK_LIQUID_FIX_H
#define DEMBARK_LIQUID_FIX_H

#include "shared_fix.h"

#include "dembark/capillary/bridge.hpp"
#include "dembark/capillary/liquid_words.hpp"
#include "dembark/contact.hpp"

namespace dembark_family {

class LiquidFix : public SharedFix {
 public:
  /// `bridge`: where volume and rupture distance go, `imbalance`: as in NewBridge.
  struct Request : dembark::capillary::BridgeRequest {
    double *bridge = nullptr, *imbalance = nullptr;
    const dembark::capillary::BridgeForce* force = nullptr;
    bool primitive_wall = false;
  };

  /// `wall_style`, `walls_with`: what walls have to be that bridges form to, for messages. `keeps_grains`: what grains own lies in this fix
  /// and goes with them, not in another one's.
  LiquidFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg, const char* wall_style, const char* walls_with, bool keeps_grains);
  ~LiquidFix() override;

  // Contacts work between these stages.
  int setmask() override { return LAMMPS_NS::FixConst::PRE_FORCE | LAMMPS_NS::FixConst::END_OF_STEP; }
  void init() override;
  void setup_pre_force(int) override;
  void pre_force(int) override;
  void end_of_step() override;
  double compute_vector(int n) override;
  double memory_usage() override;

  void grow_arrays(int count) override { ledger_.resize(std::size_t(count)); }
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

  void bridge_broke(const dembark::capillary::BrokenBridge& bridge) { broken_.push_back(bridge); }
  /// After a step of a contact: `before` is its bridge's volume (m^3) before it, `bridge` its volume and rupture distance (m) now,
  /// `imbalance` as in NewBridge; where these stand until the end of the step. A bridge that broke gives its liquid back, a touching
  /// contact without one requests it.
  void report(const dembark::capillary::BridgeSides& sides, double radius, double other_radius, const dembark::Liquid& law, bool touching,
              double before, double* bridge, double* imbalance, bool primitive_wall = false);

 protected:
  typedef std::function<void(int i, int j, double volume, double imbalance)> VisitPair;
  typedef std::function<void(double& volume, double& imbalance)> VisitWall;

  dembark::capillary::GrainLiquid grains() const { return {volumes(), atom->nlocal}; }
  int row_size() const { return int(ledger_.numbers()) + (keeps_grains_ ? 1 : 0); }
  /// The walls that bridges may form to: those named in the arguments, and all others, dry.
  void take_walls(const std::vector<std::string>& names);

  dembark::capillary::LiquidLedger ledger_;
  dembark::capillary::GrainContent content_;
  std::vector<double>* granted_ = nullptr;  // what is being copied to other ranks

 private:
  virtual double* volumes() const = 0;  ///< m^3, of each grain
  virtual void each_pair_bridge(const VisitPair& visit) const = 0;
  virtual void each_wall_bridge(int i, std::size_t wall, const VisitWall& visit) const = 0;
  virtual bool wall_is_there(std::size_t wall) const = 0;
  /// Ends the run where a bridge that forms is longer than the lists look.
  virtual void check_reach(const Request& request, double rupture_distance) const = 0;

  /// With its unit, for messages.
  std::string amount(double volume) const;
  void after_new_list();
  double count_bridges() const;

  const std::string walls_with_, wall_style_;
  const bool keeps_grains_;
  std::vector<std::string> unmet_;  // names of walls in the arguments that no run has found yet
  std::vector<Request> requests_;
  std::vector<dembark::capillary::BrokenBridge> broken_;
};

}  // namespace dembark_family

#endif
