// What goes into the solver of linear complementarity problems and what comes out; see energy_lcp.hpp.
#pragma once

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace dembark {

/// automatic: `energy` on small islands; sweeps, conjugate gradients and `block` on large ones.
/// energy: one principal pivot at a time, the one that releases the most energy.
/// block: all violated indices at once (Judice & Pires).
/// murty: the violated index that comes first, one at a time; always ends, slow.
/// pgs: projected Gauss-Seidel, for comparison; never exact.
enum class LcpMethod { automatic, energy, block, murty, pgs };

/// What users call them, in that order.
constexpr const char* lcp_method_names[] = {"auto", "energy", "block", "murty", "pgs"};

/// Throws std::invalid_argument with one line about a name that is none of these.
inline LcpMethod lcp_method(const std::string& name) {
  const auto found = std::find(std::begin(lcp_method_names), std::end(lcp_method_names), name);
  if (found == std::end(lcp_method_names))
    throw std::invalid_argument("method must be 'auto', 'energy', 'block', 'murty' or 'pgs', not '" + name + "'");
  return static_cast<LcpMethod>(found - std::begin(lcp_method_names));
}

enum class LcpStatus { solved, iteration_limit };

struct LcpOptions {
  LcpMethod method = LcpMethod::automatic;
  double tolerance = 1e-12;  ///< of the certificate; where pgs stops
  int max_iterations = 0;    ///< pivots, block steps and sweeps together, per island; 0 = own choice
  bool check_input = true;   ///< symmetry, definiteness, finite numbers; a factor that fails is reported in any case
};

/// How well z and w = M z + q fulfil the conditions. Dimensionless: with d_i = sqrt(M_ii), s_i = |q_i| + sum_j |M_ij z_j| and
/// S = max s_i / d_i, the largest number that was added up anywhere,
///   z_violation      max(0, -z_i d_i) / S
///   w_violation      max(0, -w_i / d_i) / S
///   complementarity  |z^T w| / S^2
/// Neither the units of the rows nor a factor on M or q changes them; rounding alone leaves some 1e-16.
struct LcpCertificate {
  double z_violation = 0.0, w_violation = 0.0, complementarity = 0.0;
  double worst() const { return std::max({z_violation, w_violation, complementarity}); }
};

struct LcpResult {
  Eigen::VectorXd z;           ///< >= 0
  Eigen::VectorXd w;           ///< M z + q; exactly 0 where z > 0 (but for pgs)
  int pivots = 0;              ///< single exchanges (pgs: sweeps)
  int block_steps = 0;         ///< steps that exchanged all violated indices at once
  int islands = 0;             ///< connected parts of the graph of M
  bool used_fallback = false;  ///< some rule stalled or came back to a set that it had left, and a safer one took over
  LcpCertificate certificate;  ///< of w before its active entries were set to 0
  LcpStatus status = LcpStatus::solved;
};

}  // namespace dembark
