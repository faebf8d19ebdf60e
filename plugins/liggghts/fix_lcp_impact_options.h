// The words of `fix ID group lcp/impact …`, read into numbers.
#pragma once

#include <string>
#include <vector>

#include "dembark/impact/types.hpp"
#include "dembark/impact/geometry.hpp"

namespace dembark_liggghts {

struct ImpactOptions {
  dembark::impact::Settings settings;    ///< a material for each atom type, then one for each wall; without the time step
  dembark::impact::Surroundings around;  ///< the walls, numbered in the order in which the words name them
  std::vector<std::string> walls;        ///< their names, for messages and the file of impacts
  std::vector<std::string> meshes;       ///< IDs of fix mesh/surface, of the meshes in `around`
  std::size_t types = 0;
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
