// What pair_style and pair_coeff say, as the parameters of dembark/contact.hpp for each pair of atom types.
#ifndef DEMBARK_CONTACT_COEFFICIENTS_H
#define DEMBARK_CONTACT_COEFFICIENTS_H

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "pointers.h"

#include "dembark/contact_history.hpp"
#include "dembark/pair_table.hpp"

namespace dembark_lammps {

class ContactCoefficients : protected LAMMPS_NS::Pointers {
  /// Given by pair_coeff; NAN: not yet.
  struct Given {
    double youngs_modulus = NAN, poissons_ratio = NAN;  // of a type: of pairs of equal types
    double restitution = NAN, static_friction = NAN, kinetic_friction = NAN, critical_slip_distance = NAN;
    double interface_shear_strength = dembark::unlimited_strength;
    double rolling_friction = NAN, rolling_damping_ratio = 0.0;
    double bridge_volume = NAN, contact_angle = NAN;
    double largest_radius = 0.0;  // of a type: what it may grow to in a run
  };
  struct Keyword {
    const char* name;
    double Given::* value;
  };
  static const std::array<Keyword, 12> keywords;

  /// Given by pair_style.
  struct Settings {
    dembark::NormalLaw normal_law = dembark::NormalLaw::hertz;
    double characteristic_velocity = NAN, healing_time = 0.0, surface_tension = NAN;
    dembark::Presliding presliding = dembark::Presliding::linear;
    dembark::FrictionLimit friction_limit = dembark::FrictionLimit::total;
    dembark::RollingModel rolling_model = dembark::RollingModel::off;
    bool wet = false, carried = false, tangential_damping = true, limit_force = false;
    dembark::capillary::Model capillary_model = dembark::capillary::Model::exact;
    dembark::capillary::ViscousLiquid viscous{};
  } settings_;
  std::string words_;  // of the settings
  dembark::PairTable<Given> given_;
  dembark::PairTable<dembark::ContactParameters> parameters_;
  dembark::PairTable<char> complete_;

  double number(const std::string& keyword, const char* text) const;
  template <class Option>
  void choose(const std::string& keyword, const std::string& word, const std::vector<std::string>& names, Option& option) const;
  static bool of_one_type(double Given::* value) {
    return value == &Given::youngs_modulus || value == &Given::poissons_ratio || value == &Given::largest_radius;
  }
  double needed(int i, int j, double Given::* value) const;
  /// What pair_style says of all pairs.
  dembark::ContactParameters common() const;

 public:
  static constexpr const char* style_name = "dembark/granular";

  explicit ContactCoefficients(LAMMPS_NS::LAMMPS* lmp) : Pointers(lmp) {}

  [[noreturn]] void fail(const std::string& what) const;

  /// The words after `pair_style dembark/granular`.
  void settings(int narg, char** arg);
  /// The words after `pair_coeff`; returns the pairs of types (i <= j) that they are about.
  std::vector<std::array<int, 2>> coeff(int narg, char** arg);
  /// After the last pair_coeff: no pair has parameters yet.
  void begin();
  /// The parameters of a pair of types that this style computes. What is missing or wrong ends the run with one line.
  void complete(int i, int j);
  bool is_complete(int i, int j) const { return complete_(i, j); }

  /// Of a pair that is not complete: what pair_style says of all.
  const dembark::ContactParameters& operator()(int i, int j) const { return parameters_(i, j); }
  /// m, that grains of a type may grow to; 0 unless given.
  double largest_radius(int type) const { return given_(type, type).largest_radius; }
  /// All words and numbers that were given, as a text.
  std::string given() const;
  bool wet() const { return settings_.wet; }
  dembark::HistoryLayout layout() const {
    return {settings_.wet, settings_.presliding == dembark::Presliding::partial_slip,
            settings_.rolling_model == dembark::RollingModel::elastic_plastic, settings_.carried};
  }
};

}  // namespace dembark_lammps

#endif
