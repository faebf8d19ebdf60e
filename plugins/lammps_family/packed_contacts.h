// The contacts of many grains, picked first and computed in packs (dembark/pairs): the same laws and the same numbers to round-off as one
// contact_step() after the other, in less time. Hooke's law and viscous liquid are left to the engine's other loop.
#ifndef DEMBARK_PACKED_CONTACTS_H
#define DEMBARK_PACKED_CONTACTS_H

#include <memory>
#include <vector>

#include "neigh_list.h"

#include "liquid_fix.h"
#include "packed_tally.h"

namespace dembark_family {

class PackedContacts : dembark::ContactCallbacks, dembark::HistoryCallbacks {
  typedef dembark::PairBlock PairBlock;

 protected:
  typedef dembark::Vec3<double> Vec3;

  ~PackedContacts() = default;

  static bool asked() { return dembark::PairLoops::asked_lanes() != 1; }
  /// Before a run. `frozen`: bit of grains that never move; `liquid`: of carried liquid, or nullptr; `sums`: of fix energy/account, or
  /// nullptr.
  void begin(const LAMMPS_NS::Atom& atom, const HistoryPlaces& places, int frozen, LiquidFix* liquid, dembark::ContactTally* sums);
  /// A step of `dt` (s) over `list`, which must hold a grain, without where its histories are. `types`: of grains; `masses`: kg, of what
  /// the grains move with; `keeps`, `keeps_bridges`: whether histories get the new states.
  dembark::PairStep describe(const LAMMPS_NS::NeighList& list, int types, const double* masses, int owned, double dt, bool keeps,
                             bool keeps_bridges);
  void compute_packs(const dembark::PairStep& step) {
    bridge_flag_ = step.bridge_flag;
    packs_.lists(step, *block_);
  }

  PackedTally tally_;
  double dt_ = 0.0;  // of the step

 private:
  /// Of two types of grains.
  virtual const dembark::ContactParameters& law(int type_i, int type_j) const = 0;
  /// Ends the run: the centres of two grains are at the same place, and their contact has no normal.
  virtual void refuse_coincidence(int i, int j) const = 0;
  /// Ends the run where a bridge that forms is longer than the lists look.
  virtual void check_reach(int i, int j, double rupture_distance) const = 0;

  Vec3 friction(const PairBlock& block, int k, const Vec3& normal, double twist, const dembark::NormalResponse<double>& response,
                const Vec3& velocity) override;
  Vec3 rolling(const PairBlock& block, int k, const Vec3& normal, double twist, double normal_force, double tangential_stiffness,
               const Vec3& spin) override;
  double limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) override;
  double sliding_limit(const PairBlock& block, int k, const dembark::RingMotion<double>& motion, const double* rings, double normal_force,
                       double contact_area, double& slip) override;
  void bridges(const PairBlock& block, int first, int count, const double* gap, double* cohesive_force) override;
  const dembark::ContactParameters& law(const PairBlock& block, int k) const {
    return law(atom_->type[block.grain[k]], atom_->type[block.partner[k]]);
  }

  const LAMMPS_NS::Atom* atom_ = nullptr;
  LiquidFix* liquid_ = nullptr;
  const dembark::PairLoops packs_ = dembark::PairLoops::choose();
  const std::unique_ptr<PairBlock> block_ = std::make_unique<PairBlock>();
  // Of a step:
  std::vector<dembark::PackedCoefficients<double>> packed_laws_;
  const double* masses_ = nullptr;
  bool keeps_ = false, keeps_bridges_ = false;
  int bridge_flag_ = 0;
};

}  // namespace dembark_family

#endif
