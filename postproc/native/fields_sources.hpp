// What grains, contacts and plain arrays carry onto the grid. The columns are those of dembark.postproc.field_sums.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace dembark::fields {

constexpr int grain_columns = 32, contact_columns = 20;

// Components xx yy zz xy xz yz of the product of two vectors.
inline void symmetric_parts(const double a[3], const double b[3], double factor, double* out) {
  out[0] = factor * a[0] * b[0];
  out[1] = factor * a[1] * b[1];
  out[2] = factor * a[2] * b[2];
  out[3] = factor * a[0] * b[1];
  out[4] = factor * a[0] * b[2];
  out[5] = factor * a[1] * b[2];
}

inline void product(const double a[3], const double b[3], double factor, double* out) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[3 * i + j] = factor * a[i] * b[j];
}

struct PlainSource {
  static constexpr bool placed = false;  // whether what it carries depends on where an image is
  int columns;
  const double* values;  // (count, columns)

  void prefetch(std::int64_t line) const { __builtin_prefetch(values + line * columns); }
  void prefetch_linked(std::int64_t) const {}

  void fill(std::int64_t line, const double*, double* out) const { std::copy_n(values + line * columns, columns, out); }
};

struct GrainSource {
  static constexpr bool placed = true;
  static constexpr int columns = grain_columns;
  const double *masses, *radii, *velocities, *peculiar, *touches, *liquid;  // (n,), (n,), (n, 3), (n, 3), (n,), (n,) or null
  double middle[3];

  void prefetch(std::int64_t n) const {
    for (const double* values : {masses, radii, touches, velocities + 2 * n, peculiar + 2 * n}) __builtin_prefetch(values + n);
  }
  void prefetch_linked(std::int64_t) const {}

  void fill(std::int64_t n, const double* place, double* out) const {
    const double mass = masses[n], radius = radii[n], *v = velocities + 3 * n, *w = peculiar + 3 * n;
    const double x[3] = {place[0] - middle[0], place[1] - middle[1], place[2] - middle[2]};
    out[0] = mass;
    for (int i = 0; i < 3; ++i) {
      out[1 + i] = mass * v[i];
      out[10 + i] = mass * x[i];
    }
    symmetric_parts(w, w, mass, out + 4);
    symmetric_parts(x, x, mass, out + 13);
    product(v, x, mass, out + 19);
    out[28] = 1.0;
    out[29] = 4.0 / 3.0 * 3.14159265358979323846 * radius * radius * radius;
    out[30] = touches[n];
    out[31] = liquid ? liquid[n] : 0.0;
  }
};

struct ContactSource {
  static constexpr bool placed = false;
  static constexpr int columns = contact_columns;
  const double *branch, *forces;                 // (m, 3)
  const std::int64_t* pairs;                     // (m, 2): rows of the grains
  const bool* touching;                          // (m,)
  const double *radii, *velocities, *omegas;     // (n,), (n, 3), (n, 3) or null
  const double *liquid, *power;                  // (m,) or null

  void prefetch(std::int64_t m) const {
    __builtin_prefetch(forces + 3 * m);
    __builtin_prefetch(touching + m);
    __builtin_prefetch(pairs + 2 * m);
  }

  void prefetch_linked(std::int64_t m) const {
    if (!omegas) return;
    for (const std::int64_t grain : {pairs[2 * m], pairs[2 * m + 1]}) {
      __builtin_prefetch(radii + grain);
      __builtin_prefetch(velocities + 3 * grain);
      __builtin_prefetch(omegas + 3 * grain);
    }
  }

  void fill(std::int64_t m, const double*, double* out) const {
    const double *l = branch + 3 * m, *f = forces + 3 * m;
    const double length = std::sqrt(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]), inverse = 1.0 / std::max(length, 1e-300);
    const double n[3] = {l[0] * inverse, l[1] * inverse, l[2] * inverse};
    product(f, l, -1.0, out);
    symmetric_parts(n, n, touching[m] ? 1.0 : 0.0, out + 9);
    out[15] = touching[m] ? 1.0 : 0.0;
    out[16] = out[17] = 0.0;
    out[18] = liquid ? liquid[m] : 0.0;
    out[19] = 1.0;
    if (omegas) {
      const std::int64_t one = pairs[2 * m], two = pairs[2 * m + 1];
      const double half = 0.5 * (radii[one] + radii[two] - length), arm_one = radii[one] - half, arm_two = radii[two] - half;
      double spin[3], relative[3];
      for (int i = 0; i < 3; ++i) {
        spin[i] = arm_one * omegas[3 * one + i] + arm_two * omegas[3 * two + i];
        relative[i] = velocities[3 * one + i] - velocities[3 * two + i];
      }
      relative[0] += spin[1] * n[2] - spin[2] * n[1];
      relative[1] += spin[2] * n[0] - spin[0] * n[2];
      relative[2] += spin[0] * n[1] - spin[1] * n[0];
      const auto dot = [](const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
      out[16] = -dot(f, relative);
      out[17] = out[16] + dot(f, n) * dot(relative, n);
    }
    if (power) out[16] = power[m];
  }
};

}  // namespace dembark::fields
