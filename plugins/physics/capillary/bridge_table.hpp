// Table of the stable Young-Laplace bridge of one contact angle, made for a pair loop: no logarithm, no trigonometry.
//
// Reduced quantities as in young_laplace.hpp. For v = V/R^3 the rupture gap is s_r(v), and the force has a square-root branch point
// there: F = F_r + const sqrt(s_r - s) + ... . Near touching it falls over a gap of about sqrt(v), far less than s_r when v is small.
// Both are resolved by
//   g = 1 / (1 + b s),   b about v^(-1/2),      zeta = sqrt((1 - s/s_r) g) in 0...1 (0 = rupture, 1 = touching),
//   F = g^2 H(zeta, v)
// with a smooth H of order one. In v a cell is an octave, so that its number is the exponent of the floating-point number; within
// it the coordinate mu, a polynomial in m, of the mantissa 1 + m stands in for log2(1 + m). H is a cubic spline in zeta times a cubic in mu;
// 1/s_r and b are cubics in mu.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "young_laplace.hpp"

namespace dembark::capillary {

class BridgeTable {
 public:
  static constexpr int first_octave = -30;  ///< v >= 2^-30, about 9.3e-10
  static constexpr int octaves = 30;        ///< v <= 1
  static constexpr int cells = 32;          ///< in zeta

  /// Solves Young and Laplace's equation for contact angle `theta` (rad, 0...pi/2); std::runtime_error should it not converge.
  explicit BridgeTable(double theta) : rows_(octaves), patches_(octaves * cells) {
    const YoungLaplace bridges(theta);
    std::array<Column, 4> columns;
    ShapeCoordinates touching = bridges.small_touching(volume_at(0, 0.0)), before = touching;
    int solved = 0;
    for (int octave = 0; octave < octaves; ++octave) {
      if (octave > 0) columns[0] = columns[3];
      for (int node = octave > 0 ? 1 : 0; node < 4; ++node) {
        const double v = volume_at(octave, node / 3.0);
        ShapeCoordinates guess = touching;
        if (solved > 1) {
          guess.phase += touching.phase - before.phase;
          guess.log_slenderness += touching.log_slenderness - before.log_slenderness;
        }
        require(bridges.solve(v, 0.0, guess), theta, v);
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
    return place.shrink / cubic(rows_[place.octave].inverse_rupture, place.mu);
  }

  /// F / (gamma R) at gap s >= 0 (over R), volume v > 0 (over R^3); 0 beyond rupture.
  double force(double s, double v) const {
    const Place place(v);
    const Row& row = rows_[place.octave];
    const double closeness = 1.0 - s * cubic(row.inverse_rupture, place.mu) / place.shrink;
    if (!(closeness > -1e-12)) return 0.0;
    const double g = 1.0 / (1.0 + s * cubic(row.fall, place.mu) * place.steepen);
    const double zeta = std::sqrt(std::max(closeness, 0.0) * g) * cells;
    const int cell = std::min(static_cast<int>(zeta), cells - 1);
    return g * g * bicubic(patches_[place.octave * cells + cell], zeta - cell, place.mu);
  }

  /// force(0, v).
  double touching_force(double v) const {
    const Place place(v);
    return cubic(rows_[place.octave].touching, place.mu);
  }

 private:
  using Cubic = std::array<double, 4>;
  struct Row {
    Cubic inverse_rupture, fall, touching;
  };
  using Patch = std::array<Cubic, 4>;  // [power of zeta][power of mu]

  struct Column {
    double inverse_rupture = 0.0, fall = 0.0;
    std::array<Cubic, cells> spline{};
  };

  // Octave and coordinate in it. Above the table v is held; below it lengths go on as v^(1/3) and the fall as v^(1/2), the limits of
  // a vanishing bridge.
  struct Place {
    int octave;
    double mu, shrink = 1.0, steepen = 1.0;
    explicit Place(double v) {
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

  std::vector<Row> rows_;
  std::vector<Patch> patches_;

  // Near log2(1 + m), 0 and 1 at the ends, and chosen so that v^(-1/3), which 1/s_r nearly is, is a cubic in it to 5e-7: an error e of
  // s_r shows as sqrt(e) in the force at rupture.
  static double octave_coordinate(double m) { return m * ((1.550526 - 0.762722 * m) + (m * m) * (0.252754 - 0.040558 * m)); }

  static double volume_at(int octave, double mu) {
    double m = mu;
    for (int iteration = 0; iteration < 40; ++iteration) m += mu - octave_coordinate(m);
    return std::ldexp(1.0 + m, first_octave + octave);
  }

  static double cubic(const Cubic& c, double x) { return (c[0] + c[1] * x) + (c[2] + c[3] * x) * (x * x); }

  static double bicubic(const Patch& p, double x, double y) {
    const double x2 = x * x, x3 = x2 * x;
    return (cubic(p[0], y) + cubic(p[1], y) * x) + (cubic(p[2], y) * x2 + cubic(p[3], y) * x3);
  }

  static void require(bool converged, double theta, double v) {
    if (converged) return;
    char line[128];
    std::snprintf(line, sizeof line, "the liquid bridge of contact angle %g rad and volume %g R^3 did not converge", theta, v);
    throw std::runtime_error(line);
  }

  static Column column(const YoungLaplace& bridges, double theta, double v, const ShapeCoordinates& touching) {
    ShapeCoordinates edge = touching;
    std::vector<ShapeCoordinates> path{touching};
    require(bridges.rupture(v, edge, &path), theta, v);
    const BridgeShape last = bridges.shape(edge);
    Column c;
    c.inverse_rupture = 1.0 / last.gap;
    c.fall = 1.0 / std::sqrt(v);
    std::array<double, cells + 1> h;
    h[0] = last.force * square(1.0 + c.fall * last.gap);
    // Starts between points of the path keep Newton's method on the stable branch up to the fold.
    std::size_t right = 1;
    double left_gap = 0.0, right_gap = bridges.shape(path[1]).gap;
    for (int i = cells; i > 0; --i) {
      const double zeta2 = square(static_cast<double>(i) / cells);
      const double gap = (1.0 - zeta2) / (c.inverse_rupture + c.fall * zeta2);
      while (gap > right_gap && right + 1 < path.size()) {
        left_gap = right_gap;
        right_gap = bridges.shape(path[++right]).gap;
      }
      const double part = (gap - left_gap) / (right_gap - left_gap);
      const ShapeCoordinates &near = path[right - 1], &far = path[right];
      ShapeCoordinates x{near.phase + part * (far.phase - near.phase),
                         near.log_slenderness + part * (far.log_slenderness - near.log_slenderness)};
      require(bridges.solve(v, gap, x), theta, v);
      h[i] = bridges.shape(x).force * square(1.0 + c.fall * gap);
    }
    c.spline = spline(h);
    return c;
  }

  static double square(double x) { return x * x; }

  // Not-a-knot cubic spline through equidistant values; coefficients of each interval in 0...1.
  static std::array<Cubic, cells> spline(const std::array<double, cells + 1>& h) {
    constexpr int n = cells;
    std::array<double, n + 1> second{}, upper{}, right{};
    const auto bend = [&h](int i) { return h[i - 1] - 2.0 * h[i] + h[i + 1]; };
    // M_{i-1} + 4 M_i + M_{i+1} = 6 bend, with M_0 = 2 M_1 - M_2 put in: M_1 = bend(1), M_{n-1} = bend(n-1).
    second[1] = bend(1);
    second[n - 1] = bend(n - 1);
    for (int i = 2; i < n - 1; ++i) {
      const double rest = i == 2 ? second[1] : 0.0, below = i == 2 ? 0.0 : 1.0;
      const double pivot = 4.0 - below * upper[i - 1];
      upper[i] = 1.0 / pivot;
      right[i] = (6.0 * bend(i) - rest - (i == n - 2 ? second[n - 1] : 0.0) - below * right[i - 1]) / pivot;
    }
    for (int i = n - 2; i >= 2; --i) second[i] = right[i] - (i == n - 2 ? 0.0 : upper[i] * second[i + 1]);
    second[0] = 2.0 * second[1] - second[2];
    second[n] = 2.0 * second[n - 1] - second[n - 2];
    std::array<Cubic, cells> c;
    for (int i = 0; i < n; ++i)
      c[i] = {h[i], h[i + 1] - h[i] - (2.0 * second[i] + second[i + 1]) / 6.0, 0.5 * second[i], (second[i + 1] - second[i]) / 6.0};
    return c;
  }

  // The cubic through values at mu = 0, 1/3, 2/3, 1.
  static Cubic through(double a, double b, double c, double d) {
    return {a, -5.5 * a + 9.0 * b - 4.5 * c + d, 9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d, -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d};
  }

  void fill(int octave, const std::array<Column, 4>& c) {
    Row& row = rows_[octave];
    row.inverse_rupture = through(c[0].inverse_rupture, c[1].inverse_rupture, c[2].inverse_rupture, c[3].inverse_rupture);
    row.fall = through(c[0].fall, c[1].fall, c[2].fall, c[3].fall);
    for (int cell = 0; cell < cells; ++cell)
      for (int power = 0; power < 4; ++power)
        patches_[octave * cells + cell][power] =
            through(c[0].spline[cell][power], c[1].spline[cell][power], c[2].spline[cell][power], c[3].spline[cell][power]);
    const Patch& last = patches_[octave * cells + cells - 1];
    for (int power = 0; power < 4; ++power) row.touching[power] = last[0][power] + last[1][power] + last[2][power] + last[3][power];
  }
};

}  // namespace dembark::capillary
