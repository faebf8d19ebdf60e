// dembark._physics.LcpSolver: the solver of linear complementarity problems as Python sees it. Private; dembark.physics.lcp adds
// checks, shapes, units and documentation.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>
#include <vector>

#include "dembark/energy_lcp.hpp"

namespace nb = nanobind;
using namespace dembark;

namespace {

using Values = Eigen::Ref<const Eigen::VectorXd>;
using Indices = Eigen::Ref<const Eigen::VectorXi>;
using Flags = Eigen::Array<bool, Eigen::Dynamic, 1>;  // empty: no set to begin with

template <class Solve>
nb::tuple result_of(const Flags& start, Solve solve) {
  const std::vector<char> flags(start.begin(), start.end());
  const LcpResult& r = solve(flags.empty() ? nullptr : &flags);
  const LcpCertificate& c = r.certificate;
  return nb::make_tuple(r.z, r.w, r.pivots, r.block_steps, r.islands, r.used_fallback,
                        nb::make_tuple(c.z_violation, c.w_violation, c.complementarity), r.status == LcpStatus::solved);
}

}  // namespace

void bind_lcp(nb::module_& m) {
  nb::class_<LcpOptions>(m, "LcpOptions")
      .def("__init__", [](LcpOptions* self, const std::string& method, double tolerance, int max_iterations, bool check_input) {
        new (self) LcpOptions{lcp_method(method), tolerance, max_iterations, check_input};
      });
  nb::class_<LcpSolver>(m, "LcpSolver")
      .def(nb::init<>())
      .def("solve_dense",
           [](LcpSolver& self, const Eigen::Ref<const Eigen::MatrixXd>& M, const Eigen::VectorXd& q, const Flags& start,
              const LcpOptions& options) {
             lcp::check_shapes(M.rows(), M.cols(), q.size(), nullptr);
             return result_of(start, [&](const std::vector<char>* from) -> auto& { return self.solve_dense(M.data(), q, options, from); });
           })
      .def("solve_columns", [](LcpSolver& self, const Indices& outer, const Indices& inner, const Values& value, const Eigen::VectorXd& q,
                               const Flags& start, const LcpOptions& options) {
        return result_of(start, [&](const std::vector<char>* from) -> auto& {
          return self.solve_columns(outer.data(), inner.data(), value.data(), q, options, from);
        });
      });
}
