// The words of `fix ID group lcp/impact ...`, read into numbers: the same in all engines that have this command.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../keyword_reader.hpp"
#include "geometry.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

struct Command {
  Settings settings;                ///< a material for each atom type, then one for each wall; without the time step
  ContactGeometry around;           ///< the walls, numbered in the order in which the words name them
  std::vector<std::string> walls;   ///< their names, for messages and the file of impacts
  std::vector<std::string> meshes;  ///< what the engine calls the meshes in `around`
  std::size_t types = 0;
  bool solid_cylinder = true;  ///< moment of inertia m r^2 / 2, else 2/5 m r^2
  std::string impacts_file;    ///< empty: none
  // Of logs with a length; without both there are none.
  std::vector<double> lengths;  ///< m, of logs of each type that are not in the list
  Vec3<double> axis{};          ///< their direction at the start
  std::string logs_file;        ///< list of logs with lengths and directions of their own (log_list.hpp)

  bool has_lengths() const { return !lengths.empty() || !logs_file.empty(); }
  /// kg m^2, of logs without a length
  double inertia(double mass, double radius) const {
    return solid_cylinder ? cylinder_inertia(mass, radius) : sphere_inertia(mass, radius);
  }
  /// An engine that turns bodies with an inertia of `own` m r^2 does with a torque times this number what the torque does to such a log.
  double torque_scale(double own) const { return inertia(1.0, 1.0) / own; }
};

namespace detail {

using keywords::refuse;
using keywords::text;

/// Everything that one command says; pair laws come together when all words are read.
class CommandReader : keywords::Reader {
 public:
  CommandReader(const std::vector<std::string>& words, int types, const char* mesh) : Reader(words), types_(types), mesh_(mesh) {}

  Command read() {
    while (left()) keyword(word("lcp/impact", "a keyword"));
    if (stiffness_.empty()) refuse("stiffness is missing: one value (N/m) for each atom type");
    check_lengths();
    damping_.resize(stiffness_.size());
    Settings& s = command_.settings;
    s.materials.clear();
    s.pairs.clear();
    for (std::size_t i = 0; i < stiffness_.size(); ++i) s.add({stiffness_[i], damping_[i]}, law(friction_));
    for (const auto& [stiffness, friction] : wall_laws_) s.add({stiffness, 0.0}, law(friction.value_or(friction_)));
    command_.types = stiffness_.size();
    return std::move(command_);
  }

 private:
  using Friction = FinnieRabinowicz;
  static constexpr double Vec3<double>::* axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};

  void keyword(const std::string& of) {
    Settings& settings = command_.settings;
    if (of == "stiffness") stiffness_ = per_type(of, "N/m", false);
    else if (of == "damping") damping_ = per_type(of, "N s/m", true);
    else if (of == "contact_damping") law_.contact_damping = at_least(0.0, of, "the value (N s/m)");
    else if (of == "theta") {
      settings.theta = number(of, "the value");
      if (!(settings.theta >= 0.5 && settings.theta <= 1.0)) refuse("theta: the value lies in 0.5...1, not " + text(settings.theta));
    } else if (of == "friction") friction_ = friction(of);
    else if (of == "shear_strength") {
      strength_ = positive(of, "the strength (Pa)");
      if (next_is_number()) law_.contact_area = positive(of, "the contact area (m^2)");
    } else if (of == "tangential_ratio") law_.tangential_stiffness_ratio = positive(of, "the value");
    else if (of == "wall") wall();
    else if (of == "inertia") {
      command_.solid_cylinder = choice(of, "the shape", {"cylinder", "sphere"}) == 0;
      inertia_given_ = true;
    } else if (of == "length") command_.lengths = per_type(of, "m", true);
    else if (of == "axis") {
      for (double* const part : {&command_.axis.x, &command_.axis.y, &command_.axis.z}) *part = number(of, "the direction X Y Z");
      if (norm(command_.axis) == 0.0) refuse("axis: the direction must not be zero");
    } else if (of == "logs") command_.logs_file = word(of, "the name of the file");
    else if (of == "impacts") command_.impacts_file = word(of, "the name of the file");
    else if (of == "method") {
      const std::vector<std::string> methods(std::begin(lcp_method_names), std::end(lcp_method_names));
      settings.lcp.method = lcp_method(methods[std::size_t(choice(of, "the solver", methods))]);
    } else if (of == "sweeps") {
      const double value = at_least(1.0, of, "the number");
      if (value != std::floor(value) || value > 100.0) refuse("sweeps: a whole number from 1 to 100, not " + text(value));
      settings.friction_sweeps = int(value);
    } else
      refuse("'" + of +
             "' is no keyword; there is stiffness, damping, contact_damping, theta, friction, shear_strength, tangential_ratio, wall, "
             "inertia, length, axis, logs, impacts, method, sweeps");
  }

  void check_lengths() {
    const bool directed = norm(command_.axis) > 0.0;
    if (!command_.lengths.empty() && !directed) refuse("length: axis is missing, the direction X Y Z of the logs at the start");
    if (directed && command_.lengths.empty()) refuse("axis: length is missing, one value (m) for each atom type");
    if (!command_.has_lengths()) return;
    if (inertia_given_) refuse("inertia is that of logs in cross-section; with length or logs it follows from the shape of the logs");
    if (!command_.meshes.empty())
      refuse("wall " + command_.walls[std::size_t(wall_number(command_.around.meshes[0].id))] +
             ": a mesh is for logs in cross-section; with length or logs use planes and cylinders");
    command_.solid_cylinder = false;  // what the engine turns with
  }

  ImpactPairLaw law(const Friction& friction) const {
    ImpactPairLaw law = law_;
    law.friction = friction;
    law.friction.interface_shear_strength = strength_;
    return law;
  }

  std::vector<double> per_type(const std::string& of, const std::string& unit, bool may_be_zero) {
    std::vector<double> values;
    while (next_is_number()) {
      const std::string what = "the value (" + unit + ") of type " + std::to_string(values.size() + 1);
      values.push_back(may_be_zero ? at_least(0.0, of, what) : positive(of, what));
    }
    if (int(values.size()) != types_)
      refuse(of + ": one value (" + unit + ") for each of the " + std::to_string(types_) + " atom types, not " +
             std::to_string(values.size()));
    return values;
  }

  Friction friction(const std::string& of) {
    Friction f = no_friction();
    f.static_friction = f.kinetic_friction = at_least(0.0, of, "the friction coefficient");
    if (!next_is_number()) return f;
    f.kinetic_friction = at_least(0.0, of, "the kinetic friction coefficient");
    f.critical_slip_distance = at_least(0.0, of, "the critical slip distance (m), after the static and the kinetic coefficient,");
    if (f.kinetic_friction > f.static_friction)
      refuse(of + ": kinetic friction " + text(f.kinetic_friction) + " must not exceed static friction " + text(f.static_friction));
    return f;
  }
  static Friction no_friction() {
    Friction f = ImpactPairLaw::frictionless();
    f.critical_slip_distance = 0.0;
    return f;
  }

  int axis(const std::string& of) { return choice(of, "the axis", {"x", "y", "z"}); }

  /// The two coordinates across axis k, in the order x, y, z.
  void across(const std::string& of, int k, Vec3<double>& point) {
    point.*axes[k == 0 ? 1 : 0] = number(of, "the first coordinate (m) of the axis");
    point.*axes[k == 2 ? 1 : 2] = number(of, "the second coordinate (m) of the axis");
  }

  /// About the coordinate axis that the plane is normal to; right-handed about it on both sides.
  void turn(const std::string& of, double omega, Plane& plane) {
    int k = 0;
    while (plane.normal.*axes[k] == 0.0) ++k;
    across(of + ": omega", k, plane.point);
    plane.omega = omega * plane.normal.*axes[k];
  }

  void wall() {
    std::vector<std::string> shapes = {"plane", "cylinder"};
    if (mesh_) shapes.emplace_back("mesh");
    const int shape = choice("wall", "the shape", shapes);
    const std::string name = word("wall", "the name"), of = "wall " + name;
    std::vector<std::string>& walls = command_.walls;
    if (std::find(walls.begin(), walls.end(), name) != walls.end())
      refuse(of + ": there is a wall of this name already; give each wall its own");
    ContactGeometry& around = command_.around;
    Wall* wall = nullptr;
    if (shape == 0) {
      Plane& plane = around.planes.emplace_back();
      const int k = axis(of);
      plane.point.*axes[k] = number(of, "the position (m) along the axis");
      plane.normal = {};
      plane.normal.*axes[k] = choice(of, "the side", {"lo", "hi"}) == 0 ? 1.0 : -1.0;
      wall = &plane;
    } else if (shape == 1) {
      Drum& drum = around.drums.emplace_back();
      const int k = axis(of);
      drum.axis = {};
      drum.axis.*axes[k] = 1.0;
      across(of, k, drum.point);
      drum.radius = positive(of, "the radius (m)");
      wall = &drum;
    } else {
      command_.meshes.push_back(word(of, mesh_));
      wall = &around.meshes.emplace_back();
    }
    wall->id = wall_key(std::int64_t(walls.size()));
    wall->material = types_ + int(walls.size());
    wall->stiffness = 0.0;
    std::optional<Friction> own;
    for (; next_is("stiffness") || next_is("friction") || next_is("omega");) {
      const std::string key = word(of, "a keyword");
      if (key == "stiffness") {
        if (wall->stiffness > 0.0) refuse(of + ": stiffness stands twice; the keywords of the fix itself come before the first wall");
        wall->stiffness = positive(of, "stiffness (N/m)");
      } else if (key == "friction") {
        own = friction(of + ": friction");
      } else {
        if (shape == 2) refuse(of + ": omega is for cylinders and planes");
        const double omega = number(of, "omega (rad/s)");
        if (shape == 1) around.drums.back().omega = omega;
        else turn(of, omega, around.planes.back());
      }
    }
    if (!(wall->stiffness > 0.0)) refuse(of + ": stiffness (N/m) is missing");
    wall_laws_.emplace_back(wall->stiffness, own);
    walls.push_back(name);
  }

  const int types_;
  const char* const mesh_;  ///< what names a mesh; nullptr: the engine has none
  Command command_;
  std::vector<double> stiffness_, damping_;
  ImpactPairLaw law_;  ///< but for its friction
  Friction friction_ = no_friction();
  double strength_ = unlimited_strength;  ///< Pa
  bool inertia_given_ = false;
  std::vector<std::pair<double, std::optional<Friction>>> wall_laws_;  ///< stiffness, N/m, and friction; none: that of the fix
};

}  // namespace detail

/// Reads the words after the style. mesh: what the word after the name of a wall that is a mesh is, for messages; nullptr where there are
/// none. Throws std::invalid_argument with one line: what, where, what would be right.
inline Command read_command(const std::vector<std::string>& words, int atom_types, const char* mesh = nullptr) {
  return detail::CommandReader(words, atom_types, mesh).read();
}

}  // namespace impact
}  // namespace dembark
