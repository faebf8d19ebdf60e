// Table of the stable Young-Laplace bridge of one contact angle between unequal spheres, or a sphere and a plane.
//
// As bridge_table.hpp, with the asymmetry e = |R2 - R1| / (R1 + R2) as a third axis, in the coordinate y = e^(1/2): exchanging the spheres
// changes nothing, so that far from rupture e enters as e^2, but near it small asymmetries may act like the imperfection of a
// pitchfork, with e^(2/3); y crowds the nodes where that happens. F = g^2 H(zeta, v, y), H a cubic spline in zeta times cubics in mu and
// in y, 1/s_r a cubic in mu times one in y.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bridge_table.hpp"
#include "table_parts.hpp"
#include "young_laplace_pair.hpp"

namespace dembark::capillary {

class PairTable {
 public:
  static constexpr int octaves = detail::octaves;
  static constexpr int cells = 24;  ///< in zeta
  static constexpr int slices = 2;  ///< in y

  /// Solves for contact angle `theta` (rad, 0...pi/2); `equal` is its table for equal spheres. std::runtime_error should it not converge.
  PairTable(double theta, const BridgeTable& equal) : rows_(slices * octaves), patches_(slices * octaves * cells) {
    // Columns of all volumes for the four asymmetries of a slice.
    std::array<std::vector<Column>, 4> layers;
    layers[3] = equal_layer(equal);
    for (int slice = 0; slice < slices; ++slice) {
      std::swap(layers[0], layers[3]);
      for (int k = 1; k < 4; ++k) layers[k] = layer(theta, detail::square((slice + k / 3.0) / slices));
      fill(slice, layers);
    }
  }

  /// Rupture gap over R for asymmetry e = 0...1.
  double rupture(double v, double e) const {
    const detail::Place place(v);
    const Slice at(e);
    return place.shrink / surface(rows_[at.index * octaves + place.octave].inverse_rupture, place.mu, at.y);
  }

  /// F / (gamma R) at gap s >= 0 (over R), volume v > 0 (over R^3), asymmetry e = 0...1; 0 beyond rupture.
  double force(double s, double v, double e) const {
    const detail::Place place(v);
    const Slice at(e);
    const int row = at.index * octaves + place.octave;
    const double closeness = 1.0 - s * surface(rows_[row].inverse_rupture, place.mu, at.y) / place.shrink;
    if (!(closeness > -1e-12)) return 0.0;
    const double g = 1.0 / (1.0 + s * detail::cubic(rows_[row].fall, place.mu) * place.steepen);
    const double zeta = std::sqrt(std::max(closeness, 0.0) * g) * cells;
    const int cell = std::min(static_cast<int>(zeta), cells - 1);
    return g * g * volume(patches_[row * cells + cell], zeta - cell, place.mu, at.y);
  }

  /// force(0, v, e).
  double touching_force(double v, double e) const {
    const detail::Place place(v);
    const Slice at(e);
    return surface(rows_[at.index * octaves + place.octave].touching, place.mu, at.y);
  }

 private:
  using Cubic = detail::Cubic;
  using Surface = std::array<Cubic, 4>;                 // [power of y][power of mu]
  using Patch = std::array<std::array<double, 16>, 4>;  // [power of mu][4 power of zeta + power of y]
  struct Row {
    Surface inverse_rupture, touching;
    Cubic fall;
  };
  using Column = detail::Column<cells>;
  struct Slice {
    int index;
    double y;
    explicit Slice(double e) {
      const double all = slices * std::sqrt(e);
      index = std::min(static_cast<int>(all), slices - 1);
      y = all - index;
    }
  };

  /// A solved column: bridges at zeta = i / cells, the last stable one first.
  using Bridges = std::array<PairCoordinates, cells + 1>;

  std::vector<Row> rows_;
  std::vector<Patch> patches_;

  static double surface(const Surface& c, double mu, double y) {
    return (detail::cubic(c[0], mu) + detail::cubic(c[1], mu) * y) + (detail::cubic(c[2], mu) + detail::cubic(c[3], mu) * y) * (y * y);
  }

  static double volume(const Patch& c, double x, double mu, double y) {
    std::array<double, 16> at;
    const double mu2 = mu * mu, mu3 = mu2 * mu;
    for (int i = 0; i < 16; ++i) at[i] = (c[0][i] + c[1][i] * mu) + (c[2][i] * mu2 + c[3][i] * mu3);
    const double y2 = y * y, y3 = y2 * y;
    Cubic in_x;
    for (int i = 0; i < 4; ++i) in_x[i] = (at[4 * i] + at[4 * i + 1] * y) + (at[4 * i + 2] * y2 + at[4 * i + 3] * y3);
    return detail::cubic(in_x, x);
  }

  static std::vector<Column> equal_layer(const BridgeTable& equal) {
    std::vector<Column> columns(3 * octaves + 1);
    for (int n = 0; n <= 3 * octaves; ++n) {
      const double v = node_volume(n);
      Column& c = columns[n] = {v, equal.rupture(v)};
      c.fit([&](int i) { return equal.force(c.gap(i), v); });
    }
    return columns;
  }

  static double node_volume(int n) {
    return n == 3 * octaves ? detail::volume_at(octaves - 1, 1.0) : detail::volume_at(n / 3, n % 3 / 3.0);
  }

  static std::vector<Column> layer(double theta, double asymmetry) {
    const PairYoungLaplace bridges(theta, asymmetry);
    const YoungLaplace equal(theta);
    const double smallest = node_volume(0);
    ShapeCoordinates start = equal.small_touching(smallest);
    detail::require(equal.solve(smallest, 0.0, start), theta, smallest);
    std::vector<Column> columns(3 * octaves + 1);
    Bridges here{}, before{};
    here[cells] = bridges.from_equal(equal.shape(start), start.phase);
    for (int n = 0; n <= 3 * octaves; ++n) {
      const double v = node_volume(n);
      Bridges next = here;
      if (n > 1)
        for (int i = 0; i <= cells; ++i) next[i] = between(before[i], here[i], 2.0);
      // Volume by volume the bridges of one zeta form a smooth row; only its beginning has to be looked for along the branch.
      if (n < 2 || !extend(bridges, v, next, columns[n])) {
        next = here;
        detail::require(search(bridges, v, next, columns[n]), theta, v);
      }
      before = here;
      here = next;
    }
    return columns;
  }

  /// Solves a column from guesses of all its bridges.
  static bool extend(const PairYoungLaplace& bridges, double v, Bridges& at, Column& c) {
    if (!bridges.fold(v, at[0])) return false;
    c = {v, bridges.shape(at[0]).gap};
    for (int i = 1; i <= cells; ++i)
      if (!bridges.solve(v, c.gap(i), at[i])) return false;
    c.fit([&](int i) { return bridges.shape(at[i]).force; });
    return true;
  }

  /// Solves a column from a guess of its touching bridge.
  static bool search(const PairYoungLaplace& bridges, double v, Bridges& at, Column& c) {
    if (!bridges.solve(v, 0.0, at[cells])) return false;
    std::vector<PairCoordinates> path{at[cells]};
    at[0] = at[cells];
    return bridges.rupture(v, at[0], &path) && detail::solve_column(bridges, v, path, at, c);
  }

  void fill(int slice, const std::array<std::vector<Column>, 4>& layers) {
    for (int octave = 0; octave < octaves; ++octave) {
      // What a value of all sixteen nodes of a cell in mu and y becomes: [power of y][power of mu].
      const auto bicubic = [&](const auto& value) {
        Surface in_mu, out;
        for (int k = 0; k < 4; ++k) {
          const Column* c = &layers[k][3 * octave];
          in_mu[k] = detail::through(value(c[0]), value(c[1]), value(c[2]), value(c[3]));
        }
        for (int m = 0; m < 4; ++m) {
          const Cubic in_y = detail::through(in_mu[0][m], in_mu[1][m], in_mu[2][m], in_mu[3][m]);
          for (int k = 0; k < 4; ++k) out[k][m] = in_y[k];
        }
        return out;
      };
      const int index = slice * octaves + octave;
      Row& row = rows_[index];
      row.inverse_rupture = bicubic([](const Column& c) { return c.inverse_rupture; });
      row.fall = bicubic([](const Column& c) { return c.fall; })[0];
      row.touching = bicubic([](const Column& c) { return c.touching(); });
      for (int cell = 0; cell < cells; ++cell)
        for (int power = 0; power < 4; ++power) {
          const Surface s = bicubic([&](const Column& c) { return c.spline[cell][power]; });
          for (int k = 0; k < 4; ++k)
            for (int m = 0; m < 4; ++m) patches_[index * cells + cell][m][4 * power + k] = s[k][m];
        }
    }
  }
};

}  // namespace dembark::capillary
