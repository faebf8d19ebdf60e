// What an atom is in the scene of pair_style sph/coupled.
#pragma once

namespace dembark_liggghts {

enum class SphRole : unsigned char {
  fluid,      ///< of the fluid
  solid,      ///< of a wall or body that acts by pressure
  repelling,  ///< of a body that acts by the contact potential
  none,       ///< takes no part
};

struct SphParticle {
  SphRole role = SphRole::none;
  int number = -1;  ///< among those of its role, those of this rank first
};

}  // namespace dembark_liggghts
