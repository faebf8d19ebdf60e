#include "contact_coefficients.h"

#include <algorithm>
#include <set>

#include "atom.h"
#include "error.h"
#include "utils.h"

#include "dembark/capillary/bridge_law.hpp"

using namespace LAMMPS_NS;
using dembark::ContactParameters;

namespace dembark_lammps {
namespace {

std::string types(int i, int j) { return "types " + std::to_string(i) + "-" + std::to_string(j); }

/// Of all pairs, and not behind a word of the law that it belongs to.
bool is_keyword(const dembark::Parameter& p) {
  using dembark::ContactNumber;
  for (const ContactNumber behind : {ContactNumber::characteristic_velocity, ContactNumber::liquid_viscosity, ContactNumber::minimum_gap})
    if (&p == &parameter(behind)) return false;
  return p.scope == dembark::Scope::global;
}

}  // namespace

/// The numbers of one pair of types, for dembark::read_contact().
class ContactCoefficients::Source : public dembark::ContactSource {
  const ContactCoefficients& all_;
  const int i_, j_;

 public:
  Source(const ContactCoefficients& all, int i, int j) : all_(all), i_(i), j_(j) {}

  std::string name(const dembark::Parameter& p) const override { return p.name; }
  double given(const dembark::Parameter& p, int body) const override {
    const auto place = std::size_t(&p - dembark::contact_parameters);
    if (p.scope == dembark::Scope::global) return all_.global_[place];
    const int type = body == 1 ? i_ : j_;
    return (p.scope == dembark::Scope::type ? all_.given_(type, type) : all_.given_(i_, j_)).value[place];
  }
  [[noreturn]] void missing(const dembark::Parameter& p, int body) const override {
    if (p.scope == dembark::Scope::global) all_.fail(std::string(p.name) + " is missing; give it with pair_style: " + p.name + " VALUE");
    const int first = p.scope == dembark::Scope::type && body == 2 ? j_ : i_, second = p.scope == dembark::Scope::type ? first : j_;
    all_.fail(types(first, second) + " have no " + p.name + "; give it with pair_coeff " + std::to_string(first) + " " +
              std::to_string(second) + " " + p.name + " VALUE");
  }
  [[noreturn]] void wrong(const std::string& line) const override { all_.fail(line + " (" + types(i_, j_) + ")"); }
};

void ContactCoefficients::fail(const std::string& what) const { error->all(FLERR, std::string("pair_style ") + style_name + ": " + what); }

double ContactCoefficients::number(const std::string& keyword, const char* text) const {
  if (!utils::is_double(text)) fail(keyword + " needs a number, not '" + text + "'");
  return utils::numeric(FLERR, text, false, lmp);
}

template <class Option>
void ContactCoefficients::choose(const std::string& keyword, const std::string& word, const std::vector<std::string>& names,
                                 Option& option) const {
  if (!dembark::option_from_name(names, word, option))
    fail(keyword + " '" + word + "' is unknown; it can be " + dembark::names_text(names));
}

void ContactCoefficients::settings(int narg, char** arg) {
  using dembark::ContactNumber;
  options_ = {};
  global_.fill(NAN);
  words_.clear();
  for (int k = 0; k < narg; ++k) words_ += std::string(arg[k]) + " ";
  const std::vector<std::string> off_on = {"off", "on"};
  bool wet = false, dry = false;
  const auto set = [this](ContactNumber which, double value) {
    const dembark::Parameter& p = dembark::parameter(which);
    if (!p.allows(value)) fail(dembark::wrong_value(p, p.name, value));
    global_[std::size_t(which)] = value;
  };
  std::vector<std::string> keywords = {"normal"};
  each_choice(options_, [&](const char* name, auto&&...) { keywords.emplace_back(name); });
  keywords.insert(keywords.end(), {"cohesion", "capillary_model", "viscous_liquid", "carried_liquid", "tangential_damping", "limit_force"});
  for (const dembark::Parameter& each : dembark::contact_parameters)
    if (is_keyword(each)) keywords.emplace_back(each.name);
  std::set<std::string> seen;
  for (int k = 0; k < narg;) {
    const std::string keyword = arg[k++];
    if (!seen.insert(keyword).second) fail(keyword + " is given twice");
    const auto word = [&]() -> const char* {
      if (k == narg) fail(keyword + " needs a value");
      return arg[k++];
    };
    bool chosen = false;
    each_choice(options_, [&](const char* name, const char*, auto& option, const auto& values, const char*) {
      if (keyword != name) return;
      choose(keyword, word(), values, option);
      chosen = true;
    });
    if (chosen) continue;
    if (keyword == "normal") {
      choose(keyword, word(), dembark::normal_law_names(), options_.normal_law);
      if (options_.normal_law == dembark::NormalLaw::hooke) set(ContactNumber::characteristic_velocity, number("normal hooke", word()));
    } else if (keyword == "cohesion") {
      choose(keyword, word(), dembark::cohesion_names(), options_.cohesion);
      dry = options_.cohesion != dembark::CohesionLaw::bridge;
    } else if (keyword == "capillary_model") {
      choose(keyword, word(), dembark::capillary::model_names(), options_.capillary_model);
      wet = true;
    } else if (keyword == "viscous_liquid") {
      set(ContactNumber::liquid_viscosity, number(keyword, word()));
      options_.viscous = global(ContactNumber::liquid_viscosity) > 0.0;
      const double gap = number(keyword, word());
      if (options_.viscous) set(ContactNumber::minimum_gap, gap);
    } else if (keyword == "carried_liquid") choose(keyword, word(), off_on, options_.carried_liquid);
    else if (keyword == "tangential_damping") choose(keyword, word(), off_on, options_.tangential_damping);
    else if (keyword == "limit_force") choose(keyword, word(), off_on, options_.limit_force);
    else if (const dembark::Parameter* const known = dembark::parameter(keyword); known && is_keyword(*known))
      set(static_cast<ContactNumber>(known - dembark::contact_parameters), number(keyword, word()));
    else fail("'" + keyword + "' is unknown; it can be " + dembark::names_text(keywords));
  }
  if (wet && dry) fail("capillary_model is for the cohesion bridge");
  if (wet) options_.cohesion = dembark::CohesionLaw::bridge;
  const bool bridges = options_.cohesion == dembark::CohesionLaw::bridge;
  for (std::size_t k = 0; k < global_.size(); ++k) refuse_switched_off(dembark::contact_parameters[k], global_[k]);
  if (!bridges && options_.carried_liquid) fail("carried_liquid needs a capillary_model");
  if (bridges && std::isnan(global(ContactNumber::surface_tension)))
    fail("capillary_model needs surface_tension S with S (N/m) >= 0 and finite");
}

void ContactCoefficients::refuse_switched_off(const dembark::Parameter& p, double value) const {
  if (const std::string line = dembark::switched_off(p, value, options_); !line.empty()) fail(line);
}

std::string ContactCoefficients::given() const {
  std::string text = words_;
  for (int i = 1; i <= given_.types(); ++i)
    for (int j = i; j <= given_.types(); ++j)
      for (const double value : given_(i, j).value) text += fmt::format("{:.17g} ", value);
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
  const std::string line = std::string("pair_coeff ") + arg[0] + " " + arg[1] + ": ";
  std::set<std::string> seen;
  for (int k = 2; k < narg; k += 2) {
    const std::string name = arg[k];
    const dembark::Parameter* const known = dembark::parameter(name);
    const bool radius = name == "largest_radius";
    if (!radius && (!known || known->scope == dembark::Scope::global)) {
      std::vector<std::string> names;
      for (const dembark::Parameter& each : dembark::contact_parameters)
        if (each.scope != dembark::Scope::global) names.emplace_back(each.name);
      names.emplace_back("largest_radius");
      fail("pair_coeff knows no '" + name + "'; it knows " + dembark::names_text(names));
    }
    if (!seen.insert(name).second) fail(line + name + " is given twice");
    if (k + 1 == narg) fail(line + name + " needs a value");
    const double value = number(line + name, arg[k + 1]);
    if (radius && !(value >= 0.0 && value < INFINITY)) fail(line + "largest_radius must be >= 0 and finite");
    if (known && !known->allows(value)) fail(line + dembark::wrong_value(*known, name, value));
    if (known) refuse_switched_off(*known, value);
    if (one_pair && (radius || known->scope == dembark::Scope::type))
      fail(name + " belongs to one type; give it with pair_coeff " + arg[0] + " " + arg[0] + " and pair_coeff " + arg[1] + " " + arg[1]);
    for (const auto& [i, j] : pairs)
      for (Given* const given : {&given_(i, j), &given_(j, i)})
        (radius ? given->largest_radius : given->value[std::size_t(known - dembark::contact_parameters)]) = value;
  }
  return pairs;
}

ContactParameters ContactCoefficients::common() const {
  using dembark::ContactNumber;
  ContactParameters p = dembark::chosen_laws(options_);
  if (options_.viscous) p.cohesion.liquid.viscous = {global(ContactNumber::liquid_viscosity), global(ContactNumber::minimum_gap)};
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

void ContactCoefficients::complete(int i, int j, double radius) {
  const Source source(*this, i, j);
  parameters_(i, j) = parameters_(j, i) = dembark::read_contact(options_, source);
  const double volume = parameters_(i, j).cohesion.liquid.bridge_volume;
  if (const std::string line = dembark::wrong_bridge_volume("bridge_volume", volume, radius); !line.empty()) source.wrong(line);
  complete_(i, j) = complete_(j, i) = 1;
}

}  // namespace dembark_lammps
