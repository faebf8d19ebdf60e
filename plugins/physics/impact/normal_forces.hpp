// The normal forces of a step, by the chain of solvers in lcp/: sweeps and conjugate gradients on the bodies, without a matrix; where
// those would take too long, the exact active set on a factor of the assembled matrix.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../lcp/relaxation.hpp"
#include "assembly.hpp"
#include "lines.hpp"
#include "motion.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// The contact forces of a step were not found. One line.
class UnsolvedStep : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// w = q + A z, w >= 0, z >= 0, z w = 0; A as in assembly.hpp.
struct Unknowns {
  Eigen::VectorXd q, z, w;
  std::vector<char> active;  ///< z > 0

  void resize(std::size_t n) {
    for (Eigen::VectorXd* v : {&q, &z, &w}) v->resize(Eigen::Index(n));
    active.resize(n);
  }
  void flag() {
    for (std::size_t i = 0; i < active.size(); ++i) active[i] = z[Eigen::Index(i)] > 0.0;
  }
};

class NormalForces {
 public:
  /// The rows of a step. scale: h tau^2 (s^2).
  void prepare(const Assembly& assembly, const Motion& motion, double scale, const LcpOptions& options) {
    scale_ = scale;
    options_ = options;
    options_.check_input = false;  // symmetric by construction, positive definite for finite stiffness
    assembled_ = false;
    relaxes_ = options.method == LcpMethod::automatic && assembly.size() > few;
    if (!relaxes_) return;
    const std::vector<Row>& rows = assembly.rows();
    levers_ = std::any_of(rows.begin(), rows.end(), [](const Row& r) { return r.lever; });
    planar_ = !levers_ && find_plane(rows);
    if (levers_) turning_.rows.prepare(rows, motion.response, scale, axes_);
    else if (planar_) flat_.rows.prepare(rows, motion.response, scale, axes_);
    else spatial_.rows.prepare(rows, motion.response, scale, axes_);
  }

  /// Whether solves before the last one of a step only come near.
  bool approaches() const { return relaxes_; }

  /// Begins at z and `active`, and leaves both, and w; counts in `report` what it did. last: to rounding in any case. Throws UnsolvedStep
  /// where the solver ends at its limit of iterations, or its certificate is worse than the tolerance that was asked for.
  void solve(Assembly& assembly, const Motion& motion, bool last, Unknowns& of, StepReport& report) {
    if (!relaxes_) return solve_exactly(assembly, motion, of, report);
    before_ = of.active;
    const bool found = levers_   ? relax(turning_, last, of, report)
                       : planar_ ? relax(flat_, last, of, report)
                                 : relax(spatial_, last, of, report);
    of.flag();
    if (!found) return solve_exactly(assembly, motion, of, report);
    for (std::size_t i = 0; i < before_.size(); ++i) report.pivots += of.active[i] != before_[i];
  }

 private:
  /// So many contacts cost nothing to solve exactly.
  static constexpr std::size_t few = 12;
  /// Of the forces between the sweeps of friction.
  static constexpr double approach_fraction = 1e-12;

  template <int Width>
  bool relax(lcp::Relaxation<Lines<Width>>& relaxation, bool last, Unknowns& of, StepReport& report) const {
    const double fraction = last ? lcp::rounding_fraction(options_.tolerance) : approach_fraction;
    relaxation.rows.start(of.q, fraction, of.z);
    if (!last) relaxation.approach();
    const bool found = !last || relaxation.solve(fraction);
    relaxation.rows.store(of.z);
    if (!last || !found) return found;
    relaxation.rows.store_gaps(relaxation.residual(), of.w);
    report.certificate = std::max(report.certificate, relaxation.residual().certificate().worst());
    return true;
  }

  void solve_exactly(Assembly& assembly, const Motion& motion, Unknowns& of, StepReport& report) {
    if (!assembled_) assembly.assemble(motion.response, scale_);
    assembled_ = true;
    const LcpResult& result = solver_.solve(assembly.matrix(), of.q, options_, &of.active);
    check(result);
    of.z = result.z;
    of.w = result.w;
    of.flag();
    report.pivots += result.pivots;
    report.block_steps += result.block_steps;
    report.certificate = std::max(report.certificate, result.certificate.worst());
  }

  void check(const LcpResult& result) const {
    const double bound = std::max(options_.tolerance, lcp::rounding_fraction(options_.tolerance));
    const bool ended = result.status == LcpStatus::solved;
    if (ended && result.certificate.worst() <= bound) return;
    std::ostringstream line;
    line << "the contact forces of " << result.z.size() << " contacts were not found: ";
    if (!ended) line << "the LCP solver stopped at its limit of iterations (" << result.pivots + result.block_steps << "), ";
    line << "certificate " << result.certificate.worst() << ", at most " << bound << " is accepted";
    throw UnsolvedStep(line.str());
  }

  /// Whether all normals lie in one coordinate plane, as those of logs in cross-section; axes_ begins with its axes then.
  bool find_plane(const std::vector<Row>& rows) {
    bool used[3] = {false, false, false};
    for (const Row& r : rows) used[0] |= r.normal.x != 0.0, used[1] |= r.normal.y != 0.0, used[2] |= r.normal.z != 0.0;
    static constexpr Lines<2>::Component all[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
    int out = 0;
    while (out < 3 && used[out]) ++out;
    for (int k = 0, at = 0; k < 3; ++k)
      if (k != out) axes_[at++] = all[k];
    return out < 3;
  }

  double scale_ = 0.0;
  LcpOptions options_;
  bool relaxes_ = false, assembled_ = false, planar_ = false, levers_ = false;  ///< in this step
  Lines<2>::Component axes_[3] = {};
  std::vector<char> before_;
  lcp::Relaxation<Lines<2>> flat_;
  lcp::Relaxation<Lines<4>> spatial_;
  lcp::Relaxation<Lines<6>> turning_;
  LcpSolver solver_;
};

}  // namespace impact
}  // namespace dembark
