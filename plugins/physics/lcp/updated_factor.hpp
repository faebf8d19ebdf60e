// The factor of an active set that differs from an already factorised one by a few indices.
//
// With the factor of the set B at hand, every index f that entered or left B since brings one direction that keeps the equations of
// the rest of B:
//     entered  d_f = e_f - M_BB^{-1} M_Bf     (w stays 0 on B while z_f moves),
//     left     d_f = M_BB^{-1} e_f            (w_f moves, w stays 0 on the rest of B).
// The solution for the new set is that for B plus a combination of the d_f, from a system as large as their number: w_f = 0 for those
// that entered, z_f = 0 for those that left. A direction costs one solution with the factor, where a new factor costs many.
#pragma once

#include <Eigen/LU>

#include "factors.hpp"

namespace dembark::lcp {

template <class Factor>
class UpdatedFactor {
 public:
  template <class Matrix>
  void compute(const Matrix& m, const std::vector<char>& active, bool fresh) {
    if (!fresh && update(m, active)) return;
    changed_.clear();
    base_ = active;
    factor_.compute(m, base_);
  }

  /// z_A += M_AA^{-1} right_A; arrays of full length, right is not used outside of A.
  void add_solution(const double* right, double* z) {
    const Index count = Index(changed_.size());
    if (count == 0) return factor_.add_solution(right, z);
    const std::size_t n = base_.size();
    right_.assign(right, right + n);
    part_.assign(n, 0.0);
    for (const Change& c : changed_)
      if (!c.entered) right_[std::size_t(c.index)] = 0.0;
    factor_.add_solution(right_.data(), part_.data());
    Eigen::VectorXd missing(count);
    for (Index k = 0; k < count; ++k) {
      const Change& c = changed_[std::size_t(k)];
      missing[k] = c.entered ? right[c.index] - row_times(c, part_) : -part_[std::size_t(c.index)];
    }
    const Eigen::VectorXd amount = small_.solve(missing);
    for (Index k = 0; k < count; ++k) {
      const std::vector<double>& d = changed_[std::size_t(k)].direction;
      for (std::size_t i = 0; i < n; ++i) part_[i] += amount[k] * d[i];
    }
    for (std::size_t i = 0; i < n; ++i) z[i] += part_[i];
    for (const Change& c : changed_)
      if (!c.entered) z[c.index] = 0.0;
  }

 private:
  /// More changes than this are worth a new factor.
  static constexpr std::size_t most = 12;

  struct Change {
    Index index;
    bool entered;
    std::vector<double> direction;
    std::vector<std::pair<Index, double>> row;  ///< of M, entered only
  };

  static double row_times(const Change& c, const std::vector<double>& x) {
    double sum = 0.0;
    for (const auto& [i, value] : c.row) sum += value * x[std::size_t(i)];
    return sum;
  }

  template <class Matrix>
  bool update(const Matrix& m, const std::vector<char>& active) {
    if (base_.size() != active.size()) return false;
    std::vector<Index> wanted;
    for (std::size_t i = 0; i < active.size(); ++i)
      if (active[i] != base_[i]) {
        if (wanted.size() == most) return false;
        wanted.push_back(Index(i));
      }
    // Directions that are no longer wanted go, the others stay.
    changed_.erase(std::remove_if(changed_.begin(), changed_.end(),
                                  [&](const Change& c) { return !std::binary_search(wanted.begin(), wanted.end(), c.index); }),
                   changed_.end());
    for (const Index i : wanted)
      if (std::none_of(changed_.begin(), changed_.end(), [&](const Change& c) { return c.index == i; }))
        changed_.push_back(direction(m, i));
    const Index count = Index(changed_.size());
    if (count == 0) return true;
    Eigen::MatrixXd system(count, count);
    for (Index r = 0; r < count; ++r) {
      const Change& c = changed_[std::size_t(r)];
      double largest = 0.0;
      for (Index k = 0; k < count; ++k) {
        const std::vector<double>& d = changed_[std::size_t(k)].direction;
        system(r, k) = c.entered ? row_times(c, d) : d[std::size_t(c.index)];
        largest = std::max(largest, std::fabs(system(r, k)));
      }
      // What entered must leave a pivot of its own; when it does not, a new factor says what is wrong.
      if (!(system(r, r) > 1e-6 * (c.entered ? m.diagonal(c.index) : largest))) return false;
    }
    small_.compute(system);
    return true;
  }

  template <class Matrix>
  Change direction(const Matrix& m, Index f) {
    const std::size_t n = base_.size();
    Change c{f, !base_[std::size_t(f)], std::vector<double>(n, 0.0), {}};
    right_.assign(n, 0.0);
    if (c.entered) {
      m.copy_column(f, right_.data());
      for (std::size_t i = 0; i < n; ++i) {
        if (right_[i] != 0.0) c.row.emplace_back(Index(i), right_[i]);
        right_[i] = -right_[i];
      }
    } else {
      right_[std::size_t(f)] = 1.0;
    }
    factor_.add_solution(right_.data(), c.direction.data());
    if (c.entered) c.direction[std::size_t(f)] = 1.0;
    return c;
  }

  Factor factor_;
  std::vector<char> base_;
  std::vector<Change> changed_;
  Eigen::PartialPivLU<Eigen::MatrixXd> small_;
  std::vector<double> right_, part_;
};

}  // namespace dembark::lcp
