// Arrays between numpy and the headers, for the bindings.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <vector>

namespace dembark::python {

using Array = nanobind::ndarray<const double, nanobind::ndim<1>, nanobind::c_contig, nanobind::device::cpu>;
using Table = nanobind::ndarray<const double, nanobind::ndim<2>, nanobind::c_contig, nanobind::device::cpu>;
using Result = nanobind::ndarray<nanobind::numpy, double>;

/// A copy that Python owns.
inline Result numpy(const std::vector<double>& values, std::initializer_list<std::size_t> shape) {
  double* data = new double[values.size() + 1];
  std::copy(values.begin(), values.end(), data);
  const nanobind::capsule owner(data, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  return Result(data, shape.size(), shape.begin(), owner);
}

}  // namespace dembark::python
