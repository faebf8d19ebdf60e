// Decimal numbers in text to the nearest double, with a point whatever the user's language is.
#pragma once

#include <locale.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

namespace dembark {

namespace detail {

/// As std::from_chars reads a double, which standard libraries before GCC 11 cannot. Slower.
inline const char* decimal_of_c_library(const char* first, const char* last, double& value) {
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  const char* digits = first + (first != last && *first == '-');
  if (digits == last || *digits == '+' || *digits == '-' || std::strchr(" \t\n\v\f\r", *digits) != nullptr) return first;
  const char* stop = digits;
  while (stop != last && *stop != '\0' && std::strchr(" \t\n\v\f\r", *stop) == nullptr) ++stop;
  const bool hexadecimal = stop - digits > 1 && *digits == '0' && (digits[1] == 'x' || digits[1] == 'X');
  const std::string word(first, hexadecimal ? digits + 1 : stop);
  char* end = nullptr;
  value = strtod_l(word.c_str(), &end, plain);
  return first + (end - word.c_str());
}

}  // namespace detail

/// Reads the number at `first`, which `last` or what is no part of a number ends, and returns where it ends: `first` if there is none.
/// A number too small for a double is zero, one too large infinite.
inline const char* read_decimal(const char* first, const char* last, double& value) {
#ifdef __cpp_lib_to_chars
  const auto [end, error] = std::from_chars(first, last, value);
  if (error == std::errc()) return end;
  if (error != std::errc::result_out_of_range) return first;
#endif
  return detail::decimal_of_c_library(first, last, value);
}

}  // namespace dembark
