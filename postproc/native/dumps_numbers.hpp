// Words of a dump that are numbers.
#pragma once

#include <cmath>

#include "dembark/decimal.hpp"

namespace dembark::dumps {

enum class Word { number, not_finite, no_number };

inline bool ends_word(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

// The word at `p`, which some white space before `end` ends; afterwards `p` stands behind it.
inline Word read_number(const char*& p, const char* end, double& value) {
  const char* const first = p + (*p == '+' && p[1] != '-');
  const char* const stop = read_decimal(first, end, value);
  if (stop == first || !ends_word(*stop)) {
    while (!ends_word(*p)) ++p;
    return Word::no_number;
  }
  p = stop;
  return std::isfinite(value) ? Word::number : Word::not_finite;
}

}  // namespace dembark::dumps
