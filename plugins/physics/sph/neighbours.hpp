// Which particles are near which: sorting, slabs and rows, made anew when particles have moved far enough.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "scene.hpp"

namespace dembark::sph {

class Neighbours {
 public:
  /// Sorts the fluid of this process, `id` with it, and finds all pairs within `reach` (m); images keep their numbers. Throws
  /// std::runtime_error when particles are spread too far.
  void build(Scene& scene, double reach) {
    FluidParticles& fluid = scene.fluid;
    std::vector<Solids>& solids = scene.solids;
    const int threads = scene.settings.threads;
    const Vector far = set_grid(fluid, solids, reach);
    const int n = fluid.size(), all = fluid.with_images(), slabs = (grid_.layers() + 1) / 2, layer = grid_.cells_of_layer();
    order_.sort(grid_, fluid.position.data(), std::size_t(n));
    const std::vector<int>& members = order_.members();
    permute(members, fluid.position);
    permute(members, fluid.velocity);
    permute(members, fluid.acceleration);
    permute(members, fluid.shift);
    permute(members, fluid.density);
    permute(members, fluid.pressure);
    permute(members, fluid.id);
    at_build_ = fluid.position;
    solids_at_build_.clear();
    std::vector<Rows>& pairs = fluid.pairs;
    pairs.resize(std::size_t(slabs));
    for (int s = 0; s < slabs; ++s) pairs[s].clear(order_.begin(2 * s * layer), s + 1 < slabs ? order_.begin(2 * (s + 1) * layer) : n);
    parallel_for(slabs, threads, [&](int s) { pair_rows(grid_, order_, fluid.position, all, pairs[s]); });
    fluid.border.clear(0, all > n ? n : 0);
    images_.places.clear();
    if (all > n) images_.sort(grid_, fluid.position, n, all, [](const Vector&) { return true; });
    all_rows(grid_, fluid.position, images_.order, images_.places, images_.numbers.data(), all, fluid.border);
    for (Solids& set : solids) {
      solids_at_build_.push_back(set.position);
      near_.sort(grid_, set.position, 0, set.with_images(), [&](const Vector& p) { return inside(p, reach); });
      set.of_fluid.resize(pairs.size());
      parallel_for(slabs, threads, [&](int s) {
        Rows& rows = set.of_fluid[s];
        rows.clear(pairs[s].begin, pairs[s].end);
        all_rows(grid_, fluid.position, near_.order, near_.places, near_.numbers.data(), set.with_images(), rows);
      });
      set.near_fluid.resize((std::size_t(set.size()) + block - 1) / block);
      parallel_for(int(set.near_fluid.size()), threads, [&](int b) {
        Rows& rows = set.near_fluid[b];
        rows.clear(b * block, std::min((b + 1) * block, set.size()));
        for (int k = rows.begin; k < rows.end; ++k) {
          const Vector& p = set.position[k];
          if (inside(p, reach)) {
            append_row(grid_, p, order_, fluid.position, nullptr, rows.neighbour);
            append_row(grid_, p, images_.order, images_.places, images_.numbers.data(), rows.neighbour);
          }
          rows.end_row(all);
        }
      });
    }
    scene.resize(far);
    fresh_ = true;
    ++builds_;
  }

  /// Whether particles may have moved more than `skin` (m) towards each other since.
  bool outdated(const Scene& scene, double skin) const {
    if (!fresh_) return true;
    double most = farthest(scene.fluid.position, at_build_);
    for (std::size_t s = 0; s < scene.solids.size(); ++s) most = std::max(most, farthest(scene.solids[s].position, solids_at_build_[s]));
    // As a difference that is no number compares: such particles are found by their speed.
    return 4.0 * most > skin * skin;
  }
  void forget() { fresh_ = false; }
  long builds() const { return builds_; }

 private:
  /// Some of the particles first ... last - 1 of an array, in the order of their cells: their numbers there, and places (m).
  struct Sorted {
    CellOrder order;
    std::vector<int> numbers;
    std::vector<Vector> places;

    template <class Taken>
    void sort(const Grid& grid, const std::vector<Vector>& positions, int first, int last, const Taken& taken) {
      taken_.clear();
      unsorted_.clear();
      for (int k = first; k < last; ++k)
        if (taken(positions[k])) taken_.push_back(k), unsorted_.push_back(positions[k]);
      order.sort(grid, unsorted_.data(), unsorted_.size());
      numbers.clear();
      places.clear();
      for (const int m : order.members()) numbers.push_back(taken_[m]), places.push_back(unsorted_[m]);
    }

   private:
    std::vector<int> taken_;
    std::vector<Vector> unsorted_;
  };

  /// Arrays that an engine does not use stay empty, as accelerations in LIGGGHTS.
  template <class T>
  static void permute(const std::vector<int>& members, std::vector<T>& values) {
    if (values.empty()) return;
    std::vector<T> sorted = values;
    for (std::size_t k = 0; k < members.size(); ++k) sorted[k] = values[members[k]];
    values.swap(sorted);
  }
  static double farthest(const std::vector<Vector>& now, const std::vector<Vector>& then) {
    double most = 0.0;
    for (std::size_t k = 0; k < now.size(); ++k) {
      const Vector d = now[k] - then[k];
      most = std::max(most, dot(d, d));
    }
    return most;
  }
  /// Returns a place (m) beyond the reach of all particles.
  Vector set_grid(const FluidParticles& fluid, const std::vector<Solids>& solids, double reach) {
    const double none = std::numeric_limits<double>::infinity();
    Vector low{none, none, none}, high{-none, -none, -none};
    const auto take = [&](const Vector& p) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    };
    for (const Vector& p : fluid.position) take(p);
    if (fluid.position.empty()) low = high = {};
    grid_.set(low, high, reach);
    low_ = low;
    high_ = high;
    for (const Solids& set : solids)
      for (const Vector& p : set.position) take(p);
    return high + Vector{100.0 * reach, 0.0, 0.0};
  }

  /// Whether p may be near the fluid at all.
  bool inside(const Vector& p, double reach) const {
    return p.x > low_.x - reach && p.y > low_.y - reach && p.z > low_.z - reach && p.x < high_.x + reach && p.y < high_.y + reach &&
           p.z < high_.z + reach;
  }

  static constexpr int block = 256;  // of rows of solid particles

  Grid grid_;
  CellOrder order_;
  Sorted images_, near_;  // of the fluid; of solids near it
  std::vector<Vector> at_build_;
  std::vector<std::vector<Vector>> solids_at_build_;
  Vector low_{}, high_{};
  bool fresh_ = false;
  long builds_ = 0;
};

}  // namespace dembark::sph
