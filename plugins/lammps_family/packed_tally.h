// What packs of contacts (dembark/pairs) have come to, part by part, for fix energy/account.
#ifndef DEMBARK_PACKED_TALLY_H
#define DEMBARK_PACKED_TALLY_H

#include <array>
#include <cmath>
#include <optional>

#include "atom.h"

#include "dembark/contact_energy.hpp"
#include "dembark/contact_history.hpp"
#include "dembark/contact_tally.hpp"
#include "dembark/pairs/pair_step.hpp"
#include "shared_fix.h"

namespace dembark_family {

/// Where the row of numbers of a contact has the parts of its state; -1: nowhere.
struct HistoryPlaces {
  int friction = 0, cohesion = -1, rings = -1, rolling = -1, imbalance = -1;
};

/// Of Hertzian contacts, in steps of some duration: their states must be in their histories.
class PackedTally : public dembark::ResultStore {
  typedef dembark::Vec3<double> Vec3;
  typedef dembark::PairBlock PairBlock;

 public:
  dembark::ContactTally* sums = nullptr;  ///< of the fix; nullptr: nobody asks
  const LAMMPS_NS::Atom* atom = nullptr;
  HistoryPlaces at;
  int frozen = 0;  ///< bit of grains that never move: two of them have no works

  /// What no row of the results has, of a contact in the block: attraction (N); couple of rolling resistance (N m), if it is on.
  void note_cohesive_force(int k, double force) { cohesive_forces_[std::size_t(k)] = force; }
  void note_rolling(int k, bool on, const Vec3& couple) {
    rolls_[std::size_t(k)] = on;
    couples_[std::size_t(k)] = couple;
  }

  void store(const PairBlock& block, int first, int count, const dembark::PackResults& results) override {
    for (int n = 0; n < count; ++n)
      add(block, first + n, {results.force + n, results.moment + n, results.normal + n, results.friction + n});
  }

 private:
  std::array<double, PairBlock::room> cohesive_forces_{};
  std::array<bool, PairBlock::room> rolls_{};
  std::array<Vec3, PairBlock::room> couples_{};

  void add(const PairBlock& block, int k, const dembark::PackResults& of) {
    constexpr double exponent = 1.5;
    const int i = block.grain[k], j = block.partner[k];
    const bool touches = block.pick[k] & 1;
    const double cohesive_force = cohesive_forces_[std::size_t(k)];
    if ((!touches && cohesive_force == 0.0) || (atom->mask[i] & atom->mask[j] & frozen)) return;
    const Vec3 apart = vector(atom->x[i]) - vector(atom->x[j]);
    const double distance = std::sqrt(dot(apart, apart));
    const Vec3 normal = (1.0 / distance) * apart;
    dembark::ContactParts parts;
    parts[dembark::ContactPart::cohesive] = -cohesive_force * normal;
    if (touches) {
      const double *const history = block.history[k], overlap = atom->radius[i] + atom->radius[j] - distance;
      const double normal_stiffness = of.normal[0][3], tangential_stiffness = of.friction[0][3];
      std::optional<dembark::SlipRings> rings;
      if (at.rings >= 0) rings = dembark::load_rings(history + at.rings);
      split_touching(parts, normal, overlap, normal_stiffness * overlap / exponent, exponent,
                     dot(vector(of.normal[0]), normal) + cohesive_force, tangential_stiffness, vector(of.friction[0]),
                     vector(history + at.friction), rings ? &*rings : nullptr);
      if (rolls_[std::size_t(k)])
        split_rolling(parts, couples_[std::size_t(k)], at.rolling >= 0 ? vector(history + at.rolling) : Vec3{},
                      dembark::rolling_stiffness(tangential_stiffness, dembark::reduced(atom->radius[i], atom->radius[j])));
    }
    dembark::ContactLevers levers;
    levers.one = -of.force[0][3] * normal;
    levers.two = of.moment[0][3] * normal;
    sums->add_pair(parts, levers, i, j);
  }
};

}  // namespace dembark_family

#endif
