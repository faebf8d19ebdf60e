// A number that a user gives to a law: its name, unit, range and default, once for all engines, Python and the documentation.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

namespace dembark {

/// Of what a number is: of the contact law, of a material, or of a pair of materials.
enum class Scope { global, type, pair };

// In the order of a row, not of the sizes.
struct Parameter {   // NOLINT(clang-analyzer-optin.performance.Padding)
  const char* name;  ///< as LAMMPS and Python write it; LIGGGHTS and YADE write camelCase, see camel_case()
  const char* unit;  ///< SI; "1" without
  double low;        ///< smallest value
  bool above_low;    ///< larger than `low`, not equal to it
  double high;       ///< largest value; INFINITY: any finite number
  bool infinite;     ///< infinity is a value, too
  double otherwise;  ///< where it is not given; NAN: it must be given
  Scope scope;
  const char* doc;       ///< one sentence without a full stop
  const char* liggghts;  ///< its name in LIGGGHTS where that is not camelCase of `name`, else nullptr

  bool allows(double value) const {
    return (above_low ? value > low : value >= low) && value <= high && (infinite || std::isfinite(value));
  }
  bool required() const { return std::isnan(otherwise); }
};

/// "static_friction" is "staticFriction".
inline std::string camel_case(const std::string& name) {
  std::string out;
  bool upper = false;
  for (const char c : name) {
    if (c != '_') out += upper ? static_cast<char>(c - 'a' + 'A') : c;
    upper = c == '_';
  }
  return out;
}

inline std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// What values are right: "> 0 and <= 1".
inline std::string range_text(const Parameter& p) {
  std::string text = (p.above_low ? "> " : ">= ") + number_text(p.low);
  if (std::isfinite(p.high)) text += " and <= " + number_text(p.high);
  else if (!p.infinite) text += " and finite";
  return text;
}

/// The line about a wrong value: what, what would be right. `name`: as the user has written it.
inline std::string wrong_value(const Parameter& p, const std::string& name, double value) {
  return name + (std::string(p.unit) == "1" ? "" : std::string(" (") + p.unit + ")") + " must be " + range_text(p) + ", not " +
         number_text(value);
}

}  // namespace dembark
