// What the contact models read: keywords with named values, and material properties from `fix property/global`, with range checks and
// defaults.
#ifndef DEMBARK_MODEL_PROPERTIES_H
#define DEMBARK_MODEL_PROPERTIES_H

#include <array>
#include <cmath>
#include <string>
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
#include "dembark/pair_table.hpp"
#include "engine_access.h"

namespace dembark_liggghts {

/// A keyword with named values, e.g. `presliding linear|exponential`.
class ChoiceSetting : public EnumSetting<int> {
  std::string choices_;

 public:
  ChoiceSetting(const std::string& name, const std::vector<std::string>& values) : EnumSetting<int>(name) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      addOption(values[i], static_cast<int>(i));
      choices_ += (i ? ", " : "") + values[i];
    }
  }
  int parseArguments(char** args) override {
    const int consumed = EnumSetting<int>::parseArguments(args);
    if (consumed < 0) error_message = name + " '" + args[1] + "' is unknown; it can be " + choices_;
    return consumed;
  }
};

/// Register keyword `name`; `target` gets the index of the chosen value, at once that of the default `values[0]`.
inline void register_choice(Settings& settings, const std::string& name, int& target, const std::vector<std::string>& values) {
  Setting*& slot = keywords(settings)[name];
  if (!slot) slot = new ChoiceSetting(name, values);
  ChoiceSetting* setting = static_cast<ChoiceSetting*>(slot);
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

  /// Whether a table of pairs of types is there.
  bool given(const char* name) const { return find(name, "peratomtypepair", false); }

  // A value that is not given is `otherwise`, or an error where that is NAN.
  double scalar(const char* name, double otherwise = NAN) const {
    LAMMPS_NS::FixPropertyGlobal* const fix = find(name, "scalar", std::isnan(otherwise));
    return fix ? fix->compute_scalar() : otherwise;
  }
  double per_type(const char* name, int type) const { return find(name, "peratomtype", true)->compute_vector(type - 1); }
  double per_pair(const char* name, int i, int j, double otherwise = NAN) const {
    LAMMPS_NS::FixPropertyGlobal* const fix = find(name, "peratomtypepair", std::isnan(otherwise));
    if (!fix) return otherwise;
    const double value = fix->compute_array(i - 1, j - 1);
    if (value != fix->compute_array(j - 1, i - 1))
      fail(std::string(name) + " differs between types " + std::to_string(i) + "-" + std::to_string(j) + " and " + std::to_string(j) + "-" +
           std::to_string(i) + "; the table of a pair property has to be symmetric");
    return value;
  }
};

/// The laws of all pairs of types, each as `law(i, j, "i-j")` makes it.
template <class Law>
auto for_all_pairs(const PropertyReader& read, Law law) {
  PairTable<decltype(law(1, 1, std::string()))> laws(read.types());
  for (int i = 1; i <= read.types(); ++i)
    for (int j = 1; j <= read.types(); ++j) laws(i, j) = law(i, j, std::to_string(i) + "-" + std::to_string(j));
  return laws;
}

inline PairTable<dembark::FinnieRabinowicz> read_friction(const PropertyReader& read, dembark::Presliding presliding,
                                                          dembark::FrictionLimit friction_limit) {
  return for_all_pairs(read, [&](int i, int j, const std::string& pair) {
    dembark::FinnieRabinowicz law;
    law.static_friction = read.per_pair("staticFriction", i, j);
    law.kinetic_friction = read.per_pair("kineticFriction", i, j);
    law.critical_slip_distance = read.per_pair("criticalSlipDistance", i, j);
    law.interface_shear_strength = read.per_pair("interfaceShearStrength", i, j, dembark::unlimited_strength);
    law.healing_time = read.scalar("healingTime", 0.0);
    law.presliding = presliding;
    law.friction_limit = friction_limit;
    if (law.error()) read.fail(std::string(law.error()) + " (types " + pair + ")");
    return law;
  });
}

inline PairTable<dembark::RollingResistance> read_rolling(const PropertyReader& read, dembark::RollingModel model) {
  return for_all_pairs(read, [&](int i, int j, const std::string& pair) {
    dembark::RollingResistance law{model, read.per_pair("coefficientRollingFriction", i, j), 0.0};
    if (model == dembark::RollingModel::elastic_plastic) law.damping_ratio = read.per_pair("coefficientRollingViscousDamping", i, j, 0.0);
    if (law.error()) read.fail(std::string(law.error()) + " (types " + pair + ")");
    return law;
  });
}

/// `carried`: bridges take their volume from the grains, none is given.
inline PairTable<dembark::Liquid> read_liquids(const PropertyReader& read, dembark::capillary::Model model, bool viscous, bool carried) {
  dembark::Liquid same;
  same.surface_tension = read.scalar("surfaceTension");
  if (!(same.surface_tension >= 0.0 && same.surface_tension < INFINITY)) read.fail("surfaceTension (N/m) must be >= 0 and finite");
  same.viscous.viscosity = viscous ? read.scalar("liquidViscosity") : read.scalar("liquidViscosity", 0.0);
  if (!viscous && same.viscous.viscosity != 0.0)
    read.fail("liquidViscosity is given, but viscous forces are off; write 'viscous_liquid on' after the models, or leave it out");
  if (viscous) same.viscous.minimum_gap = read.scalar("minimumGap");
  if (const char* wrong = same.viscous.error()) read.fail(std::string("liquidViscosity, minimumGap: ") + wrong);
  return for_all_pairs(read, [&](int i, int j, const std::string& pair) {
    dembark::Liquid liquid = same;
    if (!carried) liquid.bridge_volume = read.per_pair("bridgeVolume", i, j);
    if (!(liquid.bridge_volume >= 0.0 && liquid.bridge_volume < INFINITY))
      read.fail("bridgeVolume (m^3) must be >= 0 and finite (types " + pair + ")");
    const double angle = 0.5 * (read.per_type("contactAngle", i) + read.per_type("contactAngle", j));
    if (!(angle >= 0.0 && angle <= 0.5 * dembark::pi))
      read.fail("contactAngle is in radians (stock models take degrees) and must lie in 0...pi/2; the mean of types " + std::to_string(i) +
                " and " + std::to_string(j) + " is " + std::to_string(angle));
    liquid.force = &dembark::capillary::shared_bridge_force(model, angle);
    return liquid;
  });
}

}  // namespace dembark_liggghts

#endif
