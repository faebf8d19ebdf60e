// Linear complementarity problems with a symmetric positive definite matrix: find z with
//     w = M z + q,   w >= 0,   z >= 0,   z^T w = 0.                                          (1)
// In an impact or contact problem z are the contact forces, w the gaps at the end of the step, M the compliance of the contacts
// and q the gaps without contact forces. The solution exists and is unique.
//
// Methods (LcpMethod):
//   energy     While some entry of the transformed right-hand side is negative, exchange w_i <-> z_i where -q_i^2 / M_ii of the
//              transformed system is most negative: the exchange that releases the most energy. G. N. Kolesnikov, Resources and
//              Technology 10 (2013). Ties go to the lower index. The paper proves no end: a set that comes back hands over to
//              least index, and LcpResult::guarded says so.
//   block      Exchange all violated indices at once, J. J. Judice & F. M. Pires, Computers & Operations Research 21 (1994) 587.
//              A few sweeps of Gauss-Seidel guess the first set unless one is given. When the number of violations stalls, descent of
//              the energy finds another (lcp/descent.hpp); then energy pivots take over and least index if they stall, too.
//   murty      Least index, K. G. Murty, Opsearch 11 (1974) 138: ends for certain, may take many pivots.
//   pgs        Projected Gauss-Seidel, to the tolerance.
//   automatic  energy on small islands, block on large ones.
// Islands (connected components of the graph of M) are solved apart. All but pgs end with the exact active set; z comes from a
// Cholesky factor with iterative refinement, for scaled condition numbers up to some 1e14. What is rounding is told by
// s_i = |q_i| + sum_j |M_ij z_j|, so the units of single rows do not matter.
#pragma once

#include <cmath>

#include "lcp/block_pivots.hpp"
#include "lcp/checks.hpp"
#include "lcp/definite.hpp"
#include "lcp/islands.hpp"
#include "lcp/sparse_proof.hpp"
#include "lcp/types.hpp"

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
    if (n > 0) {
      try {
        const lcp::DenseBlock block{m, n, n};
        load(block, nullptr, q, start);
        if (options.check_input) all_definite(block);
        run_dense(block, options, start != nullptr);
        store(nullptr, n);
      } catch (const lcp::NotDefinite& what) {
        lcp::fail_definite(what.row, what);
      }
    }
    finish(options, q, lcp::DenseBlock{m, n, n});
    return result_;
  }

 private:
  using Index = Eigen::Index;
  /// Islands up to this size are solved by energy pivots on a dense copy (automatic).
  static constexpr Index small_island = 40;
  /// Larger ones with more than this share of nonzeros are solved as dense.
  static constexpr double dense_share = 0.25;
  static constexpr Index dense_limit = 8192;
  /// Sweeps before block steps: a sweep of a full matrix costs much against its factor, one of a sparse matrix little.
  static constexpr int dense_sweeps = 4, sparse_sweeps = 15;

  const LcpResult& solve_islands(const int* outer, const int* inner, const double* value, const Eigen::VectorXd& q,
                                 const LcpOptions& options, const std::vector<char>* start) {
    const Index n = q.size();
    const bool fill_reducing = options.method == LcpMethod::automatic || options.method == LcpMethod::block;
    if (!islands_.fits(outer, inner, n, fill_reducing)) {
      islands_.analyse(outer, inner, n, fill_reducing, small_island);
      definite_.forget(islands_.count(), n, std::size_t(outer[n]));
    }
    islands_.gather(value);
    result_.islands = islands_.count();
    for (int t = 0; t < islands_.count(); ++t) {
      const int* order = islands_.order(t);
      try {
        if (islands_.size(t) == 1) solve_single(order[0], islands_.block(t).diagonals[0], q, start);
        else solve_island(t, q, options, start);
      } catch (const lcp::NotDefinite& what) {
        lcp::fail_definite(order[what.row], what);
      }
    }
    diagonal_.resize(n);
    islands_.scatter_diagonal(diagonal_.data());
    finish(options, q, lcp::SparseBlock{n, outer, inner, value, diagonal_.data()});
    return result_;
  }

  void begin(const Eigen::VectorXd& q, const LcpOptions& options) {
    lcp::check_options(options);
    if (options.check_input) lcp::check_finite(q.data(), q.size());
    result_.z.setZero(q.size());
    result_.w = q;
    result_.pivots = result_.block_steps = result_.islands = 0;
    result_.guarded = false;
    result_.status = LcpStatus::solved;
    active_.assign(std::size_t(q.size()), 0);
  }

  /// Whether a dense matrix is best left dense: one island and not mostly zeros.
  bool compact(const double* m, Index n) {
    if (n <= 1) return n == 0;  // a single unknown needs no factor
    if (n > small_island) {
      const double enough = dense_share * double(n) * double(n);
      Index entries = 0;
      for (Index j = 0; j < n && double(entries) < enough; ++j) entries += (Eigen::Map<const Eigen::ArrayXd>(m + j * n, n) != 0.0).count();
      if (double(entries) < enough) return false;
    }
    std::vector<Index> queue{0}, left;
    for (Index i = n; --i > 0;) left.push_back(i);
    while (!queue.empty() && !left.empty()) {
      const double* column = m + queue.back() * n;
      queue.pop_back();
      std::size_t kept = 0;
      for (const Index i : left) {
        if (column[i] != 0.0) queue.push_back(i);
        else left[kept++] = i;
      }
      left.resize(kept);
    }
    return left.empty();
  }

  void solve_single(Index i, double m, const Eigen::VectorXd& q, const std::vector<char>* start) {
    const bool active = q[i] < 0.0;
    if (!(m > 0.0)) throw lcp::NotDefinite{0, m, m};
    if (active) result_.z[i] = -q[i] / m;
    active_[std::size_t(i)] = active;
    result_.pivots += active != (start && (*start)[std::size_t(i)]);
  }

  void solve_island(int island, const Eigen::VectorXd& q, const LcpOptions& options, const std::vector<char>* start) {
    const lcp::SparseBlock block = islands_.block(island);
    const Index n = block.n, entries = islands_.entries(island);
    const int* order = islands_.order(island);
    load(block, order, q, start);
    const bool single = options.method == LcpMethod::energy || options.method == LcpMethod::murty;
    const bool dense = n <= small_island || (n <= dense_limit && double(entries) >= dense_share * double(n) * double(n));
    if (dense) {
      dense_.assign(std::size_t(n * n), 0.0);
      for (Index j = 0; j < n; ++j) block.copy_column(j, dense_.data() + j * n);
      const lcp::DenseBlock m{dense_.data(), n, n};
      if (options.check_input && !lcp::dominant(block)) all_definite(m);
      run_dense(m, options, start != nullptr);
    } else {
      if (options.check_input) definite_.check(island, islands_.first(island), block);
      if (single) {
        if (n > dense_limit)
          lcp::fail("methods energy and murty keep n^2 numbers and take islands up to ", dense_limit, " unknowns, not ", n,
                    "; use auto or block");
        add(singles_.run(block, unknowns_, options.method == LcpMethod::murty, options));
      } else if (options.method == LcpMethod::pgs) {
        add(lcp::gauss_seidel(block, unknowns_, options));
      } else {
        guess(block, start != nullptr, sparse_sweeps);
        add(sparse_.run(block, unknowns_, options, false));
      }
    }
    store(order, n);
  }

  void run_dense(const lcp::DenseBlock& m, const LcpOptions& options, bool started) {
    const bool small = options.method == LcpMethod::automatic && m.n <= small_island;
    if (options.method == LcpMethod::pgs) {
      add(lcp::gauss_seidel(m, unknowns_, options));
    } else if (small || options.method == LcpMethod::energy || options.method == LcpMethod::murty) {
      add(singles_.run(m, unknowns_, options.method == LcpMethod::murty, options));
    } else {
      guess(m, started, dense_sweeps);
      const lcp::Outcome outcome = steps_.run(m, unknowns_, options, true);
      add(outcome);
      if (outcome.guarded && !outcome.limit) add(singles_.run(m, unknowns_, false, options));
    }
  }

  /// A first active set for the block steps where none is given.
  template <class Matrix>
  void guess(const Matrix& m, bool started, int sweeps) {
    if (started) return;
    for (int sweep = 0; sweep < sweeps; ++sweep) lcp::gauss_seidel_sweep(m, unknowns_.q, unknowns_.z);
    for (std::size_t i = 0; i < unknowns_.z.size(); ++i) unknowns_.active[i] = unknowns_.z[i] > 0.0;
  }

  void all_definite(const lcp::DenseBlock& m) {
    if (proof_.holds(m)) return;
    const std::vector<char> all(std::size_t(m.n), 1);
    whole_.compute(m, all);
  }

  template <class Matrix>
  void load(const Matrix& m, const int* order, const Eigen::VectorXd& q, const std::vector<char>* start) {
    const Index n = m.n;
    unknowns_.resize(n);
    for (Index k = 0; k < n; ++k) {
      const Index i = order ? order[k] : k;
      unknowns_.q[std::size_t(k)] = q[i];
      unknowns_.root[std::size_t(k)] = std::sqrt(m.diagonal(k));
      if (start) unknowns_.active[std::size_t(k)] = (*start)[std::size_t(i)] != 0;
    }
  }

  void store(const int* order, Index n) {
    for (Index k = 0; k < n; ++k) {
      const Index i = order ? order[k] : k;
      active_[std::size_t(i)] = unknowns_.active[std::size_t(k)];
      result_.z[i] = unknowns_.active[std::size_t(k)] ? std::max(unknowns_.z[std::size_t(k)], 0.0) : 0.0;
    }
  }

  void add(const lcp::Outcome& outcome) {
    result_.pivots += outcome.pivots;
    result_.block_steps += outcome.block_steps;
    result_.guarded |= outcome.guarded;
    if (outcome.limit) result_.status = LcpStatus::iteration_limit;
  }

  /// w and the certificate, from the M and q that were given: independent of whatever the methods kept.
  template <class Matrix>
  void finish(const LcpOptions& options, const Eigen::VectorXd& q, const Matrix& m) {
    const Index n = q.size();
    scale_.resize(n);
    root_.resize(n);
    for (Index i = 0; i < n; ++i) root_[i] = std::sqrt(m.diagonal(i));
    m.multiply(q.data(), result_.z.data(), result_.w.data(), scale_.data());
    double low = 0.0, most = 0.0, product = 0.0;
    for (Index i = 0; i < n; ++i) {
      low = std::max(low, -result_.w[i] / root_[i]);
      most = std::max(most, scale_[i] / root_[i]);
      product += result_.z[i] * result_.w[i];
    }
    result_.certificate = {};  // z is never negative: what is cut off at 0 shows in w
    if (most > 0.0) {
      result_.certificate.w_violation = low / most;
      result_.certificate.complementarity = std::fabs(product) / (most * most);
    }
    if (options.method == LcpMethod::pgs) return;
    const double share = lcp::rounding_share(options.tolerance);
    for (Index i = 0; i < n; ++i)
      if (active_[std::size_t(i)] || std::fabs(result_.w[i]) <= share * scale_[i]) result_.w[i] = 0.0;
  }

  LcpResult result_;
  lcp::Islands islands_;
  lcp::Unknowns unknowns_;
  lcp::SinglePivots singles_;
  lcp::BlockPivots<lcp::DenseBlock, lcp::DenseFactor> steps_;
  lcp::BlockPivots<lcp::SparseBlock, lcp::SparseFactor> sparse_;
  lcp::DefiniteProof proof_;
  lcp::DenseFactor whole_;
  lcp::SparseProof definite_;
  Eigen::SparseMatrix<double> copy_;
  Eigen::VectorXd scale_, root_, diagonal_;
  std::vector<double> dense_;
  std::vector<char> active_;
};

}  // namespace dembark
