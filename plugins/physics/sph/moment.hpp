// The moment of the kernel, by which sums over gradients are divided: that of the lattice, or that of each particle's neighbours.
//
//   drho_i/dt = 1/M_i sum m (v_i - v_j) . grad W,   dv_i/dt = -sum m (p_i/(M_i rho_i^2) + p_j/(M_j rho_j^2)) grad W         (1)
//   M_i = -1/d sum_j m/rho_i r^2 W'/r                                                                                      (2)
//
// d: dimension; j: fluid and solid particles. Particles that have left their lattice have a moment that is larger by 1 % at h = 1.3 dx, at
// any spacing: with the moment of the lattice, less pressure carries the weight. (2) is 1/d of the trace of the matrix of J. Bonet & T.-S.
// L. Lok, Comput. Methods Appl. Mech. Eng. 180 (1999) 97. The matrix would make the rates exact for any linear velocity, but forces would
// not be central; with a scalar, momentum and angular momentum stay, and the rate is exact for a linear velocity up to the anisotropy of
// the neighbours. The sums of (1) are adjoint: what pressure takes from the motion is stored as compression.
//
// The sum in (2) is not taken below that over the lattice at rho_0: at free surfaces, where neighbours are missing, nothing is corrected.
// Viscosity and diffusion of density are divided by the moment of the lattice in both. Units SI.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace dembark::sph {

enum class Moment { lattice, particles };
/// Their names, in their order.
inline std::vector<std::string> moment_names() { return {"lattice", "particles"}; }

/// Moment of the lattice over (2) with rho_0 for rho_i, at most 1. divergence: of positions, sum m/rho_0 (x_j - x_i) . grad W.
inline double moment_correction(int dimension, double lattice, double divergence) {
  return lattice / std::max(divergence / dimension, lattice);
}

}  // namespace dembark::sph
