// The rule of carried liquid as Python sees it. Private; dembark.physics.liquid adds checks, shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <string>

#include "dembark/capillary/liquid.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;

namespace {

using Array = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Result = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

Result make_result(std::size_t n, double*& data) {
  data = new double[n];
  return Result(data, {n}, nb::capsule(data, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
}

capillary::ShareRule share_rule(bool cap, double factor) {
  return {cap ? capillary::ShareRule::Kind::cap : capillary::ShareRule::Kind::fraction, factor};
}

}  // namespace

void bind_liquid(nb::module_& m) {
  m.def("liquid_returns", &capillary::return_names);
  m.def("liquid_share_error", [](bool cap, double factor) {
    const char* const wrong = share_rule(cap, factor).error();
    return std::string(wrong ? wrong : "");
  });
  m.def("liquid_share", [](Array radius, Array other, bool cap, double factor) {
    const capillary::ShareRule rule = share_rule(cap, factor);
    double* out;
    Result result = make_result(radius.shape(0), out);
    for (std::size_t i = 0; i < radius.shape(0); ++i) out[i] = rule(radius(i), other(i));
    return result;
  });
  m.def("liquid_grant", [](Array liquid, Array demand) {
    double* out;
    Result result = make_result(liquid.shape(0), out);
    for (std::size_t i = 0; i < liquid.shape(0); ++i) out[i] = capillary::grant(liquid(i), demand(i));
    return result;
  });
  // Volume, taken from i, taken from j, given back to i, given back to j. An infinite radius_j is a wall that keeps `wall_part`.
  m.def("liquid_bridge", [](Array given_i, Array given_j, Array radius_i, Array radius_j, Array wall_part, Array largest, int rule) {
    const std::size_t n = given_i.shape(0);
    double* out[5];
    nb::list columns;
    for (double*& column : out) columns.append(make_result(n, column));
    const auto back = static_cast<capillary::Return>(rule);
    for (std::size_t k = 0; k < n; ++k) {
      const bool wall = !(radius_j(k) < capillary::flat<double>);
      const capillary::NewBridge<double> b =
          wall ? capillary::form_wall_bridge(given_i(k), given_j(k), wall_part(k), back, largest(k))
               : capillary::form_bridge(given_i(k), given_j(k), radius_i(k), radius_j(k), back, largest(k));
      const double values[] = {b.volume, b.from_i, b.from_j, capillary::returned(b.volume, b.imbalance),
                               capillary::returned(b.volume, -b.imbalance)};
      for (int c = 0; c < 5; ++c) out[c][k] = values[c];
    }
    return nb::tuple(columns);
  });
}
