// The normal forces of strongly coupled contacts: the active set by block pivots, J. J. Judice & F. M. Pires, Computers & Operations
// Research 21 (1994) 587, from a good guess, on a sparse Cholesky factor of the contacts that carry a force.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "../lcp/factors.hpp"
#include "elimination_order.hpp"
#include "motion.hpp"

namespace dembark {
namespace impact {

/// w = q + A z with A = diag(compliance) + scale G^T M'^-1 G; see system.hpp.
class Elimination {
 public:
  /// Begins with the set in `active`. Leaves active, z, w, and in `certificate` what LcpCertificate::worst is; block_steps: exchanges
  /// of the set are added. False where the set is not found soon, or the matrix is singular to rounding: for a solver with a guard.
  bool solve(const std::vector<Row>& rows, const std::vector<BodyResponse>& bodies, double scale, double share, const Eigen::VectorXd& q,
             std::vector<char>& active, Eigen::VectorXd& z, Eigen::VectorXd& w, double& certificate, int& block_steps) {
    rows_ = &rows;
    bodies_ = &bodies;
    scale_ = scale;
    size_.resize(rows.size());
    own_.resize(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Row& r = rows[i];
      own_[i] = r.compliance + scale * (body(r.a).inverse + (r.b >= 0 ? body(r.b).inverse : 0.0));
    }
    for (int step = 0; step < most_steps; ++step) {
      try {
        factorise(active);
      } catch (const lcp::NotDefinite&) {
        return false;
      }
      refine(q, share, z, w);
      if (!exchange(share, active, z, w)) {
        certificate = judge(active, z, w);
        return true;
      }
      ++block_steps;
    }
    return false;
  }

 private:
  static constexpr int most_steps = 12;

  const BodyResponse& body(int b) const { return (*bodies_)[std::size_t(b)]; }

  /// A of the active set in the order of elimination: of each column the entries above the diagonal, and it.
  void factorise(const std::vector<char>& active) {
    chosen_.clear();
    for (std::size_t i = 0; i < active.size(); ++i)
      if (active[i]) chosen_.push_back(int(i));
    order_.arrange(*rows_, bodies_->size(), chosen_);
    const std::size_t n = chosen_.size();
    last_.assign(bodies_->size(), -1);
    next_.resize(2 * n);
    start_.resize(n + 1);
    column_.clear();
    value_.clear();
    diagonal_.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const Row& r = (*rows_)[std::size_t(chosen_[k])];
      start_[k] = int(column_.size());
      for (int side = 0; side < (r.b >= 0 ? 2 : 1); ++side) {
        const int shared = side ? r.b : r.a;
        const Vec3<double> push = (side ? -scale_ : scale_) * body(shared).inverse * r.normal;
        int& last = last_[std::size_t(shared)];
        for (int other = last; other >= 0; other = next_[std::size_t(other)]) {  // contacts of the body so far, two slots each
          const Row& o = (*rows_)[std::size_t(chosen_[std::size_t(other / 2)])];
          column_.push_back(other / 2);
          value_.push_back(other % 2 ? -dot(push, o.normal) : dot(push, o.normal));
        }
        next_[2 * k + std::size_t(side)] = last;
        last = int(2 * k) + side;
      }
      diagonal_[k] = own_[std::size_t(chosen_[k])];
      column_.push_back(int(k));
      value_.push_back(diagonal_[k]);
    }
    start_[n] = int(column_.size());
    all_.assign(n, 1);
    factor_.compute({Eigen::Index(n), start_.data(), column_.data(), value_.data(), diagonal_.data()}, all_);
  }

  /// z of the active set, to rounding, and what follows for all.
  void refine(const Eigen::VectorXd& q, double share, Eigen::VectorXd& z, Eigen::VectorXd& w) {
    z.setZero();
    w = q;
    right_.resize(chosen_.size());
    gain_.resize(chosen_.size());
    for (int pass = 0; pass < 4; ++pass) {
      for (std::size_t k = 0; k < chosen_.size(); ++k) right_[k] = -w[chosen_[k]], gain_[k] = 0.0;
      factor_.add_solution(right_.data(), gain_.data());
      for (std::size_t k = 0; k < chosen_.size(); ++k) z[chosen_[k]] += gain_[k];
      measure(q, z, w);
      double worst = 0.0;
      for (const int i : chosen_) worst = std::max(worst, size_[std::size_t(i)] > 0.0 ? std::fabs(w[i]) / size_[std::size_t(i)] : 0.0);
      if (worst <= 0.25 * share) break;  // a quarter of what counts as rounding
    }
  }

  /// w = q + A z by the motion of the bodies, and of each row the size of what has been added up.
  void measure(const Eigen::VectorXd& q, const Eigen::VectorXd& z, Eigen::VectorXd& w) {
    shift_.assign(bodies_->size(), Vec3<double>());
    for (const int i : chosen_) {
      const Row& r = (*rows_)[std::size_t(i)];
      shift_[std::size_t(r.a)] += (scale_ * body(r.a).inverse * z[i]) * r.normal;
      if (r.b >= 0) shift_[std::size_t(r.b)] -= (scale_ * body(r.b).inverse * z[i]) * r.normal;
    }
    for (std::size_t i = 0; i < rows_->size(); ++i) {
      const Row& r = (*rows_)[i];
      const double force = z[Eigen::Index(i)], own = own_[i] * force;
      const double whole = dot(r.normal, r.b >= 0 ? shift_[std::size_t(r.a)] - shift_[std::size_t(r.b)] : shift_[std::size_t(r.a)]);
      const double others = whole - (own - r.compliance * force);
      w[Eigen::Index(i)] = q[Eigen::Index(i)] + r.compliance * force + whole;
      size_[i] = std::fabs(q[Eigen::Index(i)]) + std::fabs(own) + std::fabs(others);
    }
  }

  /// Exchanges all rows that break their condition by more than rounding; false where none does.
  bool exchange(double share, std::vector<char>& active, const Eigen::VectorXd& z, const Eigen::VectorXd& w) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < size_.size(); ++i) largest = std::max(largest, size_[i] * size_[i] / own_[i]);
    largest = std::numeric_limits<double>::epsilon() * std::sqrt(largest);
    bool found = false;
    for (std::size_t i = 0; i < size_.size(); ++i) {
      const double own = own_[i], value = active[i] ? z[Eigen::Index(i)] * own : w[Eigen::Index(i)];
      if (!(value < 0.0) || value >= -(share * size_[i] + largest * std::sqrt(own))) continue;
      active[i] ^= 1;
      found = true;
    }
    return found;
  }

  /// Cuts rounding off; the certificate is that of what was there before.
  double judge(const std::vector<char>& active, Eigen::VectorXd& z, Eigen::VectorXd& w) const {
    double largest = 0.0, low = 0.0, product = 0.0;
    for (std::size_t i = 0; i < size_.size(); ++i) {
      double &force = z[Eigen::Index(i)], &opening = w[Eigen::Index(i)];
      const double own = own_[i], below = std::max(-opening, 0.0);
      force = active[i] ? std::max(force, 0.0) : 0.0;
      largest = std::max(largest, size_[i] * size_[i] / own);
      low = std::max(low, below * below / own);
      product += force * opening;
      opening = active[i] ? 0.0 : std::max(opening, 0.0);
    }
    return largest > 0.0 ? std::max(std::sqrt(low / largest), std::fabs(product) / largest) : 0.0;
  }

  const std::vector<Row>* rows_ = nullptr;
  const std::vector<BodyResponse>* bodies_ = nullptr;
  double scale_ = 0.0;
  EliminationOrder order_;
  lcp::SparseFactor factor_;
  std::vector<int> chosen_;  ///< rows of the active set in the order of elimination
  std::vector<int> start_, column_, last_, next_;
  std::vector<double> value_, diagonal_, right_, gain_;
  std::vector<double> own_;   ///< m/N, of each row its diagonal of A
  std::vector<double> size_;  ///< m, of the terms that add up to w
  std::vector<char> all_;
  std::vector<Vec3<double>> shift_;
};

}  // namespace impact
}  // namespace dembark
