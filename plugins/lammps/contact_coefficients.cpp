#include "contact_coefficients.h"

#include <algorithm>

#include "atom.h"
#include "error.h"
#include "utils.h"

#include "dembark/capillary/bridge_law.hpp"

using namespace LAMMPS_NS;
using dembark::ContactParameters;

namespace dembark_lammps {
namespace {

std::string list(const std::vector<std::string>& names) {
  std::string text = names[0];
  for (std::size_t k = 1; k < names.size(); ++k) text += (k + 1 < names.size() ? ", " : " or ") + names[k];
  return text;
}

std::string types(int i, int j) { return "types " + std::to_string(i) + "-" + std::to_string(j); }

}  // namespace

const std::array<ContactCoefficients::Keyword, 12> ContactCoefficients::keywords = {{
    {"youngs_modulus", &Given::youngs_modulus},
    {"poissons_ratio", &Given::poissons_ratio},
    {"restitution", &Given::restitution},
    {"static_friction", &Given::static_friction},
    {"kinetic_friction", &Given::kinetic_friction},
    {"critical_slip_distance", &Given::critical_slip_distance},
    {"interface_shear_strength", &Given::interface_shear_strength},
    {"rolling_friction", &Given::rolling_friction},
    {"rolling_damping_ratio", &Given::rolling_damping_ratio},
    {"bridge_volume", &Given::bridge_volume},
    {"contact_angle", &Given::contact_angle},
    {"largest_radius", &Given::largest_radius},
}};

void ContactCoefficients::fail(const std::string& what) const { error->all(FLERR, std::string("pair_style ") + style_name + ": " + what); }

double ContactCoefficients::number(const std::string& keyword, const char* text) const {
  if (!utils::is_double(text)) fail(keyword + " needs a number, not '" + text + "'");
  return utils::numeric(FLERR, text, false, lmp);
}

template <class Option>
void ContactCoefficients::choose(const std::string& keyword, const std::string& word, const std::vector<std::string>& names,
                                 Option& option) const {
  if (!dembark::option_from_name(names, word, option)) fail(keyword + " '" + word + "' is unknown; it can be " + list(names));
}

void ContactCoefficients::settings(int narg, char** arg) {
  settings_ = {};
  words_.clear();
  for (int k = 0; k < narg; ++k) words_ += std::string(arg[k]) + " ";
  const std::vector<std::string> off_on = {"off", "on"};
  for (int k = 0; k < narg;) {
    const std::string keyword = arg[k++];
    const auto word = [&]() -> const char* {
      if (k == narg) fail(keyword + " needs a value");
      return arg[k++];
    };
    if (keyword == "normal") {
      choose(keyword, word(), dembark::normal_law_names(), settings_.normal_law);
      if (settings_.normal_law == dembark::NormalLaw::hooke) {
        settings_.characteristic_velocity = number("normal hooke", word());
        if (!(settings_.characteristic_velocity > 0.0)) fail("normal hooke needs a characteristic velocity > 0 m/s");
      }
    } else if (keyword == "presliding") choose(keyword, word(), dembark::presliding_names(), settings_.presliding);
    else if (keyword == "friction_limit") choose(keyword, word(), dembark::friction_limit_names(), settings_.friction_limit);
    else if (keyword == "rolling_resistance") choose(keyword, word(), dembark::rolling_names(), settings_.rolling_model);
    else if (keyword == "capillary_model") {
      choose(keyword, word(), dembark::capillary::model_names(), settings_.capillary_model);
      settings_.wet = true;
    } else if (keyword == "surface_tension") settings_.surface_tension = number(keyword, word());
    else if (keyword == "viscous_liquid") {
      const double viscosity = number(keyword, word());
      settings_.viscous = {viscosity, number(keyword, word())};
      if (const char* wrong = settings_.viscous.error()) fail(keyword + ": " + wrong);
    } else if (keyword == "carried_liquid") choose(keyword, word(), off_on, settings_.carried);
    else if (keyword == "healing_time") settings_.healing_time = number(keyword, word());
    else if (keyword == "tangential_damping") choose(keyword, word(), off_on, settings_.tangential_damping);
    else if (keyword == "limit_force") choose(keyword, word(), off_on, settings_.limit_force);
    else
      fail("'" + keyword +
           "' is unknown; it can be normal, presliding, friction_limit, rolling_resistance, capillary_model, surface_tension, "
           "viscous_liquid, carried_liquid, healing_time, tangential_damping or limit_force");
  }
  if (settings_.wet && !(settings_.surface_tension >= 0.0 && settings_.surface_tension < INFINITY))
    fail("capillary_model needs surface_tension S with S (N/m) >= 0 and finite");
  if (!settings_.wet && (!std::isnan(settings_.surface_tension) || settings_.viscous.on()))
    fail("surface_tension and viscous_liquid need a capillary_model");
  if (!settings_.wet && settings_.carried) fail("carried_liquid needs a capillary_model");
}

std::string ContactCoefficients::given() const {
  std::string text = words_;
  for (int i = 1; i <= given_.types(); ++i)
    for (int j = i; j <= given_.types(); ++j)
      for (const Keyword& each : keywords) text += fmt::format("{:.17g} ", given_(i, j).*each.value);
  return text;
}

std::vector<std::array<int, 2>> ContactCoefficients::coeff(int narg, char** arg) {
  if (narg < 2) fail("pair_coeff needs two types and keywords with values");
  const int count = atom->ntypes;
  if (given_.types() != count) given_ = dembark::PairTable<Given>(count);
  int low[2], high[2];
  for (int k = 0; k < 2; ++k) utils::bounds(FLERR, arg[k], 1, count, low[k], high[k], error);
  const bool one_pair = low[0] == high[0] && low[1] == high[1] && low[0] != low[1];
  std::vector<std::array<int, 2>> pairs;
  for (int i = low[0]; i <= high[0]; ++i)
    for (int j = std::max(low[1], i); j <= high[1]; ++j) pairs.push_back({i, j});
  if (pairs.empty()) fail(std::string("pair_coeff ") + arg[0] + " " + arg[1] + " names no pair of types; the smaller one comes first");
  for (int k = 2; k < narg; k += 2) {
    const std::string name = arg[k];
    const auto known = std::find_if(keywords.begin(), keywords.end(), [&](const Keyword& each) { return name == each.name; });
    if (known == keywords.end()) {
      std::vector<std::string> names;
      for (const Keyword& each : keywords) names.emplace_back(each.name);
      fail("pair_coeff knows no '" + name + "'; it knows " + list(names));
    }
    if (k + 1 == narg) fail("pair_coeff: " + name + " needs a value");
    const double value = number("pair_coeff: " + name, arg[k + 1]);
    if (known->value == &Given::largest_radius && !(value >= 0.0 && value < INFINITY)) fail("largest_radius must be >= 0 and finite");
    if (one_pair && of_one_type(known->value))
      fail(name + " belongs to one type; give it with pair_coeff " + arg[0] + " " + arg[0] + " and pair_coeff " + arg[1] + " " + arg[1]);
    for (const auto& [i, j] : pairs) given_(i, j).*known->value = given_(j, i).*known->value = value;
  }
  return pairs;
}

double ContactCoefficients::needed(int i, int j, double Given::* value) const {
  const double found = given_(i, j).*value;
  if (std::isnan(found)) {
    const auto keyword = std::find_if(keywords.begin(), keywords.end(), [&](const Keyword& each) { return each.value == value; });
    fail(types(i, j) + " have no " + keyword->name + "; give it with pair_coeff " + std::to_string(i) + " " + std::to_string(j) + " " +
         keyword->name + " VALUE");
  }
  return found;
}

ContactParameters ContactCoefficients::common() const {
  ContactParameters p;
  p.normal_law = settings_.normal_law;
  p.characteristic_velocity = settings_.characteristic_velocity;
  p.tangential_damping = settings_.tangential_damping;
  p.limit_force = settings_.limit_force;
  p.friction.healing_time = settings_.healing_time;
  p.friction.presliding = settings_.presliding;
  p.friction.friction_limit = settings_.friction_limit;
  p.rolling.model = settings_.rolling_model;
  p.liquid.surface_tension = settings_.surface_tension;
  p.liquid.viscous = settings_.viscous;
  return p;
}

void ContactCoefficients::begin() {
  const int count = atom->ntypes;
  if (given_.types() != count) given_ = dembark::PairTable<Given>(count);
  parameters_ = dembark::PairTable<ContactParameters>(count);
  complete_ = dembark::PairTable<char>(count);
  const ContactParameters all = common();
  for (int i = 1; i <= count; ++i)
    for (int j = 1; j <= count; ++j) parameters_(i, j) = all;
}

void ContactCoefficients::complete(int i, int j) {
  const Given& given = given_(i, j);
  const std::string pair = " (" + types(i, j) + ")";
  const double youngs[2] = {needed(i, i, &Given::youngs_modulus), needed(j, j, &Given::youngs_modulus)};
  const double poisson[2] = {needed(i, i, &Given::poissons_ratio), needed(j, j, &Given::poissons_ratio)};
  for (int k = 0; k < 2; ++k) {
    if (!(youngs[k] > 0.0 && youngs[k] < INFINITY)) fail("youngs_modulus (Pa) must be > 0 and finite" + pair);
    if (!(poisson[k] > -1.0 && poisson[k] <= 0.5)) fail("poissons_ratio must be > -1 and <= 0.5" + pair);
  }
  const double restitution = needed(i, j, &Given::restitution);
  if (!(restitution > 0.0 && restitution <= 1.0)) fail("restitution must be > 0 and <= 1" + pair);

  ContactParameters p = common();
  p.elasticity = {dembark::effective_youngs_modulus(youngs[0], poisson[0], youngs[1], poisson[1]),
                  dembark::effective_shear_modulus(youngs[0], poisson[0], youngs[1], poisson[1]), restitution};
  p.friction = {needed(i, j, &Given::static_friction),
                needed(i, j, &Given::kinetic_friction),
                needed(i, j, &Given::critical_slip_distance),
                given.interface_shear_strength,
                settings_.healing_time,
                settings_.presliding,
                settings_.friction_limit};
  if (const char* wrong = p.friction.error()) fail(wrong + pair);
  if (settings_.rolling_model != dembark::RollingModel::off)
    p.rolling = {settings_.rolling_model, needed(i, j, &Given::rolling_friction), given.rolling_damping_ratio};
  if (const char* wrong = p.rolling.error()) fail(wrong + pair);
  if (settings_.wet) {
    if (settings_.carried && given.bridge_volume > 0.0)
      fail("bridge_volume is given, but with carried_liquid on a bridge takes its volume from the grains; leave one of them out" + pair);
    const double volume = settings_.carried ? 0.0 : needed(i, j, &Given::bridge_volume), angle = needed(i, j, &Given::contact_angle);
    if (!(volume >= 0.0 && volume < INFINITY)) fail("bridge_volume (m^3) must be >= 0 and finite" + pair);
    if (!(angle >= 0.0 && angle <= 0.5 * dembark::pi)) fail("contact_angle is in radians and must lie in 0...pi/2 (1.5708)" + pair);
    p.liquid = {&dembark::capillary::shared_bridge_force(settings_.capillary_model, angle), settings_.surface_tension, volume,
                settings_.viscous};
  }
  parameters_(i, j) = parameters_(j, i) = p;
  complete_(i, j) = complete_(j, i) = 1;
}

}  // namespace dembark_lammps
