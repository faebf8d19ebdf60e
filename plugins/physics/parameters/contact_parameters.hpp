// The numbers of a contact: one table for the parsers of all engines, the classes of Python and the documentation, and how the laws of
// contact.hpp follow from them.
#pragma once

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "../capillary/bridge_law.hpp"
#include "../contact.hpp"
#include "parameter.hpp"

namespace dembark {

// The rows of the table. A new number is a row at the end of the second list; parsers, attributes and checks follow.
//   NUMBER(scope, name, in camel case, unit, low, above `low`, high, infinite, default, doc, name in LIGGGHTS, law): see Parameter
// clang-format off
/// Those that YADE has in places of their own: in its materials, in its law, and the volume of a bridge that forms.
#define DEMBARK_SPECIAL_NUMBERS(NUMBER) \
  NUMBER(type, youngs_modulus, youngsModulus, "Pa", 0, true, INFINITY, false, no_default, "Young's modulus", nullptr, any) \
  NUMBER(type, poissons_ratio, poissonsRatio, "1", -1, true, 0.5, false, no_default, "Poisson's ratio", nullptr, any) \
  NUMBER(global, characteristic_velocity, characteristicVelocity, "m/s", 0, true, INFINITY, false, no_default, \
         "impact speed at which the largest overlap of Hooke's law equals that of Hertz's", nullptr, hooke) \
  NUMBER(pair, bridge_volume, bridgeVolume, "m^3", 0, false, INFINITY, false, no_default, "volume of each liquid bridge", nullptr, bridge)
#define DEMBARK_CONTACT_NUMBERS(NUMBER) \
  NUMBER(pair, restitution, restitution, "1", 0, true, 1, false, no_default, "coefficient of restitution without adhesion", \
         "coefficientRestitution", any) \
  NUMBER(pair, static_friction, staticFriction, "1", 0, false, INFINITY, false, no_default, "coefficient of static friction", nullptr, any) \
  NUMBER(pair, kinetic_friction, kineticFriction, "1", 0, false, INFINITY, false, no_default, \
         "coefficient of kinetic friction, at most the static one", nullptr, any) \
  NUMBER(pair, critical_slip_distance, criticalSlipDistance, "m", 0, false, INFINITY, true, no_default, \
         "slip over which friction falls from its static to its kinetic value", nullptr, any) \
  NUMBER(pair, interface_shear_strength, interfaceShearStrength, "Pa", 0, true, INFINITY, true, unlimited_strength, \
         "shear strength of the interface; 1e30 or more is unlimited", nullptr, any) \
  NUMBER(global, healing_time, healingTime, "s", 0, false, INFINITY, true, 0, \
         "time constant in which slip is forgotten while a contact sticks; 0 is at once", nullptr, any) \
  NUMBER(pair, rolling_friction, rollingFriction, "1", 0, false, INFINITY, false, no_default, "coefficient of rolling resistance", \
         "coefficientRollingFriction", rolling) \
  NUMBER(pair, rolling_damping_ratio, rollingDampingRatio, "1", 0, false, INFINITY, false, 0, "damping ratio of the rolling spring", \
         "coefficientRollingViscousDamping", rolling_spring) \
  NUMBER(global, surface_tension, surfaceTension, "N/m", 0, false, INFINITY, false, no_default, "surface tension of the liquid", \
         nullptr, bridge) \
  NUMBER(pair, contact_angle, contactAngle, "rad", 0, false, 1.5707963267948966, false, no_default, "contact angle", nullptr, bridge) \
  NUMBER(global, liquid_viscosity, liquidViscosity, "Pa s", 0, false, INFINITY, false, 0, \
         "viscosity of the liquid; 0 is without viscous forces", nullptr, bridge) \
  NUMBER(global, minimum_gap, minimumGap, "m", 0, true, INFINITY, false, no_default, \
         "gap below which viscous forces do not grow, the roughness of the surfaces", nullptr, bridge) \
  NUMBER(pair, cohesive_force, cohesiveForce, "N", 0, false, INFINITY, false, no_default, "attraction of touching surfaces", \
         nullptr, constant_force) \
  NUMBER(pair, work_of_adhesion, workOfAdhesion, "J/m^2", 0, false, INFINITY, false, no_default, \
         "work of adhesion, twice the surface energy of equal materials", nullptr, surface_energy)

/// Choices by a word that all engines parse alike: CHOICE(name, in camel case, type, first, names of its values, doc).
#define DEMBARK_CONTACT_CHOICES(CHOICE) \
  CHOICE(presliding, presliding, Presliding, linear, presliding_names, "curve of friction below its limit") \
  CHOICE(friction_limit, frictionLimit, FrictionLimit, total, friction_limit_names, \
         "normal force that limits friction, with its damping or of its spring alone") \
  CHOICE(rolling_resistance, rollingResistance, RollingModel, off, rolling_names, "couple against rolling")
// clang-format on

/// In the order of contact_parameters.
enum class ContactNumber {
#define DEMBARK_NAME(scope, name, ...) name,
  DEMBARK_SPECIAL_NUMBERS(DEMBARK_NAME) DEMBARK_CONTACT_NUMBERS(DEMBARK_NAME)
#undef DEMBARK_NAME
};

inline constexpr Parameter contact_parameters[] = {
#define DEMBARK_ROW(scope, name, camel, unit, low, above, high, infinite, otherwise, doc, liggghts, law) \
  {#name, #camel, unit, low, above, high, infinite, otherwise, Scope::scope, doc, liggghts, ReadBy::law},
    DEMBARK_SPECIAL_NUMBERS(DEMBARK_ROW) DEMBARK_CONTACT_NUMBERS(DEMBARK_ROW)
#undef DEMBARK_ROW
};
inline constexpr int contact_parameter_count = sizeof(contact_parameters) / sizeof(Parameter);

inline const Parameter& parameter(ContactNumber number) { return contact_parameters[static_cast<int>(number)]; }

/// By its name; nullptr for an unknown one.
inline const Parameter* parameter(const std::string& name) {
  for (const Parameter& each : contact_parameters)
    if (name == each.name) return &each;
  return nullptr;
}

/// The laws of a contact, which users choose by words.
struct ContactOptions {
  NormalLaw normal_law = NormalLaw::hertz;
#define DEMBARK_MEMBER(name, camel, type, first, ...) type name = type::first;
  DEMBARK_CONTACT_CHOICES(DEMBARK_MEMBER)
#undef DEMBARK_MEMBER
  CohesionLaw cohesion = CohesionLaw::none;
  capillary::Model capillary_model = capillary::Model::exact;
  bool viscous = false;         ///< bridges resist with the viscosity of their liquid
  bool carried_liquid = false;  ///< bridges take their liquid from the grains
  bool tangential_damping = true, limit_force = false;
};

/// Calls visit(name, name in camel case, option, names of its values, doc) for each choice.
template <class Visit>
void each_choice(ContactOptions& options, Visit visit) {
#define DEMBARK_VISIT(name, camel, type, first, names, doc) visit(#name, #camel, options.name, names(), doc);
  DEMBARK_CONTACT_CHOICES(DEMBARK_VISIT)
#undef DEMBARK_VISIT
}
#define DEMBARK_NAME(name, ...) #name,
inline constexpr const char* contact_choices[] = {DEMBARK_CONTACT_CHOICES(DEMBARK_NAME)};
#undef DEMBARK_NAME
inline constexpr int contact_choice_count = sizeof(contact_choices) / sizeof(*contact_choices);

/// The line about a number that the chosen laws do not read: which switch is off; empty where they read it. A number of 0 asks for nothing.
inline std::string switched_off(const Parameter& p, double value, const ContactOptions& options, bool camel_case = false) {
  if (p.law == ReadBy::any || std::isnan(value) || value == 0.0) return "";
  const RollingModel rolling = options.rolling_resistance;
  const CohesionLaw cohesion = options.cohesion;
  const std::string rolls = rolling_names()[std::size_t(rolling)], coheres = cohesion_names()[std::size_t(cohesion)];
  const auto unless = [&](bool on, const char* law, const char* in_camel_case, const std::string& chosen, const char* needed) {
    return on ? ""
              : std::string(camel_case ? p.camel_case : p.name) + " is given, but " + (camel_case ? in_camel_case : law) + " is " + chosen +
                    "; it needs " + needed;
  };
  switch (p.law) {
    case ReadBy::any: break;
    case ReadBy::hooke: return unless(options.normal_law == NormalLaw::hooke, "normal_law", "normalLaw", "hertz", "hooke");
    case ReadBy::rolling:
      return unless(rolling != RollingModel::off, "rolling_resistance", "rollingResistance", rolls, "constant_torque or elastic_plastic");
    case ReadBy::rolling_spring:
      return unless(rolling == RollingModel::elastic_plastic, "rolling_resistance", "rollingResistance", rolls, "elastic_plastic");
    case ReadBy::bridge:
      return unless(cohesion == CohesionLaw::bridge, "cohesion", "cohesion", coheres,
                    camel_case ? "bridge, which a capillaryModel is" : "bridge, which a capillary_model is");
    case ReadBy::constant_force: return unless(cohesion == CohesionLaw::constant, "cohesion", "cohesion", coheres, "constant");
    case ReadBy::surface_energy:
      return unless(cohesion == CohesionLaw::dmt || cohesion == CohesionLaw::jkr, "cohesion", "cohesion", coheres, "dmt or jkr");
  }
  return "";
}

/// The line about a volume that can only be a mistake in its unit; empty for another one. `radius`: m, the largest of the bodies; 0 is
/// unknown. `name`: as the user has written it.
inline std::string wrong_bridge_volume(const std::string& name, double volume, double radius) {
  const double cubes = volume / (radius * radius * radius);
  if (!(radius > 0.0) || !(cubes > 100.0)) return "";
  return name + " (m^3) is " + number_text(cubes) +
         " cubes of the largest radius; a bridge between grains has at most a few, give its volume in m^3";
}

/// Where an engine keeps the numbers of a pair of types.
class ContactSource {
 public:
  virtual ~ContactSource() = default;
  /// As the user writes it.
  virtual std::string name(const Parameter& p) const = 0;
  /// The value; NAN where none was given. `body` 1 or 2, for Scope::type.
  virtual double given(const Parameter& p, int body) const = 0;
  /// Ends the reading: one line about what is missing (with how to give it) or wrong.
  [[noreturn]] virtual void missing(const Parameter& p, int body) const = 0;
  [[noreturn]] virtual void wrong(const std::string& line) const = 0;

  double number(ContactNumber which, int body = 1) const {
    const Parameter& p = parameter(which);
    double value = given(p, body);
    if (std::isnan(value)) {
      if (p.required()) missing(p, body);
      value = p.otherwise;
    }
    if (!p.allows(value)) wrong(wrong_value(p, name(p), value));
    return value;
  }
};

/// Refuses what is given of a law that is switched off.
inline void refuse_switched_off(const ContactOptions& options, const ContactSource& source, bool camel_case = false) {
  for (const Parameter& p : contact_parameters)
    if (const std::string line = switched_off(p, source.given(p, 1), options, camel_case); !line.empty()) source.wrong(line);
}

inline HertzParameters read_elasticity(const ContactSource& source) {
  typedef ContactNumber N;
  const double youngs[2] = {source.number(N::youngs_modulus, 1), source.number(N::youngs_modulus, 2)};
  const double poisson[2] = {source.number(N::poissons_ratio, 1), source.number(N::poissons_ratio, 2)};
  return {effective_youngs_modulus(youngs[0], poisson[0], youngs[1], poisson[1]),
          effective_shear_modulus(youngs[0], poisson[0], youngs[1], poisson[1]), source.number(N::restitution)};
}

inline Friction read_friction(const ContactOptions& options, const ContactSource& source) {
  typedef ContactNumber N;
  const Friction law{source.number(N::static_friction),
                     source.number(N::kinetic_friction),
                     source.number(N::critical_slip_distance),
                     source.number(N::interface_shear_strength),
                     source.number(N::healing_time),
                     options.presliding,
                     options.friction_limit};
  if (law.error()) source.wrong(law.error());
  return law;
}

inline RollingResistance read_rolling(const ContactOptions& options, const ContactSource& source) {
  typedef ContactNumber N;
  if (options.rolling_resistance == RollingModel::off) return {};
  RollingResistance law{options.rolling_resistance, source.number(N::rolling_friction), 0.0};
  if (options.rolling_resistance == RollingModel::elastic_plastic) law.damping_ratio = source.number(N::rolling_damping_ratio);
  return law;
}

inline Cohesion read_cohesion(const ContactOptions& options, const ContactSource& source) {
  typedef ContactNumber N;
  Cohesion cohesion;
  cohesion.law = options.cohesion;
  switch (cohesion.law) {
    case CohesionLaw::none: break;
    case CohesionLaw::constant: cohesion.cohesive_force = source.number(N::cohesive_force); break;
    case CohesionLaw::jkr:
      if (options.normal_law != NormalLaw::hertz) source.wrong("the cohesion jkr needs the normal law hertz");
      [[fallthrough]];
    case CohesionLaw::dmt: cohesion.work_of_adhesion = source.number(N::work_of_adhesion); break;
    case CohesionLaw::bridge: {
      Liquid& liquid = cohesion.liquid;
      liquid.surface_tension = source.number(N::surface_tension);
      if (options.viscous) liquid.viscous = {source.number(N::liquid_viscosity), source.number(N::minimum_gap)};
      if (!options.carried_liquid) liquid.bridge_volume = source.number(N::bridge_volume);
      else if (source.given(parameter(N::bridge_volume), 1) > 0.0)
        source.wrong(source.name(parameter(N::bridge_volume)) +
                     " is given, but carried liquid gives a bridge its volume; leave one of them out");
      liquid.force = &capillary::shared_bridge_force(options.capillary_model, source.number(N::contact_angle));
    }
  }
  return cohesion;
}

/// The laws without their numbers.
inline ContactParameters chosen_laws(const ContactOptions& options) {
  ContactParameters p;
  p.normal_law = options.normal_law;
  p.tangential_damping = options.tangential_damping;
  p.limit_force = options.limit_force;
  p.friction.presliding = options.presliding;
  p.friction.friction_limit = options.friction_limit;
  p.rolling.model = options.rolling_resistance;
  p.cohesion.law = options.cohesion;
  return p;
}

inline ContactParameters read_contact(const ContactOptions& options, const ContactSource& source) {
  refuse_switched_off(options, source);
  ContactParameters p = chosen_laws(options);
  p.elasticity = read_elasticity(source);
  if (p.normal_law == NormalLaw::hooke) p.characteristic_velocity = source.number(ContactNumber::characteristic_velocity);
  p.friction = read_friction(options, source);
  p.rolling = read_rolling(options, source);
  p.cohesion = read_cohesion(options, source);
  return p;
}

}  // namespace dembark
