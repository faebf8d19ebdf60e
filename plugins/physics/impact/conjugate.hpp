// Conjugate gradients for the contacts that carry a force, all others open: what sweeps of Gauss-Seidel would take hundreds of turns for
// where contacts are coupled strongly. A symmetric sweep is the preconditioner, and of the form of S. C. Eisenstat, SIAM Journal on
// Scientific and Statistical Computing 2 (1981) 1, a step costs no more than that sweep: with the diagonal scaled to 1 and
// A = L + 1 + L^T, the residual is that of (1 + L)^-1 A (1 + L^T)^-1, and its product with p is t + (1 + L)^-1 (p - t), t = (1 + L^T)^-1 p.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "lines.hpp"

namespace dembark {
namespace impact {

/// On the face of all forces z that are zero where they are zero now.
template <int Width>
class ConjugateGradients {
 public:
  /// Takes the face from the forces; whether it is the same as the last one.
  bool take_face(const Lines<Width>& lines) {
    last_.swap(face_);
    face_.clear();
    for (std::size_t i = 0; i < lines.near(); ++i)
      if (lines.force(i) > 0.0) face_.push_back(int(i));
    return face_ == last_;
  }

  /// Where solve() stops; residual and forces are root mean squares.
  struct Goal {
    double fall = 0.0;   ///< residual over what it was
    double floor = 0.0;  ///< residual over the forces
    int most_steps = 0;
    double worth_steps = 0.0;  ///< stops where more are still to come
  };

  /// Looks for the forces of the face, from what they are and the bodies as Lines::gather() left them; stops as well where a force is
  /// clearly negative. False where it stops because too much is still to come.
  bool solve(const Lines<Width>& lines, const Goal& goal) {
    load(lines);
    double square = residual_.squaredNorm(), share = 0.0;
    const double first = square, enough = std::max(goal.fall * goal.fall * square, goal.floor * goal.floor * begin_.squaredNorm());
    steps_ = 0;
    while (steps_ < goal.most_steps && square > enough) {
      const double length = square / turn(share);
      gain_ += length * part_;
      residual_ -= length * image_;
      const double next = residual_.squaredNorm();
      share = next / square;
      square = next;
      if (++steps_ % 8 != 0) continue;
      if (lowest() < -doubt * std::sqrt(square)) break;
      if (steps_ >= tell && steps_ * std::log(square / enough) > goal.worth_steps * std::log(first / square)) return false;
    }
    return true;
  }

  /// Of the last solve().
  int steps() const { return steps_; }

  /// Moves the forces by `part` of the way to what was found; those that would turn negative are zero. Whether there were any.
  bool apply(Lines<Width>& lines, double part) {
    bool crossed = false;
    for (std::size_t k = 0; k < face_.size(); ++k) {
      const std::size_t i = std::size_t(face_[k]);
      const double z = lines.line(i).root * (begin_[Eigen::Index(k)] + part * gain_[Eigen::Index(k)]);
      crossed |= !(z > 0.0);
      lines.set_force(i, std::max(z, 0.0));
    }
    return crossed;
  }

 private:
  using Vector = typename Lines<Width>::Vector;
  static constexpr double doubt = 2.0;  ///< of the residual: so far off forces may still be
  static constexpr int tell = 24;       ///< so many steps tell how fast the residual falls

  /// A contact, scaled: the forces by the root of the diagonal, the shifts of the bodies by that of their response.
  struct Link {
    Vector on_a, on_b;
    Vector *a, *b;
    double pulled() const { return (on_a.cwiseProduct(*a) - on_b.cwiseProduct(*b)).sum(); }
    void push(double force) const {
      *a += force * on_a;
      *b -= force * on_b;
    }
  };

  /// The face, its residual with the sweep, and no step yet.
  void load(const Lines<Width>& lines) {
    const Eigen::Index n = Eigen::Index(face_.size());
    links_.resize(face_.size());
    push_.resize(lines.bodies());
    for (Eigen::VectorXd* v : {&residual_, &image_, &part_, &begin_}) v->resize(n);
    direction_.setZero(n);
    gain_.setZero(n);
    clear();
    for (Eigen::Index k = 0; k < n; ++k) {
      const std::size_t i = std::size_t(face_[std::size_t(k)]);
      const auto& l = lines.line(i);
      Link& link = links_[std::size_t(k)];
      link.on_a = (l.root * std::sqrt(l.of_a)) * l.normal;
      link.on_b = (l.root * std::sqrt(l.of_b)) * l.normal;
      link.a = &push_[std::size_t(l.a)];
      link.b = &push_[std::size_t(l.b)];
      begin_[k] = lines.force(i) / l.root;
      residual_[k] = -l.root * lines.opening(i) - link.pulled();
      link.push(residual_[k]);
    }
  }

  /// The next direction, what it makes of the residual, and the product of both. share: of the last direction in it.
  double turn(double share) {
    const Eigen::Index n = residual_.size();
    const Link* const links = links_.data();
    const double* const residual = residual_.data();
    double *const direction = direction_.data(), *const part = part_.data(), *const image = image_.data();
    clear();
    for (Eigen::Index k = n - 1; k >= 0; --k) {
      const double p = residual[k] + share * direction[k], pulled = links[k].pulled(), t = p - pulled;
      links[k].push(t);
      direction[k] = p;
      part[k] = t;
      image[k] = pulled;
    }
    clear();
    double product = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double u = image[k] - links[k].pulled(), whole = part[k] + u;
      links[k].push(u);
      image[k] = whole;
      product += direction[k] * whole;
    }
    return product;
  }

  /// Of the forces, scaled.
  double lowest() const { return (begin_ + gain_).minCoeff(); }

  void clear() {
    for (Vector& s : push_) s.setZero();
  }

  int steps_ = 0;
  std::vector<int> face_, last_;
  std::vector<Link, Eigen::aligned_allocator<Link>> links_;
  std::vector<Vector, Eigen::aligned_allocator<Vector>> push_;
  Eigen::VectorXd residual_, direction_, image_, part_, gain_, begin_;
};

}  // namespace impact
}  // namespace dembark
