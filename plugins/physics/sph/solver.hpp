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
#include "neighbours.hpp"
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
    passes_.pressures(scene_);
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
    const std::string wrong = scene_.settings.step_error(dt);
    if (!wrong.empty()) throw std::invalid_argument(wrong);
    prepare();
    FluidParticles& fluid = scene_.fluid;
    double power = 0.0;
    for (Body& b : scene_.bodies) power += b.first_half(dt);
    scene_.lost.work += 0.5 * dt * power;
    scene_.each(fluid.size(),
                [&](int i) { first_half(fluid.position[i], fluid.velocity[i], (0.5 * dt) * fluid.acceleration[i], fluid.shift[i], dt); });
    check_speed();
    for (Solids& set : scene_.solids) set.follow(scene_.bodies);
    if (neighbours_.outdated(scene_, scene_.settings.skin * scene_.settings.h())) search();
    ++scene_.step;
    compute(dt);
    scene_.each(fluid.size(), [&](int i) { fluid.velocity[i] += (0.5 * dt) * fluid.acceleration[i]; });
    power = 0.0;
    for (Body& b : scene_.bodies) power += b.second_half(dt);
    scene_.lost.work += 0.5 * dt * power;
    time_ += dt;
  }

  double time() const { return time_; }
  long steps() const { return scene_.step; }
  /// How often neighbours were searched.
  long searches() const { return neighbours_.builds(); }
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
    for (int i = 0; i < fluid.size(); ++i) add_energies(s, fluid.position[i], fluid.velocity[i], fluid.density[i], e);
    for (const Body& b : scene_.bodies) e.bodies += b.energy(s.gravity);
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
    passes_.pressures(scene_);
    for (Solids& set : scene_.solids) set.follow(scene_.bodies);
  }

 private:
  static constexpr double version = 2.0;

  static Settings checked(const Settings& settings) {
    if (const char* const wrong = settings.error()) throw std::invalid_argument(wrong);
    return settings;
  }

  void begin() {
    if (begun_) return;
    for (Solids& set : scene_.solids) set.follow(scene_.bodies);
    search();
    compute(0.0);
    begun_ = true;
  }

  std::vector<double> packed() {
    neighbours_.forget();
    std::vector<double> out{version, double(scene_.fluid.size()), double(scene_.bodies.size()), double(scene_.solids[0].size())};
    exchange([&](double& value) { out.push_back(value); });
    return out;
  }

  void check_room() {
    const Crowding found = crowding(scene_);
    const int worst = found.worst();
    judged_ = worst < 0;
    if (judged_) return;
    begun_ = false;
    const Vector& p = scene_.fluid.position[std::size_t(worst)];
    throw std::invalid_argument("the particle of fluid at (" + keywords::text(p.x) + ", " + keywords::text(p.y) + ", " +
                                keywords::text(p.z) + ") m " + found.line(worst));
  }

  void search() {
    const Settings& s = scene_.settings;
    neighbours_.build(scene_, (support + s.skin) * s.h());
  }

  void compute(double dt) {
    passes_.compute(scene_, dt, OneProcess{});
    FluidParticles& fluid = scene_.fluid;
    const Vector& gravity = scene_.settings.gravity;
    scene_.each(fluid.size(), [&](int i) { fluid.acceleration[i] = gravity + Vector{fluid.sum[i].x, fluid.sum[i].y, fluid.sum[i].z}; });
    for (Body& b : scene_.bodies) {
      b.force += b.film;
      b.torque += b.film_torque;
      b.accelerate(gravity);
    }
  }

  /// Speeds beyond that of sound, or that are no numbers.
  void check_speed() const {
    for (int i = 0; i < scene_.fluid.size(); ++i) {
      const Vector& v = scene_.fluid.velocity[i];
      if (slower_than_sound(scene_.settings, v)) continue;
      throw std::runtime_error("the fluid blew up at t = " + std::to_string(time_) + " s: particle " + std::to_string(scene_.fluid.id[i]) +
                               " " + too_fast(scene_.settings, v));
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
    double steps = double(scene_.step);
    value(time_), value(steps);
    scene_.step = long(steps);
  }

  Scene scene_;
  Neighbours neighbours_;
  Passes passes_;
  double time_ = 0.0;
  bool begun_ = false;
  bool judged_ = false;  // whether particles overlap that were given
};

}  // namespace dembark::sph
