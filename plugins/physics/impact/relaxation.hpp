// The normal forces of a step by projected Gauss-Seidel and conjugate gradients, on the bodies instead of a matrix.
//
// Where impacts are resolved in time (omega tau well below 1) the springs give way far more than the bodies do in a step, and a change of
// one force hardly reaches the next contact: each sweep gains one or two digits. Where it does reach, the sweeps still find which contacts
// carry a force, and conjugate gradients find how much, in turn, after J. L. Morales, J. Nocedal & M. Smelyanskiy, Numerische Mathematik
// 111 (2008) 251. The residual is pushed down to the rounding that a factor would leave as well, and only such an answer is accepted.
// Nothing is carried from step to step, so a run that is resumed repeats to the last bit.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "conjugate.hpp"
#include "lines.hpp"
#include "motion.hpp"

namespace dembark {
namespace impact {

/// w = q + A z, w >= 0, z >= 0, z w = 0; A as in lines.hpp.
class Relaxation {
 public:
  /// The rows of a step, which must outlive its solves. bodies: with 1/m' as `inverse`; scale: h tau^2 (s^2).
  void prepare(const std::vector<Row>& rows, const std::vector<BodyResponse>& bodies, double scale) {
    planar_ = find_plane(rows);
    if (planar_) flat_.lines.prepare(rows, bodies, scale, axes_);
    else spatial_.lines.prepare(rows, bodies, scale, axes_);
  }

  /// Forces between the sweeps of friction, from the z given: to four digits of each row's own scale, or as near as a few sweeps come.
  void approach(const Eigen::VectorXd& q, Eigen::VectorXd& z) { planar_ ? flat_.approach(q, z) : spatial_.approach(q, z); }

  /// Solves from the z given; leaves z and w, and in `certificate` what LcpCertificate::worst is, from scales that are no larger than those
  /// defined there. False: not converged; z is then a guess of the solution.
  /// share: of what is added up in a row, that is rounding.
  /// Gives up where a factor of the contacts that carry a force would take less time.
  bool solve(const Eigen::VectorXd& q, double share, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
    return planar_ ? flat_.solve(q, share, z, w, certificate) : spatial_.solve(q, share, z, w, certificate);
  }

  /// Goes on where the last solve() gave up, however long it takes.
  bool finish(double share, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
    return planar_ ? flat_.finish(share, z, w, certificate) : spatial_.finish(share, z, w, certificate);
  }

 private:
  template <int Width>
  struct Solver {
    Lines<Width> lines;

    void approach(const Eigen::VectorXd& q, Eigen::VectorXd& z) {
      lines.start(q, 1e-12, z);
      lines.template relax<false>();
      lines.template relax<false>();
      lines.widen();
      for (int sweep = 0; sweep < approach_sweeps && lines.template relax<true>() > close; ++sweep) continue;
      lines.store(z);
    }

    bool solve(const Eigen::VectorXd& q, double share, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
      lines.start(q, share, z);
      const bool solved = sweep(share, w, certificate) || descend(share, worth_steps, w, certificate);
      lines.store(z);
      return solved;
    }

    bool finish(double share, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
      const bool solved = descend(share, std::numeric_limits<double>::max(), w, certificate);
      lines.store(z);
      return solved;
    }

   private:
    static constexpr int most_sweeps = 90, blind_sweeps = 4;  ///< none has been seen to do with so few
    static constexpr double worth_sweeps = 40.0;              ///< so many that are still to come cost more than conjugate gradients
    static constexpr int approach_sweeps = 10;
    static constexpr double close = 1e-4;  ///< of a row's own scale: where approach() stops
    static constexpr int most_faces = 300, most_steps = 10000;
    static constexpr double worth_steps = 80.0;  ///< so many that are still to come cost more than a factor
    static constexpr int face_sweeps = 3;
    static constexpr double fall = 0.2;  ///< of the residual, while the face still changes

    /// Projected Gauss-Seidel; false where it converges slowly.
    bool sweep(double share, Eigen::VectorXd& w, double& certificate) {
      for (int sweep = 0; sweep < blind_sweeps; ++sweep) {
        lines.template relax<false>();
        if (sweep == 1) lines.widen();
      }
      double first = 0.0;  // size of the steps at the begin of the count
      for (int sweep = blind_sweeps, count = 0; sweep < most_sweeps; ++sweep, ++count) {
        const double step = lines.template relax<true>(), enough = 30.0 * share;
        if (count == 0) first = step;
        if (step > enough) {
          if (count > 2 && !(step < first && count * std::log(enough / step) > worth_sweeps * std::log(step / first))) return false;
          continue;  // the residual is what the next sweep's steps would be
        }
        lines.gather();
        if (lines.widen()) count = -1;
        else if (lines.judge(share, w, certificate)) return true;
      }
      return false;
    }

    /// Conjugate gradients on the face that sweeps find, until both agree; false where more than `worth` steps are still to come.
    bool descend(double share, double worth, Eigen::VectorXd& w, double& certificate) {
      lines.widen();
      conjugate.take_face(lines);
      bool same = false;
      for (int face = 0, steps = 0; face < most_faces && steps < most_steps; ++face) {
        lines.gather();
        const double before = lines.energy();
        const bool soon = conjugate.solve(lines, {same ? 0.0 : fall, 0.05 * share, most_steps - steps, worth});
        steps += conjugate.steps();
        // Forces that are cut off may cost more than the others have gained.
        for (double part = 1.0;; part *= 0.5) {
          const bool cut = conjugate.apply(lines, part);
          lines.gather();
          if (!cut || part < 1e-3 || lines.energy() < before) break;
        }
        const bool wider = lines.widen();
        if (same && !soon) return false;
        if (same && !wider && lines.judge(share, w, certificate)) return true;
        for (int sweep = 0; sweep < face_sweeps; ++sweep) lines.template relax<false>();
        same = conjugate.take_face(lines) && !wider;
      }
      return false;
    }

    ConjugateGradients<Width> conjugate;
  };

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

  bool planar_ = false;
  Lines<2>::Component axes_[3] = {};
  Solver<2> flat_;
  Solver<4> spatial_;
};

}  // namespace impact
}  // namespace dembark
