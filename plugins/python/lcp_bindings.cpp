// dembark._physics.LcpSolver: the solver of linear complementarity problems as Python sees it. Private; dembark.physics.lcp adds
// checks, shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "dembark/energy_lcp.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;

namespace {

using Array = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::f_contig, nb::device::cpu>;
using Indices = nb::ndarray<const int, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

LcpOptions options_of(const std::string& method, double tolerance, int max_iterations, bool check_input) {
  LcpOptions options;
  options.method = lcp_method(method);
  options.tolerance = tolerance;
  options.max_iterations = max_iterations;
  options.check_input = check_input;
  return options;
}

nb::ndarray<nb::numpy, double, nb::ndim<1>> numpy(const Eigen::VectorXd& v) {
  const std::size_t n = std::size_t(v.size());
  double* data = new double[n + 1];
  std::copy_n(v.data(), n, data);
  return {data, {n}, nb::capsule(data, [](void* p) noexcept { delete[] static_cast<double*>(p); })};
}

nb::tuple tuple_of(const LcpResult& r) {
  const LcpCertificate& c = r.certificate;
  return nb::make_tuple(numpy(r.z), numpy(r.w), r.pivots, r.block_steps, r.islands, r.used_fallback,
                        nb::make_tuple(c.z_violation, c.w_violation, c.complementarity), r.status == LcpStatus::solved);
}

Eigen::VectorXd vector_of(const Array& q) { return Eigen::Map<const Eigen::VectorXd>(q.data(), Eigen::Index(q.shape(0))); }

}  // namespace

void bind_lcp(nb::module_& m) {
  nb::class_<LcpSolver>(m, "LcpSolver")
      .def(nb::init<>())
      .def("solve_dense",
           [](LcpSolver& self, const Matrix& M, const Array& q, const Flags& start, bool started, const std::string& method,
              double tolerance, int max_iterations, bool check_input) {
             const Eigen::VectorXd right = vector_of(q);
             const std::vector<char> flags(start.data(), start.data() + start.shape(0));
             lcp::check_shapes(Eigen::Index(M.shape(0)), Eigen::Index(M.shape(1)), right.size(), started ? &flags : nullptr);
             const LcpOptions options = options_of(method, tolerance, max_iterations, check_input);
             return tuple_of(self.solve_dense(M.data(), right, options, started ? &flags : nullptr));
           })
      .def("solve_columns",
           [](LcpSolver& self, const Indices& outer, const Indices& inner, const Array& value, const Array& q, const Flags& start,
              bool started, const std::string& method, double tolerance, int max_iterations, bool check_input) {
             const Eigen::VectorXd right = vector_of(q);
             const std::vector<char> flags(start.data(), start.data() + start.shape(0));
             const Eigen::Index n = Eigen::Index(outer.shape(0)) - 1;
             lcp::check_shapes(n, n, right.size(), started ? &flags : nullptr);
             return tuple_of(self.solve_columns(outer.data(), inner.data(), value.data(), right,
                                                options_of(method, tolerance, max_iterations, check_input), started ? &flags : nullptr));
           });
}
