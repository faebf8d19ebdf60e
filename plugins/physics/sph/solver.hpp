// A solver for weakly compressible fluid with walls and rigid bodies: the terms of pair_terms.hpp, wall.hpp and state.hpp, steps in time,
// energies, states to go on from.
//
// One step, kick - drift - kick, with every force computed once:
//   v += dt/2 a,  x += dt v,  rho += dt drho/dt(x, v),  p_w from the fluid,  a(x, rho, v),  v += dt/2 a                  (1)
// Density and velocity take turns: sound is integrated as by leapfrog, stable up to omega dt = 2 without growth of energy. Schemes that
// compute all rates at once from extrapolated velocities gain energy at any step and need diffusion to hide it. Bodies move in the same
// steps; the acceleration of a wall particle in its pressure is that of the step before, stable for a body of size L as long as
// 2 (rho_f/rho_s) (dx/L) < 1.
//
// The same state goes the same way, bit for bit, on any number of threads. Units SI.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../keyword_reader.hpp"
#include "crowding.hpp"
#include "passes.hpp"

namespace dembark::sph {

class Solver {
 public:
  /// positions (m) of particles of equal mass, densities (kg/m^3) and velocities (m/s). loops: of an instruction set that the processor
  /// has. Throws std::invalid_argument.
  Solver(const Settings& settings, std::vector<Vector> positions, std::vector<double> densities, std::vector<Vector> velocities,
         const Loops& loops = portable_loops())
      : passes_(checked(settings), loops) {
    const std::size_t n = positions.size();
    if (n == 0) throw std::invalid_argument("positions: there must be one particle of fluid or more");
    if (densities.size() != n || velocities.size() != n) throw std::invalid_argument("densities and velocities: one for each particle");
    scene_.settings = settings;
    FluidParticles& fluid = scene_.fluid;
    fluid.position = std::move(positions);
    fluid.velocity = std::move(velocities);
    fluid.density = std::move(densities);
    fluid.acceleration.assign(n, Vector{});
    fluid.shift.assign(n, Vector{});
    fluid.pressure.resize(n);
    fluid.id.resize(n);
    for (std::size_t i = 0; i < n; ++i) fluid.id[i] = int(i);
    update_pressure();
  }

  /// A wall or body of particles at `points` (m, in its frame); returns its number. Only before the first step.
  int add(const Body& body, const std::vector<Vector>& points) {
    if (begun_) throw std::invalid_argument("walls and bodies must be added before the first step");
    if (body.free && body.driven) throw std::invalid_argument("a body is free or driven, not both");
    if (body.free && !(body.mass > 0.0 && !std::isinf(body.mass))) throw std::invalid_argument("mass of a free body must be > 0 (kg)");
    scene_.bodies.push_back(body);
    Solids& set = scene_.solids[scene_.settings.contact.on() && (body.free || body.driven) ? 1 : 0];
    for (const Vector& p : points) set.add(int(scene_.bodies.size()) - 1, p, scene_.settings.state.density);
    return int(scene_.bodies.size()) - 1;
  }

  /// Says that the particles of a body, in space, are the lattice of a box with these edges (m) around its centre, for films in slits.
  void add_box(int number, const Vector& edges, const std::array<int, 3>& count) {
    const Solids& set = scene_.solids[0];
    const auto first = std::find(set.body.begin(), set.body.end(), number);
    const long due = long(count[0]) * count[1] * count[2];
    if (begun_) throw std::invalid_argument("boxes must be added before the first step");
    if (scene_.settings.dimension != 3) throw std::invalid_argument("boxes with films are for three dimensions");
    if (!(edges.x > 0.0 && edges.y > 0.0 && edges.z > 0.0)) throw std::invalid_argument("edges of a box must be > 0 (m)");
    if (std::count(set.body.begin(), set.body.end(), number) != due || due < 1)
      throw std::invalid_argument("a box must be a body on which the fluid acts by pressure, with as many particles as its lattice");
    scene_.slits.boxes.push_back({number, int(first - set.body.begin()), 0.5 * edges, count});
  }
  /// A floor or side that boxes can stand at: solid where (x - point) . normal < 0.
  void add_plane(const Vector& point, const Vector& normal) {
    if (!(norm(normal) > 0.0)) throw std::invalid_argument("the normal of a plane must not be zero");
    scene_.slits.planes.push_back({point, (1.0 / norm(normal)) * normal});
  }

  /// One step of dt (s). Throws std::invalid_argument for a step that is not stable and as prepare(), std::runtime_error when the fluid
  /// blows up.
  void step(double dt) {
    check_step(dt);
    prepare();
    FluidParticles& fluid = scene_.fluid;
    for (Body& b : scene_.bodies) b.kick(0.5 * dt);
    scene_.lost.work += 0.5 * dt * power();
    for (Body& b : scene_.bodies) b.drift(dt);
    scene_.each([&](int i) {
      fluid.velocity[i] += (0.5 * dt) * fluid.acceleration[i];
      fluid.position[i] += dt * fluid.velocity[i] + fluid.shift[i];
    });
    check_speed();
    for (Solids& set : scene_.solids) set.follow(scene_.bodies);
    if (scene_.neighbours.outdated(fluid, scene_.solids, scene_.settings.skin * scene_.settings.h())) search();
    passes_.density(scene_, dt);
    passes_.forces(scene_, dt);
    scene_.each([&](int i) { fluid.velocity[i] += (0.5 * dt) * fluid.acceleration[i]; });
    scene_.lost.work += 0.5 * dt * power();
    for (Body& b : scene_.bodies) b.kick(0.5 * dt);
    time_ += dt;
    ++steps_;
  }

  double time() const { return time_; }
  long steps() const { return steps_; }
  /// How often neighbours were searched.
  long searches() const { return scene_.neighbours.builds(); }
  /// Fluid, in the order of the cells (`id` has its numbers), walls and bodies.
  const Scene& scene() const { return scene_; }
  /// To change loads, the velocities and accelerations of bodies that are not free, and the places of those that are driven.
  Body& body(int number) { return scene_.bodies.at(std::size_t(number)); }

  /// Forces of the state as it is, if no step has computed them. Throws std::invalid_argument when particles overlap that were given; then
  /// they can be given another place.
  void prepare() {
    begin();
    if (!judged_) check_room();
  }

  Energies energies() const {
    Energies e = scene_.lost;
    const Settings& s = scene_.settings;
    const FluidParticles& fluid = scene_.fluid;
    for (int i = 0; i < fluid.size(); ++i) {
      e.kinetic += 0.5 * s.mass() * dot(fluid.velocity[i], fluid.velocity[i]);
      e.potential -= s.mass() * dot(s.gravity, fluid.position[i]);
      e.compression += s.mass() * s.state.energy(fluid.density[i]);
    }
    for (const Body& b : scene_.bodies)
      if (b.free) e.bodies += b.kinetic_energy() - b.mass * dot(s.gravity, b.position);
    return e;
  }

  /// Everything needed to go on bit for bit; from here on this solver goes on as one that is given it. Throws as prepare().
  std::vector<double> state() {
    prepare();
    return packed();
  }
  /// Goes on from a state of a solver that was made the same way. Throws std::invalid_argument.
  void restore(const std::vector<double>& numbers) {
    begin();  // without the judgement of what was given, whose place the state takes
    const std::vector<double> due = packed();
    if (numbers.size() != due.size() || !std::equal(due.begin(), due.begin() + 4, numbers.begin()))
      throw std::invalid_argument("state: it is not of this fluid, with as many particles, walls and bodies");
    for (std::size_t i = 0; i < due.size(); ++i)
      if (!std::isfinite(numbers[i])) throw std::invalid_argument("state: number " + std::to_string(i) + " is not finite");
    std::size_t at = 4;
    exchange([&](double& value) { value = numbers[at++]; });
    judged_ = true;
    update_pressure();
    for (Solids& set : scene_.solids) set.follow(scene_.bodies);
  }

 private:
  static constexpr double version = 2.0;

  static Settings checked(const Settings& settings) {
    if (const char* const wrong = settings.error()) throw std::invalid_argument(wrong);
    return settings;
  }

  void check_step(double dt) const {
    const double most = scene_.settings.longest_step();
    if (dt > 0.0 && dt <= most * (1.0 + 1e-9)) return;
    throw std::invalid_argument("the time step must be > 0 and at most 0.6 h/sound_speed = " + std::to_string(1e3 * most) + " ms, not " +
                                std::to_string(1e3 * dt) + " ms");
  }

  void begin() {
    if (begun_) return;
    for (Solids& set : scene_.solids) {
      set.resize();
      set.follow(scene_.bodies);
    }
    search();
    passes_.forces(scene_, 0.0);
    begun_ = true;
  }

  std::vector<double> packed() {
    scene_.neighbours.forget();
    std::vector<double> out{version, double(scene_.fluid.size()), double(scene_.bodies.size()), double(scene_.solids[0].size())};
    exchange([&](double& value) { out.push_back(value); });
    return out;
  }

  void check_room() {
    const std::vector<Vector>& x = scene_.fluid.position;
    const auto fluid = [&](int i) { return x[std::size_t(i)]; };
    Crowding crowding(scene_.settings, x.size());
    for (const Rows& rows : scene_.neighbours.pairs()) crowding.add(rows, int(x.size()), true, fluid, fluid);
    for (const Solids& set : scene_.solids)
      for (const Rows& rows : set.of_fluid)
        crowding.add(rows, set.size(), false, fluid, [&](int k) { return set.position[std::size_t(k)]; });
    const int worst = crowding.worst();
    judged_ = worst < 0;
    if (judged_) return;
    begun_ = false;
    const Vector& p = x[std::size_t(worst)];
    throw std::invalid_argument("the particle of fluid at (" + keywords::text(p.x) + ", " + keywords::text(p.y) + ", " +
                                keywords::text(p.z) + ") m " + crowding.line(worst));
  }

  void search() {
    const Settings& s = scene_.settings;
    scene_.neighbours.build(scene_.fluid, scene_.solids, (support + s.skin) * s.h(), s.threads);
    passes_.resize(scene_);
  }

  void update_pressure() {
    FluidParticles& fluid = scene_.fluid;
    scene_.each([&](int i) { fluid.pressure[i] = scene_.settings.state.pressure(fluid.density[i]); });
  }

  /// Power (W) that moved bodies, loads and films put in.
  double power() const {
    double sum = 0.0;
    for (const Body& b : scene_.bodies) {
      const Vector force = b.film + (b.free ? b.load : -b.force), torque = b.film_torque + (b.free ? b.load_torque : -b.torque);
      sum += dot(force, b.velocity) + dot(torque, b.spin);
    }
    return sum;
  }

  /// Speeds beyond that of sound, or that are no numbers.
  void check_speed() const {
    const double sound = scene_.settings.state.sound_speed;
    for (int i = 0; i < scene_.fluid.size(); ++i) {
      const Vector& v = scene_.fluid.velocity[i];
      if (dot(v, v) <= sound * sound) continue;
      throw std::runtime_error("the fluid blew up at t = " + std::to_string(time_) + " s: particle " + std::to_string(scene_.fluid.id[i]) +
                               " moves at " + std::to_string(norm(v)) + " m/s, faster than sound (" + std::to_string(sound) +
                               " m/s); take a larger sound_speed, a shorter step or thicker walls");
    }
  }

  /// Calls value(number) for all numbers of the state, in their order.
  template <class Value>
  void exchange(const Value& value) {
    const auto vector = [&](Vector& v) { value(v.x), value(v.y), value(v.z); };
    FluidParticles& fluid = scene_.fluid;
    for (int i = 0; i < fluid.size(); ++i) {
      double id = fluid.id[i];
      value(id);
      fluid.id[i] = int(id);
      vector(fluid.position[i]), vector(fluid.velocity[i]), vector(fluid.acceleration[i]), vector(fluid.shift[i]);
      value(fluid.density[i]);
    }
    for (Solids& set : scene_.solids)
      for (double& rho : set.density) value(rho);
    for (Body& b : scene_.bodies) {
      vector(b.position), vector(b.velocity), vector(b.spin), vector(b.force), vector(b.torque), vector(b.load), vector(b.load_torque);
      vector(b.acceleration), vector(b.spin_acceleration), vector(b.film), vector(b.film_torque);
      value(b.orientation.w), value(b.orientation.x), value(b.orientation.y), value(b.orientation.z);
    }
    Energies& e = scene_.lost;
    value(e.viscous), value(e.diffusive), value(e.boundary), value(e.work), value(e.contact);
    double steps = double(steps_);
    value(time_), value(steps);
    steps_ = long(steps);
  }

  Scene scene_;
  Passes passes_;
  double time_ = 0.0;
  long steps_ = 0;
  bool begun_ = false;
  bool judged_ = false;  // whether particles overlap that were given
};

}  // namespace dembark::sph
