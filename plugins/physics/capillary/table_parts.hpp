// Parts of the tables of bridges: the axis of the volume, polynomials, splines.
//
// In v = V/R^3 a cell is an octave, so that its number is the exponent of the floating-point number; within it the coordinate mu, a
// polynomial in m, of the mantissa 1 + m stands in for log2(1 + m).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace dembark::capillary::detail {

constexpr int first_octave = -30;  ///< v >= 2^-30, about 9.3e-10
constexpr int octaves = 30;        ///< v <= 1

using Cubic = std::array<double, 4>;

inline double cubic(const Cubic& c, double x) { return (c[0] + c[1] * x) + (c[2] + c[3] * x) * (x * x); }

// Near log2(1 + m), 0 and 1 at the ends, and chosen so that v^(-1/3), which 1/s_r nearly is, is a cubic in it to 5e-7: an error e of
// s_r shows as sqrt(e) in the force at rupture.
inline double octave_coordinate(double m) { return m * ((1.550526 - 0.762722 * m) + (m * m) * (0.252754 - 0.040558 * m)); }

inline double volume_at(int octave, double mu) {
  double m = mu;
  for (int iteration = 0; iteration < 40; ++iteration) m += mu - octave_coordinate(m);
  return std::ldexp(1.0 + m, first_octave + octave);
}

// Octave and coordinate in it. Above the table v is held; below it lengths go on as v^(1/3) and the fall as v^(1/2), the limits of
// a vanishing bridge.
struct Place {
  int octave;
  double mu, shrink = 1.0, steepen = 1.0;
  explicit Place(double v) {
    std::uint64_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    octave = static_cast<int>(bits >> 52) - 1023 - first_octave;
    if (static_cast<unsigned>(octave) < static_cast<unsigned>(octaves)) {
      bits = (bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL;
      double mantissa;
      std::memcpy(&mantissa, &bits, sizeof mantissa);
      const double m = mantissa - 1.0;
      mu = octave_coordinate(m);
    } else if (octave >= octaves) {
      octave = octaves - 1;
      mu = 1.0;
    } else {
      octave = 0;
      mu = 0.0;
      const double ratio = v / std::ldexp(1.0, first_octave);
      shrink = std::cbrt(ratio);
      steepen = 1.0 / std::sqrt(ratio);
    }
  }
};

// The cubic through values at mu = 0, 1/3, 2/3, 1.
inline Cubic through(double a, double b, double c, double d) {
  return {a, -5.5 * a + 9.0 * b - 4.5 * c + d, 9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d, -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d};
}

// Not-a-knot cubic spline through equidistant values; coefficients of each interval in 0...1.
template <std::size_t points>
inline std::array<Cubic, points - 1> spline(const std::array<double, points>& h) {
  constexpr int n = points - 1;
  std::array<double, n + 1> second{}, upper{}, right{};
  const auto bend = [&h](int i) { return h[i - 1] - 2.0 * h[i] + h[i + 1]; };
  // M_{i-1} + 4 M_i + M_{i+1} = 6 bend, with M_0 = 2 M_1 - M_2 put in: M_1 = bend(1), M_{n-1} = bend(n-1).
  second[1] = bend(1);
  second[n - 1] = bend(n - 1);
  for (int i = 2; i < n - 1; ++i) {
    const double rest = i == 2 ? second[1] : 0.0, below = i == 2 ? 0.0 : 1.0;
    const double pivot = 4.0 - below * upper[i - 1];
    upper[i] = 1.0 / pivot;
    right[i] = (6.0 * bend(i) - rest - (i == n - 2 ? second[n - 1] : 0.0) - below * right[i - 1]) / pivot;
  }
  for (int i = n - 2; i >= 2; --i) second[i] = right[i] - (i == n - 2 ? 0.0 : upper[i] * second[i + 1]);
  second[0] = 2.0 * second[1] - second[2];
  second[n] = 2.0 * second[n - 1] - second[n - 2];
  std::array<Cubic, n> c;
  for (int i = 0; i < n; ++i)
    c[i] = {h[i], h[i + 1] - h[i] - (2.0 * second[i] + second[i + 1]) / 6.0, 0.5 * second[i], (second[i + 1] - second[i]) / 6.0};
  return c;
}

inline void require(bool converged, double theta, double v) {
  if (converged) return;
  char line[128];
  std::snprintf(line, sizeof line, "the liquid bridge of contact angle %g rad and volume %g R^3 did not converge", theta, v);
  throw std::runtime_error(line);
}

inline double square(double x) { return x * x; }

/// The bridges of one volume, from rupture (zeta = 0) to touching (zeta = 1): H of bridge_table.hpp as a spline of `cells` cells in zeta.
template <int cells>
struct Column {
  double inverse_rupture = 0.0, fall = 0.0;
  std::array<Cubic, cells> spline{};

  Column() = default;
  Column(double v, double rupture) : inverse_rupture(1.0 / rupture), fall(1.0 / std::sqrt(v)) {}

  /// Gap at zeta = i / cells.
  double gap(int i) const {
    const double zeta2 = square(static_cast<double>(i) / cells);
    return (1.0 - zeta2) / (inverse_rupture + fall * zeta2);
  }

  /// Takes F / (gamma R) at these gaps, force(i).
  template <class Force>
  void fit(Force force) {
    std::array<double, cells + 1> h;
    for (int i = 0; i <= cells; ++i) h[i] = force(i) * square(1.0 + fall * gap(i));
    spline = detail::spline(h);
  }

  double touching() const {
    const Cubic& last = spline[cells - 1];
    return last[0] + last[1] + last[2] + last[3];
  }
};

/// Solves for a column and its bridges, the one at rupture first, from a path of bridges from touching to rupture: starts between its
/// points keep Newton's method on the stable branch up to the fold.
template <int cells, class Solver, class Bridge>
bool solve_column(const Solver& solver, double v, const std::vector<Bridge>& path, std::array<Bridge, cells + 1>& at, Column<cells>& c) {
  c = {v, solver.shape(path.back()).gap};
  at[0] = path.back();
  at[cells] = path.front();
  std::size_t right = 1;
  double left_gap = 0.0, right_gap = solver.shape(path[1]).gap;
  for (int i = cells - 1; i > 0; --i) {
    const double gap = c.gap(i);
    while (gap > right_gap && right + 1 < path.size()) {
      left_gap = right_gap;
      right_gap = solver.shape(path[++right]).gap;
    }
    at[i] = between(path[right - 1], path[right], (gap - left_gap) / (right_gap - left_gap));
    if (!solver.solve(v, gap, at[i])) return false;
  }
  c.fit([&](int i) { return solver.shape(at[i]).force; });
  return true;
}

}  // namespace dembark::capillary::detail
