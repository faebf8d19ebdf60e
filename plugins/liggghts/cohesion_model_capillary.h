// LIGGGHTS adapter of capillary bridges. The volume of a bridge is fixed by the types, or taken from the grains (carried_liquid on, with
// fix capillary/liquid, which settles what forms and breaks).
//
//   pair_style gran model hertz tangential ... cohesion capillary [capillary_model exact|willett|willett_full|rabinovich|bagheri|constant]
//              [viscous_liquid on|off] [carried_liquid on|off]
//
// Works compiled out of tree into liggghts-dembark and, unchanged, copied into a LIGGGHTS src/ folder.
#ifdef COHESION_MODEL
COHESION_MODEL(COHESION_CAPILLARY,capillary,20)
#else

#ifndef COHESION_MODEL_CAPILLARY_H_
#define COHESION_MODEL_CAPILLARY_H_

#include "cohesion_on_core.h"

namespace LIGGGHTS {
namespace ContactModels {

template <>
class CohesionModel<COHESION_CAPILLARY> : public CohesionOnCore<true> {
 public:
  using CohesionOnCore<true>::CohesionOnCore;
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif  // COHESION_MODEL_CAPILLARY_H_
#endif
