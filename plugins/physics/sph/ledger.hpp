// Energies of a fluid with bodies, and what was lost or done on the way.
//
//   kinetic + potential + compression (fluid) + kinetic + potential (free bodies) + contact
//     = what it was + work - viscous - diffusive - boundary
//
// up to errors of the time step. `boundary` is what solid particles take through their own pressure, which no compression of theirs
// stores, through the guard (pair_terms.hpp), which gives it back, and through viscosity; it may be negative for a while. The work is
// that of moved bodies and of loads. Units J.
#pragma once

namespace dembark::sph {

struct Energies {
  double kinetic = 0.0;                                   ///< of the fluid
  double potential = 0.0;                                 ///< of the fluid under gravity, 0 at the origin
  double compression = 0.0;                               ///< of the fluid
  double bodies = 0.0;                                    ///< kinetic and potential, of free bodies
  double contact = 0.0;                                   ///< of the contact potential
  double viscous = 0.0, diffusive = 0.0, boundary = 0.0;  ///< lost so far
  double work = 0.0;                                      ///< done so far by moved bodies and loads

  double stored() const { return kinetic + potential + compression + bodies + contact; }
};

}  // namespace dembark::sph
