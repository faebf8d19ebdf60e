// One table of the numbers of a contact: what is asked for, and what is refused.
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "catch.hpp"
#include "dembark/parameters/contact_parameters.hpp"

using namespace dembark;

namespace {

struct Refused {
  std::string line;
};

/// Something in its range for each number.
class Numbers : public ContactSource {
 public:
  std::map<std::string, double> values;

  Numbers() {
    for (const Parameter& p : contact_parameters) values[p.name] = std::isfinite(p.high) ? 0.5 * (p.low + p.high) : p.low + 1.0;
  }

  /// Without those of laws that are off.
  explicit Numbers(const ContactOptions& options) : Numbers() {
    for (const Parameter& p : contact_parameters)
      if (!switched_off(p, 1.0, options).empty()) values.erase(p.name);
  }

  std::string name(const Parameter& p) const override { return p.name; }
  double given(const Parameter& p, int) const override {
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
  options.rolling_resistance = RollingModel::elastic_plastic;
  options.cohesion = CohesionLaw::bridge;
  options.viscous = true;
  return options;
}

/// The same with each law of cohesion, and with each value of each choice.
std::vector<ContactOptions> all_laws() {
  std::vector<ContactOptions> all;
  for (const CohesionLaw law : {CohesionLaw::bridge, CohesionLaw::constant, CohesionLaw::dmt}) {
    all.push_back(everything());
    all.back().cohesion = law;
  }
  for (int which = 0; which < contact_choice_count; ++which)
    for (std::size_t value = 0, count = 1; value < count; ++value) {
      ContactOptions options = everything();
      int at = 0;
      each_choice(options, [&](const char*, const char*, auto& option, const auto& values, const char*) {
        if (at++ != which) return;
        count = values.size();
        option = static_cast<std::decay_t<decltype(option)>>(value);
      });
      all.push_back(options);
    }
  return all;
}

/// "static_friction" is "staticFriction".
std::string in_camel_case(const std::string& name) {
  std::string out;
  bool upper = false;
  for (const char c : name) {
    if (c != '_') out += upper ? static_cast<char>(c - 'a' + 'A') : c;
    upper = c == '_';
  }
  return out;
}

}  // namespace

TEST_CASE("all laws together read each number, and each is refused out of its range", "[parameters]") {
  std::map<std::string, ContactOptions> reading;
  for (const ContactOptions& options : all_laws()) {
    const Numbers numbers(options);
    CHECK(refusal(options, numbers).empty());
    for (const auto& [name, value] : numbers.values) reading[name] = options;
  }
  for (const Parameter& p : contact_parameters) {
    REQUIRE(reading.count(p.name) == 1);
    const ContactOptions& options = reading[p.name];
    Numbers wrong(options);
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
  Numbers numbers(ContactOptions{});
  numbers.values["kinetic_friction"] = 1.1;
  CHECK(refusal({}, numbers).find("must not exceed") != std::string::npos);
  ContactOptions jkr = everything();
  jkr.cohesion = CohesionLaw::jkr;
  CHECK(refusal(jkr, Numbers(jkr)).find("hertz") != std::string::npos);
  ContactOptions carried = everything();
  carried.carried_liquid = true;
  CHECK(refusal(carried, Numbers(carried)).find("bridge_volume") != std::string::npos);
}

TEST_CASE("a number is read, or refused with the switch of its law", "[parameters]") {
  std::vector<ContactOptions> all = all_laws();
  all.emplace_back();
  all.push_back(everything());
  all.back().normal_law = NormalLaw::hertz;
  all.back().cohesion = CohesionLaw::jkr;
  std::set<std::string> refused;
  for (const ContactOptions& options : all) {
    const Numbers numbers(options);
    REQUIRE(refusal(options, numbers).empty());
    for (const Parameter& p : contact_parameters) {
      if (numbers.values.count(p.name)) {
        // Without a viscosity nothing needs a gap.
        if (&p == &parameter(ContactNumber::minimum_gap) && !options.viscous) continue;
        Numbers fewer = numbers;
        fewer.values.erase(p.name);
        CHECK(refusal(options, fewer) == (p.required() ? std::string("missing ") + p.name : ""));
        continue;
      }
      refused.insert(p.name);
      Numbers more = numbers;
      more.values[p.name] = 0.3;
      const std::string line = refusal(options, more);
      CHECK(line.find(std::string(p.name) + " is given, but ") == 0);
      CHECK(line.find("; it needs ") != std::string::npos);
      more.values[p.name] = 0.0;
      CHECK(refusal(options, more).empty());
    }
  }
  CHECK(refused == std::set<std::string>{"characteristic_velocity", "bridge_volume", "rolling_friction", "rolling_damping_ratio",
                                         "surface_tension", "contact_angle", "liquid_viscosity", "minimum_gap", "cohesive_force",
                                         "work_of_adhesion"});
  CHECK(switched_off(parameter(ContactNumber::rolling_friction), 0.2, {}) ==
        "rolling_friction is given, but rolling_resistance is off; it needs constant_torque or elastic_plastic");
  CHECK(switched_off(parameter(ContactNumber::bridge_volume), 1e-11, {}, true) ==
        "bridgeVolume is given, but cohesion is none; it needs bridge, which a capillaryModel is");
}

TEST_CASE("a bridge of more than a hundred cubes of the radius is a mistake in the unit", "[parameters]") {
  const double radius = 2.5e-3, cube = radius * radius * radius;
  CHECK(wrong_bridge_volume("bridge_volume", 99.0 * cube, radius).empty());
  CHECK(wrong_bridge_volume("bridge_volume", 8e-2, radius) ==
        "bridge_volume (m^3) is 5.12e+06 cubes of the largest radius; a bridge between grains has at most a few, give its volume in m^3");
  CHECK(wrong_bridge_volume("bridge_volume", 8e-2, 0.0).empty());
}

TEST_CASE("a table has each name once, with a sentence", "[parameters]") {
  std::set<std::string> names;
  for (const Parameter& p : contact_parameters) {
    CHECK(names.insert(p.name).second);
    CHECK(p.camel_case == in_camel_case(p.name));
    CHECK(std::string(p.doc).size() > 10);
    CHECK((std::isnan(p.otherwise) || p.allows(p.otherwise)));
    CHECK(&parameter(static_cast<ContactNumber>(&p - contact_parameters)) == &p);
  }
}

TEST_CASE("choices have each value once, and begin with their default", "[parameters]") {
  ContactOptions options;
  int count = 0;
  each_choice(options, [&](const std::string& name, const std::string& camel, auto& option, const auto& values, const std::string& doc) {
    ++count;
    CHECK(camel == in_camel_case(name));
    CHECK(static_cast<int>(option) == 0);
    CHECK(std::set<std::string>(values.begin(), values.end()).size() == values.size());
    CHECK(option_from_name(values, values.back(), option));
    CHECK(static_cast<std::size_t>(option) == values.size() - 1);
    CHECK(doc.size() > 10);
  });
  CHECK(count == contact_choice_count);
  CHECK(options.rolling_resistance == RollingModel::elastic_plastic);
}
