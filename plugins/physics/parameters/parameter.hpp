// A number that a user gives to a law: its name, unit, range and default, once for all engines, Python and the documentation.
#pragma once

#include <cmath>
#include <string>

#include "../message_text.hpp"

namespace dembark {

/// Of what a number is: of the contact law, of a material, or of a pair of materials.
enum class Scope { global, type, pair };

/// Which law reads a number: each, or one that a user may leave off.
enum class ReadBy { any, hooke, rolling, rolling_spring, bridge, constant_force, surface_energy };

constexpr double no_default = NAN;  ///< of a number that must be given

// In the order of a row, not of the sizes.
struct Parameter {         // NOLINT(clang-analyzer-optin.performance.Padding)
  const char* name;        ///< as LAMMPS and Python write it
  const char* camel_case;  ///< the same as YADE and LIGGGHTS write it
  const char* unit;        ///< SI; "1" without
  double low;              ///< smallest value
  bool above_low;          ///< larger than `low`, not equal to it
  double high;             ///< largest value; INFINITY: any finite number
  bool infinite;           ///< infinity is a value, too
  double otherwise;        ///< where it is not given, or no_default
  Scope scope;
  const char* doc;       ///< one sentence without a full stop
  const char* liggghts;  ///< its name in LIGGGHTS where that is another one, else nullptr
  ReadBy law;

  bool allows(double value) const {
    return (above_low ? value > low : value >= low) && value <= high && (infinite || std::isfinite(value));
  }
  bool required() const { return std::isnan(otherwise); }
};

/// What values are right: "> 0 and <= 1".
inline std::string range_text(const Parameter& p) {
  std::string text = (p.above_low ? "> " : ">= ") + number_text(p.low);
  if (std::isfinite(p.high)) text += " and <= " + number_text(p.high);
  else if (!p.infinite) text += " and finite";
  return text;
}

/// One line for a user: what it is, in which unit and range, and its default.
inline std::string description(const Parameter& p) {
  return std::string(p.doc) + (std::string(p.unit) == "1" ? "" : std::string(" [") + p.unit + "]") + "; " + range_text(p) +
         (p.required() ? "; no default" : "; default " + number_text(p.otherwise));
}

/// The line about a wrong value: what, what would be right. `name`: as the user has written it.
inline std::string wrong_value(const Parameter& p, const std::string& name, double value) {
  return name + (std::string(p.unit) == "1" ? "" : std::string(" (") + p.unit + ")") + " must be " + range_text(p) + ", not " +
         number_text(value);
}

}  // namespace dembark
