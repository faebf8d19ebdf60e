// Which candidates a step has to solve for. An engine lists every pair that might meet within the step, and that is many when steps are
// large; those that would stay open without forces from other contacts, and that no blow throws a body into, are left out, and looked at
// again with the motion that comes out. What is left out has its gap open and carries no force, so the answer is that of all candidates.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "motion.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

class Screening {
 public:
  /// Whether candidate i has to be solved for.
  bool near(std::size_t i) const { return near_[i] != 0; }
  void keep(std::size_t i) { near_[i] = 1; }

  /// rate: (2 theta - 1) tau (s), what the gap's rate adds to the opening; scale: h tau^2 (s^2), its acceleration. Candidates that are
  /// wrong stay in, for those who say so.
  void begin(const std::vector<Contact>& contacts, const Motion& motion, double rate, double scale) {
    rate_ = rate;
    scale_ = scale;
    const int bodies = int(motion.response.size());
    near_.resize(contacts.size());
    thrown_.assign(motion.response.size(), 0.0);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Contact& c = contacts[i];
      const bool known = c.a >= 0 && c.a < bodies && c.b < bodies && std::fabs(dot(c.normal, c.normal) - 1.0) < unit_tolerance;
      const double change = known ? opening(c, motion, motion.gap_acceleration(c)) : 0.0;
      near_[i] = !(known && c.gap + reach_factor * change > 0.0);
      if (known && change < 0.0 && c.gap + change < 0.0) throw_on(c, motion, -change);
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Contact& c = contacts[i];
      if (near_[i]) continue;
      const double thrown = thrown_[std::size_t(c.a)] + (c.b >= 0 ? thrown_[std::size_t(c.b)] : 0.0);
      near_[i] = thrown > 0.0 && c.gap + opening(c, motion, motion.gap_acceleration(c)) < bounce * thrown;
    }
  }

  /// Takes in what is left out and is closed by the motion with all forces; false where there is nothing.
  bool missed(const std::vector<Contact>& contacts, const Motion& motion) {
    bool found = false;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (near_[i] || contacts[i].gap + opening(contacts[i], motion, motion.whole_gap_acceleration(contacts[i])) >= 0.0) continue;
      near_[i] = found = true;
    }
    return found;
  }

  /// What no gap has changed by more than, in the sense of the contact law (m); after motion.move().
  double swept(const Motion& motion, double wall_speed) const {
    double first = 0.0, second = 0.0;
    for (std::size_t b = 0; b < motion.response.size(); ++b) {
      const double shift = motion.shift(b, rate_, scale_);
      second = std::max(second, std::min(first, shift));
      first = std::max(first, shift);
    }
    return first + std::max(second, rate_ * wall_speed);
  }

 private:
  /// More than that of two bodies that stay together, less than the elastic 2: what is not foreseen costs a second look.
  static constexpr double bounce = 1.5;

  /// How far (m) a blow that takes `change` off a gap moves the two bodies.
  void throw_on(const Contact& c, const Motion& motion, double change) {
    const double a = motion.response[std::size_t(c.a)].inverse, b = c.b >= 0 ? motion.response[std::size_t(c.b)].inverse : 0.0;
    if (!(a + b > 0.0)) return;
    double& of_a = thrown_[std::size_t(c.a)];
    of_a = std::max(of_a, change * a / (a + b));
    if (c.b < 0) return;
    double& of_b = thrown_[std::size_t(c.b)];
    of_b = std::max(of_b, change * b / (a + b));
  }

  /// Change (m) of the gap in the sense of the contact law.
  double opening(const Contact& c, const Motion& motion, double acceleration) const {
    return rate_ * motion.gap_rate(c) + scale_ * acceleration;
  }

  std::vector<char> near_;
  std::vector<double> thrown_;  ///< of each body, m, by the hardest blow of the free motion
  double rate_ = 0.0, scale_ = 0.0;
};

}  // namespace impact
}  // namespace dembark
