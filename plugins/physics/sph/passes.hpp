// The passes of a step over all particles, in their order, for the solver and for engines: densities, pressures on walls, forces on fluid
// and bodies, films, and the energy that is lost on the way.
#pragma once

#include <cstddef>
#include <vector>

#include "scene.hpp"

namespace dembark::sph {

/// For a process that has all particles. Where processes share them, the engine gives an object of the same form, which sends the numbers
/// of particles to their images on other processes.
struct OneProcess {
  void send_densities(Scene&) const {}  ///< of fluid, with its `correction` if there is one, and solids[0]
  void send_walls(Scene&) const {}      ///< `pressure` and `met` of solids[0]
  /// Pa, of the particles of boxes (Slits), from all processes.
  const std::vector<double>& box_pressures(const Scene& scene) const { return scene.solids[0].pressure; }
};

class Passes {
 public:
  Passes(const Settings& s, const Loops& loops) : loops_(&loops), numbers_(loop_numbers(s)) {}

  /// Pressures of the fluid from its densities.
  void pressures(Scene& scene) const { pressures(scene, 0); }

  /// Particles have got their places after a step of dt (s), 0: none. Densities, pressures and shifts of the fluid, `sum` of all particles,
  /// and what the fluid and its films do to bodies: of this process `force` and `torque`, of all `film` and `film_torque`.
  template <class Images>
  void compute(Scene& scene, double dt, Images&& images) {
    if (dt > 0.0 || scene.settings.corrects()) rates(scene, dt);
    if (dt > 0.0) {
      densities(scene, dt);
      images.send_densities(scene);
      if (shepard_is_due(scene.settings.shepard, scene.step)) {
        filter(scene);
        images.send_densities(scene);
      }
      pressures(scene, scene.fluid.size());
    } else if (scene.settings.corrects()) {
      images.send_densities(scene);
    }
    walls(scene);
    images.send_walls(scene);
    forces(scene, dt);
    if (scene.settings.xsph.on() && dt > 0.0) smooth_drift(scene, dt);
    if (scene.settings.contact.on()) repel(scene);
    push_bodies(scene);
    const Settings& s = scene.settings;
    if (!scene.slits.boxes.empty())
      scene.slits.push(s.slit_pressure, s.spacing, s.state.density, s.gravity, images.box_pressures(scene), scene.bodies);
  }

 private:
  /// Moment of the lattice over that of a particle of the fluid.
  static double corrected(const Scene& scene, int i) {
    return scene.fluid.correction[i] * scene.fluid.density[i] / scene.settings.state.density;
  }

  static int kernel(const Scene& scene) { return int(scene.settings.kernel); }

  static void pressures(Scene& scene, int first) {
    FluidParticles& fluid = scene.fluid;
    scene.each(fluid.with_images() - first,
               [&](int i) { fluid.pressure[first + i] = scene.settings.state.pressure(fluid.density[first + i]); });
  }

  /// Of the densities of the fluid and of dynamic boundary particles, at their places; and the corrections of the moment there.
  void rates(Scene& scene, double dt) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    const bool places = scene.sums_places();
    scene.each(fluid.with_images(), [&](int i) {
      fluid.records[i] = density_record(s, fluid.position[i], fluid.velocity[i], fluid.density[i], fluid.pressure[i]);
      fluid.rate[i] = 0.0;
      if (places) fluid.diffused[i] = 0.0, fluid.shift_sum[i] = {};
    });
    Solids& walls = scene.solids[0];
    for (int k = 0; k < walls.with_images(); ++k) walls.records[k] = solid_record(walls.position[k], walls.velocity[k]);
    scene.lost.diffusive += dt * s.mass() * pairs(scene, loops_->density_pairs[kernel(scene)][places]);
    across(scene, walls, loops_->density_across[kernel(scene)][places]);
    if (s.corrects())
      scene.each(fluid.size(), [&](int i) { fluid.correction[i] = moment_correction(s.dimension, numbers_.moment, fluid.shift_sum[i].w); });
    if (s.boundary == Boundary::dynamic) {
      walls.rate.assign(walls.rate.size(), 0.0);
      back(scene, walls, loops_->density_across[kernel(scene)][0]);
    }
  }

  /// From their rates, after a step of dt (s); and the shifts of the fluid.
  void densities(Scene& scene, double dt) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    Solids& walls = scene.solids[0];
    if (s.boundary == Boundary::dynamic)
      for (int k = 0; k < walls.size(); ++k) walls.density[k] = boundary_density(s, walls.density[k], walls.rate[k], dt);
    scene.each(fluid.size(), [&](int i) {
      double& rate = fluid.rate[i];
      if (s.corrects()) rate *= corrected(scene, i);
      if (scene.sums_places()) rate += fluid.diffused[i];
      fluid.density[i] = fluid_density(s, numbers_, fluid.density[i], rate, dt);
      fluid.pressure[i] = s.state.pressure(fluid.density[i]);
      if (scene.shifts()) {
        const Quad& q = fluid.shift_sum[i];
        fluid.shift[i] = shift(s.shifting, s.dimension, s.h(), s.spacing, dt, fluid.velocity[i], {q.x, q.y, q.z}, q.w);
      }
    });
  }

  /// Shepard's filter of the fluid's densities. The compression energy that it takes counts as lost by diffusion.
  void filter(Scene& scene) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    scene.each(fluid.with_images(), [&](int i) {
      fluid.records[i] = force_record(fluid.position[i], fluid.velocity[i], fluid.density[i], 0.0);
      fluid.sum[i] = {};
    });
    pairs(scene, loops_->shepard_pairs[kernel(scene)]);
    const double own = with_kernel(s, [](const auto& kernel) { return kernel.value(0.0); });
    double taken = 0.0;
    for (int i = 0; i < fluid.size(); ++i) {
      const ShepardTerms<double> self = shepard_terms(own, fluid.density[i]);
      const double rho = shepard_density(fluid.sum[i].x + self.weight, fluid.sum[i].y + self.volume);
      taken += s.state.energy(fluid.density[i]) - s.state.energy(rho);
      fluid.density[i] = rho;
      fluid.pressure[i] = s.state.pressure(rho);
    }
    scene.lost.diffusive += s.mass() * taken;
  }

  /// XSPH: adds to the shifts. Records are those of the forces.
  void smooth_drift(Scene& scene, double dt) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    scene.each(fluid.with_images(), [&](int i) { fluid.shift_sum[i] = {}; });
    pairs(scene, loops_->xsph_pairs[kernel(scene)]);
    const double factor = dt * s.xsph.epsilon * s.mass();
    scene.each(fluid.size(), [&](int i) {
      const Quad& q = fluid.shift_sum[i];
      const Vector drift = factor * Vector{q.x, q.y, q.z};
      fluid.shift[i] = scene.shifts() ? fluid.shift[i] + drift : drift;
    });
  }

  /// Pressures and velocities that the fluid meets at solid particles; clears sums.
  void walls(Scene& scene) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    Solids& set = scene.solids[0];
    const bool extrapolated = s.boundary == Boundary::extrapolated;
    scene.each(fluid.with_images(), [&](int i) {
      fluid.records[i] = force_record(fluid.position[i], fluid.velocity[i], fluid.density[i], fluid.pressure[i]);
      fluid.sum[i] = {};
    });
    set.sum.assign(set.sum.size(), Quad{});
    if (extrapolated) {
      for (int k = 0; k < set.size(); ++k) set.records[k] = solid_record(set.position[k], {});
      back(scene, set, loops_->wall_sums[kernel(scene)]);
    }
    for (int k = 0; k < set.size(); ++k) {
      set.met[k] = set.velocity[k];
      if (!extrapolated) {
        set.pressure[k] = s.state.pressure(set.density[k]);
        continue;
      }
      const Quad& q = set.sum[k];
      const WallSums sums{q.w, set.rate[k], {q.x, q.y, q.z}, set.velocity_sum[k]};
      const Body& b = scene.bodies[set.body[k]];
      set.pressure[k] = wall_pressure(sums, s.gravity - b.acceleration_at(set.position[k] - b.position), s.state.tension);
      set.met[k] = wall_velocity(sums, set.velocity[k]);
      set.sum[k] = {};
    }
  }

  /// Of pressure and viscosity, and losses over dt.
  void forces(Scene& scene, double dt) {
    const Settings& s = scene.settings;
    Solids& set = scene.solids[0];
    for (int k = 0; k < set.with_images(); ++k) {
      const double rho = s.boundary == Boundary::extrapolated ? wall_density(s.state, set.pressure[k]) : set.density[k];
      set.records[k] = force_record(set.position[k], set.met[k], rho, set.pressure[k]);
    }
    // Solid particles have the moment of the lattice.
    FluidParticles& fluid = scene.fluid;
    if (s.corrects()) scene.each(fluid.with_images(), [&](int i) { fluid.records[i].a *= corrected(scene, i); });
    const int slip = s.no_slip ? 0 : 1;
    scene.lost.viscous += dt * s.mass() * pairs(scene, loops_->force_pairs[kernel(scene)]);
    across(scene, set, loops_->force_across[kernel(scene)][slip]);
    scene.lost.boundary += dt * s.mass() * back(scene, set, loops_->force_across[kernel(scene)][slip]);
  }

  /// Of the contact potential, and its energy (J).
  void repel(Scene& scene) {
    with_kernel(scene.settings, [&](const auto& kernel) { repel(scene, kernel); });
  }
  template <class Kernel>
  void repel(Scene& scene, const Kernel& kernel) {
    const Settings& s = scene.settings;
    FluidParticles& fluid = scene.fluid;
    Solids& set = scene.solids[1];
    const double mass = s.mass(), solid = mass / s.state.density;
    parts_.assign(set.of_fluid.size(), 0.0);
    parallel_for(int(set.of_fluid.size()), s.threads, [&](int b) {
      set.of_fluid[b].each(set.with_images(), [&](int i, int j) {
        const Vector d = fluid.position[i] - set.position[j];
        const double r = norm(d), volumes = solid * mass / fluid.density[i];
        const Vector a = (contact_factor(s.contact, kernel, r, volumes, numbers_.at_spacing) / mass) * d;
        fluid.sum[i] = {fluid.sum[i].x + a.x, fluid.sum[i].y + a.y, fluid.sum[i].z + a.z, 0.0};
        parts_[b] += contact_energy(s.contact, kernel, r, volumes, numbers_.at_spacing);
      });
    });
    set.sum.assign(set.sum.size(), Quad{});
    parallel_for(int(set.near_fluid.size()), s.threads, [&](int b) {
      set.near_fluid[b].each(fluid.with_images(), [&](int j, int i) {
        const Vector d = fluid.position[i] - set.position[j];
        const double volumes = solid * mass / fluid.density[i];
        const Vector a = (contact_factor(s.contact, kernel, norm(d), volumes, numbers_.at_spacing) / mass) * d;
        set.sum[j] = {set.sum[j].x - a.x, set.sum[j].y - a.y, set.sum[j].z - a.z, 0.0};
      });
    });
    scene.lost.contact = added();
  }

  static void push_bodies(Scene& scene) {
    const double mass = scene.settings.mass();
    for (Body& b : scene.bodies) b.force = b.torque = {};
    for (const Solids& set : scene.solids)
      for (int k = 0; k < set.size(); ++k) {
        Body& b = scene.bodies[set.body[k]];
        const Vector force = mass * Vector{set.sum[k].x, set.sum[k].y, set.sum[k].z};
        b.force += force;
        b.torque += cross(set.position[k] - b.position, force);
      }
  }

  LoopArguments arguments(Scene& scene, const Rows& rows) const {
    LoopArguments in;
    in.start = rows.start.data();
    in.neighbour = rows.neighbour.data();
    in.begin = rows.begin;
    in.end = rows.end;
    in.dimension = scene.settings.dimension;
    in.h = scene.settings.h();
    in.pair = numbers_.pair;
    in.volume = scene.settings.mass() / scene.settings.state.density;
    in.own = in.others = scene.fluid.records.data();
    in.rate = scene.fluid.rate.data();
    in.diffused = scene.fluid.diffused.data();
    in.shift = scene.fluid.shift_sum.data();
    in.sum = scene.fluid.sum.data();
    return in;
  }
  double added() const {
    double sum = 0.0;
    for (const double part : parts_) sum += part;
    return sum;
  }

  /// Fluid and fluid: even slabs, then odd ones. Another process has the other half of what pairs at the border lose.
  double pairs(Scene& scene, Loops::Loop loop) {
    const std::vector<Rows>& slabs = scene.fluid.pairs;
    const int count = int(slabs.size());
    parts_.assign(slabs.size(), 0.0);
    for (int odd = 0; odd < 2; ++odd)
      parallel_for((count + 1 - odd) / 2, scene.settings.threads,
                   [&](int k) { parts_[2 * k + odd] = loop(arguments(scene, slabs[2 * k + odd])); });
    return added() + 0.5 * loop(arguments(scene, scene.fluid.border));
  }
  /// What solid particles do to the fluid.
  void across(Scene& scene, const Solids& set, Loops::Loop loop) {
    parallel_for(int(set.of_fluid.size()), scene.settings.threads, [&](int k) {
      LoopArguments in = arguments(scene, set.of_fluid[k]);
      in.others = set.records.data();
      loop(in);
    });
  }
  /// What the fluid does to solid particles.
  double back(Scene& scene, Solids& set, Loops::Loop loop) {
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
    return added();
  }

  const Loops* loops_;
  LoopNumbers numbers_;
  std::vector<double> parts_;
};

}  // namespace dembark::sph
