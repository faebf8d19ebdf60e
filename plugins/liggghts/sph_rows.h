// The engine's list of neighbours, sorted into the rows of dembark/sph/loops.hpp by what the particles are.
#pragma once

#include <vector>

#include "dembark/sph/cells.hpp"

namespace dembark_liggghts {

enum class SphRole : unsigned char {
  none,       ///< takes no part
  fluid,      ///< of the fluid
  solid,      ///< of a wall or body that acts by pressure
  repelling,  ///< of a body that acts by the contact potential
};

/// Rows of the atoms 0 ... n - 1 of this rank; neighbours are its own atoms and ghosts. Of two ranks each has the pairs across their
/// border.
struct SphRows {
  dembark::sph::Rows inner;               ///< fluid with fluid of this rank, each pair once
  dembark::sph::Rows border;              ///< fluid with ghosts of fluid
  dembark::sph::Rows of_fluid;            ///< solid particles near fluid ones
  dembark::sph::Rows near_fluid;          ///< fluid particles near solid ones
  dembark::sph::Rows repelling_fluid;     ///< repelling particles near fluid ones
  dembark::sph::Rows fluid_of_repelling;  ///< fluid particles near repelling ones

  /// own: atoms of this rank. each_pair(pair): calls pair(i, j) for all pairs of the list, i < own. none: the number that fills up rows.
  template <class EachPair>
  void build(const std::vector<SphRole>& role, int own, int none, const EachPair& each_pair) {
    dembark::sph::Rows* const all[] = {&inner, &border, &of_fluid, &near_fluid, &repelling_fluid, &fluid_of_repelling};
    for (dembark::sph::Rows* rows : all) {
      rows->begin = 0;
      rows->end = own;
      rows->start.assign(std::size_t(own) + 1, 0);
    }
    each_pair([&](int i, int j) { sort(role, own, i, j, [](dembark::sph::Rows& rows, int k, int) { ++rows.start[std::size_t(k) + 1]; }); });
    for (dembark::sph::Rows* rows : all) {
      // Whole packs of four.
      for (int k = 0; k < own; ++k) rows->start[k + 1] = rows->start[k] + (rows->start[k + 1] + 3) / 4 * 4;
      rows->neighbour.assign(std::size_t(rows->start[own]), none);
      rows->end = own;
    }
    fill_.assign(6 * std::size_t(own), 0);
    each_pair([&](int i, int j) {
      sort(role, own, i, j, [&](dembark::sph::Rows& rows, int k, int neighbour) {
        std::size_t which = 0;
        while (all[which] != &rows) ++which;
        rows.neighbour[std::size_t(rows.start[k] + fill_[which * std::size_t(own) + std::size_t(k)]++)] = neighbour;
      });
    });
  }

 private:
  template <class Put>
  void sort(const std::vector<SphRole>& role, int own, int i, int j, const Put& put) {
    const SphRole a = role[i], b = role[j];
    if (a == SphRole::fluid && b == SphRole::fluid) put(j < own ? inner : border, i, j);
    else if (a == SphRole::fluid) across(b, own, i, j, put);
    else if (b == SphRole::fluid) across(a, own, j, i, put);
  }
  template <class Put>
  void across(SphRole solid, int own, int fluid, int other, const Put& put) {
    if (solid == SphRole::none) return;
    const bool repels = solid == SphRole::repelling;
    if (fluid < own) put(repels ? repelling_fluid : of_fluid, fluid, other);
    if (other < own) put(repels ? fluid_of_repelling : near_fluid, other, fluid);
  }

  std::vector<int> fill_;
};

}  // namespace dembark_liggghts
