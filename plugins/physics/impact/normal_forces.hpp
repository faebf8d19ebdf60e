// The normal forces of a step: which way of solving the complementarity problem takes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "assembly.hpp"
#include "elimination.hpp"
#include "motion.hpp"
#include "relaxation.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// w = q + A z, w >= 0, z >= 0, z w = 0; A as in assembly.hpp.
class NormalForces {
 public:
  /// The rows of a step. scale: h tau^2 (s^2).
  void prepare(const Assembly& assembly, const Motion& motion, double scale, const LcpOptions& options) {
    scale_ = scale;
    options_ = options;
    options_.check_input = false;  // symmetric by construction, positive definite for finite stiffness
    assembled_ = false;
    relaxes_ = options.method == LcpMethod::automatic && assembly.size() > few;
    if (relaxes_) relaxation_.prepare(assembly.rows(), motion.response, scale);
  }

  /// Whether solves before the last one of a step only come near.
  bool approaches() const { return relaxes_; }

  /// Begins at z and `active`, and leaves both, and w; counts in `report` what it did. last: to rounding in any case.
  void solve(Assembly& assembly, const Motion& motion, const Eigen::VectorXd& q, bool last, std::vector<char>& active, Eigen::VectorXd& z,
             Eigen::VectorXd& w, StepReport& report) {
    if (!relaxes_) return solve_exactly(assembly, motion, q, active, z, w, report);
    before_ = active;
    double certificate = 0.0;
    const double share = lcp::rounding_share(options_.tolerance);
    if (!last) {
      relaxation_.approach(q, z);
    } else if (!relaxation_.solve(q, share, z, w, certificate)) {
      flag(z, active);
      const bool found =
          elimination_.solve(assembly.rows(), motion.response, scale_, share, q, active, z, w, certificate, report.block_steps);
      if (!found && !relaxation_.finish(share, z, w, certificate)) return solve_exactly(assembly, motion, q, active, z, w, report);
    }
    flag(z, active);
    for (std::size_t i = 0; i < active.size(); ++i) report.pivots += active[i] != before_[i];
    report.certificate = std::max(report.certificate, certificate);
  }

 private:
  /// So many contacts cost nothing to solve exactly.
  static constexpr std::size_t few = 12;

  static void flag(const Eigen::VectorXd& z, std::vector<char>& active) {
    for (std::size_t i = 0; i < active.size(); ++i) active[i] = z[Eigen::Index(i)] > 0.0;
  }

  void solve_exactly(Assembly& assembly, const Motion& motion, const Eigen::VectorXd& q, std::vector<char>& active, Eigen::VectorXd& z,
                     Eigen::VectorXd& w, StepReport& report) {
    if (!assembled_) assembly.assemble(motion.response, scale_);
    assembled_ = true;
    const LcpResult& result = solver_.solve(assembly.matrix(), q, options_, &active);
    z = result.z;
    w = result.w;
    flag(z, active);
    report.pivots += result.pivots;
    report.block_steps += result.block_steps;
    report.certificate = std::max(report.certificate, result.certificate.worst());
  }

  double scale_ = 0.0;
  LcpOptions options_;
  bool relaxes_ = false, assembled_ = false;  ///< in this step
  std::vector<char> before_;
  Relaxation relaxation_;
  Elimination elimination_;
  LcpSolver solver_;
};

}  // namespace impact
}  // namespace dembark
