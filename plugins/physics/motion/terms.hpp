// The terms that a wall's motion is the sum of (prescribed_motion.hpp), each with its exact first and second derivative.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../constants.hpp"
#include "../vec3.hpp"
#include "words.hpp"

namespace dembark {

/// Where a wall is, from its place when the motion began: translation, and rotation about an axis that moves with the translation.
struct WallState {
  Vec3<double> displacement{}, velocity{}, acceleration{};     ///< m, m/s, m/s^2
  double angle = 0.0, rate = 0.0, angular_acceleration = 0.0;  ///< rad, rad/s, rad/s^2
};

namespace motion {

constexpr double never = std::numeric_limits<double>::infinity();

/// Of a motion along a direction, to either side, at any time.
struct Bounds {
  double displacement = 0.0, acceleration = 0.0;  ///< m, infinite for one that goes on; m/s^2
};

/// A function of time and its derivatives.
struct Jet {
  double value = 0.0, first = 0.0, second = 0.0;
};
inline Jet operator*(const Jet& f, const Jet& g) {
  return {f.value * g.value, f.first * g.value + f.value * g.first, f.second * g.value + 2.0 * f.first * g.first + f.value * g.second};
}

/// What moves, and how far: a translation (m) and an angle (rad).
struct Direction {
  Vec3<double> along{};
  double about = 0.0;

  void add(const Jet& f, WallState& to) const {
    to.displacement += f.value * along;
    to.velocity += f.first * along;
    to.acceleration += f.second * along;
    to.angle += f.value * about;
    to.rate += f.first * about;
    to.angular_acceleration += f.second * about;
  }
};

/// s = t / duration to the smooth step 6 s^5 - 15 s^4 + 10 s^3, of which two derivatives vanish at both ends.
inline Jet smooth_step(double t, double duration) {
  const double s = t / duration;
  if (!(s > 0.0)) return {};
  if (s >= 1.0) return {1.0, 0.0, 0.0};
  const double left = 1.0 - s;
  return {s * s * s * (s * (6.0 * s - 15.0) + 10.0), 30.0 * s * s * left * left / duration,
          60.0 * s * left * (1.0 - 2.0 * s) / (duration * duration)};
}

/// From when to when (s) a term acts. Without a start of its own it starts when the motion begins.
struct Window {
  std::string kind;  ///< of the term, for messages
  double start = 0.0;
  bool given = false;
  double until = never;
  double ramps = 0.0;  ///< s, both

  /// s: the first end after t; a start that was not given is none.
  double next_end(double t) const { return given && t < start ? start : t < until ? until : never; }
  /// The motion begins. Throws std::invalid_argument for a term that ends before it starts.
  void begin(double now) {
    if (!given) start = now;
    if (until > start && !(until < start + ramps)) return;
    std::string line = "motion " + kind + ": until " + number_text(until) + " s must be later than start " + number_text(start) + " s";
    if (ramps > 0.0) line += " by both ramps, " + number_text(ramps) + " s";
    throw std::invalid_argument(line);
  }
};

/// r(t) [sine sin(w (t - start) + phase) + cosine cos(w (t - start) + phase)], with the envelope r that rises in `ramp` s from `start` on
/// and falls as it rose up to `until`. Without a ramp the term is zero before `start`, begins at its place with its full speed, and stays
/// where it is from `until` on.
struct Oscillation {
  Direction sine, cosine;
  double frequency = 0.0, phase = 0.0, ramp = 0.0;
  Window window;

  void add(double t, WallState& to) const {
    if (ramp > 0.0) {
      const Jet down = window.until < never ? smooth_step(window.until - t, ramp) : Jet{1.0, 0.0, 0.0};
      add(t, smooth_step(t - window.start, ramp) * Jet{down.value, -down.first, down.second}, to);
      return;
    }
    if (t < window.start) return;
    if (t < window.until) add(t, {1.0, 0.0, 0.0}, to);
    else hold(window.until, 1.0, to);
    hold(window.start, -1.0, to);
  }
  Bounds bounds(const Vec3<double>& along) const {
    const double s = dot(sine.along, along), c = dot(cosine.along, along), amplitude = std::hypot(s, c), w = two_pi * frequency;
    if (ramp > 0.0)  // the largest derivatives of the smooth step are 15/8 and 10/sqrt(3)
      return {amplitude, amplitude * (w * w + 3.75 * w / ramp + 5.7735026918962577 / (ramp * ramp))};
    return {amplitude + std::fabs(s * std::sin(phase) + c * std::cos(phase)), amplitude * w * w};
  }
  double next_jump(double t) const { return ramp > 0.0 ? never : window.next_end(t); }

 private:
  Jet wave(double t, double ahead) const {
    const double w = two_pi * frequency, x = w * (t - window.start) + phase;
    const double s = ahead == 0.0 ? std::sin(x) : std::cos(x), c = ahead == 0.0 ? std::cos(x) : -std::sin(x);
    return {s, w * c, -w * w * s};
  }
  void add(double t, const Jet& envelope, WallState& to) const {
    sine.add(envelope * wave(t, 0.0), to);
    cosine.add(envelope * wave(t, 1.0), to);
  }
  void hold(double t, double sign, WallState& to) const {
    sine.add({sign * wave(t, 0.0).value, 0.0, 0.0}, to);
    cosine.add({sign * wave(t, 1.0).value, 0.0, 0.0}, to);
  }
};

/// velocity s + acceleration s^2/2 with s = t - start, up to `until`; before a start that is given at rest, before another as behind it.
struct Uniform {
  Direction velocity, acceleration;  ///< a second
  Window window;

  void add(double t, WallState& to) const {
    if (window.given && t < window.start) return;
    const double s = std::min(t, window.until) - window.start;
    const bool moves = t < window.until;
    velocity.add({s, moves ? 1.0 : 0.0, 0.0}, to);
    acceleration.add({0.5 * s * s, moves ? s : 0.0, moves ? 1.0 : 0.0}, to);
  }
  Bounds bounds(const Vec3<double>& along) const {
    const double a = std::fabs(dot(acceleration.along, along));
    return {a == 0.0 && dot(velocity.along, along) == 0.0 ? 0.0 : never, a};
  }
  double next_jump(double t) const { return window.next_end(t); }
};

enum class PulseShape { half_sine, constant, rising };

/// Pulses of acceleration of `duration` s every `interval` s, of the signs in their order. Between and after them the speed stays.
struct Jolts {
  Direction acceleration;  ///< the largest, a second squared
  PulseShape shape = PulseShape::half_sine;
  double duration = 0.0, interval = 0.0;
  Window window;
  std::vector<double> signs;  ///< one of each pulse

  /// After the other members: position and speed, over the largest acceleration, where each pulse begins.
  void prepare() {
    position_.assign(1, 0.0);
    speed_.assign(1, 0.0);
    for (const double sign : signs) {
      const Jet end = since(interval);
      position_.push_back(position_.back() + speed_.back() * interval + sign * end.value);
      speed_.push_back(speed_.back() + sign * end.first);
    }
  }
  void add(double t, WallState& to) const {
    if (t < window.start) return;
    const double since_start = t - window.start;
    const std::size_t k = std::min(std::size_t(std::min(since_start / interval, 1e9)), signs.size());
    const double s = since_start - double(k) * interval;
    const Jet pulse = k < signs.size() ? since(s) : Jet{};
    const double sign = k < signs.size() ? signs[k] : 0.0;
    acceleration.add({position_[k] + speed_[k] * s + sign * pulse.value, speed_[k] + sign * pulse.first, sign * pulse.second}, to);
  }
  Bounds bounds(const Vec3<double>& along) const {
    const double a = std::fabs(dot(acceleration.along, along));
    return {a == 0.0 ? 0.0 : never, a};
  }
  double next_jump(double) const { return never; }

 private:
  /// Of one pulse of unit acceleration, s after its beginning.
  Jet since(double s) const {
    const double d = duration, x = std::min(s, d);
    Jet f;
    if (shape == PulseShape::half_sine) {
      const double w = 0.5 * two_pi / d;
      f = {(x - std::sin(w * x) / w) / w, (1.0 - std::cos(w * x)) / w, std::sin(w * x)};
    } else if (shape == PulseShape::constant) {
      f = {0.5 * x * x, x, 1.0};
    } else {
      f = {x * x * x / (6.0 * d), x * x / (2.0 * d), x / d};
    }
    return s < d ? f : Jet{f.value + f.first * (s - d), f.first, 0.0};
  }

  std::vector<double> position_, speed_;
};

/// A row of a table: time (s) from the start on, and displacement (m).
struct TableRow {
  double time = 0.0;
  Vec3<double> displacement{};
};

/// The cubic spline through the rows, at rest in its ends, before and after; from the place of the first row.
class Table {
 public:
  Window window;

  Table() = default;
  /// At least two rows, their times ascending.
  explicit Table(std::vector<TableRow> rows) : rows_(std::move(rows)), slopes_(rows_.size()) {
    // Continuous second derivatives: a tridiagonal system for the slopes, of which the ends are zero.
    const std::size_t n = rows_.size();
    for (std::size_t k = 1; k < n; ++k) finest_ = std::min(finest_, rows_[k].time - rows_[k - 1].time);
    std::vector<double> upper(n, 0.0);
    for (std::size_t k = 1; k + 1 < n; ++k) {
      const double before = rows_[k].time - rows_[k - 1].time, after = rows_[k + 1].time - rows_[k].time;
      const Vec3<double> right = (3.0 / (before * before)) * (rows_[k].displacement - rows_[k - 1].displacement) +
                                 (3.0 / (after * after)) * (rows_[k + 1].displacement - rows_[k].displacement);
      const double diagonal = 2.0 / before + 2.0 / after - upper[k - 1] / before;
      upper[k] = 1.0 / (after * diagonal);
      slopes_[k] = (1.0 / diagonal) * (right - (1.0 / before) * slopes_[k - 1]);
    }
    for (std::size_t k = n - 1; k-- > 1;) slopes_[k] -= upper[k] * slopes_[k + 1];
  }

  const std::vector<TableRow>& rows() const { return rows_; }
  double finest() const { return finest_; }  ///< s: the least time between two rows
  void add(double time, WallState& to) const {
    if (rows_.empty()) return;
    const double t = time - window.start;
    const double now = std::clamp(t, rows_.front().time, rows_.back().time);
    const auto next = std::upper_bound(rows_.begin() + 1, rows_.end() - 1, now, [](double x, const TableRow& row) { return x < row.time; });
    const std::size_t k = std::size_t(next - rows_.begin());
    const TableRow &a = rows_[k - 1], &b = rows_[k];
    const double width = b.time - a.time, s = (now - a.time) / width;
    const Vec3<double> chord = b.displacement - a.displacement, bend_a = width * slopes_[k - 1] - chord,
                       bend_b = chord - width * slopes_[k];
    const double r = 1.0 - s;
    to.displacement += a.displacement - rows_.front().displacement + s * chord + (s * r) * (r * bend_a + s * bend_b);
    if (now != t) return;
    to.velocity += (1.0 / width) * (chord + (1.0 - 2.0 * s) * (r * bend_a + s * bend_b) + (s * r) * (bend_b - bend_a));
    to.acceleration += (2.0 / (width * width)) * (bend_b - 2.0 * bend_a + (3.0 * s) * (bend_a - bend_b));
  }
  /// Between two rows the acceleration is a linear function of time.
  Bounds bounds(const Vec3<double>& along) const {
    Bounds all;
    for (std::size_t k = 1; k < rows_.size(); ++k) {
      const double width = rows_[k].time - rows_[k - 1].time, chord = dot(rows_[k].displacement - rows_[k - 1].displacement, along);
      const double bend_a = width * dot(slopes_[k - 1], along) - chord, bend_b = chord - width * dot(slopes_[k], along);
      const double largest = std::max(std::fabs(bend_b - 2.0 * bend_a), std::fabs(bend_a - 2.0 * bend_b));
      all.acceleration = std::max(all.acceleration, 2.0 * largest / (width * width));
    }
    if (all.acceleration > 0.0) all.displacement = never;
    return all;
  }
  double next_jump(double) const { return never; }

 private:
  std::vector<TableRow> rows_;
  std::vector<Vec3<double>> slopes_;
  double finest_ = never;
};

}  // namespace motion
}  // namespace dembark
