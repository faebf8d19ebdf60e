// Bodies and comparisons that several tests of the impact model share.
#pragma once

#include <cstring>
#include <random>
#include <vector>

#include "dembark/impact/scene.hpp"

namespace impact_scenes {

using dembark::Vec3;
using dembark::impact::Body;

constexpr double g = 9.81;

/// Logs of unequal size in a drum, thrown about; two materials and one of the drum.
inline std::vector<Body> crowd(int n, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Body> bodies;
  while (int(bodies.size()) < n) {
    Body b;
    b.id = std::int64_t(bodies.size()) * 3 + 1;
    b.radius = 0.06 + 0.02 * unit(random);
    b.mass = 4000 * b.radius * b.radius;
    b.inertia = dembark::impact::cylinder_inertia(b.mass, b.radius);
    b.material = int(bodies.size()) % 2;
    b.position = {0.93 * unit(random), 0.93 * unit(random), 0};
    b.velocity = {3 * unit(random), 3 * unit(random), 0};
    b.force = {0, -b.mass * g, 0};
    bool free = norm(b.position) + b.radius < 0.99;
    for (const Body& o : bodies) free = free && norm(o.position - b.position) > o.radius + b.radius + 0.002;
    if (free) bodies.push_back(b);
  }
  return bodies;
}

inline bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace impact_scenes
