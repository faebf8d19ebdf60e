// What tests of hard grains share.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "dembark/events/solver.hpp"

namespace hard_grains {

/// What the solver says of grains that cannot be, or "accepted".
inline std::string refusal(const dembark::events::Settings& settings, const std::vector<dembark::events::Grain>& grains) {
  try {
    const dembark::events::Solver solver(settings, grains);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace hard_grains
