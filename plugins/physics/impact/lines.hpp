// The rows of a step packed for sweeps over them: what is read and changed of each row lies together, in an order in which rows do not
// wait for their neighbours. The matrix is never formed: rows act on each other by the shifts of their bodies.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

#include "../lcp/residual.hpp"
#include "motion.hpp"

namespace dembark {
namespace impact {

/// w = q + A z with A = diag(compliance) + scale G^T M'^-1 G; see system.hpp. The rows of lcp/relaxation.hpp.
/// Width: components that are kept of each vector, 2 or 4 (the last one zero), of contacts on the lines of the centres; 6, for contacts
/// with a lever too: the normal and its moment about the body, either over the root of its inertia.
template <int Width>
class Lines {
  static constexpr bool central = Width != 6;

 public:
  static constexpr double worth_steps = 500.0;  ///< the matrix and its order have to be made as well

  using Vector = Eigen::Matrix<double, Width, 1>;
  using Component = double Vec3<double>::*;

  struct Nothing {};
  using OfB = std::conditional_t<central, Nothing, Vector>;

  /// A row of the problem.
  struct Line {
    Vector normal;                        ///< unit; with a lever, of a
    OfB normal_b;                         ///< with a lever
    double of_a, of_b;                    ///< response of the bodies to a unit force, m/N; with a lever it is in the normals
    double compliance, inverse, root, q;  ///< inverse: 1 over the diagonal; root: of it
    int a, b, row;

    const Vector& other() const {
      if constexpr (central) return normal;
      else return normal_b;
    }
    /// Share of the bodies in the diagonal, m/N.
    double give() const {
      if constexpr (central) return of_a + of_b;
      else return normal.squaredNorm() + normal_b.squaredNorm();
    }
    /// By how far (m) the shifts of the bodies open the row.
    double parted(const Vector& by_a, const Vector& by_b) const {
      if constexpr (central) return normal.dot(by_a - by_b);
      else return normal.dot(by_a) - normal_b.dot(by_b);
    }
  };

  /// What a sweep reads of a row and changes, in the order of the sweep: the step leads to z = keep z - q - pull (shift_a - shift_b).
  struct RelaxationRow {
    Vector pull, on_a, on_b;  ///< the normal over the row's diagonal; response of the bodies, m/N
    OfB pull_b;               ///< with a lever
    double keep, q, z;        ///< share of the bodies in the diagonal; q over it, N; N
    double base;              ///< N, what steps are compared with, but for z
    Vector *a, *b;            ///< shifts of the bodies

    double pulled() const {
      if constexpr (central) return pull.dot(*a - *b);
      else return pull.dot(*a) - pull_b.dot(*b);
    }
  };

  /// The rows of a step, which must outlive its solves. bodies: with 1/m' as `inverse`; scale: h tau^2 (s^2); axes: three components, of
  /// which the first `Width` are kept; not read with levers.
  void prepare(const std::vector<Row>& rows, const std::vector<BodyResponse>& bodies, double scale, const Component* axes) {
    rows_ = &rows;
    bodies_ = &bodies;
    scale_ = scale;
    axes_ = axes;
    built_ = false;
    shift_.resize(bodies.size() + 1);  // walls are the last, which never moves
  }

  /// Begins a solve with the forces z. fraction: of what is added up in a row, that is rounding.
  void start(const Eigen::VectorXd& q, double fraction, const Eigen::VectorXd& z) {
    if (!built_) build(q, z);
    double largest = 0.0;
    for (Line& l : lines_) {
      l.q = q[l.row];
      const double push = std::max(-l.q, 0.0);
      largest = std::max(largest, push * push * l.inverse);
    }
    floor_ = std::numeric_limits<double>::epsilon() / fraction * std::sqrt(largest);
    for (std::size_t i = 0; i < near_; ++i) start(i, z[lines_[i].row]);
    gather();
  }

  void store(Eigen::VectorXd& z) const {
    for (std::size_t i = 0; i < near_; ++i) z[lines_[i].row] = relaxation_[i].z;
    for (std::size_t i = near_; i < lines_.size(); ++i) z[lines_[i].row] = 0.0;
  }

  /// The first near() lines may carry a force; sweeps take these only.
  Eigen::Index near() const { return Eigen::Index(near_); }
  double unit(Eigen::Index i) const { return lines_[std::size_t(i)].root; }
  double force(Eigen::Index i) const { return relaxation_[std::size_t(i)].z; }
  void set_force(Eigen::Index i, double z) { relaxation_[std::size_t(i)].z = z; }
  /// What the forces minimise (J), 1/2 z A z + q z; after gather().
  double energy() const {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < near(); ++i) sum += force(i) * (lines_[std::size_t(i)].q + gap(i));
    return 0.5 * sum;
  }
  /// D (m) under the forces as gather() or the sweeps left the bodies.
  double gap(Eigen::Index i) const {
    const Line& l = lines_[std::size_t(i)];
    return l.q + l.compliance * force(i) + parted(l);
  }

  /// Positions of the bodies after the step under the forces alone.
  void gather() {
    for (Vector& s : shift_) s.setZero();
    for (std::size_t i = 0; i < near_; ++i) {
      const RelaxationRow& v = relaxation_[i];
      *v.a += v.z * v.on_a;
      *v.b -= v.z * v.on_b;
    }
  }

  /// One sweep of projected Gauss-Seidel; the largest step, in units of the row's own scale, where it is measured.
  template <bool Measured>
  double relax() {
    double most = 0.0;
    const RelaxationRow* const end = relaxation_.data() + near_;
    for (RelaxationRow* v = relaxation_.data(); v != end; ++v) {
      const double old = v->z, free = v->keep * old - (v->q + v->pulled()), next = free > 0.0 ? free : 0.0;
      const double step = next - old;
      *v->a += step * v->on_a;
      *v->b -= step * v->on_b;
      v->z = next;
      if (Measured) {
        const double size = std::fabs(step), scale = v->base + next;
        if (size > most * scale) most = size / scale;
      }
    }
    return most;
  }

  /// Rows that are pushed together by others join the sweeps; false when there are none.
  bool widen() {
    const std::size_t before = near_;
    for (std::size_t i = near_; i < lines_.size(); ++i) {
      if (!(lines_[i].q + parted(lines_[i]) < 0.0)) continue;
      std::swap(lines_[i], lines_[near_]);
      place(near_);
      start(near_++, 0.0);
    }
    return near_ > before;
  }

  /// The residual of the rows that are swept over; the others hold it. After gather() and widen().
  void measure(lcp::Residual& r) const {
    r.resize(near());
    for (Eigen::Index i = 0; i < near(); ++i) {
      const Line& l = lines_[std::size_t(i)];
      const double z = force(i), whole = parted(l), own = l.give() * z, give = l.compliance * z;
      r.z[i] = z;
      r.w[i] = l.q + give + whole;
      r.s[i] = std::fabs(l.q) + own + give + std::fabs(whole - own);
      r.unit[i] = l.root;
    }
  }
  /// D (m) of all rows, zero where they carry a force; after measure().
  void store_gaps(const lcp::Residual& r, Eigen::VectorXd& w) const {
    for (Eigen::Index i = 0; i < near(); ++i) w[lines_[std::size_t(i)].row] = r.z[i] > 0.0 ? 0.0 : std::max(r.w[i], 0.0);
    for (std::size_t i = near_; i < lines_.size(); ++i) w[lines_[i].row] = lines_[i].q + parted(lines_[i]);
  }

  /// What the forces of a face add up to; forces scaled by the root of the diagonal, shifts of the bodies by that of their response.
  class Face {
   public:
    struct Link {
      Vector on_a, on_b;
      Vector *a, *b;
    };
    struct Sums {
      const Link* links;
      double pulled(Eigen::Index k) const {
        return (links[k].on_a.cwiseProduct(*links[k].a) - links[k].on_b.cwiseProduct(*links[k].b)).sum();
      }
      void push(Eigen::Index k, double force) const {
        *links[k].a += force * links[k].on_a;
        *links[k].b -= force * links[k].on_b;
      }
    };

    void load(const Lines& lines, const std::vector<Eigen::Index>& face) {
      links_.resize(face.size());
      push_.resize(lines.shift_.size());
      for (std::size_t k = 0; k < face.size(); ++k) {
        const Line& l = lines.lines_[std::size_t(face[k])];
        links_[k] = {(l.root * std::sqrt(l.of_a)) * l.normal, (l.root * std::sqrt(l.of_b)) * l.other(), &push_[std::size_t(l.a)],
                     &push_[std::size_t(l.b)]};
      }
    }
    void clear() { std::fill(push_.begin(), push_.end(), Vector::Zero()); }
    Sums sums() const { return {links_.data()}; }

   private:
    std::vector<Link, Eigen::aligned_allocator<Link>> links_;
    std::vector<Vector, Eigen::aligned_allocator<Vector>> push_;
  };

 private:
  static constexpr std::size_t parts = 8;

  /// Rows that may carry a force come first. Contacts that follow each other share bodies, and each would wait for the last one: eight
  /// parts of the list take turns.
  void build(const Eigen::VectorXd& q, const Eigen::VectorXd& z) {
    built_ = true;
    order_.clear();
    far_.clear();
    for (int i = 0; i < int(rows_->size()); ++i) (q[i] < 0.0 || z[i] > 0.0 ? order_ : far_).push_back(i);
    near_ = order_.size();
    lines_.resize(rows_->size());
    relaxation_.resize(rows_->size());
    const std::size_t part = (near_ + parts - 1) / parts;
    std::size_t at = 0;
    for (std::size_t i = 0; i < part; ++i)
      for (std::size_t k = i; k < near_; k += part) set(at++, order_[k]);
    for (const int k : far_) set(at++, k);
  }

  void set(std::size_t i, int row) {
    const Row& r = (*rows_)[std::size_t(row)];
    Line& l = lines_[i];
    l.row = row;
    l.a = r.a;
    l.b = r.b >= 0 ? r.b : int(bodies_->size());
    l.compliance = r.compliance;
    if constexpr (central) {
      l.of_a = scale_ * (*bodies_)[std::size_t(r.a)].inverse;
      l.of_b = r.b >= 0 ? scale_ * (*bodies_)[std::size_t(r.b)].inverse : 0.0;
      l.normal.setZero();
      for (int c = 0; c < std::min(Width, 3); ++c) l.normal[c] = r.normal.*axes_[c];
      l.inverse = 1.0 / (l.compliance + l.of_a + l.of_b);
    } else {
      l.of_a = 1.0;
      l.of_b = r.b >= 0 ? 1.0 : 0.0;
      l.normal = with_lever((*bodies_)[std::size_t(r.a)], r.normal, r.moment_a);
      if (r.b >= 0) l.normal_b = with_lever((*bodies_)[std::size_t(r.b)], r.normal, r.moment_b);
      else l.normal_b.setZero();
      l.inverse = 1.0 / (l.compliance + l.give());
    }
    l.root = std::sqrt(l.inverse);
    if (i < near_) place(i);
  }

  Vector with_lever(const BodyResponse& body, const Vec3<double>& normal, const Vec3<double>& moment) const {
    const Vec3<double> n = std::sqrt(scale_ * body.inverse) * normal, m = std::sqrt(scale_ * body.spin_inverse) * moment;
    Vector v;
    v << n.x, n.y, n.z, m.x, m.y, m.z;
    return v;
  }

  /// The constant part of a relaxation row.
  void place(std::size_t i) {
    const Line& l = lines_[i];
    RelaxationRow& v = relaxation_[i];
    v.pull = l.inverse * l.normal;
    if constexpr (!central) v.pull_b = l.inverse * l.normal_b;
    v.on_a = l.of_a * l.normal;
    v.on_b = l.of_b * l.other();
    v.keep = l.give() * l.inverse;
    v.a = &shift_[std::size_t(l.a)];
    v.b = &shift_[std::size_t(l.b)];
  }

  /// What this solve makes of it; z: where it begins.
  void start(std::size_t i, double z) {
    const Line& l = lines_[i];
    RelaxationRow& v = relaxation_[i];
    v.q = l.q * l.inverse;
    v.z = z;
    v.base = std::fabs(v.q) + floor_ * l.root;
  }

  double parted(const Line& l) const { return l.parted(shift_[std::size_t(l.a)], shift_[std::size_t(l.b)]); }

  const std::vector<Row>* rows_ = nullptr;
  const std::vector<BodyResponse>* bodies_ = nullptr;
  const Component* axes_ = nullptr;
  double scale_ = 0.0;
  bool built_ = false;  ///< in this step
  std::vector<Line, Eigen::aligned_allocator<Line>> lines_;
  std::vector<RelaxationRow, Eigen::aligned_allocator<RelaxationRow>> relaxation_;
  std::vector<Vector, Eigen::aligned_allocator<Vector>> shift_;
  std::vector<int> order_, far_;
  std::size_t near_ = 0;
  double floor_ = 0.0;  ///< of a row's scale, over its root: steps below the last digit of the largest row are none
};

}  // namespace impact
}  // namespace dembark
