// Prescribed motion of walls as Python sees it. Private; dembark.physics.motion adds checks, shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "dembark/motion/prescribed_motion.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;

void bind_motion(nb::module_& m) {
  nb::class_<PrescribedMotion>(m, "PrescribedMotion")
      .def(nb::init<>())
      .def(nb::init<const std::string&>(), "words"_a)
      .def("begin", &PrescribedMotion::begin, "now"_a)
      // Rows of displacement, angle, velocity, rate, acceleration and angular acceleration at these times (s).
      .def(
          "at",
          [](const PrescribedMotion& self, nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu> times) {
            constexpr std::size_t columns = 12;
            const std::size_t n = times.shape(0);
            auto* out = new double[columns * n];
            const nb::capsule owner(out, [](void* p) noexcept { delete[] static_cast<double*>(p); });
            for (std::size_t i = 0; i < n; ++i) {
              const WallState s = self.at(times(i));
              const std::array<double, columns> row{s.displacement.x, s.displacement.y, s.displacement.z, s.angle,
                                                    s.velocity.x,     s.velocity.y,     s.velocity.z,     s.rate,
                                                    s.acceleration.x, s.acceleration.y, s.acceleration.z, s.angular_acceleration};
              std::copy(row.begin(), row.end(), out + columns * i);
            }
            return nb::ndarray<nb::numpy, double, nb::ndim<2>>(out, {n, columns}, owner);
          },
          "times"_a)
      .def_prop_ro("shortest_period", &PrescribedMotion::shortest_period);
}
