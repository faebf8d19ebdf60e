// The loops over neighbours, four at a time, for the instruction set that their pack names (pack.hpp). They know arrays and numbers only,
// so that a translation unit that is compiled for a newer processor shares no code with others.
//
// Particles come as records of one cache line, neighbours as rows that are filled up with a record far away from all others.
#pragma once

#include <cstddef>

#include "../vec3.hpp"
#include "kernels.hpp"
#include "pair_terms.hpp"
#include "shepard.hpp"
#include "xsph.hpp"

namespace dembark::sph {

/// A particle as the loops read it. What a and b are each loop says.
struct alignas(64) Record {
  double x, y, z, a, vx, vy, vz, b;
};

/// Four sums of a particle.
struct alignas(32) Quad {
  double x, y, z, w;
};

/// What the loops get: rows of the particles begin ... end - 1 of `own`, with neighbours among `others`.
struct LoopArguments {
  const Record* own = nullptr;
  const Record* others = nullptr;
  const int* start = nullptr;
  const int* neighbour = nullptr;
  int begin = 0, end = 0;
  int dimension = 3;
  double h = 1.0;
  PairCoefficients pair{};
  double volume = 0.0;                     ///< m/rho_0, of sums over places
  double* rate = nullptr;                  ///< of density, kg/m^3/s
  double* diffused = nullptr;              ///< its part by diffusion, with Places
  Quad* shift = nullptr;                   ///< grad C and divergence of positions; of xsph_pairs
  Quad* sum = nullptr;                     ///< accelerations (m/s^2), or what the loop says
  Vec3<double>* velocity_sum = nullptr;    ///< of wall_sums
  const Vec3<double>* velocity = nullptr;  ///< of the solid particles themselves, m/s
};

namespace loops {

template <class P>
struct Four {
  Vec3<P> x;
  P a;
  Vec3<P> v;
  P b;
};

template <class P>
DEMBARK_HOT void transpose(const double* r0, const double* r1, const double* r2, const double* r3, P& x, P& y, P& z, P& w) {
  typedef typename P::Lanes Lanes;
  const Lanes a = P::load(r0).lanes, b = P::load(r1).lanes, c = P::load(r2).lanes, d = P::load(r3).lanes;
  const Lanes ab_even = shuffled<0, 4, 2, 6>(a, b), ab_odd = shuffled<1, 5, 3, 7>(a, b);
  const Lanes cd_even = shuffled<0, 4, 2, 6>(c, d), cd_odd = shuffled<1, 5, 3, 7>(c, d);
  x = shuffled<0, 1, 4, 5>(ab_even, cd_even);
  z = shuffled<2, 3, 6, 7>(ab_even, cd_even);
  y = shuffled<0, 1, 4, 5>(ab_odd, cd_odd);
  w = shuffled<2, 3, 6, 7>(ab_odd, cd_odd);
}

template <class P>
DEMBARK_HOT Four<P> gather(const Record* from, const int* j) {
  const double *r0 = &from[j[0]].x, *r1 = &from[j[1]].x, *r2 = &from[j[2]].x, *r3 = &from[j[3]].x;
  Four<P> f;
  transpose(r0, r1, r2, r3, f.x.x, f.x.y, f.x.z, f.a);
  transpose(r0 + 4, r1 + 4, r2 + 4, r3 + 4, f.v.x, f.v.y, f.v.z, f.b);
  return f;
}

/// Adds a quad of each of the four to those of the particles j.
template <class P>
DEMBARK_HOT void scatter(Quad* to, const int* j, const P& x, const P& y, const P& z, const P& w) {
  // The transposed of the transposed.
  alignas(32) double rows[4][4];
  x.store(rows[0]), y.store(rows[1]), z.store(rows[2]), w.store(rows[3]);
  P q[4];
  transpose(rows[0], rows[1], rows[2], rows[3], q[0], q[1], q[2], q[3]);
  for (int k = 0; k < 4; ++k) {
    double* const place = &to[j[k]].x;
    (P::load(place) + q[k]).store(place);
  }
}

template <class P>
DEMBARK_HOT double total(const P& p) {
  return (p[0] + p[1]) + (p[2] + p[3]);
}

template <class P>
DEMBARK_HOT Vec3<P> spread(double x, double y, double z) {
  return {P(x), P(y), P(z)};
}

/// Rates of density of fluid pairs; with Places that of diffusion apart, and the sums of shifting. a: s of diffusion, b: p/rho^2. Returns
/// the power that diffusion takes out of the compression energy over m (W/kg).
template <class P, class Kernel, bool Places>
double density_pairs(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  P lost(0.0);
  for (int i = in.begin; i < in.end; ++i) {
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z), v = spread<P>(own.vx, own.vy, own.vz);
    const P s(own.a), pressure(own.b);
    P rate(0.0), diffused(0.0), cx(0.0), cy(0.0), cz(0.0), divergence(0.0);
    const int row = i - in.begin;
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const int* const j = in.neighbour + k;
      const Four<P> other = gather<P>(in.others, j);
      const Vec3<P> d = x - other.x;
      const P squared = dot(d, d), slope = kernel.slope(sqrt(squared)), push = P(in.pair.mass) * slope;
      const P compression = compression_rate(push, dot(v - other.v, d)), diffusion = diffusion_rate(in.pair, push, s, other.a);
      const P back = Places ? compression : compression - diffusion;
      rate += Places ? compression : compression + diffusion;
      for (int l = 0; l < 4; ++l) in.rate[j[l]] += back[l];
      lost -= diffusion * (pressure - other.b);
      if constexpr (Places) {
        const P weight = P(in.volume) * slope, wx = weight * d.x, wy = weight * d.y, wz = weight * d.z, spread_out = -(weight * squared);
        cx += wx, cy += wy, cz += wz, divergence += spread_out, diffused += diffusion;
        for (int l = 0; l < 4; ++l) in.diffused[j[l]] -= diffusion[l];
        scatter(in.shift, j, -wx, -wy, -wz, spread_out);
      }
    }
    in.rate[i] += total(rate);
    if constexpr (Places) {
      in.diffused[i] += total(diffused);
      Quad& q = in.shift[i];
      q = {q.x + total(cx), q.y + total(cy), q.z + total(cz), q.w + total(divergence)};
    }
  }
  return total(lost);
}

/// What solid particles add to the rates of fluid ones, or fluid ones to those of solid ones.
template <class P, class Kernel, bool Places>
double density_across(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  for (int i = in.begin; i < in.end; ++i) {
    const int row = i - in.begin;
    if (in.start[row] == in.start[row + 1]) continue;
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z), v = spread<P>(own.vx, own.vy, own.vz);
    P rate(0.0), cx(0.0), cy(0.0), cz(0.0), divergence(0.0);
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const Four<P> other = gather<P>(in.others, in.neighbour + k);
      const Vec3<P> d = x - other.x;
      const P squared = dot(d, d), slope = kernel.slope(sqrt(squared));
      rate += compression_rate(P(in.pair.mass) * slope, dot(v - other.v, d));
      if constexpr (Places) {
        const P weight = P(in.volume) * slope;
        cx += weight * d.x, cy += weight * d.y, cz += weight * d.z, divergence -= weight * squared;
      }
    }
    in.rate[i] += total(rate);
    if constexpr (Places) {
      Quad& q = in.shift[i];
      q = {q.x + total(cx), q.y + total(cy), q.z + total(cz), q.w + total(divergence)};
    }
  }
  return 0.0;
}

/// Accelerations of fluid pairs. a: p/rho^2, b: rho. Returns the power that viscosity dissipates over m (W/kg).
template <class P, class Kernel>
double force_pairs(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  P lost(0.0);
  for (int i = in.begin; i < in.end; ++i) {
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z), v = spread<P>(own.vx, own.vy, own.vz);
    const P pressure(own.a), rho(own.b);
    P ax(0.0), ay(0.0), az(0.0);
    const int row = i - in.begin;
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const int* const j = in.neighbour + k;
      const Four<P> other = gather<P>(in.others, j);
      const Vec3<P> d = x - other.x;
      const P squared = dot(d, d), push = P(in.pair.mass) * kernel.slope(sqrt(squared)), approach = dot(v - other.v, d);
      const P viscous = artificial_viscosity(in.pair, squared, approach, rho, other.b);
      const P factor = acceleration_factor(push, pressure + other.a + viscous);
      const P fx = factor * d.x, fy = factor * d.y, fz = factor * d.z;
      ax += fx, ay += fy, az += fz;
      scatter(in.sum, j, -fx, -fy, -fz, P(0.0));
      lost += viscous * push * approach;
    }
    Quad& q = in.sum[i];
    q = {q.x + total(ax), q.y + total(ay), q.z + total(az), q.w};
  }
  return total(lost);
}

/// Accelerations of fluid particles that solid ones give, or (own: solid particles) the reverse; the solid ones have the velocity that
/// viscosity meets. Slip: without viscosity. With `velocity`, those of the solid particles themselves, returns the power over m (W/kg) that
/// is lost beyond the compression of the fluid.
template <class P, class Kernel, bool Slip>
double force_across(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  P lost(0.0);
  for (int i = in.begin; i < in.end; ++i) {
    const int row = i - in.begin;
    if (in.start[row] == in.start[row + 1]) continue;
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z), v = spread<P>(own.vx, own.vy, own.vz);
    const Vec3<double> true_velocity = in.velocity ? in.velocity[i] : Vec3<double>{};
    const Vec3<P> u = spread<P>(true_velocity.x, true_velocity.y, true_velocity.z);
    const P pressure(own.a), rho(own.b);
    P ax(0.0), ay(0.0), az(0.0);
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const Four<P> other = gather<P>(in.others, in.neighbour + k);
      const Vec3<P> d = x - other.x;
      const P squared = dot(d, d), distance = sqrt(squared), push = P(in.pair.mass) * kernel.slope(distance);
      const P guard = guard_stress(in.pair, distance);
      P viscous(0.0);
      if constexpr (!Slip) viscous = artificial_viscosity(in.pair, squared, dot(v - other.v, d), rho, other.b);
      const P factor = acceleration_factor(push, pressure + other.a + guard + viscous);
      ax += factor * d.x, ay += factor * d.y, az += factor * d.z;
      lost += (pressure + guard + viscous) * push * dot(u - other.v, d);
    }
    Quad& q = in.sum[i];
    q = {q.x + total(ax), q.y + total(ay), q.z + total(az), q.w};
  }
  return total(lost);
}

/// Sums of XSPH over fluid pairs, `shift`: of (v_j - v_i) W/rho_ij. b: rho.
template <class P, class Kernel>
double xsph_pairs(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  for (int i = in.begin; i < in.end; ++i) {
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z), v = spread<P>(own.vx, own.vy, own.vz);
    const P rho(own.b);
    P ux(0.0), uy(0.0), uz(0.0);
    const int row = i - in.begin;
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const int* const j = in.neighbour + k;
      const Four<P> other = gather<P>(in.others, j);
      const Vec3<P> d = x - other.x, u = other.v - v;
      const P weight = xsph_weight(kernel.value(sqrt(dot(d, d))), rho, other.b);
      const P x_ = weight * u.x, y_ = weight * u.y, z_ = weight * u.z;
      ux += x_, uy += y_, uz += z_;
      scatter(in.shift, j, -x_, -y_, -z_, P(0.0));
    }
    Quad& q = in.shift[i];
    q = {q.x + total(ux), q.y + total(uy), q.z + total(uz), q.w};
  }
  return 0.0;
}

/// Sums of Shepard's filter over fluid pairs without the particles themselves, `sum`: W and W/rho. b: rho.
template <class P, class Kernel>
double shepard_pairs(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  for (int i = in.begin; i < in.end; ++i) {
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z);
    const P rho(own.b);
    P weight(0.0), volume(0.0);
    const int row = i - in.begin;
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const int* const j = in.neighbour + k;
      const Four<P> other = gather<P>(in.others, j);
      const Vec3<P> d = x - other.x;
      const P w = kernel.value(sqrt(dot(d, d)));
      const ShepardTerms<P> forth = shepard_terms(w, other.b), back = shepard_terms(w, rho);
      weight += forth.weight, volume += forth.volume;
      scatter(in.sum, j, back.weight, back.volume, P(0.0), P(0.0));
    }
    Quad& q = in.sum[i];
    q = {q.x + total(weight), q.y + total(volume), q.z, q.w};
  }
  return 0.0;
}

/// Sums of WallSums over the fluid around solid particles; fluid: a: p/rho^2, b: rho. `sum`: arm and weight; `rate`: pressure.
template <class P, class Kernel>
double wall_sums(const LoopArguments& in) {
  const Kernel kernel(in.dimension, in.h);
  for (int i = in.begin; i < in.end; ++i) {
    const int row = i - in.begin;
    if (in.start[row] == in.start[row + 1]) continue;
    const Record& own = in.own[i];
    const Vec3<P> x = spread<P>(own.x, own.y, own.z);
    P weight(0.0), pressure(0.0), ax(0.0), ay(0.0), az(0.0), vx(0.0), vy(0.0), vz(0.0);
    for (int k = in.start[row]; k < in.start[row + 1]; k += 4) {
      const Four<P> other = gather<P>(in.others, in.neighbour + k);
      const Vec3<P> d = x - other.x;
      const P w = kernel.value(sqrt(dot(d, d))), mass = w * other.b;
      weight += w, pressure += w * (other.a * other.b * other.b);
      ax += mass * d.x, ay += mass * d.y, az += mass * d.z;
      vx += w * other.v.x, vy += w * other.v.y, vz += w * other.v.z;
    }
    in.sum[i] = {total(ax), total(ay), total(az), total(weight)};
    in.rate[i] = total(pressure);
    in.velocity_sum[i] = {total(vx), total(vy), total(vz)};
  }
  return 0.0;
}

}  // namespace loops

/// The loops for one instruction set, with Wendland's kernel and the cubic spline, in the order of KernelName.
struct Loops {
  typedef double (*Loop)(const LoopArguments&);
  Loop density_pairs[2][2], density_across[2][2];  ///< [kernel][Places]
  Loop force_pairs[2], force_across[2][2];         ///< [kernel][slip]
  Loop wall_sums[2];
  Loop xsph_pairs[2], shepard_pairs[2];
};

template <class P>
constexpr Loops loops_of() {
  using namespace loops;
  typedef WendlandC2 W;
  typedef CubicSpline C;
  return {{{density_pairs<P, W, false>, density_pairs<P, W, true>}, {density_pairs<P, C, false>, density_pairs<P, C, true>}},
          {{density_across<P, W, false>, density_across<P, W, true>}, {density_across<P, C, false>, density_across<P, C, true>}},
          {force_pairs<P, W>, force_pairs<P, C>},
          {{force_across<P, W, false>, force_across<P, W, true>}, {force_across<P, C, false>, force_across<P, C, true>}},
          {wall_sums<P, W>, wall_sums<P, C>},
          {xsph_pairs<P, W>, xsph_pairs<P, C>},
          {shepard_pairs<P, W>, shepard_pairs<P, C>}};
}

/// Those that every processor runs.
inline const Loops& portable_loops() {
  static const Loops all = loops_of<Pack<4, Portable>>();
  return all;
}

}  // namespace dembark::sph
