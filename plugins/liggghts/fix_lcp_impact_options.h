// The words of `fix ID group lcp/impact …`, read into numbers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dembark/impact/geometry.hpp"
#include "dembark/impact/types.hpp"

namespace dembark_liggghts {

/// A wall of the command, in the order in which the words name it: a plane, a drum, or a fix mesh/surface.
struct ImpactWall {
  std::string name;              ///< of the user; appears in messages and in the file of impacts
  dembark::impact::Wall common;  ///< of a mesh
  std::optional<dembark::impact::Plane> plane;
  std::optional<dembark::impact::Drum> drum;
  std::string fix_id;                                 ///< of the fix mesh/surface, or empty
  std::optional<dembark::FinnieRabinowicz> friction;  ///< none: that of the fix
};

struct ImpactOptions {
  dembark::impact::Settings settings;  ///< a material for each atom type, then one for each wall; without the time step
  std::size_t types = 0;
  std::vector<ImpactWall> walls;
  bool solid_cylinder = true;  ///< moment of inertia m r^2 / 2, else 2/5 m r^2
  std::string impacts_file;    ///< empty: none

  double inertia(double mass, double radius) const {
    return solid_cylinder ? dembark::impact::cylinder_inertia(mass, radius) : dembark::impact::sphere_inertia(mass, radius);
  }
  /// The engine turns a torque into spin with its own inertia, that of spheres and in two dimensions that of cylinders: a torque times
  /// this number has the same effect on the inertia of a log.
  double torque_scale(int dimension) const { return (solid_cylinder ? 0.5 : 0.4) / (dimension == 2 ? 0.5 : 0.4); }
};

/// Reads the words after the style. Throws std::invalid_argument with one line: what, where, what would be right.
ImpactOptions read_impact_options(const std::vector<std::string>& words, int atom_types);

}  // namespace dembark_liggghts
