// What grains, contacts and plain arrays carry onto the grid. The columns are those of dembark.postproc.fields.sums.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fields_shafts.hpp"

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

inline Segment segment(const double* first, const double* branch) {
  return {{first[0], first[1], first[2]}, {branch[0], branch[1], branch[2]}};
}

// Each source knows the place of each of its `count` lines, what of a line is needed there to find its columns (`Contribution`), and
// fills those in. `moved`: what columns become when a place is moved by `shift`.

// Lines from `first` to `first + branch`, (count, 3) each, with any columns.
struct PlainSource {
  static constexpr bool placed = false;  // whether columns depend on where an image is
  using Place = Segment;
  struct Contribution {
    std::int32_t line;
  };
  std::int64_t count;
  const double *first, *branch;
  int columns;
  const double* values;  // (count, columns)

  Place place(std::int64_t n) const { return segment(first + 3 * n, branch + 3 * n); }
  Contribution contribution(std::int64_t n) const { return {std::int32_t(n)}; }
  void prefetch(const Contribution& contribution) const { __builtin_prefetch(values + std::int64_t(contribution.line) * columns); }
  void fill(const Record<PlainSource>& record, double* out) const {
    std::copy_n(values + std::int64_t(record.contribution.line) * columns, columns, out);
  }
};

// What grains carry.
struct GrainSource {
  static constexpr bool placed = true;
  static constexpr int columns = grain_columns;
  using Place = Point;
  struct Contribution {
    double mass, radius, velocity[3], peculiar[3], touches, liquid;
  };
  std::int64_t count;
  const double* places;  // (count, 3)
  const double *masses, *radii, *velocities, *peculiar, *touches, *liquid;  // (n,), (n,), (n, 3), (n, 3), (n,), (n,) or null
  double middle[3];

  Place place(std::int64_t n) const { return {{places[3 * n], places[3 * n + 1], places[3 * n + 2]}}; }
  Contribution contribution(std::int64_t n) const {
    const double *v = velocities + 3 * n, *w = peculiar + 3 * n;
    return {masses[n], radii[n], {v[0], v[1], v[2]}, {w[0], w[1], w[2]}, touches[n], liquid ? liquid[n] : 0.0};
  }
  void prefetch(const Contribution&) const {}

  void fill(const Record<GrainSource>& record, double* out) const {
    const Contribution& grain = record.contribution;
    const double mass = grain.mass, *place = record.place.first;
    const double x[3] = {place[0] - middle[0], place[1] - middle[1], place[2] - middle[2]};
    out[0] = mass;
    for (int i = 0; i < 3; ++i) {
      out[1 + i] = mass * grain.velocity[i];
      out[10 + i] = mass * x[i];
    }
    symmetric_parts(grain.peculiar, grain.peculiar, mass, out + 4);
    symmetric_parts(x, x, mass, out + 13);
    product(grain.velocity, x, mass, out + 19);
    out[28] = 1.0;
    out[29] = 4.0 / 3.0 * 3.14159265358979323846 * grain.radius * grain.radius * grain.radius;
    out[30] = grain.touches;
    out[31] = grain.liquid;
  }

  static void moved(const double shift[3], double* values) {
    constexpr int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const double mass = values[0], *momentum = values + 1, *x = values + 10;
    for (int part = 0; part < 6; ++part) {
      const int a = pair[part][0], b = pair[part][1];
      values[13 + part] += x[a] * shift[b] + shift[a] * x[b] + mass * shift[a] * shift[b];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) values[19 + 3 * i + j] += momentum[i] * shift[j];
    for (int i = 0; i < 3; ++i) values[10 + i] += mass * shift[i];
  }
};

// How a grain moves, in one line of the cache.
struct alignas(64) Motion {
  double velocity[3], omega[3], radius;
};

// What contacts carry.
struct ContactSource {
  static constexpr bool placed = false;
  static constexpr int columns = contact_columns;
  using Place = Segment;
  struct Contribution {
    double force[3];
    std::int32_t pair[2], line;
    bool touching;
  };
  std::int64_t count;
  const double *first, *branch, *forces;  // (m, 3)
  const std::int64_t* pairs;              // (m, 2): rows of the grains
  const bool* touching;                   // (m,)
  const Motion* motions;                  // (n,) of the grains, or null
  const double *liquid, *power;           // (m,) or null

  Place place(std::int64_t m) const { return segment(first + 3 * m, branch + 3 * m); }
  Contribution contribution(std::int64_t m) const {
    const double* f = forces + 3 * m;
    return {{f[0], f[1], f[2]}, {std::int32_t(pairs[2 * m]), std::int32_t(pairs[2 * m + 1])}, std::int32_t(m), touching[m]};
  }

  void prefetch(const Contribution& contribution) const {
    if (motions)
      for (const std::int32_t grain : contribution.pair) __builtin_prefetch(motions + grain);
    if (liquid) __builtin_prefetch(liquid + contribution.line);
    if (power) __builtin_prefetch(power + contribution.line);
  }

  void fill(const Record<ContactSource>& record, double* out) const {
    const double *l = record.place.branch, *f = record.contribution.force;
    const double length = std::sqrt(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]), inverse = 1.0 / std::max(length, 1e-300);
    const double n[3] = {l[0] * inverse, l[1] * inverse, l[2] * inverse}, touches = record.contribution.touching ? 1.0 : 0.0;
    product(f, l, -1.0, out);
    symmetric_parts(n, n, touches, out + 9);
    out[15] = touches;
    out[16] = out[17] = 0.0;
    out[18] = liquid ? liquid[record.contribution.line] : 0.0;
    out[19] = 1.0;
    if (motions) {
      const Motion &one = motions[record.contribution.pair[0]], &two = motions[record.contribution.pair[1]];
      const double half = 0.5 * (one.radius + two.radius - length), arm_one = one.radius - half, arm_two = two.radius - half;
      double spin[3], relative[3];
      for (int i = 0; i < 3; ++i) {
        spin[i] = arm_one * one.omega[i] + arm_two * two.omega[i];
        relative[i] = one.velocity[i] - two.velocity[i];
      }
      relative[0] += spin[1] * n[2] - spin[2] * n[1];
      relative[1] += spin[2] * n[0] - spin[0] * n[2];
      relative[2] += spin[0] * n[1] - spin[1] * n[0];
      const auto dot = [](const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
      out[16] = -dot(f, relative);
      out[17] = out[16] + dot(f, n) * dot(relative, n);
    }
    if (power) out[16] = power[record.contribution.line];
  }
};

// `radii` (n,), `velocities` and `omegas` (n, 3) of grains, together.
inline Buffer<Motion> motions_of(std::int64_t count, const double* radii, const double* velocities, const double* omegas, int threads) {
  Buffer<Motion> motions = room<Motion>(std::size_t(count));
  on_threads(threads, [&](int part) {
    const Range range(count, part, threads);
    for (std::int64_t n = range.begin; n < range.end; ++n) {
      const double *v = velocities + 3 * n, *w = omegas + 3 * n;
      motions[std::size_t(n)] = {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}, radii[n]};
    }
  });
  return motions;
}

}  // namespace dembark::fields
