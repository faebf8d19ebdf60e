// Shifting: particles move a little from where they are dense to where they are sparse, so that no voids open inside the fluid.
//
//   dx_i = -A h |v_i| dt grad C_i,  grad C_i = sum V grad W,  |dx| <= dx_0 / 10                                          (1)
//
// with A = 2 and V = m/rho_0; S. J. Lind et al., J. Comput. Phys. 231 (2012) 1499, with the coefficient of A. Skillen et al., Comput.
// Methods Appl. Mech. Eng. 265 (2013) 163. Not near a free surface, where grad C is its normal: there the divergence of positions,
// sum V (x_j - x_i) . grad W, the dimension inside, is below 1.5 in the plane and 2.75 in space (E.-S. Lee et al., J. Comput. Phys. 227
// (2008) 8417, for 1.5). Velocities stay; momentum is conserved, angular momentum and potential energy only nearly. Units SI.
#pragma once

#include <cmath>

#include "vector.hpp"

namespace dembark::sph {

struct Shifting {
  double coefficient = 2.0;  ///< A, >= 0; 0 = off

  const char* error() const { return coefficient >= 0.0 && !std::isinf(coefficient) ? nullptr : "shifting must be a number >= 0"; }
};

/// Divergence of positions below which a particle is at a free surface.
inline double surface_threshold(int dimension) { return dimension == 2 ? 1.5 : 2.75; }

/// (1), m. gradient: grad C, 1/m; divergence: of positions.
inline Vector shift(const Shifting& law, int dimension, double h, double spacing, double dt, const Vector& velocity, const Vector& gradient,
                    double divergence) {
  if (divergence < surface_threshold(dimension)) return {};
  const Vector step = (-law.coefficient * h * norm(velocity) * dt) * gradient;
  const double length = norm(step), most = 0.1 * spacing;
  return length > most ? (most / length) * step : step;
}

}  // namespace dembark::sph
