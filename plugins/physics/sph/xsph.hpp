// XSPH: particles drift with a velocity that is smoothed over their neighbours, so that they keep their order.
//
//   dx_i/dt = v_i + epsilon sum_j m/rho_ij (v_j - v_i) W,  rho_ij = (rho_i + rho_j)/2                                      (1)
//
// J. J. Monaghan, J. Comput. Phys. 82 (1989) 1. j: fluid. The velocities themselves stay; the sum is antisymmetric, so that the centre of
// mass drifts with the momentum. Like shifting, it is a displacement in the step after that whose velocities it is taken from. What it does
// to energies is not counted. Limits: epsilon = 0 is none; 0.5 is usual. Units SI.
#pragma once

#include "../pack.hpp"

namespace dembark::sph {

struct Xsph {
  double epsilon = 0.0;  ///< 0 ... 1; 0 = off

  const char* error() const { return epsilon >= 0.0 && epsilon <= 1.0 ? nullptr : "xsph must be between 0 and 1"; }
  bool on() const { return epsilon > 0.0; }
};

/// Weight of v_j - v_i in (1) over epsilon m, the same for i and j. w: W (1/m^dimension).
template <class Real>
DEMBARK_HOT Real xsph_weight(const Real& w, const Real& rho_i, const Real& rho_j) {
  return Real(2.0) * w / (rho_i + rho_j);
}

}  // namespace dembark::sph
