// What one step computes from positions and velocities: densities, pressures on walls, forces on fluid and bodies, and the energy that is
// lost on the way.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ledger.hpp"
#include "neighbours.hpp"
#include "particle_records.hpp"
#include "slits.hpp"

namespace dembark::sph {

/// Fluid, walls and bodies.
struct Scene {
  Settings settings{};
  FluidParticles fluid{};
  std::vector<Solids> solids = std::vector<Solids>(2);  ///< those that act by pressure, and those that act by the contact potential
  std::vector<Body> bodies;
  Slits slits{};
  Neighbours neighbours{};
  Energies lost{};  ///< losses and work so far

  /// Calls work(i) for all particles of the fluid.
  template <class Work>
  void each(const Work& work) {
    constexpr int chunk = 2048;
    const int n = fluid.size();
    parallel_for((n + chunk - 1) / chunk, settings.threads, [&](int c) {
      for (int i = c * chunk; i < std::min((c + 1) * chunk, n); ++i) work(i);
    });
  }
};

class Passes {
 public:
  Passes(const Settings& s, const Loops& loops) : loops_(&loops), numbers_(loop_numbers(s)) {}

  /// After a search: room, and the record that is far away.
  void resize(Scene& scene) {
    const std::size_t n = scene.fluid.position.size();
    records_.resize(n + 1);
    rate_.resize(n + 1);
    sum_.resize(n + 1);
    if (shifts(scene)) shift_sum_.resize(n + 1);
    records_[n] = far_record(scene.neighbours.far());
    for (Solids& set : scene.solids) set.records.back() = records_[n];
  }

  /// Densities and pressures of the fluid, and of dynamic boundary particles, after dt (s); shifts.
  void density(Scene& scene, double dt) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    const bool shifting = shifts(scene);
    scene.each([&](int i) {
      records_[i] = density_record(s, fluid.position[i], fluid.velocity[i], fluid.density[i], fluid.pressure[i]);
      rate_[i] = 0.0;
      if (shifting) shift_sum_[i] = {};
    });
    Solids& walls = scene.solids[0];
    for (int k = 0; k < walls.size(); ++k) {
      walls.records[k] = solid_record(walls.position[k], walls.velocity[k]);
      walls.rate[k] = 0.0;
    }
    scene.lost.diffusive += dt * s.mass() * pairs(scene, loops_->density_pairs[kernel(scene)][shifting]);
    across(scene, walls, loops_->density_across[kernel(scene)][shifting]);
    if (s.boundary == Boundary::dynamic) {
      back(scene, walls, loops_->density_across[kernel(scene)][0]);
      for (int k = 0; k < walls.size(); ++k) walls.density[k] = boundary_density(s, walls.density[k], walls.rate[k], dt);
    }
    scene.each([&](int i) {
      fluid.density[i] = fluid_density(s, numbers_, fluid.density[i], rate_[i], dt);
      fluid.pressure[i] = s.state.pressure(fluid.density[i]);
      if (shifting) {
        const Quad& q = shift_sum_[i];
        fluid.shift[i] = shift(s.shifting, s.dimension, s.h(), s.spacing, dt, fluid.velocity[i], {q.x, q.y, q.z}, q.w);
      }
    });
  }

  /// Pressures of walls, accelerations of the fluid and of free bodies, losses over dt (s).
  void forces(Scene& scene, double dt) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    scene.each([&](int i) {
      records_[i] = force_record(fluid.position[i], fluid.velocity[i], fluid.density[i], fluid.pressure[i]);
      sum_[i] = {};
    });
    Solids& walls = scene.solids[0];
    wall_states(scene, walls);
    const int slip = s.no_slip ? 0 : 1;
    scene.lost.viscous += dt * s.mass() * pairs(scene, loops_->force_pairs[kernel(scene)]);
    across(scene, walls, loops_->force_across[kernel(scene)][slip]);
    scene.lost.boundary += dt * s.mass() * back(scene, walls, loops_->force_across[kernel(scene)][slip]);
    scene.lost.contact = scene.solids[1].size() > 0 ? contact(scene) : 0.0;
    scene.each([&](int i) { fluid.acceleration[i] = s.gravity + Vector{sum_[i].x, sum_[i].y, sum_[i].z}; });
    for (Body& b : scene.bodies) b.force = b.torque = {};
    for (const Solids& set : scene.solids)
      for (int k = 0; k < set.size(); ++k) {
        if (!set.active(k)) continue;
        Body& b = scene.bodies[set.body[k]];
        const Vector force = s.mass() * Vector{set.sum[k].x, set.sum[k].y, set.sum[k].z};
        b.force += force;
        b.torque += cross(set.position[k] - b.position, force);
      }
    scene.slits.push(s.slit_pressure, s.spacing, s.state.density, s.gravity, scene.solids[0].pressure, scene.bodies);
    for (Body& b : scene.bodies) {
      b.force += b.film;
      b.torque += b.film_torque;
      b.accelerate(s.gravity);
    }
  }

 private:
  static int kernel(const Scene& scene) { return int(scene.settings.kernel); }
  static bool shifts(const Scene& scene) { return scene.settings.shifting.coefficient > 0.0; }

  LoopArguments arguments(const Scene& scene, const Rows& rows) {
    LoopArguments in;
    in.start = rows.start.data();
    in.neighbour = rows.neighbour.data();
    in.begin = rows.begin;
    in.end = rows.end;
    in.dimension = scene.settings.dimension;
    in.h = scene.settings.h();
    in.pair = numbers_.pair;
    in.volume = scene.settings.mass() / scene.settings.state.density;
    in.own = in.others = records_.data();
    in.rate = rate_.data();
    in.shift = shift_sum_.data();
    in.sum = sum_.data();
    return in;
  }
  double added(std::size_t count) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < count; ++k) sum += parts_[k];
    return sum;
  }

  /// Fluid and fluid: even slabs, then odd ones.
  double pairs(const Scene& scene, Loops::Loop loop) {
    const std::vector<Rows>& slabs = scene.neighbours.pairs();
    const int count = int(slabs.size());
    parts_.assign(slabs.size(), 0.0);
    for (int odd = 0; odd < 2; ++odd)
      parallel_for((count + 1 - odd) / 2, scene.settings.threads,
                   [&](int k) { parts_[2 * k + odd] = loop(arguments(scene, slabs[2 * k + odd])); });
    return added(slabs.size());
  }
  /// What solid particles do to the fluid.
  void across(const Scene& scene, const Solids& set, Loops::Loop loop) {
    parallel_for(int(set.of_fluid.size()), scene.settings.threads, [&](int k) {
      LoopArguments in = arguments(scene, set.of_fluid[k]);
      in.others = set.records.data();
      loop(in);
    });
  }
  /// What the fluid does to solid particles.
  double back(const Scene& scene, Solids& set, Loops::Loop loop) {
    parts_.assign(set.near_fluid.size(), 0.0);
    parallel_for(int(set.near_fluid.size()), scene.settings.threads, [&](int k) {
      LoopArguments in = arguments(scene, set.near_fluid[k]);
      in.own = set.records.data();
      in.rate = set.rate.data();
      in.sum = set.sum.data();
      in.velocity_sum = set.velocity_sum.data();
      in.velocity = set.velocity.data();
      parts_[k] = loop(in);
    });
    return added(set.near_fluid.size());
  }

  /// Pressures, densities and velocities that the fluid meets at solid particles; clears their sums.
  void wall_states(const Scene& scene, Solids& set) {
    const Settings& s = scene.settings;
    const bool extrapolated = s.boundary == Boundary::extrapolated;
    set.sum.assign(set.sum.size(), Quad{});
    if (extrapolated) {
      for (int k = 0; k < set.size(); ++k) set.records[k] = solid_record(set.position[k], {});
      back(scene, set, loops_->wall_sums[kernel(scene)]);
    }
    for (int k = 0; k < set.size(); ++k) {
      const Vector &x = set.position[k], &v = set.velocity[k];
      double rho = set.density[k];
      set.met[k] = v;
      if (extrapolated) {
        const Quad& q = set.sum[k];
        const WallSums sums{q.w, set.rate[k], {q.x, q.y, q.z}, set.velocity_sum[k]};
        const Body& b = scene.bodies[set.body[k]];
        const WallState wall = wall_state(s, sums, v, b.acceleration_at(x - b.position));
        set.pressure[k] = wall.pressure;
        set.met[k] = wall.velocity;
        rho = wall.density;
        set.sum[k] = {};
      } else {
        set.pressure[k] = s.state.pressure(rho);
      }
      set.records[k] = force_record(x, set.met[k], rho, set.pressure[k]);
    }
  }

  /// Forces of the contact potential; returns its energy (J).
  double contact(Scene& scene) {
    return with_kernel(scene.settings, [&](const auto& kernel) { return contact(scene, kernel); });
  }
  template <class Kernel>
  double contact(Scene& scene, const Kernel& kernel) {
    const Settings& s = scene.settings;
    const FluidParticles& fluid = scene.fluid;
    Solids& set = scene.solids[1];
    const double mass = s.mass(), solid = mass / s.state.density;
    parts_.assign(set.of_fluid.size(), 0.0);
    parallel_for(int(set.of_fluid.size()), s.threads, [&](int b) {
      set.of_fluid[b].each(set.size(), [&](int i, int j) {
        const Vector d = fluid.position[i] - set.position[j];
        const double r = norm(d), volumes = solid * mass / fluid.density[i];
        const Vector a = (contact_factor(s.contact, kernel, r, volumes, numbers_.at_spacing) / mass) * d;
        sum_[i] = {sum_[i].x + a.x, sum_[i].y + a.y, sum_[i].z + a.z, 0.0};
        parts_[b] += contact_energy(s.contact, kernel, r, volumes, numbers_.at_spacing);
      });
    });
    set.sum.assign(set.sum.size(), Quad{});
    parallel_for(int(set.near_fluid.size()), s.threads, [&](int b) {
      set.near_fluid[b].each(fluid.size(), [&](int j, int i) {
        const Vector d = fluid.position[i] - set.position[j];
        const double volumes = solid * mass / fluid.density[i];
        const Vector a = (contact_factor(s.contact, kernel, norm(d), volumes, numbers_.at_spacing) / mass) * d;
        set.sum[j] = {set.sum[j].x - a.x, set.sum[j].y - a.y, set.sum[j].z - a.z, 0.0};
      });
    });
    return added(set.of_fluid.size());
  }

  const Loops* loops_;
  LoopNumbers numbers_;
  std::vector<Record> records_;
  std::vector<double> rate_, parts_;
  std::vector<Quad> sum_, shift_sum_;
};

}  // namespace dembark::sph
