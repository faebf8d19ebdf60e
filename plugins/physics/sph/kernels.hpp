// Smoothing kernels W(r, h) with support 2h, in two and three dimensions, and their slopes.
//
//   Wendland C2   W = a (1 - q/2)^4 (1 + 2q),  q = r/h < 2;  a = 7/(4 pi h^2) in the plane, 21/(16 pi h^3) in space
//   cubic spline  W = a [1 - 3/2 q^2 + 3/4 q^3],  q < 1;  a/4 (2 - q)^3,  1 <= q < 2;  a = 10/(7 pi h^2), 1/(pi h^3)
//
// Both integrate to 1. H. Wendland, Adv. Comput. Math. 4 (1995) 389; J. J. Monaghan & J. C. Lattanzio, Astron. Astrophys. 149 (1985) 135.
// The slope is W'(r)/r, so that grad W = slope (x_i - x_j) without a division by r; it is 0 or less. Wendland's has no zero at r = 0 and
// keeps its sign of curvature in q, which is why particles do not pair under it; the spline is what the cited schemes of others use.
//
// Written for double and for packs (pack.hpp) alike. Units SI.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "../constants.hpp"
#include "../pack.hpp"

namespace dembark::sph {

/// Radius of both kernels over h.
constexpr double support = 2.0;

enum class KernelName { wendland_c2, cubic_spline };
/// Their names, in their order.
inline std::vector<std::string> kernel_names() { return {"wendland_c2", "cubic_spline"}; }

class WendlandC2 {
 public:
  /// dimension: 2 or 3; h: smoothing length (m), > 0.
  WendlandC2(int dimension, double h)
      : inverse_(1.0 / h),
        norm_(dimension == 2 ? 7.0 / (4.0 * pi * h * h) : 21.0 / (16.0 * pi * h * h * h)),
        steepness_(-5.0 * norm_ / (h * h)) {}

  /// W (1/m^dimension) at the distance r (m).
  template <class Real>
  DEMBARK_HOT Real value(const Real& r) const {
    const Real q = r * Real(inverse_), s = rest(q), square = s * s;
    return Real(norm_) * (square * square) * (Real(1.0) + Real(2.0) * q);
  }
  /// W'(r)/r (1/m^(dimension + 2)).
  template <class Real>
  DEMBARK_HOT Real slope(const Real& r) const {
    const Real s = rest(r * Real(inverse_));
    return Real(steepness_) * (s * s * s);
  }

 private:
  template <class Real>
  DEMBARK_HOT static Real rest(const Real& q) {
    return select(q < Real(2.0), Real(1.0) - Real(0.5) * q, Real(0.0));
  }
  double inverse_, norm_, steepness_;
};

class CubicSpline {
 public:
  CubicSpline(int dimension, double h)
      : inverse_(1.0 / h), norm_(dimension == 2 ? 10.0 / (7.0 * pi * h * h) : 1.0 / (pi * h * h * h)), steepness_(norm_ / (h * h)) {}

  template <class Real>
  DEMBARK_HOT Real value(const Real& r) const {
    const Real q = r * Real(inverse_), s = rest(q);
    return Real(norm_) * select(q < Real(1.0), Real(1.0) - q * q * (Real(1.5) - Real(0.75) * q), Real(0.25) * (s * s * s));
  }
  template <class Real>
  DEMBARK_HOT Real slope(const Real& r) const {
    const Real q = r * Real(inverse_), s = rest(q);
    // Outside of its range either branch is computed and dropped: q there is kept away from 0.
    const Real far = select(q < Real(1.0), Real(1.0), q);
    return Real(steepness_) * select(q < Real(1.0), Real(2.25) * q - Real(3.0), Real(-0.75) * (s * s) / far);
  }

 private:
  template <class Real>
  DEMBARK_HOT static Real rest(const Real& q) {
    return select(q < Real(2.0), Real(2.0) - q, Real(0.0));
  }
  double inverse_, norm_, steepness_;
};

/// Calls work(r^2) for the particles of a square or cubic lattice of this spacing (m) around one of them that the kernel reaches, itself
/// too.
template <class Work>
void each_of_lattice(int dimension, double h, double spacing, const Work& work) {
  const int reach = int(support * h / spacing) + 1, depth = dimension == 3 ? reach : 0;
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j)
      for (int k = -depth; k <= depth; ++k) work(spacing * spacing * double(i * i + j * j + k * k));
}

/// What the sum over a square or cubic lattice of spacing dx makes of the gradient of a linear field, 1 for h much larger than dx:
/// -1/dimension sum dx^dimension r^2 slope(r). 0.974 in the plane and 0.979 in space for Wendland's kernel with h = 1.3 dx. Sums over
/// gradients divided by it give still water its own pressure at any h; forces stay antisymmetric.
template <class Kernel>
double lattice_moment(const Kernel& kernel, int dimension, double h, double spacing) {
  double sum = 0.0;
  each_of_lattice(dimension, h, spacing, [&](double squared) {
    if (squared > 0.0) sum -= squared * kernel.slope(std::sqrt(squared));
  });
  return sum * std::pow(spacing, dimension) / dimension;
}

}  // namespace dembark::sph
