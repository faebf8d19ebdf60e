// Where hard grains are, in which cells, and their next events (solver.hpp).
//
// Each grain has a time of its own, up to which it has been moved, and one next event: its earliest collision with a grain in its cell or
// the next ones, or with a wall, or the face of a cell. Whenever its velocity changes all is predicted anew, when it passes a face only
// what is new behind it. A collision whose partner has had another one before is void, and the grain is predicted anew at that time. Every
// pair's next collision thus is, or is later than, the next event of one of the two.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "cells.hpp"
#include "contact_times.hpp"
#include "tournament.hpp"
#include "types.hpp"

namespace dembark::events {

class Flights {
 public:
  int size() const { return int(states_.size()); }
  const Settings& settings() const { return settings_; }

 protected:
  static constexpr int all = -1;    ///< cells, not only those behind a face
  static constexpr int again = -1;  ///< for a partner: predict anew; -2, -3, ...: walls

  /// What a search reads, a line of the cache.
  struct alignas(64) Moving {
    Vector x{}, v{};                  ///< m, m/s, at its time
    double time = 0.0, radius = 0.0;  ///< s, m
    auto fields() { return std::tie(x, v, time, radius); }
  };
  struct State {
    int number = 0;  ///< of the grain: those of a cell lie next to each other in memory
    double mass = 1.0;
    Vector spin{};
    double last = -never;  ///< s, of its last collision
    int hurried = 0;       ///< collisions in a row, each right after the one before
    std::array<double, 3> turns{};
    Place place{};
    std::uint32_t changes = 0;  ///< of its velocity
    double contact = never, leave = never;
    int partner = again;
    std::uint32_t partner_changes = 0;
    int axis = 0, side = 1;  ///< of the face
    auto fields() {
      return std::tie(number, mass, spin, last, hurried, turns[0], turns[1], turns[2], place[0], place[1], place[2], changes, contact,
                      leave, partner, partner_changes, axis, side);
    }
  };

  /// Throws std::invalid_argument with one line about what is wrong.
  Flights(Settings settings, const std::vector<Grain>& grains) : settings_(std::move(settings)), gravity_(settings_.gravity) {
    check(settings_, grains);
    falls_ = norm(gravity_) > 0.0;
    for (Wall& wall : settings_.walls) {
      wall.motion.begin(0.0);
      bounds_.push_back(wall.motion.bounds(wall.normal));
    }
    states_.resize(grains.size());
    for (std::size_t i = 0; i < grains.size(); ++i) {
      moving_.push_back({grains[i].position, grains[i].velocity, 0.0, grains[i].radius});
      states_[i].number = int(i);
      states_[i].mass = grains[i].mass;
      states_[i].spin = grains[i].spin;
      largest_ = std::max(largest_, grains[i].radius);
      for (int a = 0; a < 3; ++a) wrap(int(i), a);
    }
    begin();
    check_overlaps();
  }

  Vector nearest(Vector r) const {
    for (int a = 0; a < 3; ++a)
      if (const double length = settings_.periods[a].length(); length > 0.0) part(r, a) -= length * std::round(part(r, a) / length);
    return r;
  }
  void wrap(int i, int axis) {
    const Period& p = settings_.periods[axis];
    if (!p.repeats()) return;
    double& x = part(moving_[i].x, axis);
    const double turns = std::floor((x - p.low) / p.length());
    x -= turns * p.length();
    states_[i].turns[axis] += turns;
  }

  /// To now.
  void advance(int i) {
    Moving& m = moving_[i];
    const double t = now_ - m.time;
    m.x += t * (m.v + (0.5 * t) * gravity_);
    m.v += t * gravity_;
    m.time = now_;
  }

  /// All grains to now, which becomes the time that others are relative to; cells laid out anew, and all events predicted.
  void begin() {
    const int n = size();
    std::array<std::vector<double>, 3> along;
    for (int i = 0; i < n; ++i) {
      advance(i);
      moving_[i].time = 0.0;
      states_[i].last -= now_;
      for (int a = 0; a < 3; ++a) along[a].push_back(part(moving_[i].x, a));
    }
    base_ += now_;
    now_ = 0.0;
    // A few grains that have flown far do not make cells large.
    Vector low, high;
    for (int a = 0; a < 3; ++a) {
      std::vector<double>& x = along[a];
      const auto few = std::ptrdiff_t(n / 64);
      std::nth_element(x.begin(), x.begin() + few, x.end());
      part(low, a) = x[few];
      std::nth_element(x.begin(), x.end() - 1 - few, x.end());
      part(high, a) = x[n - 1 - few];
    }
    cells_.set(settings_.periods, low, high, 2.0 * largest_ * (1.0 + 1e-9), settings_.dimension, n);
    for (int i = 0; i < n; ++i) states_[i].place = cells_.place(moving_[i].x);
    sort();
    fill();
    events_.reset(n);
    for (int i = 0; i < n; ++i) predict(i);
  }

  /// In the order of the cells.
  void sort() {
    std::vector<std::pair<int, int>> order;
    order.reserve(states_.size());
    for (int i = 0; i < size(); ++i) order.emplace_back(cells_.number(states_[i].place), i);
    std::sort(order.begin(), order.end());
    const std::vector<Moving> moving(std::move(moving_));
    const std::vector<State> states(std::move(states_));
    moving_.clear();
    states_.clear();
    for (const auto& [cell, i] : order) {
      moving_.push_back(moving[i]);
      states_.push_back(states[i]);
    }
    index();
  }
  /// Where each grain is.
  void index() {
    index_.resize(states_.size());
    for (int i = 0; i < size(); ++i) index_[states_[i].number] = i;
  }

  /// Lists of the cells, and which walls the grains in each of them may touch.
  void fill() {
    cells_.clear(size());
    for (int i = 0; i < size(); ++i) cells_.put(i, cells_.number(states_[i].place));
    near_walls_.assign(std::size_t(cells_.count()), 0);
    for (Place p{}; p[2] < cells_.cells(2); ++p[2])
      for (p[1] = 0; p[1] < cells_.cells(1); ++p[1])
        for (p[0] = 0; p[0] < cells_.cells(0); ++p[0])
          for (std::size_t k = 0; k < settings_.walls.size(); ++k) {
            const Wall& wall = settings_.walls[k];
            const double gap = cells_.least(p, wall.normal) - dot(wall.point, wall.normal) - bounds_[k].displacement;
            if (!(gap > largest_ * (1.0 + 1e-6))) near_walls_[cells_.number(p)] |= std::uint64_t(1) << k;
          }
  }

  void check_overlaps() const {
    for (int i = 0; i < size(); ++i) {
      const Moving& m = moving_[i];
      for (std::size_t k = 0; k < settings_.walls.size(); ++k) {
        const double gap = dot(m.x - settings_.walls[k].point, settings_.walls[k].normal) - m.radius;
        if (gap < -1e-12 * m.radius)
          throw std::invalid_argument("grain " + std::to_string(states_[i].number) + " is " + number_text(-gap) + " m inside wall " +
                                      std::to_string(k) + " at the start");
      }
      each_near(i, all, [&](int j, const Vector& shift) {
        const int one = states_[i].number, other = states_[j].number;
        const double reach = m.radius + moving_[j].radius, gap = norm(m.x - moving_[j].x - shift) - reach;
        if (gap < -1e-12 * reach)
          throw std::invalid_argument("grains " + std::to_string(std::min(one, other)) + " and " + std::to_string(std::max(one, other)) +
                                      " overlap by " + number_text(-gap) + " m at the start");
      });
    }
  }

  /// Calls work(j, shift) for the grains in the cells around grain i: all, or those behind the face that it has passed along an axis.
  template <class Work>
  void each_near(int i, int axis, const Work& work) const {
    const State& s = states_[i];
    const Cells::Row &along_x = cells_.row(0, s.place[0]), &along_y = cells_.row(1, s.place[1]), &along_z = cells_.row(2, s.place[2]);
    std::array<int, 3> from{along_x.from, along_y.from, along_z.from}, to{along_x.to, along_y.to, along_z.to};
    if (axis != all) {
      if (!cells_.open(axis, s.place[axis], s.side)) return;
      from[axis] = to[axis] = 1 + s.side;
    }
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x)
          for (int j = cells_.head(along_x.cell[x] + along_y.cell[y] + along_z.cell[z]); j >= 0; j = cells_.next(j))
            if (j != i) work(j, Vector{along_x.shift[x], along_y.shift[y], along_z.shift[z]});
  }

  /// The earliest collision of grain i, which has been moved to now, with grains in these cells, if it is earlier than the one it has.
  void find_grains(int i, int axis) {
    const Moving m = moving_[i];
    State& s = states_[i];
    double best = s.contact - now_;
    int partner = again;
    each_near(i, axis, [&](int j, const Vector& shift) {
      const Moving& o = moving_[j];
      const double t = now_ - o.time;
      Vector place = m.x - o.x - shift - t * o.v, velocity = m.v - o.v;
      if (falls_) {
        place -= (0.5 * t * t) * gravity_;
        velocity -= t * gravity_;
      }
      const double found = pair_contact(place, velocity, m.radius + o.radius, best);
      // Of equal times the first in memory, in whatever order the cells hold them.
      if (!(found < best || (found == best && j < partner))) return;
      best = found;
      partner = j;
    });
    if (partner == again) return;
    s.contact = now_ + best;
    s.partner = partner;
    s.partner_changes = states_[partner].changes;
  }
  void find_walls(int i, std::uint64_t walls) {
    const Moving& m = moving_[i];
    State& s = states_[i];
    for (int k = 0; walls != 0; ++k, walls >>= 1) {
      if ((walls & 1) == 0) continue;
      const Flight flight{base_ + now_, m.x, m.v, gravity_, m.radius};
      const WallContact found = wall_contact(flight, settings_.walls[k], bounds_[k], base_ + s.contact);
      const double t = std::max(now_, found.time - base_);
      if (!(t < s.contact)) continue;
      s.contact = t;
      s.partner = found.touches ? -2 - k : again;
    }
  }
  void find_face(int i) {
    const Moving& m = moving_[i];
    State& s = states_[i];
    s.leave = never;
    for (int a = 0; a < settings_.dimension; ++a) {
      const double x = part(m.x, a), v = part(m.v, a), g = part(gravity_, a);
      for (int side = -1; side <= 1; side += 2) {
        if (!cells_.open(a, s.place[a], side) || (g == 0.0 && !(side * v > 0.0))) continue;
        const double t = now_ + first_zero(side * (cells_.face(a, s.place[a], side) - x), -side * v, -side * g);
        if (!(t < s.leave)) continue;
        s.leave = t;
        s.axis = a;
        s.side = side;
      }
    }
    events_.set(i, std::min(s.contact, s.leave));
  }
  void predict(int i) {
    State& s = states_[i];
    s.contact = never;
    s.partner = again;
    find_grains(i, all);
    find_walls(i, near_walls_[cells_.number(s.place)]);
    find_face(i);
  }

  /// To the next cell.
  void pass(int i) {
    State& s = states_[i];
    advance(i);
    const int from = cells_.number(s.place);
    const int turns = cells_.step(s.place, s.axis, s.side);
    if (turns != 0) {
      part(moving_[i].x, s.axis) += turns * settings_.periods[s.axis].length();
      s.turns[s.axis] -= turns;
    }
    const int to = cells_.number(s.place);
    cells_.take(i, from);
    cells_.put(i, to);
    find_grains(i, s.axis);
    find_walls(i, near_walls_[to] & ~near_walls_[from]);
    find_face(i);
  }

  Settings settings_;
  Vector gravity_;
  bool falls_ = false;
  double largest_ = 0.0;  ///< m, radius
  std::vector<motion::Bounds> bounds_;
  std::vector<Moving> moving_;
  std::vector<State> states_;
  std::vector<int> index_;
  Cells cells_;
  std::vector<std::uint64_t> near_walls_;  ///< a bit each, of the cells
  Tournament events_;
  double base_ = 0.0, now_ = 0.0;  ///< s: the time that others are relative to, and the present one
};

}  // namespace dembark::events
