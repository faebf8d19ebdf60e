// The whole contact law of two grains by their types, for who integrates contacts anew: known where the pair loop is ours.
#ifndef DEMBARK_PAIR_PARAMETERS_H
#define DEMBARK_PAIR_PARAMETERS_H

#include "dembark/contact.hpp"

namespace dembark_liggghts {

class PairParameters {
 public:
  PairParameters() = default;
  PairParameters(const PairParameters&) = delete;
  PairParameters& operator=(const PairParameters&) = delete;
  virtual ~PairParameters() {
    if (known == this) known = nullptr;
  }
  virtual dembark::ContactParameters parameters(int type_1, int type_2) const = 0;

  inline static const PairParameters* known = nullptr;  ///< of the pair style; null: of another combination of models
};

}  // namespace dembark_liggghts

#endif
