// What the solver of hard grains is given, and the accounts that it keeps.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "cells.hpp"

namespace dembark::events {

struct Grain {
  double mass = 1.0, radius = 1.0;        ///< kg, m
  Vector position{}, velocity{}, spin{};  ///< m, m/s, rad/s
  auto fields() { return std::tie(mass, radius, position, velocity, spin); }
};

struct Settings {
  int dimension = 3;              ///< 2: discs or spheres in the plane z = 0, which turn about z
  double shape = 0.4;             ///< I / (m r^2)
  CollisionLaw law;               ///< of grains with grains
  Vector gravity{};               ///< m/s^2
  double contact_duration = 0.0;  ///< s: a collision of a grain so soon after its last one is elastic
  std::array<Period, 3> periods{};
  std::vector<Wall> walls;
};

struct WallAccount {
  double collisions = 0.0;
  double work = 0.0;  ///< J, of the wall on the grains
  Vector impulse{};   ///< N s, on the grains
  auto fields() { return std::tie(collisions, work, impulse); }
};

/// Sums from the start on. Energy: kinetic + potential + losses - work of the walls stays; momentum: that of the grains less gravity times
/// mass and time, less the impulses of the walls, stays.
struct Account {
  double collisions = 0.0;                        ///< of grains with grains
  double elastic = 0.0;                           ///< collisions, walls too, within the duration of a contact
  double crossings = 0.0, repeats = 0.0;          ///< faces of cells passed, predictions made anew
  double normal_loss = 0.0, friction_loss = 0.0;  ///< J
  std::array<Vector, 3> virial{};                 ///< J, rows: sum of impulse times distance of the centres, of grains with grains
  std::vector<WallAccount> walls;
  auto fields() {
    return std::tie(collisions, elastic, crossings, repeats, normal_loss, friction_loss, virial[0], virial[1], virial[2], walls);
  }
};

/// Throws std::invalid_argument with one line about what is wrong.
inline void check(const Settings& s, const std::vector<Grain>& grains) {
  const auto refuse = [](const std::string& line) { throw std::invalid_argument(line); };
  const auto finite = [](const Vector& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
  if (grains.empty()) refuse("there are no grains");
  if (s.dimension != 2 && s.dimension != 3) refuse("dimension must be 2 or 3");
  if (!(s.shape > 0.0 && std::isfinite(s.shape))) refuse("shape must be > 0 and finite, not " + number_text(s.shape));
  if (!s.law.error().empty()) refuse(s.law.error());
  if (!finite(s.gravity)) refuse("gravity must be finite numbers (m/s^2)");
  if (!(s.contact_duration >= 0.0 && std::isfinite(s.contact_duration)))
    refuse("contact_duration must be >= 0 s and finite, not " + number_text(s.contact_duration));
  const auto flat = [&](const Vector& v) { return s.dimension == 3 || v.z == 0.0; };
  if (!flat(s.gravity)) refuse("in two dimensions gravity has no z component");
  double largest = 0.0;
  for (std::size_t i = 0; i < grains.size(); ++i) {
    const Grain& g = grains[i];
    const std::string who = "grain " + std::to_string(i) + ": ";
    if (!(g.mass > 0.0 && std::isfinite(g.mass))) refuse(who + "mass must be > 0 kg and finite, not " + number_text(g.mass));
    if (!(g.radius > 0.0 && std::isfinite(g.radius))) refuse(who + "radius must be > 0 m and finite, not " + number_text(g.radius));
    if (!finite(g.position) || !finite(g.velocity) || !finite(g.spin)) refuse(who + "position, velocity and spin must be finite numbers");
    if (!flat(g.position) || !flat(g.velocity) || (s.dimension == 2 && (g.spin.x != 0.0 || g.spin.y != 0.0)))
      refuse(who + "in two dimensions positions and velocities have no z component, and spins no other");
    largest = std::max(largest, g.radius);
  }
  for (int a = 0; a < 3; ++a) {
    const Period& p = s.periods[a];
    const std::string which = std::string("the period along ") + "xyz"[a];
    if (!std::isfinite(p.low) || !std::isfinite(p.high) || p.high < p.low)
      refuse(which + " must end above its begin, at finite numbers (m)");
    if (!p.repeats()) continue;
    if (a >= s.dimension) refuse("in two dimensions there is no period along z");
    if (p.length() < 6.0 * largest * (1.0 + 1e-9))
      refuse(which + ", " + number_text(p.length()) + " m, must be longer than three of the largest diameters, " +
             number_text(6.0 * largest) + " m");
  }
  if (s.walls.size() > 64) refuse("there must be at most 64 walls, not " + std::to_string(s.walls.size()));
  for (std::size_t k = 0; k < s.walls.size(); ++k) {
    const Wall& w = s.walls[k];
    const std::string who = "wall " + std::to_string(k) + ": ";
    if (!finite(w.point)) refuse(who + "point must be finite numbers (m)");
    if (!(std::fabs(dot(w.normal, w.normal) - 1.0) < 1e-12)) refuse(who + "normal must be a unit vector");
    if (!flat(w.normal)) refuse(who + "in two dimensions its normal has no z component");
    if (!w.law.error().empty()) refuse(who + w.law.error());
    if (w.motion.turns()) refuse(who + "it must not turn: hard grains have walls that keep their direction");
    for (int a = 0; a < s.dimension; ++a)
      if (s.periods[a].repeats() && part(w.normal, a) != 0.0)
        refuse(who + "its normal has a part along " + "xyz"[a] + ", along which all repeats itself");
  }
}

}  // namespace dembark::events
