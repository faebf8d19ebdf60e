// The exponential function of one number or of a pack of numbers, by the same operations: the same bits in every lane and, compiled
// without contraction (-ffp-contract=off), on every processor, which the C library does not promise.
#pragma once

#include <cstring>

#include "vec3.hpp"

namespace dembark {

/// `value` times two to the integer in the last bits of `exponent`, where both are normal numbers.
DEMBARK_HOT double times_power_of_two(double value, double exponent) {
  unsigned long long bits, more;
  std::memcpy(&bits, &value, sizeof bits);
  std::memcpy(&more, &exponent, sizeof more);
  bits += more << 52;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// exp(x) for x < 700, to 2.2e-16 of the value; 0 below -700 and for what is no number.
///
/// exp(x) = 2^n exp(r) with n the integer nearest to x / ln 2. ln 2 in two parts keeps r, |r| <= ln 2 / 2, exact to the last place (W. J.
/// Cody, W. Waite, Software Manual for the Elementary Functions, 1980, chapter 6); what Taylor's series leaves behind its 13th power is
/// below 6e-18 of the sum.
template <class Real>
DEMBARK_HOT Real exponential(Real x) {
  // Added to a number below 2^51 it rounds that to an integer, which then stands in the last bits of the sum.
  constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52
  const Real shifted = x * 1.4426950408889634 + shift, n = shifted - shift;
  const Real r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10, q = r * r;
  // Even and odd powers apart, for either sum waits for itself only; 1 comes last, so that its rounding is all but the only one.
  const Real even = 1.0 / 2 + q * (1.0 / 24 + q * (1.0 / 720 + q * (1.0 / 40320 + q * (1.0 / 3628800 + q * (1.0 / 479001600)))));
  const Real odd = 1.0 / 6 + q * (1.0 / 120 + q * (1.0 / 5040 + q * (1.0 / 362880 + q * (1.0 / 39916800 + q * (1.0 / 6227020800.0)))));
  const Real sum = 1.0 + (r + q * (even + r * odd));
  return select(x > -700.0, times_power_of_two(sum, shifted), Real(0.0));
}

}  // namespace dembark
