#include "fix_lcp_impact_options.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace dembark_liggghts {
namespace {

const char* const keywords =
    "stiffness, damping, contact_damping, theta, friction, shear_strength, tangential_ratio, wall, inertia, impacts, method, sweeps";

[[noreturn]] void refuse(const std::string& line) { throw std::invalid_argument(line); }

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.15g", value);
  return buffer;
}

bool is_number(const std::string& word, double& value) {
  char* end = nullptr;
  value = std::strtod(word.c_str(), &end);
  return !word.empty() && *end == '\0' && std::isfinite(value);
}

class Words {
 public:
  explicit Words(const std::vector<std::string>& words) : words_(words) {}

  bool left() const { return at_ < words_.size(); }
  bool next_is_number() const {
    double ignored;
    return left() && is_number(words_[at_], ignored);
  }

  std::string word(const std::string& of, const std::string& what) {
    if (!left()) refuse(of + ": " + what + " is missing");
    return words_[at_++];
  }

  double number(const std::string& of, const std::string& what) {
    const std::string found = word(of, what);
    double value;
    if (!is_number(found, value)) refuse(of + ": '" + found + "' is no number; it wants " + what);
    return value;
  }

  double at_least(double lowest, const std::string& of, const std::string& what) {
    const double value = number(of, what);
    if (!(value >= lowest)) refuse(of + ": " + what + " must be >= " + text(lowest) + ", not " + text(value));
    return value;
  }

  double positive(const std::string& of, const std::string& what) {
    const double value = number(of, what);
    if (!(value > 0.0)) refuse(of + ": " + what + " must be > 0, not " + text(value));
    return value;
  }

  int choice(const std::string& of, const std::string& what, const std::vector<std::string>& all) {
    const std::string found = word(of, what);
    std::string list;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (found == all[i]) return int(i);
      list += (i ? ", " : "") + all[i];
    }
    refuse(of + ": " + what + " is one of " + list + ", not '" + found + "'");
  }

 private:
  const std::vector<std::string>& words_;
  std::size_t at_ = 0;
};

std::vector<double> per_type(Words& words, const std::string& keyword, const std::string& unit, int types, bool may_be_zero) {
  std::vector<double> values;
  while (words.next_is_number()) {
    const std::string what = "the value (" + unit + ") of type " + std::to_string(values.size() + 1);
    values.push_back(may_be_zero ? words.at_least(0.0, keyword, what) : words.positive(keyword, what));
  }
  if (int(values.size()) != types)
    refuse(keyword + ": one value (" + unit + ") for each of the " + std::to_string(types) + " atom types, not " +
           std::to_string(values.size()));
  return values;
}

ImpactFriction read_friction(Words& words, const std::string& of) {
  ImpactFriction f;
  f.static_coefficient = f.kinetic_coefficient = words.at_least(0.0, of, "the friction coefficient");
  if (words.next_is_number()) {
    f.kinetic_coefficient = words.at_least(0.0, of, "the kinetic friction coefficient");
    f.slip_distance = words.at_least(0.0, of, "the critical slip distance (m), after the static and the kinetic coefficient,");
    if (f.kinetic_coefficient > f.static_coefficient)
      refuse(of + ": kinetic friction " + text(f.kinetic_coefficient) + " must not exceed static friction " + text(f.static_coefficient));
  }
  return f;
}

int axis(Words& words, const std::string& of) { return words.choice(of, "the axis", {"x", "y", "z"}); }

ImpactWall read_wall(Words& words, const std::vector<ImpactWall>& others, bool& needs_more, std::string& unread) {
  ImpactWall wall;
  wall.shape = ImpactWall::Shape(words.choice("wall", "the shape", {"plane", "cylinder", "mesh"}));
  wall.name = words.word("wall", "the name");
  const std::string of = "wall " + wall.name;
  for (const ImpactWall& other : others)
    if (other.name == wall.name) refuse(of + ": there is a wall of this name already; give each wall its own");
  if (wall.shape == ImpactWall::plane) {
    wall.axis = axis(words, of);
    wall.position = words.number(of, "the position (m) along the axis");
    wall.free_above = words.choice(of, "the side", {"lo", "hi"}) == 0;
  } else if (wall.shape == ImpactWall::cylinder) {
    wall.axis = axis(words, of);
    wall.centre[0] = words.number(of, "the first coordinate (m) of the axis");
    wall.centre[1] = words.number(of, "the second coordinate (m) of the axis");
    wall.radius = words.positive(of, "the radius (m)");
  } else {
    wall.fix_id = words.word(of, "the ID of a fix mesh/surface");
  }
  needs_more = false;
  while (words.left()) {
    const std::string keyword = words.word(of, "a keyword");
    if (keyword == "stiffness") {
      if (wall.stiffness > 0.0) refuse(of + ": stiffness stands twice; the keywords of the fix itself come before the first wall");
      wall.stiffness = words.positive(of, "stiffness (N/m)");
    } else if (keyword == "friction") {
      wall.friction = read_friction(words, of + ": friction");
      wall.has_friction = true;
    } else if (keyword == "omega") {
      if (wall.shape != ImpactWall::cylinder) refuse(of + ": omega is for cylinders; a mesh moves with fix move/mesh");
      wall.omega = words.number(of, "omega (rad/s)");
    } else {
      needs_more = true;
      unread = keyword;
      break;
    }
  }
  if (!(wall.stiffness > 0.0)) refuse(of + ": stiffness (N/m) is missing");
  return wall;
}

}  // namespace

ImpactOptions read_impact_options(const std::vector<std::string>& list, int atom_types) {
  ImpactOptions o;
  Words words(list);
  bool pending = false;
  std::string keyword;
  while (pending || words.left()) {
    if (!pending) keyword = words.word("lcp/impact", "a keyword");
    pending = false;
    if (keyword == "stiffness") o.stiffness = per_type(words, keyword, "N/m", atom_types, false);
    else if (keyword == "damping") o.damping = per_type(words, keyword, "N s/m", atom_types, true);
    else if (keyword == "contact_damping") o.contact_damping = words.at_least(0.0, keyword, "the value (N s/m)");
    else if (keyword == "theta") {
      o.theta = words.number(keyword, "the value");
      if (!(o.theta >= 0.5 && o.theta <= 1.0)) refuse("theta: the value lies in 0.5...1, not " + text(o.theta));
    } else if (keyword == "friction") o.friction = read_friction(words, keyword);
    else if (keyword == "shear_strength") {
      o.shear_strength = words.positive(keyword, "the strength (Pa)");
      if (words.next_is_number()) o.shear_area = words.positive(keyword, "the contact area (m^2)");
    } else if (keyword == "tangential_ratio") o.tangential_ratio = words.positive(keyword, "the value");
    else if (keyword == "wall") o.walls.push_back(read_wall(words, o.walls, pending, keyword));
    else if (keyword == "inertia") o.solid_cylinder = words.choice(keyword, "the shape", {"cylinder", "sphere"}) == 0;
    else if (keyword == "impacts") o.impacts_file = words.word(keyword, "the name of the file");
    else if (keyword == "method") {
      const std::vector<std::string> methods(std::begin(dembark::lcp_method_names), std::end(dembark::lcp_method_names));
      o.method = dembark::lcp_method(methods[std::size_t(words.choice(keyword, "the solver", methods))]);
    } else if (keyword == "sweeps") {
      const double value = words.at_least(1.0, keyword, "the number");
      if (value != std::floor(value) || value > 100.0) refuse("sweeps: a whole number from 1 to 100, not " + text(value));
      o.sweeps = int(value);
    } else refuse("'" + keyword + "' is no keyword; there is " + keywords);
  }
  if (o.stiffness.empty()) refuse("stiffness is missing: one value (N/m) for each atom type");
  if (o.damping.empty()) o.damping.assign(std::size_t(atom_types), 0.0);
  for (ImpactWall& wall : o.walls)
    if (!wall.has_friction) wall.friction = o.friction;
  return o;
}

}  // namespace dembark_liggghts
