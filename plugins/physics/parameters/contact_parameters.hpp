// The numbers of a contact: one table for the parsers of all engines, the classes of Python and the documentation, and how the laws of
// contact.hpp follow from them.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "../capillary/bridge_law.hpp"
#include "../contact.hpp"
#include "parameter.hpp"

namespace dembark {

/// In the order of contact_parameters.
enum class ContactNumber {
  youngs_modulus,
  poissons_ratio,
  restitution,
  characteristic_velocity,
  static_friction,
  kinetic_friction,
  critical_slip_distance,
  interface_shear_strength,
  healing_time,
  rolling_friction,
  rolling_damping_ratio,
  surface_tension,
  contact_angle,
  bridge_volume,
  liquid_viscosity,
  minimum_gap,
  cohesive_force,
  work_of_adhesion,
};

// clang-format off
inline constexpr Parameter contact_parameters[] = {
  {"youngs_modulus", "Pa", 0, true, INFINITY, false, NAN, Scope::type, "Young's modulus", nullptr},
  {"poissons_ratio", "1", -1, true, 0.5, false, NAN, Scope::type, "Poisson's ratio", nullptr},
  {"restitution", "1", 0, true, 1, false, NAN, Scope::pair, "coefficient of restitution without adhesion", "coefficientRestitution"},
  {"characteristic_velocity", "m/s", 0, true, INFINITY, false, NAN, Scope::global,
   "impact speed at which the largest overlap of Hooke's law equals that of Hertz's", nullptr},
  {"static_friction", "1", 0, false, INFINITY, false, NAN, Scope::pair, "coefficient of static friction", nullptr},
  {"kinetic_friction", "1", 0, false, INFINITY, false, NAN, Scope::pair, "coefficient of kinetic friction, at most the static one", nullptr},
  {"critical_slip_distance", "m", 0, false, INFINITY, true, NAN, Scope::pair,
   "slip over which friction falls from its static to its kinetic value", nullptr},
  {"interface_shear_strength", "Pa", 0, true, INFINITY, true, unlimited_strength, Scope::pair,
   "shear strength of the interface; 1e30 or more is unlimited", nullptr},
  {"healing_time", "s", 0, false, INFINITY, true, 0, Scope::global, "time constant in which slip is forgotten while a contact sticks; 0 is at once",
   nullptr},
  {"rolling_friction", "1", 0, false, INFINITY, false, NAN, Scope::pair, "coefficient of rolling resistance", "coefficientRollingFriction"},
  {"rolling_damping_ratio", "1", 0, false, INFINITY, false, 0, Scope::pair, "damping ratio of the rolling spring",
   "coefficientRollingViscousDamping"},
  {"surface_tension", "N/m", 0, false, INFINITY, false, NAN, Scope::global, "surface tension of the liquid", nullptr},
  {"contact_angle", "rad", 0, false, 1.5707963267948966, false, NAN, Scope::pair, "contact angle", nullptr},
  {"bridge_volume", "m^3", 0, false, INFINITY, false, NAN, Scope::pair, "volume of each liquid bridge", nullptr},
  {"liquid_viscosity", "Pa s", 0, false, INFINITY, false, 0, Scope::global, "viscosity of the liquid; 0 is without viscous forces", nullptr},
  {"minimum_gap", "m", 0, true, INFINITY, false, NAN, Scope::global, "gap below which viscous forces do not grow, the roughness of the surfaces",
   nullptr},
  {"cohesive_force", "N", 0, false, INFINITY, false, NAN, Scope::pair, "attraction of touching surfaces", nullptr},
  {"work_of_adhesion", "J/m^2", 0, false, INFINITY, false, NAN, Scope::pair, "work of adhesion, twice the surface energy of equal materials",
   nullptr},
};
// clang-format on
inline constexpr int contact_parameter_count = sizeof(contact_parameters) / sizeof(Parameter);
static_assert(contact_parameter_count == static_cast<int>(ContactNumber::work_of_adhesion) + 1);

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
  Presliding presliding = Presliding::linear;
  FrictionLimit friction_limit = FrictionLimit::total;
  RollingModel rolling_model = RollingModel::off;
  CohesionLaw cohesion = CohesionLaw::none;
  capillary::Model capillary_model = capillary::Model::exact;
  bool viscous = false;         ///< bridges resist with the viscosity of their liquid
  bool carried_liquid = false;  ///< bridges take their liquid from the grains
  bool tangential_damping = true, limit_force = false;
};

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

inline HertzParameters read_elasticity(const ContactSource& source) {
  typedef ContactNumber N;
  const double youngs[2] = {source.number(N::youngs_modulus, 1), source.number(N::youngs_modulus, 2)};
  const double poisson[2] = {source.number(N::poissons_ratio, 1), source.number(N::poissons_ratio, 2)};
  return {effective_youngs_modulus(youngs[0], poisson[0], youngs[1], poisson[1]),
          effective_shear_modulus(youngs[0], poisson[0], youngs[1], poisson[1]), source.number(N::restitution)};
}

inline FinnieRabinowicz read_friction(const ContactOptions& options, const ContactSource& source) {
  typedef ContactNumber N;
  const FinnieRabinowicz law{source.number(N::static_friction),
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
  if (options.rolling_model == RollingModel::off) return {};
  RollingResistance law{options.rolling_model, source.number(N::rolling_friction), 0.0};
  if (options.rolling_model == RollingModel::elastic_plastic) law.damping_ratio = source.number(N::rolling_damping_ratio);
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
  p.rolling.model = options.rolling_model;
  p.cohesion.law = options.cohesion;
  return p;
}

inline ContactParameters read_contact(const ContactOptions& options, const ContactSource& source) {
  ContactParameters p = chosen_laws(options);
  p.elasticity = read_elasticity(source);
  if (p.normal_law == NormalLaw::hooke) p.characteristic_velocity = source.number(ContactNumber::characteristic_velocity);
  p.friction = read_friction(options, source);
  p.rolling = read_rolling(options, source);
  p.cohesion = read_cohesion(options, source);
  return p;
}

}  // namespace dembark
