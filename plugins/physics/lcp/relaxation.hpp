// The first two links of the chain: sweeps of projected Gauss-Seidel, then conjugate gradients on the face that they find, without any
// factor. The third is active_set.hpp.
//
// Where impacts are resolved in time (omega tau well below 1) the springs give way far more than the bodies do in a step, and a change of
// one force hardly reaches the next contact: each sweep gains one or two digits. Where it does reach, the sweeps still find which contacts
// carry a force, and conjugate gradients find how much, in turn, after J. L. Morales, J. Nocedal & M. Smelyanskiy, Numerische Mathematik
// 111 (2008) 251. The energy z^T M z / 2 + q^T z falls with each, so no face comes back for good. The residual is pushed down to the
// rounding that a factor would leave as well, and only such an answer is accepted. Nothing is carried from solve to solve, so a run that
// is resumed repeats to the last bit.
#pragma once

#include "conjugate.hpp"

namespace dembark::lcp {

/// `Rows` multiplies by the matrix M: MatrixRows has it stored, impact::Lines makes the products from the contacts between bodies. It has
/// - near(): the first near() rows may carry a force. widen() adds further rows that do, and returns whether it found any.
/// - force(i): z_i. set_force(i, z) does not change the products M z; gather() computes them again.
/// - gap(i): w_i with those products. unit(i): 1 / sqrt(M_ii).
/// - relax<Measured>(): one sweep; returns the largest change of a force, scaled by its row.
/// - energy(): z^T M z / 2 + q^T z, and measure(r): the residual, both after gather().
/// - worth_steps: the number of steps of conjugate gradients that cost as much as a factorization.
/// - Face: the rows that carry a force, scaled to a unit diagonal: load(rows, face), clear(), and sums() with pulled(k) and push(k, force).
template <class Rows>
class Relaxation {
 public:
  Rows rows;  ///< to be started before each solve

  /// So many sweeps, unmeasured.
  void sweep(int count) {
    for (int k = 0; k < count; ++k) rows.template relax<false>();
  }

  /// Until a sweep leaves the set of positive forces as it is, or so many times.
  void find_set(int most) {
    conjugate_.take_face(rows);
    for (int k = 0; k < most; ++k) {
      sweep(1);
      if (conjugate_.take_face(rows)) break;
    }
  }

  /// To four digits of each row's own scale, or as near as a few sweeps come.
  void approach() {
    sweep(2);
    rows.widen();
    for (int k = 0; k < approach_sweeps && rows.template relax<true>() > close; ++k) continue;
  }

  /// To rounding, a fraction of what is added up in a row. False: not converged; the forces are then a guess of the solution. Gives up
  /// where a factor of the contacts that carry a force would take less time.
  bool solve(double fraction) { return relax(fraction) || descend(fraction, Rows::worth_steps, few_faces); }

  /// Goes on where the last solve() gave up, however long it takes.
  bool finish(double fraction) { return descend(fraction, std::numeric_limits<double>::infinity(), few_faces + int(rows.near())); }

  /// Of the forces that were accepted.
  const Residual& residual() const { return residual_; }

 private:
  static constexpr int most_sweeps = 90, blind_sweeps = 4;  ///< none has been seen to do with so few
  static constexpr double worth_sweeps = 40.0;              ///< so many that are still to come cost more than conjugate gradients
  static constexpr int approach_sweeps = 10;
  static constexpr double close = 1e-4;  ///< of a row's own scale: where approach() stops
  static constexpr int few_faces = 300;
  static constexpr int face_steps = 30;  ///< of conjugate gradients, times the faces: where they end in any case
  static constexpr int face_sweeps = 3;
  static constexpr double fall = 0.2;  ///< of the residual, while the face still changes

  bool accepted(double fraction) {
    rows.measure(residual_);
    return residual_.solved(fraction);
  }

  /// Projected Gauss-Seidel; false where it converges slowly.
  bool relax(double fraction) {
    sweep(2);
    rows.widen();
    sweep(blind_sweeps - 2);
    double first = 0.0;  // size of the steps at the begin of the count
    for (int sweep = blind_sweeps, count = 0; sweep < most_sweeps; ++sweep, ++count) {
      const double step = rows.template relax<true>(), enough = 30.0 * fraction;
      if (count == 0) first = step;
      if (step > enough) {
        if (count > 2 && !(step < first && count * std::log(enough / step) > worth_sweeps * std::log(step / first))) return false;
        continue;  // the residual is what the next sweep's steps would be
      }
      rows.gather();
      if (rows.widen()) count = -1;
      else if (accepted(fraction)) return true;
    }
    return false;
  }

  /// Conjugate gradients on the face that sweeps find, until both agree; false where more than `worth` steps are still to come.
  bool descend(double fraction, double worth, int most_faces) {
    const int most_steps = face_steps * most_faces;
    rows.widen();
    conjugate_.take_face(rows);
    bool same = false;
    for (int face = 0, steps = 0; face < most_faces && steps < most_steps; ++face) {
      rows.gather();
      const double before = rows.energy();
      const bool soon = conjugate_.solve(rows, {same ? 0.0 : fall, 0.05 * fraction, most_steps - steps, worth});
      steps += conjugate_.steps();
      // Forces that are cut off may cost more than the others have gained.
      for (double part = 1.0;; part *= 0.5) {
        const bool cut = conjugate_.apply(rows, part);
        rows.gather();
        if (!cut || part < 1e-3 || rows.energy() < before) break;
      }
      const bool wider = rows.widen();
      if (same && !soon) return false;
      if (same && !wider && accepted(fraction)) return true;
      sweep(face_sweeps);
      same = conjugate_.take_face(rows) && !wider;
    }
    return false;
  }

  ConjugateGradients<Rows> conjugate_;
  Residual residual_;
};

}  // namespace dembark::lcp
