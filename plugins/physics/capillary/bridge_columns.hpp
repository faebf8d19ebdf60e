// Solved bridges for the tables of bridge_table.hpp: for each node of the volume those from rupture to touching. Host only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

#include "bridge_solver.hpp"
#include "bridge_table.hpp"

namespace dembark::capillary::detail {

/// Volume of a node; each octave has four, at mu = 0, 1/3, 2/3, 1, the last being the first of the next.
inline double node_volume(int node) {
  const int octave = std::min(node / 3, octaves - 1);
  const double mu = (node - 3 * octave) / 3.0;
  double m = mu;
  for (int iteration = 0; iteration < 40; ++iteration) m += mu - octave_coordinate(m);
  return std::ldexp(1.0 + m, first_octave + octave);
}

// Not-a-knot cubic spline through equidistant values; coefficients of each interval in 0...1.
template <std::size_t points>
inline std::array<Cubic, points - 1> spline(const std::array<double, points>& h) {
  constexpr int n = points - 1;
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
  std::array<Cubic, n> c;
  for (int i = 0; i < n; ++i)
    c[i] = {h[i], h[i + 1] - h[i] - (2.0 * second[i] + second[i + 1]) / 6.0, 0.5 * second[i], (second[i + 1] - second[i]) / 6.0};
  return c;
}

/// The bridges of one volume, from rupture (zeta = 0) to touching (zeta = 1): H of bridge_table.hpp as a spline of `cells` cells in zeta.
template <int cells>
struct Column {
  double inverse_rupture = 0.0, fall = 0.0;
  std::array<Cubic, cells> spline{};

  Column() = default;
  Column(double v, double rupture) : inverse_rupture(1.0 / rupture), fall(1.0 / std::sqrt(v)) {}

  /// Gap at zeta = i / cells.
  double gap(int i) const {
    const double zeta = static_cast<double>(i) / cells, zeta2 = zeta * zeta;
    return (1.0 - zeta2) / (inverse_rupture + fall * zeta2);
  }

  /// Takes F / (gamma R) at these gaps, force(i).
  template <class Force>
  void fit(Force force) {
    std::array<double, cells + 1> h;
    for (int i = 0; i <= cells; ++i) {
      const double steepness = 1.0 + fall * gap(i);
      h[i] = force(i) * (steepness * steepness);
    }
    spline = detail::spline(h);
  }

  double touching() const {
    const Cubic& last = spline[cells - 1];
    return last[0] + last[1] + last[2] + last[3];
  }
};

/// The columns of all nodes for one asymmetry.
template <int cells>
using Layer = std::vector<Column<cells>>;

/// Solves for a layer from the touching bridge of the first node.
template <int cells, class Family>
class LayerSolver {
 public:
  explicit LayerSolver(const BridgeSolver<Family>& bridges) : bridges_(bridges) {}

  /// std::runtime_error should it not converge.
  Layer<cells> operator()(const BridgeCoordinates& touching) {
    Layer<cells> columns(3 * octaves + 1);
    Bridges before{}, guess{};
    guess[cells] = touching;
    for (int node = 0; node <= 3 * octaves; ++node) {
      volume_ = node_volume(node);
      if (node > 1)
        for (int i = 0; i <= cells; ++i) guess[i] = between(before[i], at_[i], 2.0);
      before = at_;
      at_ = guess;
      // Volume by volume the bridges of one zeta form a smooth row; only its beginning has to be looked for along the branch, and where
      // equal spheres lose their stability in another way than before.
      if (node > 1 && extend(columns[node])) continue;
      at_[cells] = guess[cells];
      if (!search(columns[node])) fail();
      guess = at_;
    }
    return columns;
  }

 private:
  using Bridges = std::array<BridgeCoordinates, cells + 1>;  // at zeta = i / cells, the last stable one first

  const BridgeSolver<Family>& bridges_;
  double volume_ = 0.0;
  Bridges at_{};

  /// Solves a column from guesses of all its bridges.
  bool extend(Column<cells>& c) {
    if (!bridges_.end(volume_, at_[0])) return false;
    c = {volume_, bridges_.shape(at_[0]).gap};
    for (int i = 1; i <= cells; ++i)
      if (!(bridges_.solve(volume_, c.gap(i), at_[i]) && bridges_.steadiness(at_[i]) > 0.0)) return false;
    c.fit([this](int i) { return bridges_.shape(at_[i]).force; });
    return true;
  }

  /// Solves a column from a guess of its touching bridge: starts between points of the path from there to rupture keep Newton's method on
  /// the stable branch up to its end.
  bool search(Column<cells>& c) {
    std::vector<BridgeCoordinates> path;
    if (!bridges_.solve(volume_, 0.0, at_[cells])) return false;
    path.push_back(at_[cells]);
    at_[0] = at_[cells];
    if (!bridges_.rupture(volume_, at_[0], path)) return false;
    c = {volume_, bridges_.shape(at_[0]).gap};
    std::size_t right = 1;
    double left_gap = 0.0, right_gap = bridges_.shape(path[1]).gap;
    for (int i = cells - 1; i > 0; --i) {
      const double gap = c.gap(i);
      while (gap > right_gap && right + 1 < path.size()) {
        left_gap = right_gap;
        right_gap = bridges_.shape(path[++right]).gap;
      }
      at_[i] = between(path[right - 1], path[right], (gap - left_gap) / (right_gap - left_gap));
      if (!bridges_.solve(volume_, gap, at_[i])) return false;
    }
    c.fit([this](int i) { return bridges_.shape(at_[i]).force; });
    return true;
  }

  [[noreturn]] void fail() const {
    char line[128];
    std::snprintf(line, sizeof line, "the liquid bridge of contact angle %g rad and volume %g R^3 did not converge",
                  bridges_.contact_angle(), volume_);
    throw std::runtime_error(line);
  }
};

}  // namespace dembark::capillary::detail
