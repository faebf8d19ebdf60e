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
// where a factor was needed, z has been refined iteratively, for scaled condition numbers up to some 1e14. What is rounding is told by
// s_i = |q_i| + sum_j |M_ij z_j|, so the units of single rows do not matter.
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
    begin(q, options);
    if (options.check_input) lcp::check_sparse(outer, inner, value, q.size());
    return solve_islands(outer, inner, value, q, options, start);
  }

  /// Column-major n x n array.
  const LcpResult& solve_dense(const double* m, const Eigen::VectorXd& q, const LcpOptions& options, const std::vector<char>* start) {
    const Index n = q.size();
    begin(q, options);
    if (options.check_input) lcp::check_dense(m, n);
    if (!compact(m, n)) {
      copy_ = Eigen::Map<const Eigen::MatrixXd>(m, n, n).sparseView(0.0, 0.0);
      return solve_islands(copy_.outerIndexPtr(), copy_.innerIndexPtr(), copy_.valuePtr(), q, options, start);
    }
    result_.islands = n > 0;
    const lcp::DenseBlock block{m, n};
    if (n > 0) solve_block(block, nullptr, q, options, start);
    return finish(block, q, options);
  }

 private:
  using Index = Eigen::Index;
  /// Islands up to this size are solved by energy pivots on a dense copy (automatic).
  static constexpr Index small_island = 40;
  /// Larger ones with more than this fraction of nonzeros are solved as dense.
  static constexpr double dense_fraction = 0.25;
  static constexpr Index dense_limit = 8192;

  /// The links of the chain for one kind of matrix.
  template <class Matrix, class Factor, int Sweeps>
  struct Chain {
    /// Before block steps: a sweep of a full matrix costs much against its factor, one of a sparse matrix little.
    static constexpr int sweeps = Sweeps;
    lcp::Relaxation<lcp::MatrixRows<Matrix>> relaxation;
    lcp::ActiveSet<Matrix, Factor> exact;
  };

  void begin(const Eigen::VectorXd& q, const LcpOptions& options) {
    lcp::check_options(options);
    if (options.check_input) lcp::check_finite(q.data(), q.size());
    result_ = LcpResult();
    result_.z.setZero(q.size());
    active_.assign(std::size_t(q.size()), 0);
  }

  /// Whether a dense matrix is best left dense: one island and not mostly zeros.
  bool compact(const double* m, Index n) const {
    if (n <= 1) return n == 0;  // a single unknown needs no factor
    const lcp::DenseBlock block{m, n};
    if (n > small_island) {
      const double enough = dense_fraction * double(n) * double(n);
      Index entries = 0;
      for (Index j = 0; j < n && double(entries) < enough; ++j) entries += (block.column(j) != 0.0).count();
      if (double(entries) < enough) return false;
    }
    std::vector<Index> queue{0}, left;
    for (Index i = n; --i > 0;) left.push_back(i);
    while (!queue.empty() && !left.empty()) {
      const auto column = block.column(queue.back());
      queue.pop_back();
      const auto kept = std::partition(left.begin(), left.end(), [&](Index i) { return column[i] == 0.0; });
      queue.insert(queue.end(), kept, left.end());
      left.erase(kept, left.end());
    }
    return left.empty();
  }

  const LcpResult& solve_islands(const int* outer, const int* inner, const double* value, const Eigen::VectorXd& q,
                                 const LcpOptions& options, const std::vector<char>* start) {
    const Index n = q.size();
    const bool fill_reducing = options.method == LcpMethod::automatic || options.method == LcpMethod::block;
    if (!islands_.fits(outer, inner, n, fill_reducing)) islands_.analyse(outer, inner, n, fill_reducing, small_island);
    islands_.gather(value);
    result_.islands = islands_.count();
    diagonal_.resize(n);
    islands_.scatter_diagonal(diagonal_.data());
    const lcp::SparseBlock whole{n, outer, inner, value, diagonal_.data()};
    // The certificate is that of the whole, so what stops at a tolerance of it cannot go island by island.
    if (options.method == LcpMethod::pgs && n > 0) solve_block(whole, nullptr, q, options, start);
    for (int t = 0; t < islands_.count() && options.method != LcpMethod::pgs; ++t) solve_island(t, q, options, start);
    return finish(whole, q, options);
  }

  void solve_island(int island, const Eigen::VectorXd& q, const LcpOptions& options, const std::vector<char>* start) {
    const lcp::SparseBlock block = islands_.block(island);
    const int* order = islands_.order(island);
    const double full = double(block.n) * double(block.n);
    if (block.n == 1) return solve_single(order[0], block.diagonal(0), q, start);
    if (block.n > small_island && (block.n > dense_limit || double(islands_.entries(island)) < dense_fraction * full))
      return solve_block(block, order, q, options, start);
    dense_values_.setZero(block.n, block.n);
    for (Index j = 0; j < block.n; ++j) block.add_column(j, 1.0, dense_values_.col(j).data());
    solve_block(lcp::DenseBlock{dense_values_.data(), block.n}, order, q, options, start);
  }

  void solve_single(Index i, double m, const Eigen::VectorXd& q, const std::vector<char>* start) {
    const bool active = q[i] < 0.0;
    if (!(m > 0.0)) lcp::fail_definite(i, {0, m, m});
    if (active) result_.z[i] = -q[i] / m;
    active_[std::size_t(i)] = active;
    result_.pivots += active != (start && (*start)[std::size_t(i)]);
  }

  /// One island; order: its unknowns among all, null for all in their order.
  template <class Matrix>
  void solve_block(const Matrix& m, const int* order, const Eigen::VectorXd& q, const LcpOptions& options, const std::vector<char>* start) {
    const auto index = [order](Index k) { return order ? Index(order[k]) : k; };
    unknowns_.reset(m);
    for (Index k = 0; k < m.n; ++k) {
      unknowns_.q[k] = q[index(k)];
      if (start) unknowns_.active[std::size_t(k)] = (*start)[std::size_t(index(k))] != 0;
    }
    try {
      if (options.check_input && !definite_.holds(m)) chain(m).exact.check_definite(m);
      add(run(m, options, start != nullptr));
    } catch (const lcp::NotDefinite& what) {
      lcp::fail_definite(index(what.row), what);
    }
    for (Index k = 0; k < m.n; ++k) {
      const bool active = unknowns_.active[std::size_t(k)];
      active_[std::size_t(index(k))] = active;
      result_.z[index(k)] = active ? std::max(unknowns_.z[k], 0.0) : 0.0;
    }
  }

  template <class Matrix>
  lcp::Outcome run(const Matrix& m, const LcpOptions& options, bool started) {
    auto& [relaxation, exact] = chain(m);
    const bool automatic = options.method == LcpMethod::automatic;
    if (options.method == LcpMethod::pgs) return lcp::gauss_seidel(m, unknowns_, options, relaxation.rows);
    if (options.method != LcpMethod::block && (!automatic || m.n <= small_island)) {
      if (m.n > dense_limit)
        lcp::fail("methods energy and murty keep n^2 numbers and take islands up to ", dense_limit, " unknowns, not ", m.n,
                  "; use auto or block");
      return singles_.run(m, unknowns_, options.method == LcpMethod::murty, options);
    }
    bool solved = false;
    if (!started) {
      const double fraction = lcp::rounding_fraction(options.tolerance);
      relaxation.rows.start(m, unknowns_, fraction);
      if (automatic && std::is_same_v<Matrix, lcp::SparseBlock>) solved = relaxation.solve(fraction);
      else relaxation.sweep(chain(m).sweeps);
      unknowns_.z = relaxation.rows.forces();
      unknowns_.take_set();
    }
    return solved ? lcp::Outcome() : exact.run(m, unknowns_, options, &relaxation);
  }

  void add(const lcp::Outcome& outcome) {
    result_.pivots += outcome.pivots;
    result_.block_steps += outcome.block_steps;
    result_.used_fallback |= outcome.used_fallback;
    if (outcome.limit) result_.status = LcpStatus::iteration_limit;
  }

  /// w and the certificate, from the M and q that were given: independent of whatever the methods kept.
  template <class Matrix>
  const LcpResult& finish(const Matrix& m, const Eigen::VectorXd& q, const LcpOptions& options) {
    unknowns_.reset(m);
    unknowns_.q = q;
    unknowns_.z = result_.z;
    unknowns_.measure(m);
    result_.w = unknowns_.w;
    result_.certificate = unknowns_.certificate();
    if (options.method == LcpMethod::pgs) return result_;
    const double fraction = lcp::rounding_fraction(options.tolerance);
    for (Index i = 0; i < q.size(); ++i)
      if (active_[std::size_t(i)] || std::fabs(result_.w[i]) <= fraction * unknowns_.s[i]) result_.w[i] = 0.0;
    return result_;
  }

  auto& chain(const lcp::DenseBlock&) { return dense_; }
  auto& chain(const lcp::SparseBlock&) { return sparse_; }

  LcpResult result_;
  lcp::Islands islands_;
  lcp::Unknowns unknowns_;
  lcp::SinglePivots singles_;
  Chain<lcp::DenseBlock, lcp::DenseFactor, 8> dense_;
  Chain<lcp::SparseBlock, lcp::SparseFactor, 15> sparse_;
  lcp::DefiniteProof definite_;
  Eigen::SparseMatrix<double> copy_;
  Eigen::MatrixXd dense_values_;
  Eigen::VectorXd diagonal_;
  std::vector<char> active_;
};

}  // namespace dembark
