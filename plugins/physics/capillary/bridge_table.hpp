// Table of the stable Young-Laplace bridge of one contact angle, made for a pair loop: no logarithm, no trigonometry.
//
// Reduced quantities as in young_laplace.hpp. For v = V/R^3 the rupture gap is s_r(v), and the force has a square-root branch point
// there: F = F_r + const sqrt(s_r - s) + ... . Near touching it falls over a gap of about sqrt(v), far less than s_r when v is small.
// Both are resolved by
//   g = 1 / (1 + b s),   b about v^(-1/2),      zeta = sqrt((1 - s/s_r) g) in 0...1 (0 = rupture, 1 = touching),
//   F = g^2 H(zeta, v)
// with a smooth H of order one. In v a cell is an octave, so that its number is the exponent of the floating-point number; within
// it the coordinate mu, a polynomial in m, of the mantissa 1 + m stands in for log2(1 + m). H is a cubic spline in zeta times a cubic in
// mu; 1/s_r and b are cubics in mu.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "table_parts.hpp"
#include "young_laplace.hpp"

namespace dembark::capillary {

class BridgeTable {
 public:
  static constexpr int octaves = detail::octaves;
  static constexpr int cells = 32;  ///< in zeta

  /// Solves Young and Laplace's equation for contact angle `theta` (rad, 0...pi/2); std::runtime_error should it not converge.
  explicit BridgeTable(double theta) : rows_(octaves), patches_(octaves * cells) {
    const YoungLaplace bridges(theta);
    std::array<detail::Column<cells>, 4> columns;
    ShapeCoordinates touching = bridges.small_touching(detail::volume_at(0, 0.0)), before = touching;
    int solved = 0;
    for (int octave = 0; octave < octaves; ++octave) {
      if (octave > 0) columns[0] = columns[3];
      for (int node = octave > 0 ? 1 : 0; node < 4; ++node) {
        const double v = detail::volume_at(octave, node / 3.0);
        ShapeCoordinates guess = solved > 1 ? between(before, touching, 2.0) : touching;
        detail::require(bridges.solve(v, 0.0, guess), theta, v);
        before = touching;
        touching = guess;
        ++solved;
        columns[node] = column(bridges, theta, v, touching);
      }
      fill(octave, columns);
    }
  }

  /// Rupture gap over R.
  double rupture(double v) const {
    const Place place(v);
    return place.shrink / detail::cubic(rows_[place.octave].inverse_rupture, place.mu);
  }

  /// F / (gamma R) at gap s >= 0 (over R), volume v > 0 (over R^3); 0 beyond rupture.
  double force(double s, double v) const {
    const Place place(v);
    const Row& row = rows_[place.octave];
    const double closeness = 1.0 - s * detail::cubic(row.inverse_rupture, place.mu) / place.shrink;
    if (!(closeness > -1e-12)) return 0.0;
    const double g = 1.0 / (1.0 + s * detail::cubic(row.fall, place.mu) * place.steepen);
    const double zeta = std::sqrt(std::max(closeness, 0.0) * g) * cells;
    const int cell = std::min(static_cast<int>(zeta), cells - 1);
    return g * g * bicubic(patches_[place.octave * cells + cell], zeta - cell, place.mu);
  }

  /// force(0, v).
  double touching_force(double v) const {
    const Place place(v);
    return detail::cubic(rows_[place.octave].touching, place.mu);
  }

 private:
  using Cubic = detail::Cubic;
  using Place = detail::Place;
  struct Row {
    Cubic inverse_rupture, fall, touching;
  };
  using Patch = std::array<Cubic, 4>;  // [power of zeta][power of mu]

  std::vector<Row> rows_;
  std::vector<Patch> patches_;

  static double bicubic(const Patch& p, double x, double y) {
    const double x2 = x * x, x3 = x2 * x;
    return (detail::cubic(p[0], y) + detail::cubic(p[1], y) * x) + (detail::cubic(p[2], y) * x2 + detail::cubic(p[3], y) * x3);
  }

  static detail::Column<cells> column(const YoungLaplace& bridges, double theta, double v, const ShapeCoordinates& touching) {
    ShapeCoordinates edge = touching;
    std::vector<ShapeCoordinates> path{touching};
    std::array<ShapeCoordinates, cells + 1> at;
    detail::Column<cells> c;
    detail::require(bridges.rupture(v, edge, &path) && detail::solve_column(bridges, v, path, at, c), theta, v);
    return c;
  }

  void fill(int octave, const std::array<detail::Column<cells>, 4>& c) {
    Row& row = rows_[octave];
    row.inverse_rupture = detail::through(c[0].inverse_rupture, c[1].inverse_rupture, c[2].inverse_rupture, c[3].inverse_rupture);
    row.fall = detail::through(c[0].fall, c[1].fall, c[2].fall, c[3].fall);
    for (int cell = 0; cell < cells; ++cell)
      for (int power = 0; power < 4; ++power)
        patches_[octave * cells + cell][power] =
            detail::through(c[0].spline[cell][power], c[1].spline[cell][power], c[2].spline[cell][power], c[3].spline[cell][power]);
    row.touching = detail::through(c[0].touching(), c[1].touching(), c[2].touching(), c[3].touching());
  }
};

}  // namespace dembark::capillary
