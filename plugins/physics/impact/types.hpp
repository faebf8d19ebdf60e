// Impacts of logs by a linear complementarity problem: what goes in and what comes out.
//
// A body (a log, in cross-section a disc, in space a capsule) has its mass at the centre and a massless boundary on a spring of stiffness
// s (N/m). In a contact the gap between the boundaries and the normal force obey D >= 0, N >= 0, D N = 0; every time step solves all
// contacts together. The scheme is in system.hpp. The model is that of G. N. Kolesnikov (2013), in the form of leapfrog.
//
// Units SI. Normals point from b (or the wall) to a: the direction of the force on a.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "../archive.hpp"
#include "../energy_lcp.hpp"
#include "../finnie_rabinowicz.hpp"
#include "../vec3.hpp"

namespace dembark {
namespace impact {

/// A body at the moment the engine computes forces: positions at step n, velocities at step n - 1/2, the forces of everything else.
struct Body {
  std::int64_t id = 0;      ///< >= 0, unique
  double mass = 1.0;        ///< kg, > 0; +inf = held fast or moved by the engine
  double inertia = 1.0;     ///< kg m^2 about the axis of the spin, > 0; +inf = does not turn. Log: m r^2 / 2
  double radius = 1.0;      ///< m, >= 0
  int material = 0;         ///< index into Settings::materials
  Vec3<double> position{};  ///< m
  Vec3<double> velocity{};  ///< m/s
  Vec3<double> spin{};      ///< rad/s
  Vec3<double> force{};     ///< N, everything but these contacts (weight, ...)
  Vec3<double> torque{};    ///< N m
  // Of a capsule (capsules.hpp). The inertia above is that across the axis then.
  Vec3<double> half_axis{};    ///< m, from the centre to that of a cap; zero: a disc or a ball
  double axial_inertia = 0.0;  ///< kg m^2, about the axis, > 0; +inf = does not turn about it

  /// Of a disc or a ball; what a capsule has more is in Capsule.
  auto fields() { return std::tie(id, mass, inertia, radius, material, position, velocity, spin, force, torque); }
};

/// Inertia (kg m^2) of a solid cylinder about its axis, m r^2 / 2.
inline double cylinder_inertia(double mass, double radius) { return 0.5 * mass * radius * radius; }
/// Inertia (kg m^2) of a solid sphere, 2 m r^2 / 5.
inline double sphere_inertia(double mass, double radius) { return 0.4 * mass * radius * radius; }

/// Whether the body is a capsule.
inline bool has_length(const Body& b) { return b.half_axis.x != 0.0 || b.half_axis.y != 0.0 || b.half_axis.z != 0.0; }

/// What all walls have in common. The wall has infinite mass and a local stiffness of its own.
struct Wall {
  std::int64_t id = -1;                                        ///< < 0, unique, stable: wall_key(number)
  int material = 0;                                            ///< index into Settings::materials: friction and damping with the bodies
  double stiffness = std::numeric_limits<double>::infinity();  ///< s_w, N/m, > 0; +inf = rigid
};

/// The key of feature `feature` (triangle, ...) of wall `number` (both >= 0, below 2^20 and 2^32): always < 0, and exact as a double.
/// Contacts of one body with features of the same wall hand their history on to one another.
inline std::int64_t wall_key(std::int64_t number, std::int64_t feature = 0) { return -1 - (number * (std::int64_t(1) << 32) + feature); }
/// The number of the wall that a key belongs to.
inline std::int64_t wall_number(std::int64_t key) { return (-1 - key) / (std::int64_t(1) << 32); }
/// That of the feature.
inline std::int64_t wall_feature(std::int64_t key) { return (-1 - key) % (std::int64_t(1) << 32); }
/// The key of body `id` (below 2^52) as the second one of a contact that is number `point` (0 or 1) of those of the pair.
inline std::int64_t body_key(std::int64_t id, std::int64_t point) { return id + point * (std::int64_t(1) << 52); }
/// What users see of a key: the id of a body, or -1, -2, ... for the first, second, ... wall.
inline std::int64_t shown_id(std::int64_t key) { return key < 0 ? -1 - wall_number(key) : key % (std::int64_t(1) << 52); }

/// A candidate: a pair that touches or may touch within the step. Geometry is that of step n.
struct Contact {
  int a = 0;                      ///< index into the bodies
  int b = -1;                     ///< index into the bodies, or -1: a wall
  std::int64_t key_a = 0;         ///< id of body a
  std::int64_t key_b = -1;        ///< key of body b, or the wall's (< 0); contacts keep their history by these two
  double gap = 0.0;               ///< m, < 0 = overlap of the undeformed bodies
  Vec3<double> normal{};          ///< unit, from b (or the wall) to a
  Vec3<double> point_velocity{};  ///< m/s, walls: velocity of their surface at the contact
  int wall_material = 0;          ///< walls: index into Settings::materials
  double wall_stiffness = std::numeric_limits<double>::infinity();  ///< walls: s_w, N/m
  // Of contacts that act off the centre of a body, as those of capsules do.
  bool lever = false;                   ///< what follows counts
  bool concave = false;                 ///< the wall bends towards the body: the inside of a drum
  double share = 1.0;                   ///< of the stiffness and damping of the contact of two bodies, in (0, 1]
  Vec3<double> offset_a{}, offset_b{};  ///< m, from the centres of the bodies to those of the circles that touch
};

/// A gap is a candidate if this factor times the free motion of a step would close it: forces of other contacts close gaps, too.
constexpr double reach_factor = 2.0;

/// By how much the square of a unit normal may differ from 1.
constexpr double unit_tolerance = 1e-6;

struct Material {
  double stiffness = 1e7;  ///< s, N/m, > 0, of one body at its boundary (a wall brings its own with each contact)
  double damping = 0.0;    ///< lambda, N s/m, >= 0: body damping, on the absolute velocity while the body is in contact

  auto fields() { return std::tie(stiffness, damping); }
};

/// Of a pair of materials. The default is without friction.
struct ImpactPairLaw {
  FinnieRabinowicz friction = frictionless();
  double tangential_stiffness_ratio = 2.0 / 7.0;  ///< tangential stiffness over the normal stiffness of the contact, > 0
  double contact_damping = 0.0;  ///< c, N s/m, >= 0, on the deformation of the contact: Galilean invariant; times the ratio along it
  double contact_area = 0.0;     ///< m^2, for the shear strength of the interface; 0 = pi R* N / s, the circle of R*, N and s

  static FinnieRabinowicz frictionless() {
    FinnieRabinowicz law;
    law.static_friction = law.kinetic_friction = 0.0;
    return law;
  }
  auto fields() {
    FinnieRabinowicz& f = friction;
    return std::tie(f.static_friction, f.kinetic_friction, f.critical_slip_distance, f.interface_shear_strength, f.healing_time,
                    f.presliding, tangential_stiffness_ratio, contact_damping, contact_area);
  }
};

struct Settings {
  double dt = 1e-5;         ///< tau, s, > 0
  double theta = 1.0;       ///< 1/2 ... 1; 1 = the published scheme, 1/2 = without its numerical loss
  int friction_sweeps = 2;  ///< >= 1: friction and normal forces are computed in turn so many times a step
  LcpOptions lcp{};
  std::vector<Material> materials = std::vector<Material>(1);
  std::vector<ImpactPairLaw> pairs = std::vector<ImpactPairLaw>(1);  ///< n x n, row by row, symmetric, n = number of materials

  /// Appends a material with the same law against all others and itself; a wall is a material of its own.
  void add(const Material& material, const ImpactPairLaw& law) {
    const std::size_t n = materials.size();
    std::vector<ImpactPairLaw> wider((n + 1) * (n + 1), law);
    for (std::size_t i = 0; i < n; ++i) std::copy_n(pairs.begin() + std::ptrdiff_t(i * n), n, wider.begin() + std::ptrdiff_t(i * (n + 1)));
    pairs.swap(wider);
    materials.push_back(material);
  }
  auto fields() { return std::tie(dt, theta, friction_sweeps, lcp.method, lcp.tolerance, materials, pairs); }
};

/// What contacts do to a body.
struct ContactWrench {
  Vec3<double> force{}, torque{};  ///< N, N m

  auto fields() { return std::tie(force, torque); }
};

/// Of the last step, and totals since the system began (marked).
struct StepReport {
  int contacts = 0;                ///< candidates
  int active = 0;                  ///< contacts with N > 0
  std::int64_t impacts_begun = 0;  ///< total
  double peak_force = 0.0;         ///< N, largest N of the step
  double impulse_sum = 0.0;        ///< total, N s: sum of N tau over contacts and steps
  double dissipated_energy = 0.0;  ///< total, J: friction, both dampings and the loss of the scheme
  double elastic_energy = 0.0;     ///< J, in the springs now, normal and tangential
  int pivots = 0;                  ///< of all solves of the step; of relaxed ones the contacts that changed sides
  int block_steps = 0;             ///< likewise
  std::int64_t pivots_total = 0;   ///< total
  double certificate = 0.0;        ///< worst entry of the solver's certificate in the step, scaled
  double worst_certificate = 0.0;  ///< total
  double peak_force_so_far = 0.0;  ///< N, total

  /// In the order of every output.
  auto fields() {
    return std::tie(contacts, active, impacts_begun, peak_force, impulse_sum, dissipated_energy, elastic_energy, pivots, block_steps,
                    pivots_total, certificate, worst_certificate, peak_force_so_far);
  }

  /// At the beginning of a step: the totals.
  StepReport totals() const {
    StepReport t = *this;
    t.contacts = t.active = t.pivots = t.block_steps = 0;
    t.peak_force = t.elastic_energy = t.certificate = 0.0;
    return t;
  }
};

/// One contact of the last step, for output.
struct ContactResult {
  int a = -1, b = -1;                  ///< as in Contact; not known of a restored step
  std::int64_t key_a = 0, key_b = -1;  ///< key_a < key_b for pairs
  Vec3<double> normal{};
  double gap = 0.0;           ///< m, at step n, of the undeformed bodies
  double normal_force = 0.0;  ///< N, on a along the normal
  Vec3<double> tangential{};  ///< N, on a
  Vec3<double> point{};       ///< m
  double deformed_gap = 0.0;  ///< D, m, between the deformed boundaries

  auto fields() { return std::tie(key_a, key_b, normal, gap, normal_force, tangential, point, deformed_gap); }
};

/// One impact: a contact from the first step with N > 0 to the last.
struct Impact {
  std::int64_t a = 0, b = -1;   ///< ids; b < 0: wall
  double time = 0.0;            ///< s, of its first step
  double duration = 0.0;        ///< s, steps times tau
  double peak_force = 0.0;      ///< N
  double impulse = 0.0;         ///< N s, sum of N tau
  double relative_speed = 0.0;  ///< m/s, approach along the normal at the beginning, positive = closing
  double dissipated = 0.0;      ///< J, in this contact
  Vec3<double> point{};         ///< m, of contact at the beginning
  double friction_loss = 0.0;   ///< J, of `dissipated`: by sliding and by the dash-pot along the contact
  Vec3<double> normal{};        ///< from b to a, at the beginning
  double turn_a = 0.0;          ///< rad, that a has turned by since the first step, at the beginning; see Turns
  double turn_b = 0.0;          ///< likewise, of b; 0: wall

  auto fields() {
    return std::tie(a, b, time, duration, peak_force, impulse, relative_speed, dissipated, point, friction_loss, normal, turn_a, turn_b);
  }
};

/// The row of a contact or an impact in a table: its fields in their order, with the second key as users see it.
template <class Record>
std::vector<double> table_row(const Record& record) {
  std::vector<double> row = to_numbers(record);
  row[1] = double(shown_id(std::int64_t(row[1])));
  return row;
}

/// The one clear line about what is wrong with the settings, or an empty string.
inline std::string settings_error(const Settings& s) {
  std::string error;
  const auto must = [&error](bool right, const std::string& what, auto value) {
    if (!right && error.empty()) error = what + ", not " + std::to_string(value);
  };
  must(s.dt > 0.0 && std::isfinite(s.dt), "time step must be > 0 s and finite", s.dt);
  must(s.theta >= 0.5 && s.theta <= 1.0, "theta must lie between 0.5 and 1", s.theta);
  must(s.friction_sweeps >= 1, "friction sweeps must be >= 1", s.friction_sweeps);
  must(s.lcp.tolerance > 0.0 && s.lcp.tolerance < 1.0, "tolerance must lie between 0 and 1", s.lcp.tolerance);
  const std::size_t n = s.materials.size();
  if (error.empty() && n == 0) return "at least one material is needed";
  must(s.pairs.size() == n * n, std::to_string(n) + " materials need " + std::to_string(n * n) + " pair laws", s.pairs.size());
  for (std::size_t i = 0; error.empty() && i < n; ++i) {
    const Material& m = s.materials[i];
    const std::string which = "material " + std::to_string(i) + ": ";
    must(m.stiffness > 0.0 && std::isfinite(m.stiffness), which + "stiffness must be > 0 N/m and finite", m.stiffness);
    must(m.damping >= 0.0 && std::isfinite(m.damping), which + "damping must be >= 0 N s/m and finite", m.damping);
  }
  for (std::size_t k = 0; error.empty() && k < n * n; ++k) {
    const ImpactPairLaw& p = s.pairs[k];
    const double ratio = p.tangential_stiffness_ratio;
    const std::string which = "materials " + std::to_string(k / n) + " and " + std::to_string(k % n) + ": ";
    if (p.friction.error()) return which + p.friction.error();
    if (p.friction.presliding == Presliding::partial_slip) return which + "partial slip is that of spheres, logs have none";
    if (p.friction.friction_limit != FrictionLimit::total) return which + "friction of logs is limited by the total normal force";
    must(ratio > 0.0 && std::isfinite(ratio), which + "tangential stiffness ratio must be > 0", ratio);
    must(p.contact_damping >= 0.0 && std::isfinite(p.contact_damping), which + "contact damping must be >= 0 N s/m and finite",
         p.contact_damping);
    must(p.contact_area >= 0.0, which + "contact area must be >= 0 m^2", p.contact_area);
    if (error.empty() && to_numbers(p) != to_numbers(s.pairs[k % n * n + k / n]))
      return which + "the pair laws must be the same in both orders";
  }
  return error;
}

}  // namespace impact
}  // namespace dembark
