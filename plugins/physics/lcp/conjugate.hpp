// Conjugate gradients for the contacts that carry a force, all others open: what sweeps of Gauss-Seidel would take hundreds of turns for
// where contacts are coupled strongly. A symmetric sweep is the preconditioner, and of the form of S. C. Eisenstat, SIAM Journal on
// Scientific and Statistical Computing 2 (1981) 1, a step costs no more than that sweep: with the diagonal scaled to 1 and
// A = L + 1 + L^T, the residual is that of (1 + L)^-1 A (1 + L^T)^-1, and its product with p is t + (1 + L)^-1 (p - t), t = (1 + L^T)^-1 p.
#pragma once

#include "residual.hpp"

namespace dembark::lcp {

/// On the face of all forces z that are zero where they are zero now. Rows: as in relaxation.hpp.
template <class Rows>
class ConjugateGradients {
 public:
  /// Takes the face from the forces; whether it is the same as the last one.
  bool take_face(const Rows& rows) {
    last_.swap(face_);
    face_.clear();
    for (Index i = 0; i < rows.near(); ++i)
      if (rows.force(i) > 0.0) face_.push_back(i);
    return face_ == last_;
  }

  /// Where solve() stops; residual and forces are root mean squares.
  struct Goal {
    double fall = 0.0;   ///< residual over what it was
    double floor = 0.0;  ///< residual over the forces
    int most_steps = 0;
    double worth_steps = 0.0;  ///< stops where more are still to come; infinite: never
  };

  /// Looks for the forces of the face, from what they are and the sums as Rows::gather() left them; stops as well where a force is
  /// clearly negative. False where it stops because too much is still to come.
  bool solve(const Rows& rows, const Goal& goal) {
    load(rows);
    double square = residual_.squaredNorm(), weight = 0.0;
    const double first = square, enough = std::max(goal.fall * goal.fall * square, goal.floor * goal.floor * begin_.squaredNorm());
    steps_ = 0;
    while (steps_ < goal.most_steps && square > enough) {
      const double length = square / turn(weight);
      gain_ += length * part_;
      residual_ -= length * image_;
      const double next = residual_.squaredNorm();
      weight = next / square;
      square = next;
      if (++steps_ % 8 != 0) continue;
      if ((begin_ + gain_).minCoeff() < -doubt * std::sqrt(square)) break;
      // The residual may grow before it falls, so nothing is foreseen where nothing would come of it.
      if (std::isfinite(goal.worth_steps) && steps_ >= foresight &&
          steps_ * std::log(square / enough) > goal.worth_steps * std::log(first / square))
        return false;
    }
    return true;
  }

  /// Of the last solve().
  int steps() const { return steps_; }

  /// Moves the forces by `part` of the way to what was found; those that would turn negative are zero. Whether there were any.
  bool apply(Rows& rows, double part) const {
    bool crossed = false;
    for (std::size_t k = 0; k < face_.size(); ++k) {
      const double z = rows.unit(face_[k]) * (begin_[Index(k)] + part * gain_[Index(k)]);
      crossed |= !(z > 0.0);
      rows.set_force(face_[k], std::max(z, 0.0));
    }
    return crossed;
  }

 private:
  static constexpr double doubt = 2.0;  ///< of the residual: so far off forces may still be
  static constexpr int foresight = 24;  ///< so many steps tell how fast the residual falls

  /// The face, its residual with the sweep, and no step yet.
  void load(const Rows& rows) {
    const Index n = Index(face_.size());
    sums_.load(rows, face_);
    for (Eigen::VectorXd* v : {&residual_, &image_, &part_, &begin_}) v->resize(n);
    direction_.setZero(n);
    gain_.setZero(n);
    sums_.clear();
    const auto sums = sums_.sums();
    for (Index k = 0; k < n; ++k) {
      const Index i = face_[std::size_t(k)];
      begin_[k] = rows.force(i) / rows.unit(i);
      residual_[k] = -rows.unit(i) * rows.gap(i) - sums.pulled(k);
      sums.push(k, residual_[k]);
    }
  }

  /// The next direction, what it makes of the residual, and the product of both. weight: of the last direction in it.
  double turn(double weight) {
    const Index n = residual_.size();
    // What is pushed could lie anywhere, for all that the compiler knows: pointers of our own spare it to read the members again.
    const auto sums = sums_.sums();
    const double* const residual = residual_.data();
    double *const direction = direction_.data(), *const part = part_.data(), *const image = image_.data();
    sums_.clear();
    for (Index k = n - 1; k >= 0; --k) {
      const double p = residual[k] + weight * direction[k], pulled = sums.pulled(k), t = p - pulled;
      sums.push(k, t);
      direction[k] = p;
      part[k] = t;
      image[k] = pulled;
    }
    sums_.clear();
    double product = 0.0;
    for (Index k = 0; k < n; ++k) {
      const double u = image[k] - sums.pulled(k), whole = part[k] + u;
      sums.push(k, u);
      image[k] = whole;
      product += direction[k] * whole;
    }
    return product;
  }

  int steps_ = 0;
  std::vector<Index> face_, last_;
  typename Rows::Face sums_;
  Eigen::VectorXd residual_, direction_, image_, part_, gain_, begin_;
};

}  // namespace dembark::lcp
