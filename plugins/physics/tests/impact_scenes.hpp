// Bodies and comparisons that several tests of the impact model share.
#pragma once

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "dembark/impact/scene.hpp"

namespace impact_scenes {

using dembark::Vec3;
using dembark::impact::Body;
using dembark::impact::ImpactPairLaw;
using dembark::impact::Settings;

constexpr double g = 9.81;

inline Settings two_materials(double dt, double theta, double mu, double contact_damping = 0.0) {
  Settings s;
  s.dt = dt;
  s.theta = theta;
  s.materials = {{1e7, 0.0}, {5e7, 0.0}};
  s.pairs.assign(4, ImpactPairLaw());
  for (ImpactPairLaw& p : s.pairs) {
    p.friction.static_friction = p.friction.kinetic_friction = mu;
    p.contact_damping = contact_damping;
  }
  return s;
}

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

/// All pairs with gap <= reach (m).
inline void find_pairs(const std::vector<Body>& bodies, double reach, std::vector<dembark::impact::Contact>& contacts) {
  dembark::impact::PairFinder().find(bodies, reach, contacts);
}

/// A step with these candidates; adds what the contacts do to the bodies to `force` and `torque`.
inline const dembark::impact::StepReport& step(dembark::impact::System& system, const std::vector<Body>& bodies,
                                               const std::vector<dembark::impact::Contact>& contacts, double time, double kick,
                                               std::vector<Vec3<double>>& force, std::vector<Vec3<double>>& torque) {
  const auto all = [&](double, std::vector<dembark::impact::Contact>& found) { found = contacts; };
  const dembark::impact::StepReport& report = system.step(bodies, all, 0.0, time, kick, INFINITY);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    force[i] += system.wrenches()[i].force;
    torque[i] += system.wrenches()[i].torque;
  }
  return report;
}

/// A lattice of triangles whose neighbours overlap or miss each other by `gap`, at random.
inline std::vector<Body> lattice(int columns, int rows, double gap, bool tilted, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Body> bodies;
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j) {
      Body b;
      b.id = std::int64_t(bodies.size());
      b.radius = 0.05;
      b.mass = 20.0 + 10.0 * unit(random);
      b.inertia = dembark::impact::cylinder_inertia(b.mass, b.radius);
      const double x = 0.1 * (i + 0.5 * (j % 2)) + gap * unit(random), y = 0.0866 * j + gap * unit(random);
      b.position = {tilted ? 0.8 * x : x, y, tilted ? 0.6 * x : 0.0};
      b.velocity = {0.5 * unit(random), 0.5 * unit(random), tilted ? 0.5 * unit(random) : 0.0};
      b.force = {0.0, -b.mass * g, 0.0};
      bodies.push_back(b);
    }
  return bodies;
}

inline bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace impact_scenes
