// Decimal numbers in text to the nearest double.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <system_error>

namespace dembark::dumps {

enum class Word { number, not_finite, no_number };

inline bool ends_word(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

// The word at `p`, which some white space before `end` ends; afterwards `p` stands behind it.
inline Word read_number(const char*& p, const char* end, double& value) {
  const char* const first = p + (*p == '+' && p[1] != '-');
  const auto [stop, error] = std::from_chars(first, end, value);
  if (stop == first || !ends_word(*stop)) {
    while (!ends_word(*p)) ++p;
    return Word::no_number;
  }
  p = stop;
  if (error == std::errc::result_out_of_range) {
    // The library leaves the value alone. What is too small has a negative exponent.
    const char* const digits = first + (*first == '-');
    if (std::memchr(digits, '-', std::size_t(stop - digits)) == nullptr) return Word::not_finite;
    value = *first == '-' ? -0.0 : 0.0;
  }
  return std::isfinite(value) ? Word::number : Word::not_finite;
}

}  // namespace dembark::dumps
