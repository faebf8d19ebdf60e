// Tables of the stable Young-Laplace bridge of one contact angle, made for a pair loop: no logarithm, no trigonometry.
//
// Reduced quantities as in young_laplace.hpp. For v = V/R^3 the rupture gap is s_r(v), and the force has a square-root branch point
// there: F = F_r + const sqrt(s_r - s) + ... . Near touching it falls over a gap of about sqrt(v), far less than s_r when v is small.
// Both are resolved by
//   g = 1 / (1 + b s),   b about v^(-1/2),      zeta = sqrt((1 - s/s_r) g) in 0...1 (0 = rupture, 1 = touching),
//   F = g^2 H(zeta, v)
// with a smooth H of order one, a cubic spline in zeta times a cubic in the coordinate mu of v; 1/s_r and b are cubics in mu.
// In v a cell is an octave, so that its number is the exponent of the floating-point number; within it mu, a polynomial in m, of the
// mantissa 1 + m stands in for log2(1 + m).
//
// Unequal spheres, or a sphere and a plane, add the asymmetry e = |R2 - R1| / (R1 + R2) as a third axis, in the coordinate y = e^(1/2):
// exchanging the spheres changes nothing, so that far from rupture e enters as e^2, but near it small asymmetries may act like the
// imperfection of a pitchfork, with e^(2/3); y crowds the nodes where that happens. H and 1/s_r are then times cubics in y.
//
// What is here evaluates, on a processor or a device: plain values that point to arrays of numbers. bridge_law.hpp solves for them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "../vec3.hpp"  // DEMBARK_FUNCTION

namespace dembark::capillary {

namespace detail {

constexpr int first_octave = -30;  ///< v >= 2^-30, about 9.3e-10
constexpr int octaves = 30;        ///< v <= 1

using Cubic = std::array<double, 4>;

DEMBARK_FUNCTION inline double cubic(const Cubic& c, double x) { return (c[0] + c[1] * x) + (c[2] + c[3] * x) * (x * x); }

// Near log2(1 + m), 0 and 1 at the ends, and chosen so that v^(-1/3), which 1/s_r nearly is, is a cubic in it to 5e-7: an error e of
// s_r shows as sqrt(e) in the force at rupture.
DEMBARK_FUNCTION inline double octave_coordinate(double m) { return m * ((1.550526 - 0.762722 * m) + (m * m) * (0.252754 - 0.040558 * m)); }

// Octave and coordinate in it. Above the table v is held; below it lengths go on as v^(1/3) and the fall as v^(1/2), the limits of
// a vanishing bridge.
struct Place {
  int octave;
  double mu, shrink = 1.0, steepen = 1.0;
  DEMBARK_FUNCTION explicit Place(double v) {
    std::uint64_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    octave = static_cast<int>(bits >> 52) - 1023 - first_octave;
    if (static_cast<unsigned>(octave) < static_cast<unsigned>(octaves)) {
      bits = (bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL;
      double mantissa;
      std::memcpy(&mantissa, &bits, sizeof mantissa);
      const double m = mantissa - 1.0;
      mu = octave_coordinate(m);
    } else if (octave >= octaves) {
      octave = octaves - 1;
      mu = 1.0;
    } else {
      octave = 0;
      mu = 0.0;
      const double ratio = v / std::ldexp(1.0, first_octave);
      shrink = std::cbrt(ratio);
      steepen = 1.0 / std::sqrt(ratio);
    }
  }
};

using Square = std::array<Cubic, 4>;
using Cube = std::array<std::array<double, 16>, 4>;  // [power of mu][4 power of zeta + power of y]

// A cubic in mu; a square [power of y][power of mu].
DEMBARK_FUNCTION inline double evaluate(const Cubic& c, double mu, double) { return cubic(c, mu); }
DEMBARK_FUNCTION inline double evaluate(const Square& c, double mu, double y) {
  return (cubic(c[0], mu) + cubic(c[1], mu) * y) + (cubic(c[2], mu) + cubic(c[3], mu) * y) * (y * y);
}

// A square [power of zeta][power of mu] and a cube at x in a cell of zeta.
DEMBARK_FUNCTION inline double evaluate(const Square& p, double x, double mu, double) {
  const double x2 = x * x, x3 = x2 * x;
  return (cubic(p[0], mu) + cubic(p[1], mu) * x) + (cubic(p[2], mu) * x2 + cubic(p[3], mu) * x3);
}
DEMBARK_FUNCTION inline double evaluate(const Cube& c, double x, double mu, double y) {
  std::array<double, 16> at;
  const double mu2 = mu * mu, mu3 = mu2 * mu;
  for (int i = 0; i < 16; ++i) at[i] = (c[0][i] + c[1][i] * mu) + (c[2][i] * mu2 + c[3][i] * mu3);
  const double y2 = y * y, y3 = y2 * y;
  Cubic in_x;
  for (int i = 0; i < 4; ++i) in_x[i] = (at[4 * i] + at[4 * i + 1] * y) + (at[4 * i + 2] * y2 + at[4 * i + 3] * y3);
  return cubic(in_x, x);
}

}  // namespace detail

/// A table of `cells` in zeta and `slices` in y; with no slices, of equal spheres. It owns nothing.
template <int slices, int cells>
struct BridgeTable {
  static constexpr bool equal = slices == 0;
  using Line = std::conditional_t<equal, detail::Cubic, detail::Square>;
  using Patch = std::conditional_t<equal, detail::Square, detail::Cube>;
  struct Row {
    Line inverse_rupture, touching;
    detail::Cubic fall;
  };

  static constexpr int row_count = (equal ? 1 : slices) * detail::octaves, patch_count = row_count * cells;
  const Row* rows = nullptr;       ///< [slice][octave]
  const Patch* patches = nullptr;  ///< [slice][octave][cell of zeta]

  /// Rupture gap over R for asymmetry e = 0...1.
  DEMBARK_FUNCTION double rupture(double v, double e) const {
    const detail::Place place(v);
    const Slice slice(e);
    return place.shrink / detail::evaluate(row(slice, place).inverse_rupture, place.mu, slice.y);
  }

  /// F / (gamma R) at gap s >= 0 (over R), volume v > 0 (over R^3), asymmetry e = 0...1; 0 beyond rupture.
  DEMBARK_FUNCTION double force(double s, double v, double e) const {
    const detail::Place place(v);
    const Slice slice(e);
    const Row& at = row(slice, place);
    const double closeness = 1.0 - s * detail::evaluate(at.inverse_rupture, place.mu, slice.y) / place.shrink;
    if (!(closeness > -1e-12)) return 0.0;
    const double g = 1.0 / (1.0 + s * detail::cubic(at.fall, place.mu) * place.steepen);
    const double zeta = std::sqrt(std::max(closeness, 0.0) * g) * cells;
    const int cell = std::min(static_cast<int>(zeta), cells - 1);
    return g * g * detail::evaluate(patches[(&at - rows) * cells + cell], zeta - cell, place.mu, slice.y);
  }

  /// force(0, v, e).
  DEMBARK_FUNCTION double touching_force(double v, double e) const {
    const detail::Place place(v);
    const Slice slice(e);
    return detail::evaluate(row(slice, place).touching, place.mu, slice.y);
  }

 private:
  struct Slice {
    int index = 0;
    double y = 0.0;
    DEMBARK_FUNCTION explicit Slice(double e) {
      if (equal) return;
      const double all = slices * std::sqrt(e);
      index = std::min(static_cast<int>(all), slices - 1);
      y = all - index;
    }
  };

  DEMBARK_FUNCTION const Row& row(const Slice& slice, const detail::Place& place) const {
    return rows[slice.index * detail::octaves + place.octave];
  }
};

/// The stable bridge of one contact angle between any two spheres. Arguments and results as in BridgeTable; no number where the table for
/// unequal spheres is needed and is not there.
struct ExactTables {
  static constexpr double alike = 1e-7;  // spheres equal but for round-off; the rupture distance moves by e^(2/3) at most
  BridgeTable<0, 32> equal{};
  BridgeTable<2, 24> unequal{};

  DEMBARK_FUNCTION double rupture(double v, double e) const {
    if (!(e > alike)) return equal.rupture(v, e);
    return unequal.rows ? unequal.rupture(v, e) : NAN;
  }
  DEMBARK_FUNCTION double force(double s, double v, double e) const {
    if (!(e > alike)) return equal.force(s, v, e);
    return unequal.rows ? unequal.force(s, v, e) : NAN;
  }
  DEMBARK_FUNCTION double touching_force(double v, double e) const {
    if (!(e > alike)) return equal.touching_force(v, e);
    return unequal.rows ? unequal.touching_force(v, e) : NAN;
  }
};

}  // namespace dembark::capillary
