// Tables of the stable Young-Laplace bridge of one contact angle, made for a pair loop: no logarithm, no trigonometry.
//
// Reduced quantities as in young_laplace.hpp. For v = V/R^3 the rupture gap is s_r(v), and the force has a square-root branch point
// there: F = F_r + const sqrt(s_r - s) + ... . Near touching it falls over a gap of about sqrt(v), far less than s_r when v is small.
// Both are resolved by
//   g = 1 / (1 + b s),   b about v^(-1/2),      zeta = sqrt((1 - s/s_r) g) in 0...1 (0 = rupture, 1 = touching),
//   F = g^2 H(zeta, v)
// with a smooth H of order one, a cubic spline in zeta times a cubic in the coordinate mu of v (bridge_columns.hpp); 1/s_r and b are
// cubics in mu.
//
// Unequal spheres, or a sphere and a plane, add the asymmetry e = |R2 - R1| / (R1 + R2) as a third axis, in the coordinate y = e^(1/2):
// exchanging the spheres changes nothing, so that far from rupture e enters as e^2, but near it small asymmetries may act like the
// imperfection of a pitchfork, with e^(2/3); y crowds the nodes where that happens. H and 1/s_r are then times cubics in y.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <type_traits>
#include <vector>

#include "bridge_columns.hpp"

namespace dembark::capillary {

namespace detail {

using Square = std::array<Cubic, 4>;
using Cube = std::array<std::array<double, 16>, 4>;  // [power of mu][4 power of zeta + power of y]

// A cubic in mu; a square [power of y][power of mu].
inline double evaluate(const Cubic& c, double mu, double) { return cubic(c, mu); }
inline double evaluate(const Square& c, double mu, double y) {
  return (cubic(c[0], mu) + cubic(c[1], mu) * y) + (cubic(c[2], mu) + cubic(c[3], mu) * y) * (y * y);
}

// A square [power of zeta][power of mu] and a cube at x in a cell of zeta.
inline double evaluate(const Square& p, double x, double mu, double) {
  const double x2 = x * x, x3 = x2 * x;
  return (cubic(p[0], mu) + cubic(p[1], mu) * x) + (cubic(p[2], mu) * x2 + cubic(p[3], mu) * x3);
}
inline double evaluate(const Cube& c, double x, double mu, double y) {
  std::array<double, 16> at;
  const double mu2 = mu * mu, mu3 = mu2 * mu;
  for (int i = 0; i < 16; ++i) at[i] = (c[0][i] + c[1][i] * mu) + (c[2][i] * mu2 + c[3][i] * mu3);
  const double y2 = y * y, y3 = y2 * y;
  Cubic in_x;
  for (int i = 0; i < 4; ++i) in_x[i] = (at[4 * i] + at[4 * i + 1] * y) + (at[4 * i + 2] * y2 + at[4 * i + 3] * y3);
  return cubic(in_x, x);
}

// The cubic through values at 0, 1/3, 2/3, 1.
inline Cubic through(double a, double b, double c, double d) {
  return {a, -5.5 * a + 9.0 * b - 4.5 * c + d, 9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d, -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d};
}

}  // namespace detail

/// A table of `cells` in zeta and `slices` in y; with no slices, of equal spheres.
template <int slices, int cells>
class BridgeTable {
 public:
  /// Layers for y = 0, 1/(3 slices), ..., 1.
  explicit BridgeTable(const std::vector<detail::Layer<cells>>& layers) {
    for (int slice = 0; slice < std::max(slices, 1); ++slice)
      for (int octave = 0; octave < detail::octaves; ++octave) fill(&layers[3 * slice], 3 * octave);
  }

  /// Rupture gap over R for asymmetry e = 0...1.
  double rupture(double v, double e) const {
    const detail::Place place(v);
    const Slice slice(e);
    return place.shrink / detail::evaluate(row(slice, place).inverse_rupture, place.mu, slice.y);
  }

  /// F / (gamma R) at gap s >= 0 (over R), volume v > 0 (over R^3), asymmetry e = 0...1; 0 beyond rupture.
  double force(double s, double v, double e) const {
    const detail::Place place(v);
    const Slice slice(e);
    const Row& at = row(slice, place);
    const double closeness = 1.0 - s * detail::evaluate(at.inverse_rupture, place.mu, slice.y) / place.shrink;
    if (!(closeness > -1e-12)) return 0.0;
    const double g = 1.0 / (1.0 + s * detail::cubic(at.fall, place.mu) * place.steepen);
    const double zeta = std::sqrt(std::max(closeness, 0.0) * g) * cells;
    const int cell = std::min(static_cast<int>(zeta), cells - 1);
    return g * g * detail::evaluate(patches_[(&at - rows_.data()) * cells + cell], zeta - cell, place.mu, slice.y);
  }

  /// force(0, v, e).
  double touching_force(double v, double e) const {
    const detail::Place place(v);
    const Slice slice(e);
    return detail::evaluate(row(slice, place).touching, place.mu, slice.y);
  }

 private:
  static constexpr bool equal = slices == 0;
  using Line = std::conditional_t<equal, detail::Cubic, detail::Square>;
  using Patch = std::conditional_t<equal, detail::Square, detail::Cube>;
  struct Row {
    Line inverse_rupture, touching;
    detail::Cubic fall;
  };
  struct Slice {
    int index = 0;
    double y = 0.0;
    explicit Slice(double e) {
      if (equal) return;
      const double all = slices * std::sqrt(e);
      index = std::min(static_cast<int>(all), slices - 1);
      y = all - index;
    }
  };

  std::vector<Row> rows_;
  std::vector<Patch> patches_;

  const Row& row(const Slice& slice, const detail::Place& place) const { return rows_[slice.index * detail::octaves + place.octave]; }

  void fill(const detail::Layer<cells>* layers, int node) {
    // What a value of all nodes of a cell in mu, and in y, becomes.
    const auto fit = [layers, node](const auto& value) {
      const auto in_mu = [&](int layer) {
        const detail::Column<cells>* const c = &layers[layer][node];
        return detail::through(value(c[0]), value(c[1]), value(c[2]), value(c[3]));
      };
      if constexpr (equal) return in_mu(0);
      else {
        const detail::Square at{in_mu(0), in_mu(1), in_mu(2), in_mu(3)};
        Line out;
        for (int m = 0; m < 4; ++m) {
          const detail::Cubic in_y = detail::through(at[0][m], at[1][m], at[2][m], at[3][m]);
          for (int k = 0; k < 4; ++k) out[k][m] = in_y[k];
        }
        return out;
      }
    };
    using Column = detail::Column<cells>;
    const Column* const first = &layers[0][node];
    rows_.push_back({fit([](const Column& c) { return c.inverse_rupture; }), fit([](const Column& c) { return c.touching(); }),
                     detail::through(first[0].fall, first[1].fall, first[2].fall, first[3].fall)});
    for (int cell = 0; cell < cells; ++cell) {
      Patch& patch = patches_.emplace_back();
      for (int power = 0; power < 4; ++power) {
        const Line line = fit([cell, power](const Column& c) { return c.spline[cell][power]; });
        if constexpr (equal) patch[power] = line;
        else
          for (int k = 0; k < 4; ++k)
            for (int m = 0; m < 4; ++m) patch[m][4 * power + k] = line[k][m];
      }
    }
  }
};

/// The stable bridge of one contact angle between any two spheres: a table for equal ones, and one for unequal ones that is solved for when
/// the first unequal pair comes. May be read from many threads.
class ExactBridge {
 public:
  /// `theta` in rad, 0...pi/2. std::runtime_error should the solution not converge.
  explicit ExactBridge(double theta) : theta_(theta), equal_({solve<32>(YoungLaplace(theta), touching(theta))}) {}

  // Arguments as in BridgeTable.
  double rupture(double v, double e) const { return e > alike ? unequal().rupture(v, e) : equal_.rupture(v, e); }
  double force(double s, double v, double e) const { return e > alike ? unequal().force(s, v, e) : equal_.force(s, v, e); }
  double touching_force(double v, double e) const { return e > alike ? unequal().touching_force(v, e) : equal_.touching_force(v, e); }

 private:
  static constexpr double alike = 1e-7;  // spheres equal but for round-off; the rupture distance moves by e^(2/3) at most
  static constexpr int slices = 2, cells = 24;

  double theta_;
  BridgeTable<0, 32> equal_;
  mutable std::once_flag solved_;
  mutable std::unique_ptr<const BridgeTable<slices, cells>> unequal_;

  static BridgeCoordinates touching(double theta) { return YoungLaplace(theta).small_touching(detail::node_volume(0)); }

  template <int cells, class Family>
  static detail::Layer<cells> solve(const BridgeSolver<Family>& bridges, const BridgeCoordinates& touching) {
    return detail::LayerSolver<cells, Family>(bridges)(touching);
  }

  /// The bridges of equal spheres as the other table needs them.
  detail::Layer<cells> equal_layer() const {
    detail::Layer<cells> columns;
    for (int node = 0; node <= 3 * detail::octaves; ++node) {
      const double v = detail::node_volume(node);
      auto& c = columns.emplace_back(v, equal_.rupture(v, 0.0));
      c.fit([&](int i) { return equal_.force(c.gap(i), v, 0.0); });
    }
    return columns;
  }

  const BridgeTable<slices, cells>& unequal() const {
    std::call_once(solved_, [this] {
      const YoungLaplace equal(theta_);
      BridgeCoordinates start = touching(theta_);
      equal.solve(detail::node_volume(0), 0.0, start);
      std::vector<detail::Layer<cells>> layers{equal_layer()};
      for (int layer = 1; layer <= 3 * slices; ++layer) {
        const double y = layer / (3.0 * slices);
        layers.push_back(solve<cells>(PairYoungLaplace(theta_, y * y), equal.among_unequal(start)));
      }
      unequal_ = std::make_unique<const BridgeTable<slices, cells>>(layers);
    });
    return *unequal_;
  }
};

}  // namespace dembark::capillary
