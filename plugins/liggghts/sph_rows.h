// The engine's list of neighbours, sorted into the rows of dembark/sph/scene.hpp by what the particles are.
#pragma once

#include <cstddef>
#include <vector>

#include "dembark/sph/scene.hpp"

namespace dembark_liggghts {

enum class SphRole : unsigned char {
  fluid,      ///< of the fluid
  solid,      ///< of a wall or body that acts by pressure
  repelling,  ///< of a body that acts by the contact potential
  none,       ///< takes no part
};

/// What an atom is in the scene.
struct SphParticle {
  SphRole role = SphRole::none;
  int number = -1;  ///< among those of its role, those of this rank first
};

class SphRows {
 public:
  /// each_pair(pair): calls pair(i, j) for all pairs of the list; i is of this rank, and own are the atoms 0 ... own - 1. Of two ranks each
  /// has the pairs across their border.
  template <class EachPair>
  void build(const std::vector<SphParticle>& atoms, int own, dembark::sph::Scene& scene, const EachPair& each_pair) {
    dembark::sph::FluidParticles& fluid = scene.fluid;
    fluid.pairs.resize(1);
    begin(pairs, fluid.pairs[0], fluid.size());
    begin(border, fluid.border, fluid.size());
    for (std::size_t s = 0; s < 2; ++s) {
      dembark::sph::Solids& set = scene.solids[s];
      set.of_fluid.resize(1);
      set.near_fluid.resize(1);
      begin(of_fluid + 2 * s, set.of_fluid[0], fluid.size());
      begin(near_fluid + 2 * s, set.near_fluid[0], set.size());
    }
    each_pair(
        [&](int i, int j) { sort(atoms, own, i, j, [this](std::size_t which, int k, int) { ++at_[which]->start[std::size_t(k) + 1]; }); });
    for (std::size_t which = 0; which < kinds; ++which) {
      dembark::sph::Rows& rows = *at_[which];
      // Whole packs of four.
      for (std::size_t k = 1; k < rows.start.size(); ++k) rows.start[k] = rows.start[k - 1] + (rows.start[k] + 3) / 4 * 4;
      const bool of_solids = which == of_fluid || which == of_fluid + 2;
      rows.neighbour.assign(std::size_t(rows.start.back()),
                            of_solids ? scene.solids[(which - of_fluid) / 2].with_images() : fluid.with_images());
      next_[which].assign(rows.start.begin(), rows.start.end() - 1);
    }
    each_pair([&](int i, int j) {
      sort(atoms, own, i, j, [this](std::size_t which, int k, int neighbour) {
        at_[which]->neighbour[std::size_t(next_[which][std::size_t(k)]++)] = neighbour;
      });
    });
  }

 private:
  static constexpr std::size_t pairs = 0, border = 1, of_fluid = 2, near_fluid = 3, kinds = 6;  // the latter two of both kinds of solids

  void begin(std::size_t which, dembark::sph::Rows& rows, int count) {
    at_[which] = &rows;
    rows.begin = 0;
    rows.end = count;
    rows.start.assign(std::size_t(count) + 1, 0);
  }
  template <class Put>
  static void sort(const std::vector<SphParticle>& atoms, int own, int i, int j, const Put& put) {
    const SphParticle &a = atoms[std::size_t(i)], &b = atoms[std::size_t(j)];
    if (a.role == SphRole::fluid && b.role == SphRole::fluid) put(j < own ? pairs : border, a.number, b.number);
    else if (a.role == SphRole::fluid) across(a, b, true, j < own, put);
    else if (b.role == SphRole::fluid) across(b, a, j < own, true, put);
  }
  template <class Put>
  static void across(const SphParticle& fluid, const SphParticle& solid, bool own_fluid, bool own_solid, const Put& put) {
    if (solid.role == SphRole::none) return;
    const std::size_t kind = solid.role == SphRole::repelling ? 2 : 0;
    if (own_fluid) put(of_fluid + kind, fluid.number, solid.number);
    if (own_solid) put(near_fluid + kind, solid.number, fluid.number);
  }

  dembark::sph::Rows* at_[kinds] = {};
  std::vector<int> next_[kinds];  // place of the next neighbour of each row
};

}  // namespace dembark_liggghts
