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
#include "dembark/parameters/contact_parameters.hpp"

namespace dembark_lammps {

class ContactCoefficients : protected LAMMPS_NS::Pointers {
  /// Given by pair_coeff, in the order of dembark::contact_parameters; NAN: not yet.
  struct Given {
    std::array<double, dembark::contact_parameter_count> value;
    double largest_radius = 0.0;  // of a type: what it may grow to in a run
    Given() { value.fill(NAN); }
  };

  /// Given by pair_style.
  dembark::ContactOptions options_;
  std::array<double, dembark::contact_parameter_count> global_;
  double global(dembark::ContactNumber which) const { return global_[std::size_t(which)]; }
  std::string words_;  // of the settings
  dembark::PairTable<Given> given_;
  dembark::PairTable<dembark::ContactParameters> parameters_;
  dembark::PairTable<char> complete_;

  double number(const std::string& keyword, const char* text) const;
  template <class Option>
  void choose(const std::string& keyword, const std::string& word, const std::vector<std::string>& names, Option& option) const;
  /// What pair_style says of all pairs.
  dembark::ContactParameters common() const;
  class Source;
  void refuse_switched_off(const dembark::Parameter& p, double value) const;

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
  /// The parameters of a pair of types that this style computes, the largest grain of which has `radius` (m; 0 without grains). What is
  /// missing or wrong ends the run with one line.
  void complete(int i, int j, double radius);
  bool is_complete(int i, int j) const { return complete_(i, j); }

  /// Of a pair that is not complete: what pair_style says of all.
  const dembark::ContactParameters& operator()(int i, int j) const { return parameters_(i, j); }
  /// m, that grains of a type may grow to; 0 unless given.
  double largest_radius(int type) const { return given_(type, type).largest_radius; }
  /// All words and numbers that were given, as a text.
  std::string given() const;
  /// Whether contacts are held over gaps.
  bool holds() const { return dembark::Cohesion{options_.cohesion}.holds(); }
  dembark::HistoryLayout layout() const {
    return {holds(), options_.presliding == dembark::Presliding::partial_slip,
            options_.rolling_resistance == dembark::RollingModel::elastic_plastic, options_.carried_liquid};
  }
};

}  // namespace dembark_lammps

#endif
