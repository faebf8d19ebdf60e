// The contacts of many grains, picked first and computed in packs (dembark/pairs): the same laws and the same numbers to round-off as one
// contact_step() after the other, in less time. Hooke's law and viscous liquid are left to the other loop.
#ifndef DEMBARK_PACKED_CONTACTS_H
#define DEMBARK_PACKED_CONTACTS_H

#include <memory>
#include <vector>

#include "pointers.h"

#include "contact_coefficients.h"
#include "dembark/pairs/pair_step.hpp"
#include "neighbor_history.h"
#include "packed_tally.h"

namespace LAMMPS_NS {
class FixCapillaryLiquid;
class NeighList;
}  // namespace LAMMPS_NS

namespace dembark_lammps {

class PackedContacts : dembark::ScalarLaws, dembark::ScalarMemory, LAMMPS_NS::Pointers {
 public:
  PackedContacts(LAMMPS_NS::LAMMPS* lmp, const ContactCoefficients& coefficients) : Pointers(lmp), coefficients_(coefficients) {}

  /// After the last pair_coeff: whether packs know the law. `tally`: that of fix energy/account, or nullptr.
  bool prepare(int freeze_bit, LAMMPS_NS::FixCapillaryLiquid* liquid, dembark::ContactTally* tally);
  /// Forces, torques and histories of a step. `masses`: kg, of what the grains move with.
  void step(const LAMMPS_NS::NeighList& list, const NeighborHistory& history, const double* masses);

 private:
  typedef dembark::Vec3<double> Vec3;
  typedef dembark::PairBlock PairBlock;

  Vec3 friction(const PairBlock& block, int k, const Vec3& normal, double twist, const dembark::NormalResponse<double>& response,
                const Vec3& velocity) override;
  Vec3 rolling(const PairBlock& block, int k, const Vec3& normal, double twist, double normal_force, double tangential_stiffness,
               const Vec3& spin) override;
  double limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) override;
  double sliding_limit(const PairBlock& block, int k, const dembark::RingMotion<double>& motion, const double* rings, double normal_force,
                       double contact_area, double& slip) override;
  void bridges(const PairBlock& block, int first, int count, const double* gap, double* pull) override;
  const dembark::ContactParameters& law(const PairBlock& block, int k) const;
  void collect_laws();

  const ContactCoefficients& coefficients_;
  dembark::HistoryLayout layout_;
  int freeze_bit_ = 0;
  const double* masses_ = nullptr;
  LAMMPS_NS::FixCapillaryLiquid* liquid_ = nullptr;
  const dembark::PairLoops packs_ = dembark::PairLoops::choose();
  const std::unique_ptr<PairBlock> block_ = std::make_unique<PairBlock>();
  std::vector<dembark::PairLaw<double>> laws_;  // of this step
  dembark_family::PackedTally tally_;
};

}  // namespace dembark_lammps

#endif
