// Particles of walls and bodies: where they are, what they feel, and their pairs with the fluid.
#pragma once

#include <vector>

#include "bodies.hpp"
#include "cells.hpp"
#include "loops.hpp"
#include "wall.hpp"

namespace dembark::sph {

struct Solids {
  std::vector<int> body;                   ///< of each particle
  std::vector<Vector> local;               ///< m, from the body's centre in its frame
  std::vector<Vector> position, velocity;  ///< m, m/s
  std::vector<double> density;             ///< kg/m^3; of dynamic boundary particles only
  std::vector<double> pressure;            ///< Pa
  std::vector<Vector> met;                 ///< m/s, the velocity that viscosity meets
  std::vector<Quad> sum;                   ///< of loops
  std::vector<double> rate;
  std::vector<Vector> velocity_sum;
  std::vector<Record> records;   ///< and one far away
  std::vector<Rows> of_fluid;    ///< solid particles near each fluid one, by slabs of the fluid
  std::vector<Rows> near_fluid;  ///< fluid particles near each solid one, by blocks of the solid ones
  CellOrder order;

  int size() const { return int(body.size()); }
  bool active(int k) const {
    const Rows& rows = near_fluid[std::size_t(k) / block];
    const int row = k - rows.begin;
    return rows.start[row + 1] > rows.start[row];
  }
  static constexpr int block = 256;

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
    const std::size_t n = body.size();
    pressure.resize(n, 0.0);
    met.resize(n);
    sum.assign(n, Quad{});
    rate.assign(n, 0.0);
    velocity_sum.assign(n, Vector{});
    records.resize(n + 1);
    near_fluid.resize((n + block - 1) / block);
  }
};

}  // namespace dembark::sph
