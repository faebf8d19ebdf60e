// What the contact models read: keywords with named values, and material properties from `fix property/global`, with range checks and
// defaults.
#ifndef DEMBARK_MODEL_PROPERTIES_H
#define DEMBARK_MODEL_PROPERTIES_H

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "atom.h"
#include "error.h"
#include "fix_property_global.h"
#include "force.h"
#include "modify.h"
#include "property_registry.h"
#include "update.h"

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/contact.hpp"
#include "dembark/message_text.hpp"
#include "dembark/pair_table.hpp"
#include "dembark/parameters/contact_parameters.hpp"
#include "engine_access.h"

namespace dembark_liggghts {

/// A keyword with named values, e.g. `presliding linear|exponential`.
template <class Option>
class ChoiceSetting : public EnumSetting<Option> {
  std::vector<std::string> values_;

 public:
  ChoiceSetting(const std::string& name, const std::vector<std::string>& values) : EnumSetting<Option>(name), values_(values) {
    for (std::size_t i = 0; i < values.size(); ++i) this->addOption(values[i], static_cast<Option>(i));
  }
  int parseArguments(char** args) override {
    const int consumed = EnumSetting<Option>::parseArguments(args);
    if (consumed < 0) this->error_message = this->name + " '" + args[1] + "' is unknown; it can be " + dembark::names_text(values_);
    return consumed;
  }
};

/// Register keyword `name`; `target` gets the chosen value, of which `values` are the names, and at once the first of them.
template <class Option>
void register_choice(Settings& settings, const std::string& name, Option& target, const std::vector<std::string>& values) {
  Setting*& slot = keywords(settings)[name];
  if (!slot) slot = new ChoiceSetting<Option>(name, values);
  auto* const setting = static_cast<ChoiceSetting<Option>*>(slot);
  setting->registerTarget(target);
  setting->setDefault(values[0]);
}

/// Sums of the engine's models, of energy and of heat: they would be incomplete with models that have no part in them.
class StockSums {
  struct Sum {
    const char* name;
    bool heat, on = false;
  };
  std::array<Sum, 6> sums_{{{"computeElasticPotential", false},
                            {"computeDissipatedEnergy", false},
                            {"heating_normal_hertz", true},
                            {"heating_normal_hooke", true},
                            {"heating_tangential_history", true},
                            {"heating_tracking", true}}};

 public:
  /// `all`: also those that no model has registered, and that the engine would call unknown.
  void register_in(Settings& settings, bool all) {
    for (Sum& sum : sums_)
      if (all || keywords(settings).count(sum.name)) settings.registerOnOff(sum.name, sum.on, false);
  }
  /// Refuses those that are on, of heat only where `with_heat`.
  void refuse(LAMMPS_NS::Error* error, const std::string& model, bool with_heat) const {
    for (const Sum& sum : sums_)
      if (sum.on && (with_heat || !sum.heat))
        error->all(FLERR, (model + " has no part in '" + sum.name + "', whose sums would be incomplete; leave it out, and take " +
                           "fix energy/account for energies")
                              .c_str());
  }
};

using dembark::PairTable;

/// Properties of the engine for one model. A missing one without default, a wrong shape or an asymmetric pair table ends the run with one
/// line.
class PropertyReader {
  LAMMPS_NS::LAMMPS* lmp_;
  LAMMPS_NS::Modify* modify_;
  LAMMPS_NS::Error* error_;
  int types_;
  std::string model_;

  LAMMPS_NS::Fix* look_up(const char* name, const char* shape, int n, int m) const {
    return modify_->find_fix_property(name, "property/global", shape, n, m, model_.c_str(), false);
  }

  LAMMPS_NS::FixPropertyGlobal* find(const char* name, const std::string& shape, bool required) const {
    // The engine's look-up accepts a scalar only with length 0 and otherwise checks the length.
    const int n = shape == "scalar" ? 0 : types_, m = shape == "peratomtypepair" ? types_ : 0;
    if (LAMMPS_NS::Fix* const fix = look_up(name, shape.c_str(), n, m)) return static_cast<LAMMPS_NS::FixPropertyGlobal*>(fix);
    // One that is there in another form is a mistake, also where none is needed.
    std::string other;
    for (const char* form : {"scalar", "peratomtype", "peratomtypepair"})
      if (form != shape && look_up(name, form, 0, 0)) other = form;
    if (!required && other.empty()) return nullptr;
    const std::string values = n == 0   ? "VALUE"
                               : m == 0 ? "VALUE (one a type)"
                                        : std::to_string(lmp_->atom->ntypes) + " VALUE (one a pair of types)";
    const std::string line = model_ + " needs the material property '" + name + "': fix ID all property/global " + name + " " + shape +
                             " " + values + (other.empty() ? "" : ", not " + other);
    error_->all(FLERR, line.c_str());
    return nullptr;
  }

 public:
  PropertyReader(PropertyRegistry& registry, LAMMPS_NS::Modify* modify, LAMMPS_NS::Error* error, const std::string& model)
      : lmp_(registry.getLAMMPS()), modify_(modify), error_(error), types_(registry.max_type()), model_(model) {
    if (lmp_->force->nktv2p != 1.0)
      fail(std::string("pressures of units ") + lmp_->update->unit_style +
           " are not force over length squared; use si, cgs, micro, nano or lj");
  }

  int types() const { return types_; }

  void fail(const std::string& what) const { error_->all(FLERR, (model_ + ": " + what).c_str()); }

  /// Of a pair of types, or of type i; NAN where it is not given, or an error where it is `required`. A contact angle is the mean of the
  /// two types.
  double value(const dembark::Parameter& p, int i, int j, bool required) const {
    const std::string name = this->name(p);
    const bool angle = &p == &parameter(dembark::ContactNumber::contact_angle), of_type = angle || p.scope == dembark::Scope::type;
    const bool global = p.scope == dembark::Scope::global;
    LAMMPS_NS::FixPropertyGlobal* const fix = find(name.c_str(), global ? "scalar" : of_type ? "peratomtype" : "peratomtypepair", required);
    if (!fix) return NAN;
    if (global) return fix->compute_scalar();
    if (angle) return 0.5 * (fix->compute_vector(i - 1) + fix->compute_vector(j - 1));
    if (of_type) return fix->compute_vector(i - 1);
    const double value = fix->compute_array(i - 1, j - 1);
    if (value != fix->compute_array(j - 1, i - 1))
      fail(name + " differs between types " + std::to_string(i) + "-" + std::to_string(j) + " and " + std::to_string(j) + "-" +
           std::to_string(i) + "; the table of a pair property has to be symmetric");
    return value;
  }
  static std::string name(const dembark::Parameter& p) { return p.liggghts ? p.liggghts : p.camel_case; }
};

/// The numbers of one pair of types, for dembark::read_friction() and its like.
class PropertySource : public dembark::ContactSource {
  const PropertyReader& read_;
  const int i_, j_;

 public:
  PropertySource(const PropertyReader& read, int i, int j) : read_(read), i_(i), j_(j) {}
  std::string name(const dembark::Parameter& p) const override { return PropertyReader::name(p); }
  double given(const dembark::Parameter& p, int body) const override { return read_.value(p, body == 1 ? i_ : j_, j_, false); }
  [[noreturn]] void missing(const dembark::Parameter& p, int body) const override {
    read_.value(p, body == 1 ? i_ : j_, j_, true);
    std::abort();  // the line before has ended the run
  }
  [[noreturn]] void wrong(const std::string& line) const override {
    read_.fail(line + " (types " + std::to_string(i_) + "-" + std::to_string(j_) + ")");
    std::abort();
  }
};

/// The laws of all pairs of types, each as `law(source)` makes it.
template <class Law>
auto for_all_pairs(const PropertyReader& read, Law law) {
  PairTable<decltype(law(std::declval<const PropertySource&>()))> laws(read.types());
  for (int i = 1; i <= read.types(); ++i)
    for (int j = 1; j <= read.types(); ++j) laws(i, j) = law(PropertySource(read, i, j));
  return laws;
}

inline PairTable<dembark::Friction> read_friction(const PropertyReader& read, const dembark::ContactOptions& options) {
  return for_all_pairs(read, [&](const PropertySource& source) { return dembark::read_friction(options, source); });
}

inline PairTable<dembark::RollingResistance> read_rolling(const PropertyReader& read, const dembark::ContactOptions& options) {
  return for_all_pairs(read, [&](const PropertySource& source) { return dembark::read_rolling(options, source); });
}

inline PairTable<dembark::Cohesion> read_cohesion(const PropertyReader& read, const dembark::ContactOptions& options) {
  const dembark::Parameter& viscosity = parameter(dembark::ContactNumber::liquid_viscosity);
  if (options.cohesion == dembark::CohesionLaw::bridge && !options.viscous && read.value(viscosity, 1, 1, false) > 0.0)
    read.fail("liquidViscosity is given, but viscous forces are off; write 'viscous_liquid on' after the models, or leave it out");
  return for_all_pairs(read, [&](const PropertySource& source) { return dembark::read_cohesion(options, source); });
}

}  // namespace dembark_liggghts

#endif
