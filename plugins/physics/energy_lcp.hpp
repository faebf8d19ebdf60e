// Linear complementarity problems with a symmetric positive definite matrix: find z with
//     w = M z + q,   w >= 0,   z >= 0,   z^T w = 0.                                          (1)
// In an impact or contact problem z are the contact forces, w the gaps at the end of the step, M the compliance of the contacts
// and q the gaps without contact forces. The solution exists and is unique.
//
// Methods (LcpMethod):
//   energy     While some entry of the transformed right-hand side is negative, exchange w_i <-> z_i where -q_i^2 / M_ii of the
//              transformed system is most negative: the exchange that releases the most energy. G. N. Kolesnikov, Resources and
//              Technology 10 (2013). Ties go to the lower index. The paper proves no end: a set that comes back hands over to
//              least index, and LcpResult::used_fallback says so.
//   block      Exchange all violated indices at once, J. J. Judice & F. M. Pires, Computers & Operations Research 21 (1994) 587.
//              A few sweeps of Gauss-Seidel guess the first set unless one is given. When the number of violations stalls, descent of
//              the energy finds another (lcp/relaxation.hpp); where it stalls again, least index takes over.
//   murty      Least index, K. G. Murty, Opsearch 11 (1974) 138: ends for certain, may take many pivots.
//   pgs        Projected Gauss-Seidel, to the tolerance.
//   automatic  energy on small islands. On large ones a chain: sweeps of projected Gauss-Seidel find which z are positive, conjugate
//              gradients how large they are (sparse M), and where these would take longer than a factor, block ends it.
// Islands (connected components of the graph of M) are solved apart, but for pgs. All other methods end with a residual that is rounding;
// where a factor was needed, z has been refined iteratively, for scaled condition numbers up to some 1e14. What is rounding follows from
// s_i = |q_i| + sum_j |M_ij z_j|, so the units of single rows do not matter. q is brought to the size of 1 by a power of two: the squares
// that are compared neither vanish nor overflow, and the same problem in other units has the same steps and digits.
#pragma once

#include "lcp/active_set.hpp"
#include "lcp/checks.hpp"
#include "lcp/definite.hpp"
#include "lcp/islands.hpp"
#include "lcp/single_pivots.hpp"

namespace dembark {

/// Keeps its work space, and for sparse M the islands and the fill-reducing order, which a next matrix of the same pattern uses again.
/// Not thread-safe. The result stays valid until the next call.
class LcpSolver {
 public:
  /// M: n x n, both triangles stored; units of w / z. q: n, units of w. start: n flags of the set {z_i > 0} to begin with, for example
  /// that of the last step; it changes the number of steps, not the answer. Throws std::invalid_argument with one line that names
  /// the entry: not symmetric, not positive definite, not finite, wrong length.
  const LcpResult& solve(const Eigen::SparseMatrix<double>& M, const Eigen::VectorXd& q, const LcpOptions& options = {},
                         const std::vector<char>* start = nullptr) {
    lcp::check_shapes(M.rows(), M.cols(), q.size(), start);
    if (!M.isCompressed()) {
      Eigen::SparseMatrix<double> copy = M;
      copy.makeCompressed();
      return solve_columns(copy.outerIndexPtr(), copy.innerIndexPtr(), copy.valuePtr(), q, options, start);
    }
    return solve_columns(M.outerIndexPtr(), M.innerIndexPtr(), M.valuePtr(), q, options, start);
  }

  /// The same for a dense matrix; one that is mostly zeros, or falls into islands, is treated as sparse.
  const LcpResult& solve(const Eigen::MatrixXd& M, const Eigen::VectorXd& q, const LcpOptions& options = {},
                         const std::vector<char>* start = nullptr) {
    lcp::check_shapes(M.rows(), M.cols(), q.size(), start);
    return solve_dense(M.data(), q, options, start);
  }

  /// As above, for columns that lie in arrays of the caller. Compressed columns need ascending rows without duplicates; shapes are
  /// those of q.
  const LcpResult& solve_columns(const int* outer, const int* inner, const double* value, const Eigen::VectorXd& q,
                                 const LcpOptions& options, const std::vector<char>* start) {
    lcp::check_options(options);
    if (options.check_input) {
      lcp::check_finite(q.data(), q.size());
      lcp::check_sparse(outer, inner, value, q.size());
    }
    return solve_islands(outer, inner, value, q, options, start);
  }

  /// Column-major n x n array.
  const LcpResult& solve_dense(const double* m, const Eigen::VectorXd& q, const LcpOptions& options, const std::vector<char>* start) {
    const lcp::Matrix block = lcp::dense_matrix(m, q.size());
    lcp::check_options(options);
    if (options.check_input) {
      lcp::check_finite(q.data(), block.n);
      lcp::check_dense(m, block.n);
    }
    if (!compact(block)) {
      const Eigen::SparseMatrix<double> columns = Eigen::Map<const Eigen::MatrixXd>(m, block.n, block.n).sparseView(0.0, 0.0);
      return solve_islands(columns.outerIndexPtr(), columns.innerIndexPtr(), columns.valuePtr(), q, options, start);
    }
    order_.resize(std::size_t(block.n));
    std::iota(order_.begin(), order_.end(), 0);
    load(block, q, start);
    result_.islands = block.n > 0;
    lcp::DefiniteMargin alone;
    if (block.n > 0) solve_block(block, 0, alone, options, start);
    return finish(block, options);
  }

 private:
  using Index = Eigen::Index;
  /// Islands up to this size are solved by energy pivots on a dense copy (automatic).
  static constexpr Index small_island = 40;
  /// Larger ones with more than this fraction of nonzeros are solved as dense.
  static constexpr double dense_fraction = 0.25;
  static constexpr Index dense_limit = 8192;
  /// Before block steps: a sweep of a full matrix costs much against its factor.
  static constexpr int most_sweeps = 8;

  /// Whether a dense matrix is best left dense: one island and not mostly zeros.
  bool compact(const lcp::Matrix& m) const {
    if (m.n <= 1) return m.n == 0;  // a single unknown needs no factor
    const auto column = [&m](Index j) { return m.value + j * m.n; };
    if (m.n > small_island) {
      const double enough = dense_fraction * double(m.n) * double(m.n);
      Index entries = 0;
      for (Index j = 0; j < m.n && double(entries) < enough; ++j) entries += m.n - std::count(column(j), column(j + 1), 0.0);
      if (double(entries) < enough) return false;
    }
    std::vector<Index> queue{0}, left;
    for (Index i = m.n; --i > 0;) left.push_back(i);
    while (!queue.empty() && !left.empty()) {
      const double* reached = column(queue.back());
      queue.pop_back();
      const auto kept = std::partition(left.begin(), left.end(), [&](Index i) { return reached[i] == 0.0; });
      queue.insert(queue.end(), kept, left.end());
      left.erase(kept, left.end());
    }
    return left.empty();
  }

  /// What is given, in the order of the islands, as m is.
  void load(const lcp::Matrix& m, const Eigen::VectorXd& q, const std::vector<char>* start) {
    result_ = LcpResult();
    q_ = q(order_);
    double largest = 0.0;
    for (Index i = 0; i < m.n; ++i) largest = std::max(largest, std::fabs(q_[i]) / std::sqrt(m.diagonal(i)));
    exponent_ = largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) : 0;
    for (double& value : q_) value = std::ldexp(value, -exponent_);
    z_.setZero(q.size());
    active_.assign(order_.size(), 0);
    if (start) std::transform(order_.begin(), order_.end(), active_.begin(), [start](int i) { return (*start)[std::size_t(i)] != 0; });
  }

  const LcpResult& solve_islands(const int* outer, const int* inner, const double* value, const Eigen::VectorXd& q,
                                 const LcpOptions& options, const std::vector<char>* start) {
    const bool fill_reducing = options.method == LcpMethod::automatic || options.method == LcpMethod::block;
    if (islands_.take(outer, inner, value, q.size(), fill_reducing, small_island)) {
      margins_.assign(std::size_t(islands_.count()), {});
      margin_of_all_ = {};
    }
    order_ = islands_.order();
    load(islands_.whole(), q, start);
    result_.islands = islands_.count();
    // The certificate is that of the whole, so what stops at a tolerance of it cannot go island by island.
    if (options.method == LcpMethod::pgs && q.size() > 0) solve_block(islands_.whole(), 0, margin_of_all_, options, start);
    for (int t = 0; t < islands_.count() && options.method != LcpMethod::pgs; ++t) solve_island(t, options, start);
    return finish(islands_.whole(), options);
  }

  void solve_island(int island, const LcpOptions& options, const std::vector<char>* start) {
    lcp::Matrix block = islands_.block(island);
    const double full = double(block.n) * double(block.n);
    if (block.n == 1) return solve_single(islands_.first(island), block.diagonal(0));
    if (block.n <= small_island || (block.n <= dense_limit && double(islands_.entries(island)) >= dense_fraction * full)) {
      dense_values_.setZero(block.n, block.n);
      for (Index j = 0; j < block.n; ++j) block.add_column(j, 1.0, dense_values_.col(j).data());
      block = lcp::dense_matrix(dense_values_.data(), block.n);
    }
    solve_block(block, islands_.first(island), margins_[std::size_t(island)], options, start);
  }

  void solve_single(int at, double m) {
    const bool active = q_[at] < 0.0;
    if (!(m > 0.0)) lcp::fail_definite(order_[std::size_t(at)], {0, m, m});
    if (active) z_[at] = -q_[at] / m;
    result_.pivots += active != (active_[std::size_t(at)] != 0);
    active_[std::size_t(at)] = active;
  }

  /// One island, whose unknowns begin at `first`.
  void solve_block(const lcp::Matrix& m, int first, lcp::DefiniteMargin& margin, const LcpOptions& options, bool started) {
    const auto flags = active_.begin() + first;
    unknowns_.reset(m);
    unknowns_.q = q_.segment(first, m.n);
    std::copy_n(flags, m.n, unknowns_.active.begin());
    try {
      if (options.check_input) definite_.check(m, margin);
      add(run(m, options, started));
    } catch (const lcp::NotDefinite& what) {
      lcp::fail_definite(order_[std::size_t(first + what.row)], what);
    }
    std::copy_n(unknowns_.active.begin(), m.n, flags);
    z_.segment(first, m.n) = unknowns_.z.max(0.0);
  }

  lcp::Outcome run(const lcp::Matrix& m, const LcpOptions& options, bool started) {
    const bool automatic = options.method == LcpMethod::automatic;
    if (options.method == LcpMethod::pgs) return lcp::gauss_seidel(m, unknowns_, options, relaxation_.rows);
    if (options.method != LcpMethod::block && (!automatic || m.n <= small_island)) {
      if (m.n > dense_limit)
        lcp::fail("methods energy and murty keep n^2 numbers and take islands up to ", dense_limit, " unknowns, not ", m.n,
                  "; use auto or block");
      return singles_.run(m, unknowns_, options.method == LcpMethod::murty, options);
    }
    if (!started) {
      const double fraction = lcp::rounding_fraction(options.tolerance);
      relaxation_.rows.start(m, unknowns_, fraction);
      bool solved = false;
      if (automatic && !m.dense()) solved = relaxation_.solve(fraction);
      else relaxation_.find_set(most_sweeps);
      relaxation_.rows.store(unknowns_);
      if (solved) return {};
    }
    return exact_.run(m, unknowns_, options, &relaxation_);
  }

  void add(const lcp::Outcome& outcome) {
    result_.pivots += outcome.pivots;
    result_.block_steps += outcome.block_steps;
    result_.used_fallback |= outcome.used_fallback;
    if (outcome.limit) result_.status = LcpStatus::iteration_limit;
  }

  /// z, w and the certificate, from the M and q that were given: independent of whatever the methods kept.
  const LcpResult& finish(const lcp::Matrix& m, const LcpOptions& options) {
    unknowns_.reset(m);
    unknowns_.q = q_;
    unknowns_.z = z_;
    unknowns_.measure(m);
    result_.certificate = unknowns_.certificate();
    const double fraction = lcp::rounding_fraction(options.tolerance);
    for (Index i = 0; i < m.n && options.method != LcpMethod::pgs; ++i)
      if (active_[std::size_t(i)] || std::fabs(unknowns_.w[i]) <= fraction * unknowns_.s[i]) unknowns_.w[i] = 0.0;
    result_.z.resize(m.n);
    result_.w.resize(m.n);
    for (Index i = 0; i < m.n; ++i) {
      const int at = order_[std::size_t(i)];
      result_.z[at] = std::ldexp(z_[i], exponent_);
      result_.w[at] = std::ldexp(unknowns_.w[i], exponent_);
      if (std::isinf(result_.z[at]) && std::isfinite(z_[i]))
        lcp::fail("z[", at, "] is beyond the largest number; multiply M by a factor, or q");
    }
    return result_;
  }

  LcpResult result_;
  lcp::Islands islands_;
  std::vector<int> order_;  ///< the unknowns, island after island; so do the next three go
  Eigen::ArrayXd q_, z_;    ///< over 2^exponent_
  int exponent_ = 0;
  std::vector<char> active_;
  lcp::Unknowns unknowns_;  ///< of one island
  lcp::SinglePivots singles_;
  lcp::Relaxation<lcp::MatrixRows> relaxation_;
  lcp::ActiveSet exact_;
  lcp::DefiniteProof definite_;
  std::vector<lcp::DefiniteMargin> margins_;  ///< of the islands
  lcp::DefiniteMargin margin_of_all_;         ///< of the matrix that is not split
  Eigen::MatrixXd dense_values_;
};

}  // namespace dembark
