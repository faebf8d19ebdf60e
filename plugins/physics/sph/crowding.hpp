// Whether particles overlap at the beginning: a body put where fluid is, fluid added twice, walls of a finer spacing than the fluid's.
//
//   C_i = sum_j W(|x_i - x_j|) / sum_lattice W,   j: all particles within the support, i too                             (1)
//
// is 1 within the lattice, less at a surface, 2 where two lattices lie in each other. A fluid that begins so is thrown apart by pressures
// that no one asked for, and is then told as one that blew up, if at all. A start is refused if a particle of fluid has another one nearer
// than 0.4 dx, or
//
//   C_i > 1.4 + 0.5 max(1.3 - h/dx, 0)                                                                                   (2)
//
// Starts that are right are not: where lattices meet at any angle, half a spacing each from the face between them, C is below 1.05; with
// fluid up to a face, half a spacing from the wall's particles, 1.3 (h = 1.3 dx), 1.4 (0.8 dx), in a corner 1.6 (0.8 dx); with
// displacements by up to 0.2 dx along each axis 1.25 (1.3 dx), 1.4 (1 dx), 1.5 (0.8 dx). By (2) a body in the fluid is found at any offset
// between the lattices if it is two particles wide (h up to 1.3 dx) or four (h of 3 dx).
//
// Later states are not judged: a particle pressed into a wall during a run was not put there by the user.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "cells.hpp"
#include "scene.hpp"

namespace dembark::sph {

class Crowding {
 public:
  /// particles: the number of particles whose neighbours add() takes.
  Crowding(const Settings& settings, std::size_t particles) : settings_(settings), weight_(particles) {
    with_kernel(settings_, [&](const auto& kernel) {
      each_of_lattice(settings_.dimension, settings_.h(), settings_.spacing,
                      [&](double squared) { full_ += kernel.value(std::sqrt(squared)); });
      std::fill(weight_.begin(), weight_.end(), kernel.value(0.0));
    });
  }

  /// Adds the neighbours in `rows`. own(i), other(j): positions (m) of particle i and of its neighbour j; none: the number that fills up
  /// rows; mutual: j is one of the particles, too, and each pair is in the rows only once.
  template <class Own, class Other>
  void add(const Rows& rows, int none, bool mutual, const Own& own, const Other& other) {
    with_kernel(settings_, [&](const auto& kernel) {
      rows.each(none, [&](int i, int j) {
        const double r = norm(own(i) - other(j)), weight = kernel.value(r);
        weight_[std::size_t(i)] += weight;
        if (mutual) weight_[std::size_t(j)] += weight;
        if (!(r < nearest_)) return;
        nearest_ = r;
        of_nearest_ = i;
      });
    });
  }

  /// Number of a particle that overlaps others; -1: there is none.
  int worst() const {
    if (pair_overlaps()) return of_nearest_;
    const auto most = std::max_element(weight_.begin(), weight_.end());
    const double limit = 1.4 + 0.5 * std::max(1.3 - settings_.smoothing, 0.0);
    return most != weight_.end() && *most > limit * full_ ? int(most - weight_.begin()) : -1;
  }
  /// What the one clear line says of it.
  std::string line(int particle) const {
    char words[80];
    if (pair_overlaps()) std::snprintf(words, sizeof words, "another: it is %.2f spacings away from it", nearest_ / settings_.spacing);
    else
      std::snprintf(words, sizeof words, "others: there are %.2f times as many as in the lattice", weight_[std::size_t(particle)] / full_);
    return "overlaps " + std::string(words) + "; leave out fluid where walls and bodies are, and give them its spacing";
  }

 private:
  bool pair_overlaps() const { return nearest_ < 0.4 * settings_.spacing; }

  Settings settings_;
  double full_ = 0.0, nearest_ = std::numeric_limits<double>::infinity();
  int of_nearest_ = -1;
  std::vector<double> weight_;
};

/// Of all fluid particles of this process.
inline Crowding crowding(const Scene& scene) {
  const FluidParticles& fluid = scene.fluid;
  Crowding all(scene.settings, std::size_t(fluid.size()));
  const auto own = [&](int i) { return fluid.position[std::size_t(i)]; };
  for (const Rows& rows : fluid.pairs) all.add(rows, fluid.with_images(), true, own, own);
  all.add(fluid.border, fluid.with_images(), false, own, own);
  for (const Solids& set : scene.solids)
    for (const Rows& rows : set.of_fluid) all.add(rows, set.with_images(), false, own, [&](int k) { return set.position[std::size_t(k)]; });
  return all;
}

}  // namespace dembark::sph
