// The energies of a run: the works of all parts of all contacts (contact_energy.hpp), of gravity, walls, numerical damping and other
// forces, which balance the kinetic energy to round-off.
//
// A kick of duration h changes a velocity by h a. The work of each part f of the force F = m a in it is that on the mean velocity,
//
//   W = h P + s (h^2 / 2) Q,   P = f . v,   Q = f . a,                                                                              (1)
//
// where v is the velocity at the beginning (s = 1), the mean one (s = 0) or that at the end of the kick (s = -1). Leapfrog makes one kick a
// step, h = dt. Velocity Verlet makes two of dt/2, and P and Q with the velocity between them serve for both.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "contact_energy.hpp"

namespace dembark {

/// How a body moves.
struct BodyMotion {
  SixVector mass{};  ///< 0 where forces do not change the velocity; there the body is a wall to the others
  SixVector velocity{};

  DEMBARK_HOT bool is_free(std::size_t k) const { return mass[k] > 0.0; }
  DEMBARK_HOT bool is_free() const { return is_free(0) && is_free(1) && is_free(2) && is_free(3) && is_free(4) && is_free(5); }
  /// Of one of these, what belongs to the degrees of freedom that forces change, or to the others.
  DEMBARK_HOT SixVector part(SixVector of, bool free) const {
    for (std::size_t k = 0; k < of.size(); ++k)
      if (is_free(k) != free) of[k] = 0.0;
    return of;
  }
  DEMBARK_HOT SixVector accelerated(SixVector by) const {
    for (std::size_t k = 0; k < by.size(); ++k) by[k] = is_free(k) ? by[k] / mass[k] : 0.0;
    return by;
  }
  /// J, of the degrees of freedom that forces change.
  DEMBARK_HOT double kinetic() const { return kinetic(velocity); }
  DEMBARK_HOT double kinetic(const SixVector& v) const {
    return 0.5 * dot({mass[0] * v[0], mass[1] * v[1], mass[2] * v[2], mass[3] * v[3], mass[4] * v[4], mass[5] * v[5]}, v);
  }
};

/// A body and what acts on it in a moment.
struct EnergyBody : BodyMotion {
  SixVector force{};              ///< all of it
  SixVector weight{}, damping{};  ///< what gravity and numerical damping have in that
  SixVector acceleration{};

  /// After the masses.
  DEMBARK_HOT void set_forces(const SixVector& all, const SixVector& of_gravity, const SixVector& of_damping = {}) {
    force = all;
    weight = of_gravity;
    damping = of_damping;
    acceleration = accelerated(all);
  }
  /// Velocity after a kick of duration h.
  DEMBARK_HOT SixVector kicked(double h) const {
    SixVector v = velocity;
    for (std::size_t k = 0; k < v.size(); ++k) v[k] += h * acceleration[k];
    return v;
  }
};

/// P (W) and Q (W/s) of (1), of the parts of contacts' forces in the order of ContactPart, and of what else has a work.
struct Powers {
  static constexpr std::size_t walls = contact_part_count, gravity = walls + 1, damping = walls + 2, all = walls + 3, count = walls + 4;
  typedef std::array<double, count> Each;
  Each power{}, rate{};

  /// Gravity, numerical damping, and all forces together.
  DEMBARK_HOT void add_body(const EnergyBody& body) {
    const SixVector v = body.part(body.velocity, true);
    add(gravity, body.weight, v, body.acceleration);
    add(damping, body.damping, v, body.acceleration);
    add(all, body.force, v, body.acceleration);
  }
  /// The last of these alone.
  DEMBARK_HOT void add_forces(const BodyMotion& body, const SixVector& force) {
    add(all, force, body.part(body.velocity, true), body.accelerated(force));
  }
  /// For engines that add up the parts of contacts' forces body by body. Parts that are not `present` are zero.
  DEMBARK_HOT void add_loads(const EnergyBody& body, const std::array<SixVector, contact_part_count>& loads,
                             const std::array<bool, contact_part_count>& present) {
    const bool is_free = body.is_free();
    for (std::size_t part = 0; part < contact_part_count; ++part) {
      if (!present[part]) continue;
      add(part, loads[part], body.velocity, body.acceleration);
      if (!is_free) add_held(body, loads[part]);
    }
  }
  /// For engines that know the mean motions of the bodies when they look at a contact. Returns the power (W) of the normal spring.
  double add_contact(const ContactParts& parts, const ContactLevers& levers, const BodyMotion& one, const BodyMotion& two) {
    const Vec3<double> velocity = levers.velocity(one.velocity, two.velocity);
    Vec3<double> whole{};
    for (std::size_t part = 0; part < force_part_count; ++part) {
      power[part] += dot(parts.load[part], velocity);
      whole += parts.load[part];
    }
    add_held(one, levers.on_one(whole));
    add_held(two, levers.on_two(whole));
    for (std::size_t part = force_part_count; part < parts.count; ++part) {
      const SixVector on_one = levers.on_one(part, parts.load[part]), on_two = levers.on_two(part, parts.load[part]);
      power[part] += dot(on_one, one.velocity) + dot(on_two, two.velocity);
      add_held(one, on_one);
      add_held(two, on_two);
    }
    return dot(parts[ContactPart::normal_elastic], velocity);
  }
  /// What acts on a body as far as that is held: it gives the others what it takes.
  DEMBARK_HOT void add_held(const BodyMotion& body, const SixVector& load) { power[walls] -= dot(load, body.part(body.velocity, false)); }

 private:
  DEMBARK_HOT void add(std::size_t of, const SixVector& force, const SixVector& velocity, const SixVector& acceleration) {
    power[of] += dot(force, velocity);
    rate[of] += dot(force, acceleration);
  }
};

constexpr std::array<const char*, 21> energy_names{{"kinetic",
                                                    "first_kinetic",
                                                    "gravity",
                                                    "normal_elastic",
                                                    "normal_viscous",
                                                    "tangential_elastic",
                                                    "tangential_viscous",
                                                    "capillary",
                                                    "liquid_viscous",
                                                    "walls",
                                                    "numerical_damping",
                                                    "other",
                                                    "imposed",
                                                    "balance",
                                                    "normal_stored",
                                                    "tangential_stored",
                                                    "step_error",
                                                    "scale",
                                                    "rolling_elastic",
                                                    "rolling_viscous",
                                                    "rolling_stored"}};
typedef std::array<double, energy_names.size()> Energies;  ///< J, in the order of their names

/// The sums of a run, plain numbers: those of several processes add up, and a restart file holds them as they are.
struct EnergyLedger {
  double kinetic = 0.0, first_kinetic = 0.0;
  double imposed = 0.0;  ///< kinetic energy that no force made
  double normal_stored = 0.0, tangential_stored = 0.0, rolling_stored = 0.0;
  double first_stored = 0.0;  ///< of the normal springs at the beginning, and what came and went with bodies
  double spring_ahead = 0.0;  ///< work of the normal springs up to the positions of `normal_stored` that `work` does not hold yet
  Powers::Each work{};
  Powers now;

  /// Adds the works of a kick, `now` being of velocities at its beginning (side 1), in its mean (0) or at its end (-1).
  void kick(double duration, int side) {
    const double square = side * 0.5 * duration * duration, before = work[0];
    for (std::size_t k = 0; k < Powers::count; ++k) work[k] += duration * now.power[k] + square * now.rate[k];
    spring_ahead -= work[0] - before;
  }
  /// What the springs hold at the present positions; `ahead`: work of the normal springs up to these that is not in `work` yet.
  void set_stored(double normal, double tangential, double rolling, double ahead = 0.0) {
    normal_stored = normal;
    tangential_stored = tangential;
    rolling_stored = rolling;
    spring_ahead = ahead;
  }
  /// A body after a kick, with the velocity `after`: its kinetic energy (J). What is not as the forces made it was set by somebody.
  /// The body's own velocity becomes the mean one of the kick.
  DEMBARK_HOT double arrive(EnergyBody& body, double duration, const SixVector& after) {
    constexpr double round_off = 1e-13;
    const SixVector expected = body.kicked(duration);
    SixVector by_forces = after;
    bool set = false;
    for (std::size_t k = 0; k < after.size(); ++k) {
      const double momentum = body.mass[k] * std::abs(body.velocity[k]) + duration * (std::abs(body.force[k]) + std::abs(body.weight[k]));
      if (body.mass[k] * std::abs(after[k] - expected[k]) <= round_off * momentum) continue;
      by_forces[k] = expected[k];
      set = true;
    }
    const double energy = body.kinetic(after);
    if (set) imposed += energy - body.kinetic(by_forces);
    kinetic += energy;
    for (std::size_t k = 0; k < after.size(); ++k) body.velocity[k] = 0.5 * (body.velocity[k] + by_forces[k]);
    return energy;
  }

  Energies energies() const {
    const double gravity = work[Powers::gravity], damping = work[Powers::damping], all = work[Powers::all];
    double contacts = 0.0, sizes = 0.0;
    for (std::size_t k = 0; k <= Powers::walls; ++k) {
      contacts += work[k];
      sizes += std::abs(work[k]);
    }
    const double other = all - gravity - damping - contacts, balance = kinetic - first_kinetic - all - imposed;
    const double step_error = work[0] + spring_ahead + normal_stored - first_stored;
    const double scale = first_kinetic + sizes + std::abs(gravity) + std::abs(damping) + std::abs(other) + std::abs(imposed);
    return {
        kinetic,       first_kinetic, gravity, work[0], work[1],       work[2],           work[3],    work[4], work[5], work[Powers::walls],
        damping,       other,         imposed, balance, normal_stored, tangential_stored, step_error, scale,   work[6], work[7],
        rolling_stored};
  }
};
constexpr std::size_t energy_ledger_size = sizeof(EnergyLedger) / sizeof(double);
static_assert(std::is_trivially_copyable_v<EnergyLedger> && energy_ledger_size * sizeof(double) == sizeof(EnergyLedger), "numbers only");

}  // namespace dembark
