// The reference integrator and the local error of Verlet's steps as Python sees them. Private; dembark.physics.integration adds checks,
// shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "dembark/integration/adams.hpp"
#include "dembark/integration/step_error.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;

namespace {

using State = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Given = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

/// A function of (time, state) that was given by the user, with `size` numbers as its value.
struct Function {
  nb::object call;
  std::size_t state_size = 0, size = 0;
  const char* name = "";

  void operator()(double time, const double* state, double* value) const {
    // The user may keep the array: it owns its numbers.
    auto* copy = new double[state_size];
    std::copy(state, state + state_size, copy);
    nb::capsule owner(copy, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    const nb::object result = call(time, State(copy, {state_size}, owner));
    const auto numbers = nb::cast<Given>(nb::module_::import_("numpy").attr("ascontiguousarray")(result, "dtype"_a = "float64"));
    if (numbers.shape(0) != size)
      throw std::invalid_argument(std::string(name) + " must return " + std::to_string(size) + " numbers, not " +
                                  std::to_string(numbers.shape(0)));
    for (std::size_t i = 0; i < size; ++i) {
      if (!std::isfinite(numbers(i)))
        throw std::invalid_argument(std::string(name) + " returned a number that is not finite at t = " + std::to_string(time) + " s");
      value[i] = numbers(i);
    }
  }
};

struct EventFunction : Function {
  std::size_t count = 0;
};

using Integrator = Adams<Function, EventFunction>;

State copied(const std::vector<double>& numbers) {
  auto* copy = new double[numbers.size()];
  std::copy(numbers.begin(), numbers.end(), copy);
  return State(copy, {numbers.size()}, nb::capsule(copy, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
}

}  // namespace

void bind_integration(nb::module_& m) {
  // Errors of position (m) and velocity, rows of the steps from the fourth on, of components with these accelerations.
  m.def("local_errors", [](nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu> accelerations, double step) {
    const std::size_t n = accelerations.shape(0), columns = accelerations.shape(1), rows = n < 4 ? 0 : n - 3;
    auto* out = new double[2 * rows * columns];
    const nb::capsule owner(out, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    for (std::size_t c = 0; c < columns; ++c) {
      AccelerationHistory history;
      for (std::size_t i = 0; i < n; ++i) {
        LocalError e;
        if (!history.step({accelerations(i, c)}, step, e)) continue;
        out[(i - 3) * columns + c] = e.position[0];
        out[(rows + i - 3) * columns + c] = e.velocity[0];
      }
    }
    return nb::ndarray<nb::numpy, double, nb::ndim<3>>(out, {2, rows, columns}, owner);
  });
  nb::class_<Integrator>(m, "Adams")
      .def(
          "__init__",
          [](Integrator* self, nb::object derivative, nb::object events, std::size_t event_count, double step, int corrections,
             double tolerance, double time, const std::vector<double>& state, const std::vector<double>& scale) {
            const std::size_t n = state.size();
            EventFunction g{{std::move(events), n, event_count, "events"}, event_count};
            new (self) Integrator(Function{std::move(derivative), n, n, "derivative"}, {step, corrections, tolerance}, time, state, scale,
                                  std::move(g));
          },
          "derivative"_a, "events"_a.none(), "event_count"_a, "step"_a, "corrections"_a, "tolerance"_a, "time"_a, "state"_a, "scale"_a)
      .def_prop_ro("time", &Integrator::time)
      .def_prop_ro(
          "state", [](const Integrator& self) { return copied(self.state()); }, nb::rv_policy::automatic)
      .def_prop_ro(
          "error", [](const Integrator& self) { return copied(self.error_estimate()); }, nb::rv_policy::automatic)
      .def("restart", &Integrator::restart)
      .def(
          "advance",
          [](Integrator& self, double limit) {
            const AdamsStep step = self.advance(limit);
            return nb::make_tuple(step.corrections, step.difference, step.signal, step.event);
          },
          "limit"_a);
}
