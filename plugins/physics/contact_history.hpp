// The state of a contact as a row of numbers, for engines that keep histories in arrays of their own.
#pragma once

#include <cstring>

#include "contact.hpp"

namespace dembark {

/// Friction: five numbers.
static_assert(sizeof(FrictionState<double>) == 5 * sizeof(double));
DEMBARK_FUNCTION inline FrictionState<double> load_friction(const double* row) {
  FrictionState<double> state;
  std::memcpy(static_cast<void*>(&state), row, sizeof state);
  return state;
}
DEMBARK_FUNCTION inline void store_friction(double* row, const FrictionState<double>& state) { std::memcpy(row, &state, sizeof state); }

/// Partial slip. When the two bodies of a contact are swapped, displacements along the axis, which stand first, change their sign. Those
/// across it do not: with the normal, the direction across turns over.
constexpr int ring_numbers = sizeof(SlipRings) / sizeof(double);
DEMBARK_FUNCTION inline SlipRings load_rings(const double* row) {
  SlipRings rings;
  std::memcpy(static_cast<void*>(&rings), row, sizeof rings);
  return rings;
}
DEMBARK_FUNCTION inline void store_rings(double* row, const SlipRings& rings) { std::memcpy(row, &rings, sizeof rings); }

/// Cohesion: two numbers.
static_assert(sizeof(CohesionState) == 2 * sizeof(double));
DEMBARK_FUNCTION inline CohesionState load_cohesion(const double* row) { return {row[0], row[1]}; }
DEMBARK_FUNCTION inline void store_cohesion(double* row, const CohesionState& state) {
  row[0] = state.bridge_volume;
  row[1] = state.rupture_distance;
}

/// cohesion_step() with a state in a row of numbers.
DEMBARK_FUNCTION inline double cohesion_step(const Cohesion& cohesion, const CohesionContact& contact, double* row) {
  CohesionState state = load_cohesion(row);
  const double attraction = cohesion_step(cohesion, contact, state);
  store_cohesion(row, state);
  return attraction;
}

/// Which parts of a ContactState stand in a row, one after the other: friction always, then those that are switched on.
struct HistoryLayout {
  bool cohesion = false, rings = false, rolling = false;
  bool imbalance = false;  ///< of carried liquid (capillary/liquid.hpp), which load() and store() leave alone

  /// Another number for each layout.
  DEMBARK_FUNCTION int code() const { return cohesion + 2 * rings + 4 * rolling + 8 * imbalance; }

  DEMBARK_FUNCTION int cohesion_at() const { return 5; }
  DEMBARK_FUNCTION int rings_at() const { return cohesion_at() + (cohesion ? 2 : 0); }
  DEMBARK_FUNCTION int rolling_at() const { return rings_at() + (rings ? ring_numbers : 0); }
  DEMBARK_FUNCTION int imbalance_at() const { return rolling_at() + (rolling ? 3 : 0); }
  DEMBARK_FUNCTION int size() const { return imbalance_at() + (imbalance ? 1 : 0); }

  /// `state` must be a new one where its other parts are asked for.
  DEMBARK_HOT void load(const double* row, ContactState& state) const {
    state.friction = load_friction(row);
    if (cohesion) state.cohesion = load_cohesion(row + cohesion_at());
    if (rings) state.rings = load_rings(row + rings_at());
    if (rolling) std::memcpy(static_cast<void*>(&state.rolling_angle), row + rolling_at(), sizeof state.rolling_angle);
  }

  DEMBARK_HOT void store(double* row, const ContactState& state) const {
    store_friction(row, state.friction);
    if (cohesion) store_cohesion(row + cohesion_at(), state.cohesion);
    if (rings) store_rings(row + rings_at(), state.rings);
    if (rolling) std::memcpy(row + rolling_at(), &state.rolling_angle, sizeof state.rolling_angle);
  }

  /// The same contact with its bodies swapped.
  DEMBARK_FUNCTION void swap_bodies(const double* row, double* swapped) const {
    std::memcpy(swapped, row, std::size_t(size()) * sizeof *row);
    const auto turn = [swapped](int first, int count) {
      for (int k = first; k < first + count; ++k) swapped[k] = -swapped[k];
    };
    turn(0, 3);
    if (rings) turn(rings_at(), SlipRings::count);
    if (rolling) turn(rolling_at(), 3);
    if (imbalance) turn(imbalance_at(), 1);
  }
};

}  // namespace dembark
