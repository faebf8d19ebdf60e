// Decimal numbers in text to the nearest double.
#pragma once

#include <cfloat>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <system_error>

namespace dembark::dumps {

enum class Word { number, not_finite, no_number };

inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }
inline bool ends_word(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

inline constexpr std::uint64_t whole_powers[] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000};

// The digits from `q` on join the mantissa; `q` moves behind them. Numbers of one column differ in length at random, so eight
// characters are taken at a time whatever they are: a loop over single digits would end at an unforeseeable place.
inline void read_digits(const char*& q, const char* end, std::uint64_t& mantissa) {
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  while (end - q >= 8) {
    std::uint64_t word;
    std::memcpy(&word, q, 8);
    word ^= 0x3030303030303030u;
    // The lowest set bit belongs to the first byte above 9; what a carry does to later ones does not matter.
    const std::uint64_t other = ((word + 0x7676767676767676u) | word) & 0x8080808080808080u;
    const int count = other == 0 ? 8 : __builtin_ctzll(other) >> 3;
    // Zeros come before the digits; then pairs are joined, then fours, then the eight.
    if (other != 0) word = (word << (56 - 8 * count)) << 8;
    word = word * 10 + (word >> 8);
    constexpr std::uint64_t mask = 0x000000FF000000FFu;
    word = ((word & mask) * (100 + (1000000ull << 32)) + ((word >> 16) & mask) * (1 + (10000ull << 32))) >> 32;
    mantissa = mantissa * whole_powers[count] + (word & 0xFFFFFFFFu);
    q += count;
    if (other != 0) return;
  }
#endif
  for (; is_digit(*q); ++q) mantissa = mantissa * 10u + std::uint64_t(*q - '0');
}

// Any number, by the library; `first` is behind its sign. The library leaves the value alone beyond the range of doubles; what is too
// small is told from what is too large by the sign of the exponent.
inline Word read_rare(const char*& p, const char* first, bool negative, double& value) {
  const char* last = first;
  while (!ends_word(*last)) ++last;
  p = last;
  const auto [stop, error] = std::from_chars(first, last, value);
  if (stop != last || first == last || *first == '-') return Word::no_number;
  if (error == std::errc::result_out_of_range) {
    if (std::memchr(first, '-', std::size_t(last - first)) == nullptr) return Word::not_finite;
    value = 0.0;
  } else if (!(value - value == 0.0)) {
    return Word::not_finite;
  }
  if (negative) value = -value;
  return Word::number;
}

// mantissa * 10^power to the nearest double, or false where that cannot be told so easily.
//
// Where the mantissa has at most 53 bits and the power is at most 22, both are exact doubles and one multiplication or division rounds
// once, so the result is the nearest double (W. D. Clinger, How to read floating point numbers accurately, PLDI 1990). The same holds
// for 64 bits and powers to 27 in the x87 format; rounding that to 53 bits again is right unless the middle between two doubles came
// out, for this middle is a number of the format and rounding keeps order.
inline bool scale(std::uint64_t mantissa, int power, double& value) {
  static_assert(FLT_EVAL_METHOD == 0, "a product must be rounded to double once");
  static constexpr double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                      1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  if (mantissa <= (std::uint64_t(1) << 53) && power >= -22 && power <= 22) {
    const double whole = double(mantissa);
    value = power < 0 ? whole / powers[-power] : whole * powers[power];
    return true;
  }
#if LDBL_MANT_DIG == 64
  static constexpr long double long_powers[] = {1e0L,  1e1L,  1e2L,  1e3L,  1e4L,  1e5L,  1e6L,  1e7L,  1e8L,  1e9L,
                                                1e10L, 1e11L, 1e12L, 1e13L, 1e14L, 1e15L, 1e16L, 1e17L, 1e18L, 1e19L,
                                                1e20L, 1e21L, 1e22L, 1e23L, 1e24L, 1e25L, 1e26L, 1e27L};
  if (power >= -27 && power <= 27) {
    const long double whole = static_cast<long double>(mantissa);
    const long double size = power < 0 ? whole / long_powers[-power] : whole * long_powers[power];
    std::uint64_t bits;
    std::memcpy(&bits, &size, 8);
    value = double(size);
    return (bits & 0x7FF) != 0x400;
  }
#endif
  return false;
}

// Digits of a number from the first that is not zero on.
inline std::ptrdiff_t significant_digits(const char* first, std::ptrdiff_t digits) {
  for (; *first == '0' || *first == '.'; ++first) digits -= *first == '0';
  return digits;
}

// The word at `p`, which some white space before `end` ends; afterwards `p` stands behind it.
inline Word read_number(const char*& p, const char* end, double& value) {
  const bool negative = *p == '-';
  const char* const first = p + (negative || *p == '+');
  const char* q = first;
  std::uint64_t mantissa = 0;
  // Before the point the digits are few, and mostly as many in all of a column.
  for (; is_digit(*q); ++q) mantissa = mantissa * 10u + std::uint64_t(*q - '0');
  std::ptrdiff_t digits = q - first;
  int power = 0;
  if (*q == '.') {
    const char* const point = ++q;
    read_digits(q, end, mantissa);
    digits += q - point;
    power = q - point < 100 ? int(point - q) : -100;
  }
  if (*q == 'e' || *q == 'E') {
    const bool small = q[1] == '-';
    const char* const from = q + 1 + (small || q[1] == '+');
    int exponent = 0;
    for (q = from; is_digit(*q) && q - from < 5; ++q) exponent = exponent * 10 + (*q - '0');
    if (q == from) digits = 0;
    power += small ? -exponent : exponent;
  }
  // With 19 digits the mantissa cannot have overflowed.
  const bool exact = digits > 0 && (digits <= 19 || significant_digits(first, digits) <= 19) && ends_word(*q);
  if (!exact || !scale(mantissa, power, value)) return read_rare(p, first, negative, value);
  p = q;
  value = std::copysign(value, negative ? -1.0 : 1.0);
  return Word::number;
}

}  // namespace dembark::dumps
