// The stable Young-Laplace bridge of one contact angle between any two spheres: a table for equal ones, and one for unequal ones that is
// solved for when the first unequal pair comes.
#pragma once

#include <memory>
#include <mutex>

#include "bridge_table.hpp"
#include "pair_table.hpp"

namespace dembark::capillary {

/// Reduced quantities as in young_laplace_pair.hpp; `e` is the asymmetry. May be read from many threads.
class ExactBridge {
 public:
  explicit ExactBridge(double theta) : theta_(theta), equal_(theta) {}

  double rupture(double v, double e) const { return e > alike ? unequal().rupture(v, e) : equal_.rupture(v); }
  double force(double s, double v, double e) const { return e > alike ? unequal().force(s, v, e) : equal_.force(s, v); }
  double touching_force(double v, double e) const { return e > alike ? unequal().touching_force(v, e) : equal_.touching_force(v); }

 private:
  static constexpr double alike = 1e-7;  // spheres equal but for round-off; the rupture distance moves by e^(2/3) at most

  double theta_;
  BridgeTable equal_;
  mutable std::once_flag solved_;
  mutable std::unique_ptr<const PairTable> unequal_;

  const PairTable& unequal() const {
    std::call_once(solved_, [this] { unequal_ = std::make_unique<const PairTable>(theta_, equal_); });
    return *unequal_;
  }
};

}  // namespace dembark::capillary
