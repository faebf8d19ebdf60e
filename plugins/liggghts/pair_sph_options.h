// The words of `pair_style sph/coupled ...`, read into numbers.
#pragma once

#include <string>
#include <vector>

#include "dembark/sph/settings.hpp"

namespace dembark_liggghts {

/// dimension: of the box, 2 or 3. Gravity is that of fix gravity. Throws std::invalid_argument with one line: what, where, what would be
/// right.
dembark::sph::Settings read_fluid_settings(const std::vector<std::string> &words, int dimension);

}  // namespace dembark_liggghts
