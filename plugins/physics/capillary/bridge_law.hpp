// The force law of a liquid bridge as an engine builds it, once for each model and contact angle: it owns the tables of the exact model,
// which it solves for. Host only; BridgeForce (bridge.hpp), which evaluates the law, is a plain value.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <vector>

#include "bridge.hpp"
#include "bridge_columns.hpp"

namespace dembark::capillary {

namespace detail {

// The cubic through values at 0, 1/3, 2/3, 1.
inline Cubic through(double a, double b, double c, double d) {
  return {a, -5.5 * a + 9.0 * b - 4.5 * c + d, 9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d, -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d};
}

/// The arrays of a BridgeTable.
template <int slices, int cells>
class TableArrays {
 public:
  /// Layers for y = 0, 1/(3 slices), ..., 1.
  explicit TableArrays(const std::vector<Layer<cells>>& layers) {
    rows_.reserve(Table::row_count);
    patches_.reserve(Table::patch_count);
    for (int slice = 0; slice < std::max(slices, 1); ++slice)
      for (int octave = 0; octave < octaves; ++octave) fill(&layers[3 * slice], 3 * octave);
  }
  BridgeTable<slices, cells> table() const { return {rows_.data(), patches_.data()}; }

 private:
  using Table = BridgeTable<slices, cells>;
  using Line = typename Table::Line;
  using Patch = typename Table::Patch;
  static constexpr bool equal = Table::equal;

  std::vector<typename Table::Row> rows_;
  std::vector<Patch> patches_;

  void fill(const Layer<cells>* layers, int node) {
    using Solved = Column<cells>;
    // What a value of all nodes of a cell in mu, and in y, becomes.
    const auto fit = [layers, node](const auto& value) {
      const auto in_mu = [&](int layer) {
        const Solved* const c = &layers[layer][node];
        return through(value(c[0]), value(c[1]), value(c[2]), value(c[3]));
      };
      if constexpr (equal) return in_mu(0);
      else {
        const Square at{in_mu(0), in_mu(1), in_mu(2), in_mu(3)};
        Line out;
        for (int m = 0; m < 4; ++m) {
          const Cubic in_y = through(at[0][m], at[1][m], at[2][m], at[3][m]);
          for (int k = 0; k < 4; ++k) out[k][m] = in_y[k];
        }
        return out;
      }
    };
    const Solved* const first = &layers[0][node];
    rows_.push_back({fit([](const Solved& c) { return c.inverse_rupture; }), fit([](const Solved& c) { return c.touching(); }),
                     through(first[0].fall, first[1].fall, first[2].fall, first[3].fall)});
    for (int cell = 0; cell < cells; ++cell) {
      Patch& patch = patches_.emplace_back();
      for (int power = 0; power < 4; ++power) {
        const Line line = fit([cell, power](const Solved& c) { return c.spline[cell][power]; });
        if constexpr (equal) patch[power] = line;
        else
          for (int k = 0; k < 4; ++k)
            for (int m = 0; m < 4; ++m) patch[m][4 * power + k] = line[k][m];
      }
    }
  }
};

}  // namespace detail

/// Pairs that a law is built for: equal spheres only, which takes about 70 ms of one core for the exact model, or any spheres and walls,
/// 0.25 s more.
enum class Pairs { equal, any };

/// The exact model's tables of one contact angle, with their arrays, which copies share.
class ExactBridge : public ExactTables {
 public:
  /// `theta` in rad, 0...pi/2. std::runtime_error should the solution not converge.
  explicit ExactBridge(double theta, Pairs pairs = Pairs::any) : theta_(theta) {
    equal_ = std::make_shared<const EqualArrays>(std::vector<detail::Layer<32>>{solve<32>(YoungLaplace(theta), touching(theta))});
    equal = equal_->table();
    if (pairs == Pairs::any) complete();
  }

  /// Solves for unequal spheres too, if that has not been done.
  void complete() {
    if (unequal_) return;
    const YoungLaplace symmetric(theta_);
    BridgeCoordinates start = touching(theta_);
    symmetric.solve(detail::node_volume(0), 0.0, start);
    std::vector<detail::Layer<cells>> layers{equal_layer()};
    for (int layer = 1; layer <= 3 * slices; ++layer) {
      const double y = layer / (3.0 * slices);
      layers.push_back(solve<cells>(PairYoungLaplace(theta_, y * y), symmetric.among_unequal(start)));
    }
    unequal_ = std::make_shared<const UnequalArrays>(layers);
    unequal = unequal_->table();
  }

 private:
  static constexpr int slices = 2, cells = 24;
  using EqualArrays = detail::TableArrays<0, 32>;
  using UnequalArrays = detail::TableArrays<slices, cells>;

  double theta_;
  std::shared_ptr<const EqualArrays> equal_;
  std::shared_ptr<const UnequalArrays> unequal_;

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
      auto& c = columns.emplace_back(v, equal.rupture(v, 0.0));
      c.fit([&](int i) { return equal.force(c.gap(i), v, 0.0); });
    }
    return columns;
  }
};

/// A BridgeForce with what it points to. Copies share the tables, so that it may be read from many threads.
class BridgeLaw : public BridgeForce {
 public:
  /// `contact_angle` in rad, 0...pi/2, the mean of the two surfaces; std::invalid_argument otherwise. `exact` solves for its tables.
  BridgeLaw(Model model, double contact_angle, Pairs pairs = Pairs::any) : BridgeForce(model, checked(contact_angle)) {
    if (model != Model::exact) return;
    exact_.emplace(contact_angle, pairs);
    tables = *exact_;
  }

  /// Makes a law of Pairs::equal one of Pairs::any.
  void complete() {
    if (!exact_) return;
    exact_->complete();
    tables = *exact_;
  }

 private:
  std::optional<ExactBridge> exact_;

  static double checked(double contact_angle) {
    if (contact_angle >= 0.0 && contact_angle <= 0.5 * pi * (1.0 + 1e-12)) return contact_angle;
    char line[128];
    std::snprintf(line, sizeof line, "contact angle %g rad: it must lie in 0...pi/2 (1.5708)", contact_angle);
    throw std::invalid_argument(line);
  }
};

/// The law of one model and contact angle (rad) for any spheres and walls, built once; it stays until the program ends. Safe from many
/// threads.
inline const BridgeForce& shared_bridge_force(Model model, double contact_angle) {
  static std::mutex guard;
  static std::deque<BridgeLaw> built;
  const std::lock_guard<std::mutex> lock(guard);
  for (const BridgeLaw& force : built)
    if (force.model() == model && force.contact_angle() == contact_angle) return force;
  return built.emplace_back(model, contact_angle);
}

}  // namespace dembark::capillary
