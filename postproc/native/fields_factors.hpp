// Packs of doubles, and the shares of the Gaussian along each axis.
// Part of fields_spread.hpp, compiled for several instruction sets.
#pragma once

#include "dembark/pack.hpp"

namespace dembark::fields {
namespace {

inline double clamp(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

// Integral from 0 to x of the Gaussian of standard deviation 1, cut at 3 and normalised: x times a polynomial in x^2 of degree 16, fitted
// to 1e-15 (erf(x / sqrt 2) / (2 erf(3 / sqrt 2)) at Chebyshev points).
template <class Number>
inline Number half_gaussian(Number x) {
  x = x < -3.0 ? Number{} - 3.0 : x > 3.0 ? Number{} + 3.0 : x;
  const Number u = x * x * (1.0 / 4.5) - 1.0;
  static constexpr double c[17] = {0.22832961018667941, -0.09308378714444443, 0.046096695165837726, -0.020626803743848798,
                                   0.0080432045225557868, -0.0027365221310244204, 0.00082009289492281979, -0.00021881942106935577,
                                   5.2510114069543034e-05, -1.1434606565200895e-05, 2.2772871863171932e-06, -4.1764135591387858e-07,
                                   7.0927769907576937e-08, -1.1192516199860439e-08, 1.6650237004264441e-09, -2.464845016263867e-10,
                                   2.9930377544698147e-11};
  Number sum = u * c[16] + c[15];
  for (int k = 14; k >= 0; --k) sum = sum * u + c[k];
  return sum * x;
}

using Pack = double __attribute__((vector_size(8 * LANES)));

inline Pack load(const double* p) {
  Pack pack;
  __builtin_memcpy(&pack, p, sizeof pack);
  return pack;
}

inline void store(double* p, const Pack& pack) { __builtin_memcpy(p, &pack, sizeof pack); }

// Shares along each axis of all places on the lines of a group: (count, nodes, stride) for each axis, in the cells of the group's window,
// zero beyond the line's own; those along x times the nodes' weights.
struct Factors {
  double* of[3];
  long stride[3];
};

inline double* aligned(double* p) { return reinterpret_cast<double*>((reinterpret_cast<unsigned long long>(p) + 63) & ~63ull); }

// `pack` moved up by one lane, with the last lane of `before` in the first.
inline Pack moved_up(const Pack& before, const Pack& pack) {
#if LANES == 8
  return shuffled<7, 8, 9, 10, 11, 12, 13, 14>(before, pack);
#elif LANES == 4
  return shuffled<3, 4, 5, 6>(before, pack);
#else
  return shuffled<1, 2>(before, pack);
#endif
}

// What the shares along an axis about `place` are scaled by.
inline double closing(const Cells& cells, const Kernel& kernel, int axis, double place) {
  if (!kernel.closed || cells.periodic[axis]) return 1.0;
  const double scale = 1.0 / kernel.width;
  const double inside = half_gaussian((cells.high[axis] - place) * scale) - half_gaussian((cells.low[axis] - place) * scale);
  return place >= cells.low[axis] && place <= cells.high[axis] && inside > 0.0 ? 1.0 / inside : 0.0;
}

inline Factors gaussian_factors(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, double* scratch,
                                double** free) {
  const double scale = 1.0 / kernel.width;
  Pack above;  // numbers of the upper edges of the first cells
  for (int lane = 0; lane < LANES; ++lane) above[lane] = lane + 1;
  Factors factors;
  for (int axis = 0; axis < 3; ++axis) {
    const long stride = factors.stride[axis] = (group.all.count[axis] + LANES - 1) / LANES * LANES;
    const double step = cells.spacing[axis], low = cells.low[axis];
    double* to = factors.of[axis] = aligned(scratch);
    for (int line = 0; line < group.count; ++line) {
      const int start = group.windows[line].start[axis], count = group.windows[line].count[axis];
      const Pack edges = (above + double(start)) * step + low;
      double* const from = to + (start - group.all.start[axis]);
      for (int q = 0; q < nodes.count; ++q, to += stride) {
        const double place = group.first[3 * line + axis] + nodes.place[q] * group.branch[3 * line + axis];
        // The node's weight goes into the shares along x.
        const double factor = closing(cells, kernel, axis, place) * (axis == 0 ? nodes.weight[q] : 1.0);
        const double lowest = (low + double(start) * step - place) * scale;
        Pack below = Pack{} + (lowest > -3.0 ? half_gaussian(lowest) : half_gaussian(-3.0));
        for (long i = 0; i < stride; i += LANES) store(to + i, Pack{});
        // What a pack has too much belongs to the next place, which is filled later.
        for (int i = 0; i < count; i += LANES) {
          const Pack upper = half_gaussian<Pack>((edges + double(i) * step - place) * scale);
          store(from + q * stride + i, (upper - moved_up(below, upper)) * factor);
          below = upper;
        }
      }
    }
    scratch = to + LANES;
  }
  *free = aligned(scratch);
  return factors;
}

}  // namespace
}  // namespace dembark::fields
