// The whole contact law of two grains by their types, for who integrates contacts anew: known where the pair loop is ours.
#ifndef DEMBARK_PAIR_PARAMETERS_H
#define DEMBARK_PAIR_PARAMETERS_H

#include "dembark/contact.hpp"
#include "per_instance.h"

namespace dembark_liggghts {

class PairParameters {
 public:
  explicit PairParameters(const LAMMPS_NS::LAMMPS* engine) : engine_(engine) {}
  PairParameters(const PairParameters&) = delete;
  PairParameters& operator=(const PairParameters&) = delete;
  virtual ~PairParameters() { make_known(false); }
  virtual dembark::ContactParameters parameters(int type_1, int type_2) const = 0;

  /// Of the pair style of an engine; null: of another combination of models.
  static const PairParameters* of(const LAMMPS_NS::LAMMPS* engine) { return known_[engine]; }

 protected:
  void make_known(bool known) {
    const PairParameters*& mine = known_[engine_];
    if (known) mine = this;
    else if (mine == this) mine = nullptr;
  }

 private:
  inline static PerInstance<const PairParameters*> known_;
  const LAMMPS_NS::LAMMPS* engine_;
};

}  // namespace dembark_liggghts

#endif
