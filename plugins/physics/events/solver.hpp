// Hard grains: discs or spheres between planes that collide without duration, and fly freely in between. The solver goes from event to
// event, in the order of time, and computes each from the motion that leads to it; there is no time step.
//
// Algorithm: B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255; A. Donev, S. Torquato, F. H. Stillinger, J. Comput. Phys. 202 (2005) 737;
// how events are found is in flights.hpp.
//
// Collapse: with e < 1 grains may collide infinitely often in a finite time. With the model of S. Luding & S. McNamara, Granular Matter 1
// (1998) 113, a collision of a grain that had another within the duration t_c of a contact is elastic. A wall on which a grain comes to
// rest throws it so that it flies for t_c, were the wall's acceleration to stay; the account takes that as a negative loss. Without a
// duration rounding ends a collapse of grains that nothing drives; run() throws when a grain collides without end.
//
// Times are relative to a time that moves on, so that their resolution does not wear out. When it does, cells are laid out anew.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../archive.hpp"
#include "flights.hpp"

namespace dembark::events {

class Solver : public Flights {
 public:
  /// Throws std::invalid_argument with one line about what is wrong.
  Solver(Settings settings, const std::vector<Grain>& grains) : Flights(std::move(settings), grains) {
    account_.walls.resize(settings_.walls.size());
  }

  /// Up to the time `until` (s), or so many events; false if they did not suffice. Throws std::runtime_error in a collapse.
  bool run(double until, std::int64_t events = std::numeric_limits<std::int64_t>::max()) {
    if (!(until >= time_)) throw std::invalid_argument("the end of a run must not lie before the time that was reached");
    for (; events > 0; --events) {
      const int i = events_.first();
      if (!(base_ + events_.time(i) <= until)) {
        time_ = until;
        return true;
      }
      now_ = std::max(now_, events_.time(i));
      time_ = std::max(time_, base_ + now_);
      process(i);
      if (++passed_ >= 32 * std::int64_t(size()) + 1000) refresh();
    }
    return false;
  }

  double time() const { return time_; }  ///< s
  const Account& account() const { return account_; }
  /// A grain now, its position without the jumps from one end of a period to the other.
  Grain grain(int number) const {
    const int i = index_[number];
    const Moving& m = moving_[i];
    const State& s = states_[i];
    const double t = time_ - base_ - m.time;
    Grain g{s.mass, m.radius, m.x + t * (m.v + (0.5 * t) * gravity_), m.v + t * gravity_, s.spin};
    for (int a = 0; a < 3; ++a) part(g.position, a) += s.turns[a] * settings_.periods[a].length();
    return g;
  }
  /// J, now: kinetic, of the translation and of the spins, and potential.
  std::array<double, 3> energies() const {
    std::array<double, 3> sums{};
    for (int i = 0; i < size(); ++i) {
      const Grain g = grain(i);
      sums[0] += 0.5 * g.mass * dot(g.velocity, g.velocity);
      sums[1] += 0.5 * settings_.shape * g.mass * g.radius * g.radius * dot(g.spin, g.spin);
      sums[2] -= g.mass * dot(gravity_, g.position);
    }
    return sums;
  }
  /// The largest overlap (m) of all pairs and walls now, below zero if none touch; a pair that is farther apart than a cell counts as not.
  double overlap() const {
    double largest = -never;
    for (int i = 0; i < size(); ++i) {
      const Grain g = grain(states_[i].number);
      for (const Wall& wall : settings_.walls)
        largest = std::max(largest, -Flight{time_, g.position, g.velocity, gravity_, g.radius}.to(wall, time_).gap);
      each_near(i, all, [&](int j, const Vector&) {
        const Grain other = grain(states_[j].number);
        largest = std::max(largest, g.radius + other.radius - norm(nearest(g.position - other.position)));
      });
    }
    return largest;
  }

  /// New velocities and spins of all grains, now.
  void set_velocities(const std::vector<Vector>& velocities, const std::vector<Vector>& spins) {
    if (velocities.size() != states_.size() || spins.size() != states_.size())
      throw std::invalid_argument("there must be one velocity and one spin a grain");
    now_ = std::max(now_, time_ - base_);
    for (int i = 0; i < size(); ++i) {
      advance(i);
      moving_[i].v = velocities[states_[i].number];
      states_[i].spin = spins[states_[i].number];
    }
    refresh();
  }

  /// Everything needed to go on bit for bit.
  std::vector<double> state() const {
    Archive out;
    const_cast<Solver*>(this)->visit(out);  // writing changes nothing
    return out.numbers();
  }
  /// Goes on from the state of a solver with the same grains and walls; throws std::invalid_argument with one line if it is not one.
  void restore(const std::vector<double>& numbers) {
    Solver other(*this);
    Archive in(numbers);
    other.visit(in);
    in.end();
    other.complete(*this);
    *this = std::move(other);
  }

 private:
  void refresh() {
    passed_ = 0;
    begin();
  }
  void process(int i) {
    const State& s = states_[i];
    if (s.leave < s.contact) {
      account_.crossings += 1.0;
      return pass(i);
    }
    if (s.partner <= -2) return meet_wall(i, -2 - s.partner);
    if (s.partner >= 0 && s.partner_changes == states_[s.partner].changes) return meet_grain(i, s.partner);
    account_.repeats += 1.0;
    advance(i);
    predict(i);
  }

  bool elastic(const State& s) const { return now_ - s.last < settings_.contact_duration; }
  static double least_speed(const Vector& v, const Vector& w) { return 4.0 * std::numeric_limits<double>::epsilon() * (norm(v) + norm(w)); }
  void add(const Collision& c, bool elastic) {
    account_.normal_loss += c.normal_loss;
    account_.friction_loss += c.friction_loss;
    account_.elastic += double(elastic);
  }
  /// speed: of both that collide.
  void push(int i, const Vector& impulse, const Vector& arm, double speed) {
    State& s = states_[i];
    Moving& m = moving_[i];
    const double free = (now_ - s.last) * (speed + std::sqrt(norm(gravity_) * m.radius));
    s.hurried = free < 1e-6 * m.radius ? s.hurried + 1 : 0;
    m.v += (1.0 / s.mass) * impulse;
    s.spin += (1.0 / (settings_.shape * s.mass * m.radius * m.radius)) * cross(arm, impulse);
    s.last = now_;
    ++s.changes;
    if (s.hurried < 1000) return;
    s.hurried = 0;
    throw std::runtime_error("inelastic collapse at " + number_text(time_, 9) + " s: grain " + std::to_string(s.number) +
                             " collides without end; set contact_duration (s)");
  }

  void meet_grain(int i, int j) {
    advance(i);
    advance(j);
    const State &a = states_[i], &b = states_[j];
    const Moving &m = moving_[i], &o = moving_[j];
    const Vector apart = nearest(m.x - o.x), normal = (1.0 / norm(apart)) * apart;
    const Vector velocity = m.v - o.v - cross(m.radius * a.spin + o.radius * b.spin, normal);
    const bool soon = elastic(a) || elastic(b);
    const Collision c =
        collide(settings_.law, normal, velocity, a.mass * b.mass / (a.mass + b.mass), settings_.shape, soon, least_speed(m.v, o.v));
    account_.collisions += 1.0;
    for (int k = 0; k < 3; ++k) account_.virial[k] += part(c.impulse, k) * apart;
    add(c, soon);
    const double speed = norm(m.v) + norm(o.v);
    push(i, c.impulse, -m.radius * normal, speed);
    push(j, -c.impulse, o.radius * normal, speed);
    predict(i);
    predict(j);
  }
  void meet_wall(int i, int k) {
    advance(i);
    const Wall& wall = settings_.walls[k];
    const WallState w = wall.motion.at(base_ + now_);
    const State& s = states_[i];
    const Moving& m = moving_[i];
    const Vector velocity = m.v - w.velocity - m.radius * cross(s.spin, wall.normal);
    const bool soon = elastic(s);
    const double pressed = std::max(0.0, dot(w.acceleration - gravity_, wall.normal));
    const double least = std::max(least_speed(m.v, w.velocity), 0.5 * settings_.contact_duration * pressed);
    const Collision c = collide(wall.law, wall.normal, velocity, s.mass, settings_.shape, soon, least);
    WallAccount& sums = account_.walls[k];
    sums.collisions += 1.0;
    sums.impulse += c.impulse;
    sums.work += dot(c.impulse, w.velocity);
    add(c, soon);
    push(i, c.impulse, -m.radius * wall.normal, norm(m.v) + norm(w.velocity));
    predict(i);
  }

  void visit(Archive& archive) {
    FormatVersion version{1.0};
    archive(version);
    archive(states_);
    archive(moving_);
    archive(cells_);
    archive(account_);
    archive.all(std::tie(base_, now_, time_, passed_));
  }
  /// After a visit that has read, with the grains as they were before.
  void complete(const Solver& before) {
    const auto refuse = [](const std::string& why) { throw std::invalid_argument("the saved state " + why); };
    const std::size_t n = before.states_.size();
    if (states_.size() != n || moving_.size() != n || account_.walls.size() != settings_.walls.size())
      refuse("is that of other grains or walls");
    const auto finite = [](const Vector& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
    bool good = cells_.complete(settings_.periods, int(n)) && std::isfinite(base_) && std::isfinite(now_) && std::isfinite(time_);
    std::vector<bool> there(n, false);
    for (std::size_t i = 0; i < n && good; ++i) {
      const State& s = states_[i];
      const Moving& m = moving_[i];
      good = s.number >= 0 && s.number < int(n) && !there[s.number];
      if (!good) break;
      there[s.number] = true;
      const int was = before.index_[s.number];
      if (s.mass != before.states_[was].mass || m.radius != before.moving_[was].radius) refuse("is that of other grains");
      for (int a = 0; a < 3; ++a) good &= s.place[a] >= 0 && s.place[a] < cells_.cells(a);
      good &= finite(m.x) && finite(m.v) && finite(s.spin) && std::isfinite(m.time) && s.axis >= 0 && s.axis < 3 && std::abs(s.side) == 1 &&
              s.partner >= -1 - int(settings_.walls.size()) && s.partner < int(n) && s.partner != int(i) && s.contact >= now_ &&
              s.leave >= now_ && (s.leave == never || cells_.open(s.axis, s.place[s.axis], s.side));
    }
    if (!good) refuse("is incomplete or damaged");
    index();
    fill();
    events_.reset(int(n));
    for (std::size_t i = 0; i < n; ++i) events_.set(int(i), std::min(states_[i].contact, states_[i].leave));
  }

  Account account_;
  double time_ = 0.0;
  std::int64_t passed_ = 0;  ///< events, since cells were laid out
};

}  // namespace dembark::events
