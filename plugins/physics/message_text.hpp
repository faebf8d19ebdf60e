// Numbers and names in lines for users.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace dembark {

/// A number with so many digits at most, in the shorter of the usual forms.
inline std::string number_text(double value, int digits = 6) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

/// "a, b or c".
inline std::string names_text(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) text += (k == 0 ? "" : k + 1 < names.size() ? ", " : " or ") + names[k];
  return text;
}

}  // namespace dembark
