// The normal forces of weakly coupled contacts, by projected Gauss-Seidel on the bodies instead of a matrix.
//
// Where impacts are resolved in time (omega tau well below 1) the springs give way far more than the bodies do in a step, and a change of
// one force hardly reaches the next contact: each sweep gains one or two digits. The residual is then pushed down to the rounding that
// a factor would leave as well, and only such an answer is accepted; what converges slowly is left to the exact solver. Nothing is carried
// from step to step, so a run that is resumed repeats to the last bit.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "../lcp/blocks.hpp"
#include "motion.hpp"

namespace dembark {
namespace impact {

/// w = q + A z with A = diag(compliance) + scale G^T M'^-1 G; see system.hpp.
class Relaxation {
 public:
  /// The rows of a step. bodies: with 1/m' as `inverse`; scale: h tau^2 (s^2); compliance: m/N, of each row.
  void prepare(const std::vector<Row>& rows, const std::vector<BodyResponse>& bodies, double scale, const std::vector<double>& compliance) {
    planar_ = find_plane(rows);
    if (planar_) flat_.prepare(rows, bodies, scale, compliance, axes_);
    else spatial_.prepare(rows, bodies, scale, compliance, axes_);
  }

  /// Solves from the z given; leaves z and w, and in `certificate` what LcpCertificate::worst is, from scales that are no larger than those
  /// defined there. False: not converged, z and w are of no use.
  bool solve(const Eigen::VectorXd& q, double tolerance, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
    const double share = lcp::rounding_share(tolerance);
    return planar_ ? flat_.solve(q, share, z, w, certificate) : spatial_.solve(q, share, z, w, certificate);
  }

 private:
  using Component = double Vec3<double>::*;

  /// Width: components that are kept of each vector, 2 or 4 (the last one zero).
  template <int Width>
  class Lines {
   public:
    void prepare(const std::vector<Row>& rows, const std::vector<BodyResponse>& bodies, double scale, const std::vector<double>& compliance,
                 const Component* axes) {
      lines_.resize(rows.size());
      shift_.resize(bodies.size() + 1);  // walls are the last, which never moves
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const Row& r = rows[i];
        Line& l = lines_[i];
        l.a = r.a;
        l.b = r.b >= 0 ? r.b : int(bodies.size());
        const double of_a = scale * bodies[std::size_t(r.a)].inverse, of_b = r.b >= 0 ? scale * bodies[std::size_t(r.b)].inverse : 0.0;
        Vector n = Vector::Zero();
        for (int k = 0; k < std::min(Width, 3); ++k) n[k] = r.normal.*axes[k];
        l.normal = n;
        l.on_a = of_a * n;
        l.on_b = of_b * n;
        l.compliance = compliance[i];
        l.diagonal = compliance[i] + of_a + of_b;
        l.inverse = 1.0 / l.diagonal;
        l.root = std::sqrt(l.diagonal);
      }
    }

    bool solve(const Eigen::VectorXd& q, double share, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
      near_.clear();
      double largest = 0.0;
      for (std::size_t i = 0; i < lines_.size(); ++i) {
        const double x = q[Eigen::Index(i)];
        if (x < 0.0) largest = std::max(largest, x * x * lines_[i].inverse);
        if (x < 0.0 || z[Eigen::Index(i)] > 0.0) near_.push_back(int(i));
      }
      floor_ = std::numeric_limits<double>::epsilon() / share * std::sqrt(largest);
      interleave();
      gather(z);
      double last = std::numeric_limits<double>::infinity();
      for (int sweep = 1, fresh = 1; sweep <= most_sweeps; ++sweep, ++fresh) {
        const double step = relax(q, z);
        if (fresh > 3 && step > slowest * last) return false;
        last = step;
        if (sweep == 2 && widen(q)) fresh = 0;
        if (step > 30.0 * share) continue;  // the residual is what the next sweep's steps would be
        gather(z);
        if (judge(q, share, z, w, certificate)) return true;
        if (widen(q)) fresh = 0;
      }
      return false;
    }

   private:
    using Vector = Eigen::Matrix<double, Width, 1>;
    static constexpr int most_sweeps = 30;
    static constexpr double slowest = 0.3;  ///< of the size of a sweep's steps over that of the last one

    struct Line {
      Vector normal, on_a, on_b;  ///< unit; response of the bodies to a unit force, m/N
      double compliance, diagonal, inverse, root;
      int a, b;
    };

    /// Contacts that follow each other in the list share bodies, and each would wait for the last one: four parts of the list take turns.
    void interleave() {
      const std::size_t n = near_.size(), part = (n + 3) / 4;
      order_.clear();
      for (std::size_t i = 0; i < part; ++i)
        for (std::size_t k = i; k < n; k += part) order_.push_back(near_[k]);
    }

    /// Positions of the bodies after the step under the forces z alone.
    void gather(const Eigen::VectorXd& z) {
      for (Vector& s : shift_) s.setZero();
      for (const int i : near_) {
        const Line& l = lines_[std::size_t(i)];
        const double force = z[i];
        shift_[std::size_t(l.a)] += force * l.on_a;
        shift_[std::size_t(l.b)] -= force * l.on_b;
      }
    }

    double gap(const Line& l) const { return l.normal.dot(shift_[std::size_t(l.a)] - shift_[std::size_t(l.b)]); }

    /// One sweep; the largest step, in units of the row's own scale.
    double relax(const Eigen::VectorXd& q, Eigen::VectorXd& z) {
      double most = 0.0;
      for (const int i : order_) {
        const Line& l = lines_[std::size_t(i)];
        const double old = z[i], next = std::max(old - (q[i] + l.compliance * old + gap(l)) * l.inverse, 0.0), step = next - old;
        shift_[std::size_t(l.a)] += step * l.on_a;
        shift_[std::size_t(l.b)] -= step * l.on_b;
        z[i] = next;
        const double size = std::fabs(step) * l.diagonal, scale = std::fabs(q[i]) + l.diagonal * next + floor_ * l.root;
        if (size > most * scale) most = size / scale;
      }
      return most;
    }

    /// Rows that are pushed together by others join the list; false when there are none.
    bool widen(const Eigen::VectorXd& q) {
      const std::size_t before = near_.size();
      std::size_t next = 0;
      for (std::size_t i = 0; i < lines_.size(); ++i) {
        if (next < before && near_[next] == int(i)) ++next;
        else if (q[Eigen::Index(i)] + gap(lines_[i]) < 0.0) near_.push_back(int(i));
      }
      if (near_.size() == before) return false;
      std::inplace_merge(near_.begin(), near_.begin() + std::ptrdiff_t(before), near_.end());
      interleave();
      return true;
    }

    /// w, and whether all conditions hold to rounding.
    bool judge(const Eigen::VectorXd& q, double share, const Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate) {
      const std::size_t n = lines_.size();
      scale_.resize(n);
      double largest = 0.0, low = 0.0, product = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Index k = Eigen::Index(i);
        const Line& l = lines_[i];
        const double whole = gap(l), others = whole - (l.diagonal - l.compliance) * z[k];
        const double s = std::fabs(q[k]) + l.diagonal * z[k] + std::fabs(others);
        w[k] = q[k] + l.compliance * z[k] + whole;
        scale_[i] = s;
        largest = std::max(largest, s * s * l.inverse);
        if (w[k] < 0.0) low = std::max(low, w[k] * w[k] * l.inverse);
        product += z[k] * w[k];
      }
      bool good = true;
      const double everywhere = std::numeric_limits<double>::epsilon() * std::sqrt(largest);
      for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Index k = Eigen::Index(i);
        const double limit = share * scale_[i] + everywhere * lines_[i].root;
        if (!(z[k] > 0.0 ? std::fabs(w[k]) <= limit : w[k] >= -limit)) {
          good = false;
        } else if (z[k] > 0.0 || w[k] < 0.0) {
          w[k] = 0.0;
        }
      }
      if (good) certificate = largest > 0.0 ? std::max(std::sqrt(low / largest), std::fabs(product) / largest) : 0.0;
      return good;
    }

    std::vector<Line, Eigen::aligned_allocator<Line>> lines_;
    std::vector<Vector, Eigen::aligned_allocator<Vector>> shift_;
    std::vector<int> near_, order_;  ///< rows that may carry a force, as they come and as they are visited
    std::vector<double> scale_;
    double floor_ = 0.0;  ///< of a row's scale, over its root: steps below the last digit of the largest row are none
  };

  /// Whether all normals lie in one coordinate plane, as those of logs in cross-section; axes_ begins with its axes then.
  bool find_plane(const std::vector<Row>& rows) {
    bool used[3] = {false, false, false};
    for (const Row& r : rows) used[0] |= r.normal.x != 0.0, used[1] |= r.normal.y != 0.0, used[2] |= r.normal.z != 0.0;
    static constexpr Component all[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
    int out = 0;
    while (out < 3 && used[out]) ++out;
    for (int k = 0, at = 0; k < 3; ++k)
      if (k != out) axes_[at++] = all[k];
    return out < 3;
  }

  bool planar_ = false;
  Component axes_[3] = {};
  Lines<2> flat_;
  Lines<4> spatial_;
};

}  // namespace impact
}  // namespace dembark
