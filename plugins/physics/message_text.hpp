// Numbers and names in lines for users, and choices by name.
#pragma once

#include <algorithm>
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

/// False, and `option` as it was, for a word that is none of `names`, which stand in the order of the options.
template <class Option>
bool option_from_name(const std::vector<std::string>& names, const std::string& word, Option& option) {
  const auto found = std::find(names.begin(), names.end(), word);
  if (found != names.end()) option = static_cast<Option>(found - names.begin());
  return found != names.end();
}

/// "a, b or c".
inline std::string names_text(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) text += (k == 0 ? "" : k + 1 < names.size() ? ", " : " or ") + names[k];
  return text;
}

}  // namespace dembark
