#include "fix_lcp_impact_options.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace dembark_liggghts {
namespace {

using Vec = dembark::Vec3<double>;

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
  bool next_is(const char* word) const { return left() && words_[at_] == word; }

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

dembark::FinnieRabinowicz no_friction() {
  dembark::FinnieRabinowicz f = dembark::impact::PairLaw::frictionless();
  f.critical_slip_distance = 0.0;
  return f;
}

dembark::FinnieRabinowicz read_friction(Words& words, const std::string& of) {
  dembark::FinnieRabinowicz f = no_friction();
  f.static_friction = f.kinetic_friction = words.at_least(0.0, of, "the friction coefficient");
  if (!words.next_is_number()) return f;
  f.kinetic_friction = words.at_least(0.0, of, "the kinetic friction coefficient");
  f.critical_slip_distance = words.at_least(0.0, of, "the critical slip distance (m), after the static and the kinetic coefficient,");
  if (f.kinetic_friction > f.static_friction)
    refuse(of + ": kinetic friction " + text(f.kinetic_friction) + " must not exceed static friction " + text(f.static_friction));
  return f;
}

/// Everything that one command says; pair laws come together when all words are read.
class Reader {
 public:
  Reader(const std::vector<std::string>& words, int types) : words_(words), types_(types) {}

  ImpactOptions read() {
    while (words_.left()) keyword(words_.word("lcp/impact", "a keyword"));
    if (stiffness_.empty()) refuse("stiffness is missing: one value (N/m) for each atom type");
    damping_.resize(stiffness_.size());
    dembark::impact::Settings& s = options_.settings;
    s.materials.clear();
    s.pairs.clear();
    for (std::size_t i = 0; i < stiffness_.size(); ++i) s.add({stiffness_[i], damping_[i]}, law(friction_));
    for (const ImpactWall& wall : options_.walls) s.add({wall.common.stiffness, 0.0}, law(wall.friction.value_or(friction_)));
    options_.types = stiffness_.size();
    return std::move(options_);
  }

 private:
  void keyword(const std::string& word) {
    if (word == "stiffness") stiffness_ = per_type(words_, word, "N/m", types_, false);
    else if (word == "damping") damping_ = per_type(words_, word, "N s/m", types_, true);
    else if (word == "contact_damping") law_.contact_damping = words_.at_least(0.0, word, "the value (N s/m)");
    else if (word == "theta") {
      const double theta = options_.settings.theta = words_.number(word, "the value");
      if (!(theta >= 0.5 && theta <= 1.0)) refuse("theta: the value lies in 0.5...1, not " + text(theta));
    } else if (word == "friction") friction_ = read_friction(words_, word);
    else if (word == "shear_strength") {
      strength_ = words_.positive(word, "the strength (Pa)");
      if (words_.next_is_number()) law_.contact_area = words_.positive(word, "the contact area (m^2)");
    } else if (word == "tangential_ratio") law_.tangential_stiffness_ratio = words_.positive(word, "the value");
    else if (word == "wall") wall();
    else if (word == "inertia") options_.solid_cylinder = words_.choice(word, "the shape", {"cylinder", "sphere"}) == 0;
    else if (word == "impacts") options_.impacts_file = words_.word(word, "the name of the file");
    else if (word == "method") {
      const std::vector<std::string> methods(std::begin(dembark::lcp_method_names), std::end(dembark::lcp_method_names));
      options_.settings.lcp.method = dembark::lcp_method(methods[std::size_t(words_.choice(word, "the solver", methods))]);
    } else if (word == "sweeps") {
      const double value = words_.at_least(1.0, word, "the number");
      if (value != std::floor(value) || value > 100.0) refuse("sweeps: a whole number from 1 to 100, not " + text(value));
      options_.settings.friction_sweeps = int(value);
    } else refuse("'" + word + "' is no keyword; there is " + keywords);
  }

  dembark::impact::PairLaw law(const dembark::FinnieRabinowicz& friction) const {
    dembark::impact::PairLaw law = law_;
    law.friction = friction;
    law.friction.interface_shear_strength = strength_;
    return law;
  }

  int axis(const std::string& of) { return words_.choice(of, "the axis", {"x", "y", "z"}); }

  void wall() {
    static double Vec::* const axes[3] = {&Vec::x, &Vec::y, &Vec::z};
    const int shape = words_.choice("wall", "the shape", {"plane", "cylinder", "mesh"});
    ImpactWall wall;
    wall.name = words_.word("wall", "the name");
    const std::string of = "wall " + wall.name;
    for (const ImpactWall& other : options_.walls)
      if (other.name == wall.name) refuse(of + ": there is a wall of this name already; give each wall its own");
    const std::size_t number = options_.walls.size();
    wall.common.id = dembark::impact::wall_key(std::int64_t(number));
    wall.common.material = types_ + int(number);
    wall.common.stiffness = 0.0;
    if (shape == 0) {
      dembark::impact::Plane& plane = wall.plane.emplace();
      const int k = axis(of);
      plane.point.*axes[k] = words_.number(of, "the position (m) along the axis");
      plane.normal = Vec();
      plane.normal.*axes[k] = words_.choice(of, "the side", {"lo", "hi"}) == 0 ? 1.0 : -1.0;
    } else if (shape == 1) {
      dembark::impact::Drum& drum = wall.drum.emplace();
      const int k = axis(of);
      drum.axis = Vec();
      drum.axis.*axes[k] = 1.0;
      drum.point.*axes[k == 0 ? 1 : 0] = words_.number(of, "the first coordinate (m) of the axis");
      drum.point.*axes[k == 2 ? 1 : 2] = words_.number(of, "the second coordinate (m) of the axis");
      drum.radius = words_.positive(of, "the radius (m)");
    } else {
      wall.fix_id = words_.word(of, "the ID of a fix mesh/surface");
    }
    for (; words_.next_is("stiffness") || words_.next_is("friction") || words_.next_is("omega");) {
      const std::string word = words_.word(of, "a keyword");
      if (word == "stiffness") {
        if (wall.common.stiffness > 0.0) refuse(of + ": stiffness stands twice; the keywords of the fix itself come before the first wall");
        wall.common.stiffness = words_.positive(of, "stiffness (N/m)");
      } else if (word == "friction") {
        wall.friction = read_friction(words_, of + ": friction");
      } else {
        if (!wall.drum) refuse(of + ": omega is for cylinders; a mesh moves with fix move/mesh");
        wall.drum->omega = words_.number(of, "omega (rad/s)");
      }
    }
    if (!(wall.common.stiffness > 0.0)) refuse(of + ": stiffness (N/m) is missing");
    if (wall.plane) static_cast<dembark::impact::Wall&>(*wall.plane) = wall.common;
    if (wall.drum) static_cast<dembark::impact::Wall&>(*wall.drum) = wall.common;
    options_.walls.push_back(wall);
  }

  Words words_;
  int types_;
  ImpactOptions options_;
  std::vector<double> stiffness_, damping_;
  dembark::impact::PairLaw law_;  ///< but for its friction
  dembark::FinnieRabinowicz friction_ = no_friction();
  double strength_ = dembark::unlimited_strength;  ///< Pa
};

}  // namespace

ImpactOptions read_impact_options(const std::vector<std::string>& words, int atom_types) { return Reader(words, atom_types).read(); }

}  // namespace dembark_liggghts
