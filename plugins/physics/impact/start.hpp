// What a run of impacts must not begin with: bodies deep in each other, and a time step in which no impact is resolved.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "../message_text.hpp"
#include "geometry.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// Overlap at the start over the smaller radius, at most: what loads at rest and impacts under way have in practice is allowed, n mg/k
/// under n bodies; more is a mistake and throws bodies apart.
constexpr double most_overlap = 0.05;
/// omega tau, at most, of a step that resolves impacts: a contact lasts pi steps.
constexpr double longest_step = 1.0;

/// One line about the bodies, or the body and the wall, that overlap most, where that is too much for a start; else nothing. Points, which
/// have no radius, and what is held fast do not count. body: the word for one, in front of its number; wall: the name of wall 0, 1, ...
inline std::string start_error(const std::vector<Body>& bodies, const std::vector<Contact>& contacts, const std::string& body,
                               const std::function<std::string(std::int64_t)>& wall) {
  const Contact* worst = nullptr;
  double most = most_overlap;
  for (const Contact& c : contacts) {
    const Body &one = bodies[std::size_t(c.a)], &other = c.b >= 0 ? bodies[std::size_t(c.b)] : one;
    const double radius = std::min(one.radius, other.radius);
    if (radius == 0.0 || (std::isinf(one.mass) && std::isinf(other.mass)) || !(-c.gap > most * radius)) continue;
    most = -c.gap / radius;
    worst = &c;
  }
  if (!worst) return {};
  const std::string partner = worst->b >= 0 ? body + " " + std::to_string(shown_id(worst->key_b)) : wall(wall_number(worst->key_b));
  return body + " " + std::to_string(worst->key_a) + " and " + partner + " overlap at the start by " + number_text(most, 3) +
         " of the radius; at most " + number_text(most_overlap) + " is allowed";
}

/// kg, of a body as a contact feels it; of a capsule at its end, where it is least.
inline double least_mass(const Body& b) {
  return has_length(b) ? 1.0 / (1.0 / b.mass + dot(b.half_axis, b.half_axis) / b.inertia) : b.mass;
}

/// The largest omega = sqrt(k / m*) (rad/s) of the contacts that are possible: of the lightest bodies of each material with each other and
/// with the walls. 0 where nothing can meet.
inline double stiffest_contact(const Settings& settings, const std::vector<Body>& bodies, const ContactGeometry& around) {
  constexpr double none = std::numeric_limits<double>::infinity();
  const std::size_t n = settings.materials.size();
  std::vector<std::array<double, 2>> lightest(n, {none, none});  // kg
  for (const Body& b : bodies) {
    auto& [first, second] = lightest[std::size_t(b.material)];
    const double mass = least_mass(b);
    second = std::min(second, std::max(first, mass));
    first = std::min(first, mass);
  }
  double square = 0.0;
  const auto meet = [&](double stiffness, double other, double inverse_mass) {
    square = std::max(square, inverse_mass / (1.0 / stiffness + 1.0 / other));
  };
  for (std::size_t i = 0; i < n; ++i) {
    const double stiffness = settings.materials[i].stiffness;
    if (std::isinf(lightest[i][0])) continue;
    if (!std::isinf(lightest[i][1])) meet(stiffness, stiffness, 1.0 / lightest[i][0] + 1.0 / lightest[i][1]);
    for (std::size_t j = i + 1; j < n; ++j)
      if (!std::isinf(lightest[j][0])) meet(stiffness, settings.materials[j].stiffness, 1.0 / lightest[i][0] + 1.0 / lightest[j][0]);
    const auto walls = [&](const auto& list) {
      for (const Wall& wall : list) meet(stiffness, wall.stiffness, 1.0 / lightest[i][0]);
    };
    walls(around.planes);
    walls(around.drums);
    walls(around.meshes);
  }
  return std::sqrt(square);
}

/// One line where the time step resolves no impact of the stiffest contact, else nothing. The motion may still be right.
inline std::string step_warning(const Settings& settings, const std::vector<Body>& bodies, const ContactGeometry& around) {
  const double omega = stiffest_contact(settings, bodies, around);
  if (!(omega * settings.dt > longest_step)) return {};
  return "the time step of " + number_text(settings.dt, 3) + " s is " + number_text(omega * settings.dt, 3) +
         " / omega of the stiffest contact; impacts are resolved up to " + number_text(longest_step) + " / omega, " +
         number_text(longest_step / omega, 3) + " s: peak forces, durations and losses of impacts mean nothing";
}

}  // namespace impact
}  // namespace dembark
