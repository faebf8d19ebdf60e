// Prescribed motion of a wall: a sum of terms (terms.hpp), whose position, velocity and acceleration are known at any time. A wall has
// infinite mass: nothing that touches it changes its motion.
//
// The words of a motion, the same in all engines and Python (SI units, rad):
//   harmonic amplitude X Y Z frequency F [phase P]                    circular first X Y Z second X Y Z frequency F [phase P]
//   rocking point X Y Z axis X Y Z angle A frequency F [phase P]      rotation point X Y Z axis X Y Z rate W [acceleration B]
//   uniform velocity X Y Z [acceleration X Y Z]                       table file NAME
//   jolts shape half_sine|constant|rising acceleration X Y Z duration D [interval I] [count N] [signs +--+]
// each with [start T], all but jolts and table with [until T], the first three with [ramp N], in periods, 10 unless given.
//
// A motion begins at the time at which it is given to a wall, from where the wall stands: there its displacement and angle are zero. A term
// without `start` starts then; one that started before goes on as it would have, from that place.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "terms.hpp"
#include "words.hpp"

namespace dembark {

/// What an engine sets for a step: the mean velocities over it.
struct WallStep {
  Vec3<double> velocity{};  ///< m/s, of the point on the axis
  double rate = 0.0;        ///< rad/s
};

/// Bounds of a motion over some time.
struct WallReach {
  Vec3<double> low{}, high{};                     ///< m, of the displacement
  double least_angle = 0.0, largest_angle = 0.0;  ///< rad

  explicit WallReach(const WallState& s) : low(s.displacement), high(s.displacement), least_angle(s.angle), largest_angle(s.angle) {}
  void take(const WallState& s) {
    const Vec3<double>& d = s.displacement;
    low = {std::min(low.x, d.x), std::min(low.y, d.y), std::min(low.z, d.z)};
    high = {std::max(high.x, d.x), std::max(high.y, d.y), std::max(high.z, d.z)};
    least_angle = std::min(least_angle, s.angle);
    largest_angle = std::max(largest_angle, s.angle);
  }
  /// By a term that goes to both sides of a middle.
  void widen(const Vec3<double>& middle, const Vec3<double>& by, double middle_angle, double by_angle) {
    low += middle - by;
    high += middle + by;
    least_angle += middle_angle - by_angle;
    largest_angle += middle_angle + by_angle;
  }
};

class PrescribedMotion {
 public:
  /// At rest.
  PrescribedMotion() = default;
  /// From its words; it begins at t = 0. Throws std::invalid_argument with one line about what is wrong.
  explicit PrescribedMotion(const std::vector<std::string>& words) {
    std::size_t at = 0;
    do read(words, at);
    while (at < words.size());
    begin(0.0);
  }
  explicit PrescribedMotion(const std::string& line) : PrescribedMotion(motion::split(line)) {}

  /// Begins at the time `now` (s) instead. Throws std::invalid_argument for a term that ends before.
  void begin(double now) {
    each_term(*this, [now](auto& term) { term.window.begin(now); });
    first_place_ = {};
    first_angle_ = 0.0;
    const WallState first = at(now);
    first_place_ = first.displacement;
    first_angle_ = first.angle;
  }

  WallState at(double t) const {
    WallState state;
    each_term(*this, [&](const auto& term) { term.add(t, state); });
    state.displacement -= first_place_;
    state.angle -= first_angle_;
    return state;
  }
  /// Over the step of `h` s from `t` (s) on: [x(t + h) - x(t)] / h.
  WallStep step(double t, double h) const {
    const WallState from = at(t), to = at(t + h);
    return {(1.0 / h) * (to.displacement - from.displacement), (to.angle - from.angle) / h};
  }
  bool turns() const { return norm(axis_) > 0.0; }
  /// Whether what lies along x, y or z (along: 0, 1, 2) is turned out of that direction.
  bool turns_out_of(int along) const {
    const double part[3] = {axis_.x, axis_.y, axis_.z};
    return turns() && std::fabs(std::fabs(part[along]) - 1.0) > 1e-12;
  }
  const Vec3<double>& axis() const { return axis_; }  ///< a unit vector, or zero
  /// m: of the point on the axis that the translation moves.
  Vec3<double> centre(const WallState& state) const { return point_ + state.displacement; }

  /// s: of the fastest oscillation, twice the duration of the shortest pulse; infinite without any.
  double shortest_period() const {
    double shortest = motion::never;
    for (const auto& term : oscillations_) shortest = std::min(shortest, 1.0 / term.frequency);
    for (const auto& term : jolts_) shortest = std::min(shortest, 2.0 * term.duration);
    return shortest;
  }
  /// Of the translation along a unit vector.
  motion::Bounds bounds(const Vec3<double>& along) const {
    motion::Bounds all;
    all.displacement = std::fabs(dot(first_place_, along));
    each_term(*this, [&](const auto& term) {
      const motion::Bounds one = term.bounds(along);
      all.displacement += one.displacement;
      all.acceleration += one.acceleration;
    });
    return all;
  }
  /// s: the first time after t at which the velocity may jump; infinite if there is none.
  double next_jump(double t) const {
    double first = motion::never;
    each_term(*this, [&](const auto& term) { first = std::min(first, term.next_jump(t)); });
    return first;
  }
  /// The one clear line about a time step (s) that is too long for the motion, or nothing.
  std::string step_error(double h) const {
    for (const auto& table : tables_)
      if (table.finest() < h * (1.0 - 1e-9))
        return "its table has rows " + number_text(table.finest()) + " s apart, closer than the time step of " + number_text(h) +
               " s: take a shorter step, or fewer rows";
    if (!(shortest_period() < 10.0 * h)) return "";
    return "its shortest period, " + number_text(shortest_period()) + " s, is below ten time steps of " + number_text(h) +
           " s: take a shorter step";
  }
  /// From `from` to `to` (s); of oscillations at any time.
  WallReach reach(double from, double to) const {
    constexpr int samples = 1000;
    PrescribedMotion rest = *this;
    rest.oscillations_.clear();
    WallReach all(rest.at(from));
    for (int k = 1; k <= samples; ++k) all.take(rest.at(from + (to - from) * k / samples));
    // Rows may be closer than samples.
    for (const auto& table : tables_)
      for (const auto& row : table.rows())
        if (const double t = table.window.start + row.time; t > from && t < to) all.take(rest.at(t));
    for (const auto& term : oscillations_) {
      // Without a ramp it begins within the oscillation, whose middle is elsewhere.
      const double sine = term.ramp > 0.0 ? 0.0 : std::sin(term.phase), cosine = term.ramp > 0.0 ? 0.0 : std::cos(term.phase);
      const Vec3<double>&s = term.sine.along, &c = term.cosine.along;
      all.widen(-sine * s - cosine * c, {std::hypot(s.x, c.x), std::hypot(s.y, c.y), std::hypot(s.z, c.z)},
                -sine * term.sine.about - cosine * term.cosine.about, std::hypot(term.sine.about, term.cosine.about));
    }
    return all;
  }
  /// Bounds (m) of a point of the wall over `all`; it is at `place` when the wall is in `state`.
  void bounds(const Vec3<double>& place, const WallState& state, const WallReach& all, Vec3<double>& low, Vec3<double>& high) const {
    // With the angle phi the point turns along flat cos(phi) + side sin(phi) about a middle on the axis.
    const Vec3<double> arm = place - centre(state), side = cross(axis_, arm), flat = cross(side, axis_);
    const Vec3<double> middle = place - flat;
    const double from = all.least_angle - state.angle, to = all.largest_angle - state.angle;
    low = middle + (all.low - state.displacement);
    high = middle + (all.high - state.displacement);
    for (double Vec3<double>::* const k : {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z}) {
      const double radius = std::hypot(flat.*k, side.*k), top = std::atan2(side.*k, flat.*k);
      const auto passes = [&](double angle) { return angle + two_pi * std::ceil((from - angle) / two_pi) <= to; };
      const auto at = [&](double angle) { return flat.*k * std::cos(angle) + side.*k * std::sin(angle); };
      low.*k += passes(top + 0.5 * two_pi) ? -radius : std::min(at(from), at(to));
      high.*k += passes(top) ? radius : std::max(at(from), at(to));
    }
  }

 private:
  template <class Motion, class Visit>
  static void each_term(Motion& motion, Visit visit) {
    for (auto& term : motion.oscillations_) visit(term);
    for (auto& term : motion.uniform_) visit(term);
    for (auto& term : motion.jolts_) visit(term);
    for (auto& term : motion.tables_) visit(term);
  }

  void read(const std::vector<std::string>& words, std::size_t& at) {
    using motion::Keyword;
    static const Keyword start{"start", 1, false}, until{"until", 1, false}, frequency{"frequency", 1, true}, phase{"phase", 1, false},
        ramp{"ramp", 1, false}, point{"point", 3, true}, axis{"axis", 3, true};
    static const std::vector<motion::Grammar> grammars{
        {"harmonic", {{"amplitude", 3, true}, frequency, phase, ramp, start, until}},
        {"circular", {{"first", 3, true}, {"second", 3, true}, frequency, phase, ramp, start, until}},
        {"rocking", {point, axis, {"angle", 1, true}, frequency, phase, ramp, start, until}},
        {"rotation", {point, axis, {"rate", 1, true}, {"acceleration", 1, false}, start, until}},
        {"uniform", {{"velocity", 3, true}, {"acceleration", 3, false}, start, until}},
        {"jolts",
         {{"shape", 1, true},
          {"acceleration", 3, true},
          {"duration", 1, true},
          {"interval", 1, false},
          {"count", 1, false},
          {"signs", 1, false},
          start}},
        {"table", {{"file", 1, true}, start}}};
    const auto grammar_of = [](const std::string& word) {
      return std::find_if(grammars.begin(), grammars.end(), [&word](const motion::Grammar& g) { return g.kind == word; });
    };
    const std::string kind = at < words.size() ? words[at] : "";
    const auto grammar = grammar_of(kind);
    if (grammar == grammars.end())
      throw std::invalid_argument("there is no motion '" + kind +
                                  "'; it is harmonic, circular, rocking, rotation, uniform, jolts or table");
    const motion::Given given(*grammar, words, ++at, [&](const std::string& word) { return grammar_of(word) != grammars.end(); });
    if (kind == "harmonic") add_oscillation(given, {given.vector("amplitude"), 0.0}, {});
    else if (kind == "circular") add_oscillation(given, {given.vector("first"), 0.0}, {given.vector("second"), 0.0});
    else if (kind == "rocking") add_oscillation(given, {{}, given.number("angle")}, {});
    else if (kind == "rotation") add_uniform(given, {{}, given.number("rate")}, {{}, given.number_or("acceleration", 0.0)});
    else if (kind == "uniform") add_uniform(given, {given.vector("velocity"), 0.0}, {given.vector("acceleration"), 0.0});
    else if (kind == "jolts") add_jolts(given);
    else add_table(given);
    if (given.has("axis")) set_axis(given);
  }

  static motion::Window window(const motion::Given& given, double ramps = 0.0) {
    return {given.kind(), given.number_or("start", 0.0), given.has("start"), given.number_or("until", motion::never), ramps};
  }

  void add_oscillation(const motion::Given& given, const motion::Direction& sine, const motion::Direction& cosine) {
    motion::Oscillation term{sine, cosine, given.positive("frequency"), given.number_or("phase", 0.0), 0.0, {}};
    const double periods = given.number_or("ramp", 10.0);
    if (!(periods >= 0.0)) given.refuse("ramp " + number_text(periods) + " must be >= 0 periods");
    term.ramp = periods / term.frequency;
    term.window = window(given, 2.0 * term.ramp);
    if (norm(sine.along) + norm(cosine.along) + std::abs(sine.about) == 0.0) given.refuse("its amplitude is zero");
    oscillations_.push_back(term);
  }

  void add_uniform(const motion::Given& given, const motion::Direction& velocity, const motion::Direction& acceleration) {
    const motion::Uniform term{velocity, acceleration, window(given)};
    uniform_.push_back(term);
  }

  void add_jolts(const motion::Given& given) {
    const std::string& shape = given.word("shape");
    motion::Jolts term;
    if (shape == "half_sine") term.shape = motion::PulseShape::half_sine;
    else if (shape == "constant") term.shape = motion::PulseShape::constant;
    else if (shape == "rising") term.shape = motion::PulseShape::rising;
    else given.refuse("there is no shape '" + shape + "'; it is half_sine, constant or rising");
    term.acceleration.along = given.vector("acceleration");
    term.duration = given.positive("duration");
    term.interval = given.number_or("interval", term.duration);
    term.window = window(given);
    if (term.interval < term.duration)
      given.refuse("interval " + number_text(term.interval) + " s must be at least the duration, " + number_text(term.duration) + " s");
    const std::string signs = given.has("signs") ? given.word("signs") : "+";
    if (signs.find_first_not_of("+-") != std::string::npos) given.refuse("signs '" + signs + "' must be of + and -, such as +--+");
    const double count = given.number_or("count", double(signs.size()));
    if (!(count >= 1.0 && count <= 1e6) || count != std::floor(count))
      given.refuse("count " + number_text(count) + " must be a whole number of 1 ... 1000000");
    for (std::size_t k = 0; k < std::size_t(count); ++k) term.signs.push_back(signs[k % signs.size()] == '+' ? 1.0 : -1.0);
    term.prepare();
    jolts_.push_back(term);
  }

  /// Rows of time (s) and displacement (m), four numbers separated by blanks or commas; lines that begin with # are comments.
  void add_table(const motion::Given& given) {
    const std::string& name = given.word("file");
    std::ifstream file(name);
    if (!file) given.refuse("file '" + name + "' cannot be read");
    std::vector<motion::TableRow> rows;
    int number = 0;
    for (std::string line; std::getline(file, line);) {
      const std::string where = "file '" + name + "', line " + std::to_string(++number) + ": ";
      std::replace(line.begin(), line.end(), ',', ' ');
      const std::vector<std::string> words = motion::split(line);
      if (words.empty() || words[0][0] == '#') continue;
      double row[4];
      bool good = words.size() == 4;
      for (std::size_t k = 0; k < 4 && good; ++k) good = keywords::Reader::is_number(words[k], row[k]);
      if (!good) given.refuse(where + "it must have four numbers, time (s) and displacement x y z (m)");
      if (!rows.empty() && !(row[0] > rows.back().time)) given.refuse(where + "the times do not ascend");
      rows.push_back({row[0], {row[1], row[2], row[3]}});
    }
    if (rows.size() < 2) given.refuse("file '" + name + "' has fewer than two rows");
    tables_.emplace_back(std::move(rows));
    tables_.back().window = window(given);
  }

  void set_axis(const motion::Given& given) {
    const Vec3<double> direction = given.vector("axis"), point = given.vector("point");
    const double length = norm(direction);
    if (!(length > 0.0)) given.refuse("axis must be a vector that is not zero");
    const Vec3<double> unit = (1.0 / length) * direction;
    if (turns() && (norm(unit - axis_) > 1e-12 || norm(cross(point - point_, axis_)) > 1e-12 * (1.0 + norm(point))))
      given.refuse("all rotations of a motion must have the same point and axis");
    axis_ = unit;
    point_ = point;
  }

  std::vector<motion::Oscillation> oscillations_;
  std::vector<motion::Uniform> uniform_;
  std::vector<motion::Jolts> jolts_;
  std::vector<motion::Table> tables_;
  Vec3<double> axis_{}, point_{};
  Vec3<double> first_place_{};  ///< m and rad, of the sum of the terms when the motion began
  double first_angle_ = 0.0;
};

}  // namespace dembark
