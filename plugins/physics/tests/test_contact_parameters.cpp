// One table of the numbers of a contact: what is asked for, and what is refused.
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "catch.hpp"
#include "dembark/parameters/contact_parameters.hpp"

using namespace dembark;

namespace {

struct Refused {
  std::string line;
};

class Numbers : public ContactSource {
 public:
  std::map<std::string, double> values{{"youngs_modulus", 1e7},    {"poissons_ratio", 0.3},   {"restitution", 0.8},
                                       {"static_friction", 0.5},   {"kinetic_friction", 0.4}, {"critical_slip_distance", 1e-5},
                                       {"surface_tension", 0.07},  {"contact_angle", 0.2},    {"bridge_volume", 1e-12},
                                       {"liquid_viscosity", 1e-3}, {"minimum_gap", 1e-6},     {"cohesive_force", 1e-5},
                                       {"work_of_adhesion", 0.05}, {"rolling_friction", 0.1}, {"characteristic_velocity", 1.0}};
  mutable std::set<std::string> asked;

  std::string name(const Parameter& p) const override { return p.name; }
  double given(const Parameter& p, int) const override {
    asked.insert(p.name);
    const auto found = values.find(p.name);
    return found == values.end() ? NAN : found->second;
  }
  [[noreturn]] void missing(const Parameter& p, int) const override { throw Refused{std::string("missing ") + p.name}; }
  [[noreturn]] void wrong(const std::string& line) const override { throw Refused{line}; }
};

std::string refusal(const ContactOptions& options, const Numbers& numbers) {
  try {
    read_contact(options, numbers);
  } catch (const Refused& refused) {
    return refused.line;
  }
  return "";
}

ContactOptions everything() {
  ContactOptions options;
  options.normal_law = NormalLaw::hooke;
  options.rolling_model = RollingModel::elastic_plastic;
  options.cohesion = CohesionLaw::bridge;
  options.viscous = true;
  return options;
}

}  // namespace

TEST_CASE("all laws together ask for each number once known, and each is refused out of its range", "[parameters]") {
  Numbers numbers;
  std::set<std::string> asked;
  for (const CohesionLaw law : {CohesionLaw::bridge, CohesionLaw::constant, CohesionLaw::dmt}) {
    ContactOptions options = everything();
    options.cohesion = law;
    CHECK(refusal(options, numbers).empty());
    asked.insert(numbers.asked.begin(), numbers.asked.end());
  }
  for (const Parameter& p : contact_parameters) {
    CHECK(asked.count(p.name) == 1);
    ContactOptions options = everything();
    if (std::string(p.name) == "cohesive_force") options.cohesion = CohesionLaw::constant;
    if (std::string(p.name) == "work_of_adhesion") options.cohesion = CohesionLaw::dmt;
    Numbers wrong = numbers;
    for (const double value : {p.low - 1.0, p.above_low ? p.low : double(NAN), p.infinite ? double(NAN) : double(INFINITY)}) {
      if (std::isnan(value)) continue;
      wrong.values[p.name] = value;
      const std::string line = refusal(options, wrong);
      CHECK(line.find(p.name) != std::string::npos);
      CHECK(line.find(number_text(value)) != std::string::npos);
    }
    wrong.values.erase(p.name);
    CHECK((refusal(options, wrong) == std::string("missing ") + p.name) == p.required());
  }
}

TEST_CASE("what does not go together is refused", "[parameters]") {
  Numbers numbers;
  numbers.values["kinetic_friction"] = 0.6;
  CHECK(refusal({}, numbers).find("must not exceed") != std::string::npos);
  numbers.values["kinetic_friction"] = 0.5;
  ContactOptions jkr = everything();
  jkr.cohesion = CohesionLaw::jkr;
  CHECK(refusal(jkr, numbers).find("hertz") != std::string::npos);
  ContactOptions carried = everything();
  carried.carried_liquid = true;
  CHECK(refusal(carried, numbers).find("bridge_volume") != std::string::npos);
}

TEST_CASE("a table has each name once, with a sentence", "[parameters]") {
  std::set<std::string> names;
  for (const Parameter& p : contact_parameters) {
    CHECK(names.insert(p.name).second);
    CHECK(std::string(p.doc).size() > 10);
    CHECK((std::isnan(p.otherwise) || p.allows(p.otherwise)));
    CHECK(&parameter(static_cast<ContactNumber>(&p - contact_parameters)) == &p);
  }
  CHECK(camel_case("critical_slip_distance") == "criticalSlipDistance");
}
