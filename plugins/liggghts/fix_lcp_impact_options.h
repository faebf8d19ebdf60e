// The words of `fix ID group lcp/impact …`, read into numbers.
#pragma once

#include <string>
#include <vector>

#include "dembark/lcp/types.hpp"

namespace dembark_liggghts {

/// Friction of one kind of contact: Coulomb if both coefficients are equal.
struct ImpactFriction {
  double static_coefficient = 0.0, kinetic_coefficient = 0.0, slip_distance = 0.0;  ///< 1, 1, m
};

/// A wall of the command, in the order in which the words name it.
struct ImpactWall {
  enum Shape { plane, cylinder, mesh };
  Shape shape = plane;
  std::string name;           ///< of the user; appears in messages and in the file of impacts
  int axis = 0;               ///< 0, 1, 2: normal of the plane, axis of the cylinder
  double position = 0.0;      ///< m, plane: coordinate along the axis
  bool free_above = true;     ///< plane: `lo`, the bodies are above it
  double centre[2] = {0, 0};  ///< m, cylinder: the other two coordinates of its axis, in the order x, y, z
  double radius = 0.0;        ///< m, cylinder
  double omega = 0.0;         ///< rad/s, cylinder, right-handed about its axis
  std::string fix_id;         ///< mesh: of the fix mesh/surface
  double stiffness = 0.0;     ///< N/m
  bool has_friction = false;  ///< false: that of the fix
  ImpactFriction friction;
};

struct ImpactOptions {
  std::vector<double> stiffness, damping;  ///< per atom type, N/m and N s/m
  double contact_damping = 0.0;            ///< N s/m
  double theta = 1.0;
  ImpactFriction friction;
  double shear_strength = 0.0, shear_area = 0.0;  ///< Pa, 0 = no limit; m^2 of one contact, 0 = that of the contact's circle
  double tangential_ratio = 2.0 / 7.0;
  bool solid_cylinder = true;  ///< moment of inertia m r^2 / 2, else 2/5 m r^2
  std::string impacts_file;    ///< empty: none
  dembark::LcpMethod method = dembark::LcpMethod::automatic;
  int sweeps = 2;
  std::vector<ImpactWall> walls;
};

/// Reads the words after the style. Throws std::invalid_argument with one line: what, where, what would be right.
ImpactOptions read_impact_options(const std::vector<std::string>& words, int atom_types);

}  // namespace dembark_liggghts
