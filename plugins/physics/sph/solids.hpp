// Particles of walls and bodies: where they are, what they feel, and their pairs with the fluid.
#pragma once

#include <vector>

#include "bodies.hpp"
#include "cells.hpp"
#include "loops.hpp"
#include "wall.hpp"

namespace dembark::sph {

struct Solids {
  // Of the particles of this process, and then of the images of others'.
  std::vector<Vector> position, velocity;  ///< m, m/s
  std::vector<double> density;             ///< kg/m^3; of dynamic boundary particles only
  std::vector<double> pressure;            ///< Pa
  std::vector<Vector> met;                 ///< m/s, the velocity that viscosity meets
  std::vector<Record> records;             ///< and one far away
  // Of its own particles.
  std::vector<int> body;      ///< of each particle
  std::vector<Vector> local;  ///< m, from the body's centre in its frame
  std::vector<Quad> sum;      ///< of loops; after the forces: accelerations of fluid particles of this mass, m/s^2
  std::vector<double> rate;
  std::vector<Vector> velocity_sum;
  std::vector<Rows> of_fluid;    ///< solid particles near each fluid one
  std::vector<Rows> near_fluid;  ///< fluid particles near each solid one

  int size() const { return int(body.size()); }
  int with_images() const { return int(position.size()); }

  void add(int number, const Vector& arm, double rho) {
    body.push_back(number);
    local.push_back(arm);
    density.push_back(rho);
    position.emplace_back();
    velocity.emplace_back();
  }
  /// Places and velocities from those of the bodies.
  void follow(const std::vector<Body>& bodies) {
    for (int k = 0; k < size(); ++k) {
      const Body& b = bodies[body[k]];
      const Vector arm = b.orientation(local[k]);
      position[k] = b.position + arm;
      velocity[k] = b.velocity_at(arm);
    }
  }
  /// Room for sums and records.
  void resize() {
    const std::size_t n = position.size();
    pressure.resize(n, 0.0);
    met.resize(n);
    records.resize(n + 1);
    sum.assign(body.size(), Quad{});
    rate.assign(body.size(), 0.0);
    velocity_sum.assign(body.size(), Vector{});
  }
};

}  // namespace dembark::sph
