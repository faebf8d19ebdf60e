// Published closed forms of the capillary force between two equal spheres of radius R, and of the distance at which a bridge breaks.
//
// Reduced quantities: v = V/R^3, gap s/R, force F/(gamma R), positive = attractive; unequal spheres enter with R = 2 Ri Rj/(Ri + Rj)
// (Derjaguin). Contact angle in rad. All functions are finite for v > 0, gap >= 0 and angles of 0...pi/2. Outside the ranges of the
// regressions (v about 1e-6...0.1, angles up to 50...60 degrees) their coefficients are held, or kept from changing sign.
#pragma once

#include <algorithm>
#include <cmath>

#include "../constants.hpp"
#include "../vec3.hpp"  // DEMBARK_FUNCTION

namespace dembark::capillary {

/// (1 + theta/2) v^(1/3). Lian, Thornton & Adams, J. Colloid Interface Sci. 161 (1993) 138.
template <class Real>
DEMBARK_FUNCTION inline Real lian_rupture(Real v, Real theta) {
  using std::cbrt;
  return (Real(1) + Real(0.5) * theta) * cbrt(v);
}

/// (1 + theta/2) (v^(1/3) + v^(2/3)/10). Willett et al., Langmuir 16 (2000) 9396.
template <class Real>
DEMBARK_FUNCTION inline Real willett_rupture(Real v, Real theta) {
  using std::cbrt;
  const Real c = cbrt(v);
  return (Real(1) + Real(0.5) * theta) * (c + Real(0.1) * c * c);
}

/// Willett's closed form: 2 pi cos(theta) / (1 + 1.05 S + 2.5 S^2), S = s / sqrt(v).
template <class Real>
DEMBARK_FUNCTION inline Real willett_force(Real gap, Real v, Real cosine) {
  using std::sqrt;
  const Real scaled = gap / sqrt(v);
  return Real(two_pi) * cosine / (Real(1) + scaled * (Real(1.05) + Real(2.5) * scaled));
}

/// Rabinovich, Esayanur & Moudgil, Langmuir 21 (2005) 10992, eqs. 19-20: 2 pi [cos(theta) / (1 + s/(2 d)) + sin(alpha) sin(alpha + theta)].
/// Their d = (s/2)(sqrt(1 + 2 v/(pi s^2)) - 1) is written as 2 d = A / (s + sqrt(s^2 + A)), A = 2 v/pi, which is regular at s = 0.
template <class Real>
DEMBARK_FUNCTION inline Real rabinovich_force(Real gap, Real v, Real sine, Real cosine) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Real a = v * Real(0.63661977236758134308);
  const Real sum = gap + sqrt(gap * gap + a);
  // The immersion angle of a flat approximation; a hemisphere is the most that it can mean.
  const Real alpha = std::min(sqrt(a / sum), Real(1.57079632679489661923));
  const Real s = sin(alpha), c = cos(alpha);
  return Real(two_pi) * (cosine / (Real(1) + gap * sum / a) + s * (s * cosine + c * sine));
}

/// Regression of Willett et al. (2000), appendix: 2 pi exp(f1 - f2 exp(f3 ln S + f4 ln^2 S)), S = (s/2) / sqrt(v).
class WillettRegression {
 public:
  WillettRegression() = default;
  explicit WillettRegression(double t) {
    const double t2 = t * t;
    set(f1_, -0.44507 + 0.050832 * t - 1.1466 * t2, -0.1119 - 0.000411 * t - 0.1490 * t2, -0.012101 - 0.0036456 * t - 0.01255 * t2,
        -0.0005 - 0.0003505 * t - 0.00029076 * t2);
    set(f2_, 1.9222 - 0.57473 * t - 1.2918 * t2, -0.0668 - 0.1201 * t - 0.22574 * t2, -0.0013375 - 0.0068988 * t - 0.01137 * t2, 0.0);
    set(f3_, 1.268 - 0.01396 * t - 0.23566 * t2, 0.198 + 0.092 * t - 0.06418 * t2, 0.02232 + 0.02238 * t - 0.009853 * t2,
        0.0008585 + 0.001318 * t - 0.00053 * t2);
    set(f4_, -0.010703 + 0.073776 * t - 0.34742 * t2, 0.03345 + 0.04543 * t - 0.09056 * t2, 0.0018574 + 0.004456 * t - 0.006257 * t2, 0.0);
  }

  DEMBARK_FUNCTION double force(double gap, double v) const {
    // std::clamp may assert, which no device can.
    const double l = std::log(std::min(std::max(v, 1e-6), 0.1));
    const double f1 = at(f1_, l);
    if (!(gap > 0.0)) return two_pi * std::exp(f1);
    const double f2 = std::max(at(f2_, l), 0.0), f3 = at(f3_, l), f4 = std::min(at(f4_, l), 0.0);
    double x = std::log(0.5 * gap / std::sqrt(v));
    // The parabola has its top near rupture; past it the fit would make the force rise with the gap.
    if (2.0 * f4 * x < -f3) x = -0.5 * f3 / f4;
    const double exponent = (f3 + f4 * x) * x;
    return two_pi * std::exp(f1 - f2 * std::exp(exponent));
  }

 private:
  double f1_[4] = {}, f2_[4] = {}, f3_[4] = {}, f4_[4] = {};

  static void set(double (&f)[4], double a, double b, double c, double d) { f[0] = a, f[1] = b, f[2] = c, f[3] = d; }
  DEMBARK_FUNCTION static double at(const double (&f)[4], double l) { return f[0] + l * (f[1] + l * (f[2] + l * f[3])); }
};

/// Bagheri, Roy & Poeschel (2024), arXiv:2310.11485.
class BagheriFit {
 public:
  BagheriFit() = default;
  explicit BagheriFit(double theta) : theta_(theta), sine_(std::sin(theta)) {}

  DEMBARK_FUNCTION double force(double gap, double v) const {
    const double s = gap / willett_rupture(v, theta_);
    const double l = std::log(std::min(std::max(v, 1e-9), 1.0));
    const auto power = [l](double n) { return std::exp(n * l); };
    const double dry = two_pi * (1.0 - 0.3823 * power(0.2586));
    const double a = 0.4158 * power(0.2835) + 0.6474, b = -0.2087 * power(0.3113) + 2.267;
    const double touching = std::max(1.0 - a * std::pow(sine_, b), 0.0) * dry;
    const double as = -0.3319 * power(0.4974) + 0.6717 * power(0.1995);
    const double bs = 13.84 * power(-0.3909) - 12.11 * power(-0.3945);
    const double at = (-0.007815 * l * l - 0.2105 * l - 1.426) * theta_ * theta_ * theta_ +
                      (-1.78 * power(0.8351) + 0.6669 * power(-0.01391)) * theta_ + 1.0;
    return touching * (1.0 + as * s) / (1.0 + std::max(at, 0.0) * bs * s * (as + s));
  }

 private:
  double theta_ = 0.0, sine_ = 0.0;
};

}  // namespace dembark::capillary
