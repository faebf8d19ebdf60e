// Numbers in text: the nearest double, by the standard library and by the C library alike.
#include "catch.hpp"

#include <clocale>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "dembark/decimal.hpp"

using dembark::read_decimal;
using dembark::detail::decimal_of_c_library;

namespace {

typedef const char* (*Reader)(const char*, const char*, double&);

// The number that `text` begins with, and how many characters it has.
struct Read {
  double value = 7.0;
  long length = 0;
};
Read read(Reader reader, const std::string& text) {
  Read found;
  found.length = reader(text.data(), text.data() + text.size(), found.value) - text.data();
  return found;
}

void require_number(const std::string& text, double value, long length = -1) {
  for (const Reader reader : {Reader(read_decimal), Reader(decimal_of_c_library)}) {
    INFO(text);
    const Read found = read(reader, text);
    REQUIRE(found.length == (length < 0 ? long(text.size()) : length));
    REQUIRE((found.value == value || (std::isnan(found.value) && std::isnan(value))));
    REQUIRE(std::signbit(found.value) == std::signbit(value));
  }
}

}  // namespace

TEST_CASE("the standard library's reader of numbers is used where there is one") {
#if defined(_GLIBCXX_RELEASE)
#if _GLIBCXX_RELEASE >= 11 && !defined(__cpp_lib_to_chars)
  FAIL("std::from_chars is not used");
#endif
#endif
}

TEST_CASE("a number ends where it cannot go on") {
  require_number("1.5", 1.5);
  require_number("-2e3 7", -2000.0, 4);
  require_number("1e", 1.0, 1);
  require_number("1e+", 1.0, 1);
  require_number("0x10", 0.0, 1);
  require_number("-0x10", -0.0, 2);
  require_number("3.25abc", 3.25, 4);
  require_number("1,5", 1.0, 1);
  require_number(".5", 0.5);
  require_number("inf", std::numeric_limits<double>::infinity());
  require_number("-inf", -std::numeric_limits<double>::infinity());
  require_number("nan", std::numeric_limits<double>::quiet_NaN());
}

TEST_CASE("what is no number is not read") {
  for (const char* text : {"", "-", "+1", "--1", "-+1", " 1", "- 1", "e5", "abc", "."})
    for (const Reader reader : {Reader(read_decimal), Reader(decimal_of_c_library)}) {
      INFO(text);
      REQUIRE(read(reader, text).length == 0);
    }
}

TEST_CASE("a number beyond the range of a double is zero or infinite") {
  const double infinity = std::numeric_limits<double>::infinity();
  require_number("1e-400", 0.0);
  require_number("-1e-400", -0.0);
  require_number("1e400", infinity);
  require_number("-1e400", -infinity);
  // Without an exponent that would say so.
  require_number("0." + std::string(400, '0') + "1", 0.0);
  require_number("1" + std::string(400, '0'), infinity);
  require_number("4.9406564584124654e-324", std::numeric_limits<double>::denorm_min());
}

TEST_CASE("every double is read as it was written") {
  std::mt19937_64 chance(5);
  for (int k = 0; k < 20000; ++k) {
    const std::uint64_t bits = chance();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) continue;
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", value);
    require_number(text, value);
  }
}

TEST_CASE("the decimal point is the same in every language") {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* language : {"de_DE.UTF-8", "ru_RU.UTF-8", "C.UTF-8"})
    if (std::setlocale(LC_ALL, language) != nullptr) require_number("2.5", 2.5);
  std::setlocale(LC_ALL, before.c_str());
}
