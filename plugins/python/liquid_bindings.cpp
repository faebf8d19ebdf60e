// The rule of carried liquid as Python sees it. Private; dembark.physics.liquid adds checks, shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "dembark/capillary/liquid.hpp"

namespace nb = nanobind;
using namespace dembark;

namespace {

using Array = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Result = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

/// One array a column of what `row(k)` gives for k < n.
template <std::size_t columns, class Row>
std::vector<Result> tabulate(std::size_t n, Row row) {
  std::array<double*, columns> out;
  std::vector<Result> results;
  for (double*& column : out) {
    column = new double[n];
    results.push_back(Result(column, {n}, nb::capsule(column, [](void* p) noexcept { delete[] static_cast<double*>(p); })));
  }
  for (std::size_t k = 0; k < n; ++k) {
    const std::array<double, columns> values = row(k);
    for (std::size_t c = 0; c < columns; ++c) out[c][k] = values[c];
  }
  return results;
}

}  // namespace

void bind_liquid(nb::module_& m) {
  m.def("liquid_shares", &capillary::share_names);
  m.def("liquid_returns", &capillary::return_names);
  m.def("liquid_share", [](Array radius, Array other, const std::string& kind, double factor) {
    capillary::ShareRule rule;
    rule.set_kind(kind);
    rule.factor = factor;
    if (const char* const wrong = rule.error()) {
      char line[160];
      std::snprintf(line, sizeof line, "%s, not %g", wrong, factor);
      throw nb::value_error(line);
    }
    return tabulate<1>(radius.shape(0), [&](std::size_t k) { return std::array{rule(radius(k), other(k))}; }).front();
  });
  m.def("liquid_grant", [](Array liquid, Array demand) {
    return tabulate<1>(liquid.shape(0), [&](std::size_t k) { return std::array{capillary::grant(liquid(k), demand(k))}; }).front();
  });
  // Volume, taken from i, taken from j, given back to i, given back to j. An infinite radius_j is a wall that keeps `wall_part`.
  m.def("liquid_bridge", [](Array given_i, Array given_j, Array radius_i, Array radius_j, Array wall_part, Array largest, int rule) {
    const auto back = static_cast<capillary::Return>(rule);
    return tabulate<5>(given_i.shape(0), [&](std::size_t k) {
      const bool wall = !(radius_j(k) < capillary::flat<double>);
      const capillary::NewBridge<double> b =
          wall ? capillary::form_wall_bridge(given_i(k), given_j(k), wall_part(k), back, largest(k))
               : capillary::form_bridge(given_i(k), given_j(k), radius_i(k), radius_j(k), back, largest(k));
      return std::array{b.volume, b.from_i, b.from_j, capillary::returned(b.volume, b.imbalance),
                        capillary::returned(b.volume, -b.imbalance)};
    });
  });
}
