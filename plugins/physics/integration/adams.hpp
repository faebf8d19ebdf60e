// Reference integrator: the predictor-corrector of Adams, Bashforth and Moulton, fourth order, constant step, with a signal when its
// corrections do not settle and an estimate of its own error.
//
//   predictor   p = y_n + h/24 (55 f_n - 59 f_(n-1) + 37 f_(n-2) - 9 f_(n-3))
//   corrector   c = y_n + h/24 (9 f(t_(n+1), p) + 19 f_n - 5 f_(n-1) + f_(n-2))
//   estimate    y(t_(n+1)) - c = -19/270 (c - p) + O(h^6)                       (W. E. Milne)
//
// in the mode P(EC)^m E: the correction is repeated, at most m times, until two iterates differ by no more than a tolerance; if they
// still do, the step carries the signal. The first three steps, and three after each restart, are classical Runge-Kutta steps.
// E. Hairer, S. P. Norsett & G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993, ch. III.1.
//
// What it is for: to integrate few contacts anew and to say how wrong an engine's own steps are. It is no integrator for a bed. At
// the touch of two bodies the force has no fourth derivative, and the order falls to that of velocity Verlet unless the touch is
// located (events); an undamped oscillator gains energy, while under Verlet it does not.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace dembark {

struct AdamsSettings {
  double step = 0.0;        ///< h, s, > 0
  int corrections = 2;      ///< m, 1 or more
  double tolerance = 1e-9;  ///< epsilon, > 0: largest difference of two iterates in any component, over its scale

  /// The one clear line about what is wrong with these settings, or nullptr.
  const char* error() const {
    if (!(step > 0.0) || std::isinf(step)) return "step (s) must be a number > 0";
    if (corrections < 1) return "corrections must be 1 or more";
    if (!(tolerance > 0.0)) return "tolerance must be > 0";
    return nullptr;
  }
};

/// What one step of Adams tells.
struct AdamsStep {
  int corrections = 0;      ///< how many were made; 0 in a Runge-Kutta step
  double difference = 0.0;  ///< of the last two iterates, largest component over its scale
  bool signal = false;      ///< they still differed by more than the tolerance
  int event = -1;           ///< number of the event at which the step ended early, or -1
};

/// Events of systems that have none.
struct NoEvents {
  static constexpr std::size_t count = 0;
  void operator()(double, const double*, double*) const {}
};

/// `System`: void(double t, const double* y, double* f), the derivatives f of the state y, finite.
/// `Events`: `count` and void(double t, const double* y, double* g). A step in which a g changes its sign ends where it does: the root
/// is located to the last bits of the time, on the far side, and the integrator starts anew there. A g that comes and goes within one step
/// is not seen. Where an event changes the system (contact, stick and slip), the caller changes it and calls restart().
template <class System, class Events = NoEvents>
class Adams {
 public:
  /// `scale`: for each component, > 0, what the differences are measured by. Throws std::invalid_argument.
  Adams(System system, const AdamsSettings& settings, double time, std::vector<double> state, std::vector<double> scale, Events events = {})
      : settings_(settings),
        system_(std::move(system)),
        events_(std::move(events)),
        time_(time),
        state_(std::move(state)),
        scale_(std::move(scale)),
        error_(state_.size(), 0.0),
        predicted_(state_.size()),
        corrected_(state_.size()),
        rates_(5, std::vector<double>(state_.size())),
        stages_(3, std::vector<double>(state_.size())),
        signs_(events_.count),
        next_signs_(events_.count) {
    if (const char* const wrong = settings_.error()) throw std::invalid_argument(wrong);
    if (scale_.size() != state_.size()) throw std::invalid_argument("scale must have one number for each component of the state");
    for (const double s : scale_)
      if (!(s > 0.0)) throw std::invalid_argument("each scale must be > 0");
    restart();
  }

  double time() const { return time_; }
  const std::vector<double>& state() const { return state_; }
  /// Milne's estimate of the local error of the last step, exact minus computed, in the units of the state; 0 in a Runge-Kutta step.
  const std::vector<double>& error_estimate() const { return error_; }

  /// Forget the steps before: the system has changed.
  void restart() {
    known_ = 1;
    system_(time_, state_.data(), rates_[0].data());
    if (events_.count) events_(time_, state_.data(), signs_.data());
  }

  /// One step, or less if an event or `limit` (s) comes first. A step cut by the limit also starts the integrator anew.
  AdamsStep advance(double limit) {
    const double left = limit - time_;
    if (!(left > 0.0)) return {};
    // A rest of round-off is no step of its own.
    const bool cut = left < settings_.step * (1.0 - 1e-9);
    const double h = cut || left < settings_.step * (1.0 + 1e-9) ? left : settings_.step;
    AdamsStep told;
    if (cut || known_ < 4) {
      runge_kutta(h, corrected_);
      std::fill(error_.begin(), error_.end(), 0.0);
    } else {
      told = predict_and_correct();
    }
    const double next = cut || h == left ? limit : time_ + h;
    if (events_.count) {
      events_(next, corrected_.data(), next_signs_.data());
      told.event = first_event(h);
      if (told.event >= 0) {
        std::fill(error_.begin(), error_.end(), 0.0);
        restart();
        return told;
      }
      signs_ = next_signs_;
    }
    time_ = next;
    state_.swap(corrected_);
    if (cut) {
      restart();
      return told;
    }
    std::rotate(rates_.begin(), rates_.end() - 1, rates_.end());
    system_(time_, state_.data(), rates_[0].data());
    known_ = std::min(known_ + 1, 4);
    return told;
  }

 private:
  /// Largest |a - b| over the scale.
  double distance(const std::vector<double>& a, const std::vector<double>& b) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]) / scale_[i]);
    return largest;
  }

  AdamsStep predict_and_correct() {
    AdamsStep told;
    const double h = settings_.step, t = time_ + h;
    std::vector<double>& rate = rates_[4];
    std::vector<double>& next = stages_[0];
    for (std::size_t i = 0; i < state_.size(); ++i) {
      predicted_[i] = state_[i] + h / 24.0 * (55.0 * rates_[0][i] - 59.0 * rates_[1][i] + 37.0 * rates_[2][i] - 9.0 * rates_[3][i]);
      corrected_[i] = predicted_[i];
    }
    do {
      system_(t, corrected_.data(), rate.data());
      for (std::size_t i = 0; i < state_.size(); ++i)
        next[i] = state_[i] + h / 24.0 * (9.0 * rate[i] + 19.0 * rates_[0][i] - 5.0 * rates_[1][i] + rates_[2][i]);
      told.difference = distance(next, corrected_);
      corrected_.swap(next);
      ++told.corrections;
    } while (told.difference > settings_.tolerance && told.corrections < settings_.corrections);
    told.signal = !(told.difference <= settings_.tolerance);
    for (std::size_t i = 0; i < state_.size(); ++i) error_[i] = -19.0 / 270.0 * (corrected_[i] - predicted_[i]);
    return told;
  }

  /// The state after a classical Runge-Kutta step of `h` from here.
  void runge_kutta(double h, std::vector<double>& out) {
    std::vector<double>&k = stages_[0], &sum = stages_[1], &at = stages_[2];
    const std::vector<double>& first = rates_[0];
    const std::size_t n = state_.size();
    const auto stage = [&](const std::vector<double>& slope, double share) {
      for (std::size_t i = 0; i < n; ++i) at[i] = state_[i] + share * h * slope[i];
      system_(time_ + share * h, at.data(), k.data());
    };
    sum = first;
    stage(first, 0.5);
    for (std::size_t i = 0; i < n; ++i) sum[i] += 2.0 * k[i];
    stage(k, 0.5);
    for (std::size_t i = 0; i < n; ++i) sum[i] += 2.0 * k[i];
    stage(k, 1.0);
    for (std::size_t i = 0; i < n; ++i) out[i] = state_[i] + h / 6.0 * (sum[i] + k[i]);
  }

  static bool crosses(double before, double after) { return (before < 0.0 && after >= 0.0) || (before > 0.0 && after <= 0.0); }

  /// If an event lies in the step of `h` just made: goes there and returns its number, else -1.
  int first_event(double h) {
    double near = 0.0, far = h;
    int first = crossing(signs_, next_signs_);
    if (first < 0) return -1;
    // Bisection to the last bits: a few dozen evaluations, once an event. `far` always lies beyond the first crossing.
    const double resolution = 4e-16 * std::max(std::abs(time_), h);
    while (far - near > resolution) {
      const double middle = 0.5 * (near + far);
      if (middle == near || middle == far) break;
      runge_kutta(middle, predicted_);
      events_(time_ + middle, predicted_.data(), next_signs_.data());
      const int hit = crossing(signs_, next_signs_);
      if (hit >= 0) {
        first = hit;
        far = middle;
      } else {
        near = middle;
      }
    }
    runge_kutta(far, corrected_);
    state_ = corrected_;
    time_ += far;
    return first;
  }

  static int crossing(const std::vector<double>& before, const std::vector<double>& after) {
    for (std::size_t i = 0; i < before.size(); ++i)
      if (crosses(before[i], after[i])) return static_cast<int>(i);
    return -1;
  }

  AdamsSettings settings_;
  System system_;
  Events events_;
  double time_;
  std::vector<double> state_, scale_, error_, predicted_, corrected_;
  std::vector<std::vector<double>> rates_;   ///< f_n ... f_(n-3), and one to work in
  std::vector<std::vector<double>> stages_;  ///< to work in
  std::vector<double> signs_, next_signs_;
  int known_ = 0;  ///< of the four f, how many are right
};

}  // namespace dembark
