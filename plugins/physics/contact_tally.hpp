// The parts of all contact forces in a step, added up by the body on which they act, for engines that know the mean velocity of a step only
// when all its forces are known (contact_energy.hpp): forces and torques are kept, part by part, from their computation to the end of the
// step. Each process tallies for the bodies that it owns.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "contact_energy.hpp"
#include "energy_ledger.hpp"

namespace dembark {

struct ContactTally {
  std::vector<std::array<SixVector, contact_part_count>> loads;  ///< on each body that this process owns
  std::array<bool, contact_part_count> present{};                ///< the parts that any contact has had; the others are zero
  /// W and W/s, of each part on the bodies, were they moved as the wall is: with its velocity and acceleration of the moment.
  std::array<double, contact_part_count> wall_power{}, wall_rate{};
  double normal_stored = 0.0, tangential_stored = 0.0, rolling_stored = 0.0;  ///< J

  /// Begins anew for the forces of a moment: of this many owned bodies, in a step of `dt` s.
  void clear(int bodies, double dt) {
    half_step_ = 0.5 * dt;
    loads.assign(std::size_t(bodies), {});
    present = {};
    wall_power = wall_rate = {};
    normal_stored = tangential_stored = rolling_stored = 0.0;
  }

  /// A contact of two bodies. Of a pair that two processes compute each tallies half of what is stored.
  void add_pair(const ContactParts& parts, const ContactLevers& levers, int i, int j) {
    const bool owned = std::size_t(j) < loads.size();
    for (std::size_t k = 0; k < parts.count; ++k) {
      const Vec3<double>& load = parts.load[k];
      if (is_zero(load)) continue;
      add_load(k, i, load, levers.one);
      if (owned) add_load(k, j, -load, levers.two);
    }
    store(parts, owned ? 1.0 : 0.5);
  }

  /// How the surface of a wall moves at a contact.
  struct WallMotion {
    Vec3<double> velocity{}, spin{};                      ///< m/s, rad/s: those of the half step before
    Vec3<double> acceleration{}, angular_acceleration{};  ///< m/s^2, rad/s^2
  };
  /// A contact of a body with a wall, of which `scale` acts. The velocity of the moment is half a step of acceleration on.
  void add_wall(const ContactParts& parts, const ContactLevers& levers, int i, const WallMotion& wall, double scale = 1.0) {
    for (std::size_t k = 0; k < parts.count; ++k) {
      const bool is_force = k < force_part_count;
      const Vec3<double> load = scale * parts.load[k], &change = is_force ? wall.acceleration : wall.angular_acceleration;
      if (is_zero(load)) continue;
      add_load(k, i, load, levers.one);
      wall_power[k] += dot(load, (is_force ? wall.velocity : wall.spin) + half_step_ * change);
      wall_rate[k] += dot(load, change);
    }
    store(parts, scale);
  }

  /// Adds P and Q of the walls, and takes them from the parts.
  void add_walls(Powers& all) const {
    for (std::size_t part = 0; part < contact_part_count; ++part) {
      all.power[part] -= wall_power[part];
      all.power[Powers::walls] += wall_power[part];
      all.rate[part] -= wall_rate[part];
      all.rate[Powers::walls] += wall_rate[part];
    }
  }

 private:
  DEMBARK_HOT static bool is_zero(const Vec3<double>& load) { return load.x == 0.0 && load.y == 0.0 && load.z == 0.0; }
  /// Part k, a force at the end of the lever or a couple, on a body that this process owns.
  DEMBARK_HOT void add_load(std::size_t k, int body, const Vec3<double>& load, const Vec3<double>& lever) {
    if (k < force_part_count) add(loads[std::size_t(body)][k], load, cross(lever, load));
    else add(loads[std::size_t(body)][k], {}, load);
    present[k] = true;
  }
  void store(const ContactParts& parts, double scale) {
    normal_stored += scale * parts.normal_stored;
    tangential_stored += scale * parts.tangential_stored;
    rolling_stored += scale * parts.rolling_stored;
  }

  double half_step_ = 0.0;
};

}  // namespace dembark
