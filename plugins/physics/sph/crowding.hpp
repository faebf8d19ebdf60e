// Whether particles overlap at the beginning: a body put where fluid is, fluid added twice, walls of a finer spacing than the fluid's.
//
//   C_i = sum_j W(|x_i - x_j|) / sum_lattice W,   j: all particles within the support, i too                             (1)
//
// is 1 within the lattice, less at a surface, 2 where two lattices lie in each other. A fluid that begins so is thrown apart by pressures
// that no one asked for, and is then told as one that blew up, if at all. Where lattices meet at any angle, half a spacing each from the
// face between them, (1) is below 1.05; particles displaced by up to 0.2 spacings along each axis have up to 1.3. A body in the fluid is
// found at any offset between the lattices if it is two particles wide (h up to 1.3 spacings) or four (h of 3).
//
// Later states are not judged: a particle that was pressed into a wall is none that was put there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "cells.hpp"
#include "particle_records.hpp"

namespace dembark::sph {

class Crowding {
 public:
  /// particles: how many there are, of which rows speak.
  Crowding(const Settings& settings, std::size_t particles) : settings_(settings), weight_(particles) {
    with_kernel(settings_, [&](const auto& kernel) {
      each_of_lattice(settings_.dimension, settings_.h(), settings_.spacing,
                      [&](double squared) { full_ += kernel.value(std::sqrt(squared)); });
      std::fill(weight_.begin(), weight_.end(), kernel.value(0.0));
    });
  }

  /// Adds neighbours: own(i), other(j): positions (m) of particle i of the rows and of neighbour j; none: the number that fills up rows.
  /// mutual: each pair stands in the rows once, and j is one of the particles, too.
  template <class Own, class Other>
  void add(const Rows& rows, int none, bool mutual, const Own& own, const Other& other) {
    with_kernel(settings_, [&](const auto& kernel) {
      for (int i = rows.begin; i < rows.end; ++i)
        for (int k = rows.start[i - rows.begin]; k < rows.start[i - rows.begin + 1] && rows.neighbour[k] != none; ++k) {
          const int j = rows.neighbour[k];
          const double weight = kernel.value(norm(own(i) - other(j)));
          weight_[std::size_t(i)] += weight;
          if (mutual) weight_[std::size_t(j)] += weight;
        }
    });
  }

  /// Number of the particle with the largest sum (1), if that is more than any beginning should have; -1: there is none.
  int worst() const {
    const auto most = std::max_element(weight_.begin(), weight_.end());
    return most != weight_.end() && *most > limit * full_ ? int(most - weight_.begin()) : -1;
  }
  /// What the one clear line says of it.
  std::string line(int particle) const {
    char sum[32];
    std::snprintf(sum, sizeof sum, "%.2f", weight_[std::size_t(particle)] / full_);
    return "overlaps others: there are " + std::string(sum) +
           " times as many around it as in the lattice; leave out fluid where walls and bodies are, and give them its spacing";
  }

 private:
  static constexpr double limit = 1.4;

  Settings settings_;
  double full_ = 0.0;
  std::vector<double> weight_;
};

}  // namespace dembark::sph
