// Shepard's filter: in every so many steps the density of the fluid becomes a mean over its neighbours and itself.
//
//   rho_i = sum_j m W~,  W~ = W / sum_k (m/rho_k) W                                                                         (1)
//
// A. Colagrossi & M. Landrini, J. Comput. Phys. 191 (2003) 448, with D. Shepard's normalisation (Proc. 23rd ACM Nat. Conf. (1968) 517)
// of the kernel. j and k: fluid within the support, i too, no solid particles, as in SPHysics (M. Gomez-Gesteira et al., Comput. Geosci. 48
// (2012) 289), which filters every 30 steps. The weights (m/rho_j) W~ sum to one: a uniform density stays as it is, and none leaves the
// range of its neighbours', at free surfaces, too. At a floor, where all neighbours are above, still water gets too low a pressure. The
// mass of particles stays. Units SI.
#pragma once

#include "../pack.hpp"

namespace dembark::sph {

/// What a neighbour, or the particle itself, adds to the two sums of (1) over m: W and W/rho.
template <class Real>
struct ShepardTerms {
  Real weight, volume;
};

/// w: W (1/m^dimension) at the distance of the neighbour with the density rho (kg/m^3).
template <class Real>
DEMBARK_HOT ShepardTerms<Real> shepard_terms(const Real& w, const Real& rho) {
  return {w, w / rho};
}

/// (1), kg/m^3, from the sums over neighbours and the particle itself.
inline double shepard_density(double weight, double volume) { return weight / volume; }

/// Whether the step with this number, from 1 on, filters; every: 0 = none does.
inline bool shepard_is_due(int every, long step) { return every > 0 && step % every == 0; }

}  // namespace dembark::sph
