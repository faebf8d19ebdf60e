// LIGGGHTS adapter of the adhesion of dry surfaces: dembark/cohesion/adhesion.hpp.
//
//   pair_style gran model hertz tangential ... cohesion adhesion [adhesion_law jkr|dmt|constant]
//
// Works compiled out of tree into liggghts-dembark and, unchanged, copied into a LIGGGHTS src/ folder.
#ifdef COHESION_MODEL
COHESION_MODEL(COHESION_ADHESION,adhesion,21)
#else

#ifndef COHESION_MODEL_ADHESION_H_
#define COHESION_MODEL_ADHESION_H_

#include "cohesion_on_core.h"

namespace LIGGGHTS {
namespace ContactModels {

template <>
class CohesionModel<COHESION_ADHESION> : public CohesionOnCore<false> {
 public:
  using CohesionOnCore<false>::CohesionOnCore;
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif  // COHESION_MODEL_ADHESION_H_
#endif
