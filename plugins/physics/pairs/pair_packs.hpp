// Text of the loop, compiled once for each instruction set. All give the same bits: each lane is IEEE arithmetic without contraction, and
// forces are added one pair after the other, first to the first grain, then to the second, as the engine's loop does. All is a template
// of the pack, which names its instruction set: nothing that is compiled for a newer processor is shared with other files.
#pragma once

#include <cstddef>

#include "../contact_order.hpp"
#include "../finnie_rabinowicz.hpp"
#include "../partial_slip.hpp"
#include "pack_rows.hpp"
#include "pair_step.hpp"

namespace dembark {

template <class P>
DEMBARK_HOT PackedCoefficients<P> gathered_laws(const PackedCoefficients<double>* laws, const int* law_index) {
  const Quad<P> a = rows<P, 4>([=](int k) { return &laws[law_index[k]].effective_youngs_modulus; });
  const Quad<P> b = rows<P, 4>([=](int k) { return &laws[law_index[k]].kinetic_friction; });
  return {a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w};
}

/// Appends to the `found` pairs of the block what a pack of grain i's neighbours, from place `first` on, holds; returns their number.
/// Which pairs touch cannot be foreseen: no branch on it.
template <class P>
DEMBARK_HOT int pick_pairs(const PairStep& s, PairBlock& b, int i, int first, int found) {
  constexpr int N = P::size;
  const int *const neighbors = s.neighbors[i] + first, *const flags = s.flags[i] + first;
  const int left = s.numneigh[i] - first;
  alignas(16) int j[N];  // lanes behind the last neighbour take grain 0
  unsigned stored = 0;
#ifdef DEMBARK_PAIR_PACKS_X86
  if constexpr (N == 4) {
    const __m128i there = _mm_cmpgt_epi32(_mm_set1_epi32(left), _mm_setr_epi32(0, 1, 2, 3));
    _mm_store_si128(reinterpret_cast<__m128i*>(j), _mm_and_si128(_mm_maskload_epi32(neighbors, there), _mm_set1_epi32(s.number_bits)));
    stored = 15 & ~_mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(_mm_maskload_epi32(flags, there), _mm_setzero_si128())));
  }
#endif
  if constexpr (N == 2)
    for (int k = 0; k < N; ++k) {
      j[k] = k < left ? neighbors[k] & s.number_bits : 0;
      stored |= unsigned(k < left && flags[k] != 0) << k;
    }
  const double* const x = s.x + 3 * static_cast<long>(i);
  const PackVec<P> delta = PackVec<P>{x[0], x[1], x[2]} - rows3<P>(s.x, j);
  const P sum = s.radius[i] + values<P>(s.radius, j);
  const unsigned touching = bits(dot(delta, delta) < sum * sum), taken = (touching | stored) & ((1u << (left < N ? left : N)) - 1);
#ifdef DEMBARK_PAIR_PACKS_X86
  if constexpr (is_avx512<P>) {
    const auto append = [found, taken](int* to, __m128i lanes) __attribute__((always_inline)) {
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to + found), _mm_maskz_compress_epi32(taken, lanes));
    };
    const __m128i place = _mm_add_epi32(_mm_set1_epi32(2 * first), _mm_setr_epi32(0, 2, 4, 6));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(b.grain + found), _mm_set1_epi32(i));
    append(b.partner, _mm_load_si128(reinterpret_cast<const __m128i*>(j)));
    append(b.pick, _mm_mask_add_epi32(place, touching, place, _mm_set1_epi32(1)));
    return found + __builtin_popcount(taken);
  }
#endif
#pragma GCC unroll 8
  for (int k = 0; k < N; ++k) {
    b.grain[found] = i;
    b.partner[found] = j[k];
    b.pick[found] = 2 * (first + k) + (touching >> k & 1);
    found += taken >> k & 1;
  }
  return found;
}

/// Brings what belongs to the picked pairs together.
template <class P>
inline void gather(const PairStep& s, PairBlock& b, int found) {
  for (int k = 0; k < found; ++k) {
    const long i = b.grain[k], j = b.partner[k];
    const int place = b.pick[k] >> 1;
    b.history[k] = s.histories[i] + static_cast<long>(s.stride) * place;
    b.flags[k] = s.flags[i] + place;
    b.law_index[k] = s.type[i] * s.types + s.type[j];
    // By the time that the pair's turn has come these are there.
    __builtin_prefetch(b.history[k] + s.offset, 1);
    __builtin_prefetch(b.history[k] + s.offset + 4, 1);
    for (int n = 0; s.more >= 0 && n < s.more_numbers + 3; n += 8)
      __builtin_prefetch(b.history[k] + s.more + (n < s.more_numbers ? n : s.more_numbers - 1), 1);
    __builtin_prefetch(s.f + 3 * j, 1);
    __builtin_prefetch(s.torque + 3 * j, 1);
    *b.flags[k] = (*b.flags[k] & ~(s.contact_flags | s.bridge_flag)) | (-(b.pick[k] & 1) & (s.contact_flags | (s.wet ? s.bridge_flag : 0)));
  }
}

/// Lanes behind the last pair repeat it.
template <class P>
inline void repeat_last(PairBlock& b, int found) {
  for (int k = found; k % P::size; ++k) {
    b.grain[k] = b.grain[found - 1];
    b.partner[k] = b.partner[found - 1];
    b.law_index[k] = b.law_index[found - 1];
    b.history[k] = b.history[found - 1];
  }
}

/// Leaves the lanes `rest` of the pack at `first` to the scalar law, which gets their states as they were.
template <class P>
__attribute__((noinline)) void scalar_friction(const PairStep& s, const PairBlock& b, int first, unsigned rest, const PackVec<P>& normal,
                                               const P& twist, const PackVec<P>& velocity, const NormalResponse<P>& response,
                                               PackVec<P>& tangential) {
  for (int k = 0; k < P::size; ++k) {
    if (!(rest >> k & 1)) continue;
    const auto lane = [k](const PackVec<P>& v) { return Vec3<double>{v.x[k], v.y[k], v.z[k]}; };
    const Vec3<double> force = s.scalar.friction(b, first + k, lane(normal), twist[k],
                                                 {response.force[k], response.tangential_stiffness[k], response.tangential_damping[k],
                                                  response.contact_area[k], 0.0, response.force[k]},
                                                 lane(velocity));
    tangential.x.lanes[k] = force.x;
    tangential.y.lanes[k] = force.y;
    tangential.z.lanes[k] = force.z;
  }
}

/// Couples of the lanes `touching` of the pack at `first`, each by the scalar law, onto both grains.
template <class P>
__attribute__((noinline)) void scalar_rolling(const PairStep& s, const PairBlock& b, int first, unsigned touching, const PackVec<P>& normal,
                                              const P& twist, const PackVec<P>& spin, const NormalResponse<P>& response) {
  for (int k = 0; k < P::size; ++k) {
    if (!(touching >> k & 1)) continue;
    const auto lane = [k](const PackVec<P>& v) { return Vec3<double>{v.x[k], v.y[k], v.z[k]}; };
    const Vec3<double> couple =
        s.memory->rolling(b, first + k, lane(normal), twist[k], response.force[k], response.tangential_stiffness[k], lane(spin));
    const auto add_to = [&s](int grain, const Vec3<double>& torque) {
      if (grain >= s.owned) return;
      double* const to = s.torque + 3 * static_cast<long>(grain);
      to[0] += torque.x, to[1] += torque.y, to[2] += torque.z;
    };
    add_to(b.grain[first + k], couple);
    add_to(b.partner[first + k], -couple);
  }
}

/// Of the lanes of a linear spring that do not stick without a doubt: those that stick, and those that slip, which have then become
/// `moved`. Interfaces with a shear strength, and what is no number, are in neither.
template <class P>
struct Slip {
  unsigned sticks = 0;
  LaneMask<P> slips{};
  FrictionState<P> moved{};
};
template <class P>
__attribute__((noinline)) Slip<P> slip_of(const PackedCoefficients<P>& law, const NormalResponse<P>& response, const PackVec<P>& increment,
                                          const LaneMask<P>& unsure, const FrictionState<P>& state) {
  // Bounded, which what is no number is not.
  const auto plain = unsure & !(law.interface_shear_strength < unlimited_strength) &
                     (response.tangential_stiffness * dot(state.displacement, state.displacement) < P(INFINITY));
  Slip<P> found;
  found.slips = coulomb_slip(law, response.force, response.tangential_stiffness, increment, plain, state, found.moved);
  found.sticks = bits(plain & !found.slips);
  return found;
}

template <class P>
DEMBARK_HOT void replace(const LaneMask<P>& which, PackVec<P>& old, const PackVec<P>& now) {
  old = {select(which, now.x, old.x), select(which, now.y, old.y), select(which, now.z, old.z)};
}

/// Partial slip of the lanes `there`: displacement, slip and energy into `state`; the dash-pot's constant and the share of slip that is
/// kept of those that slide as a whole. Returns the lanes that it has served: of the others, which are new or have changed much, nothing
/// has changed.
template <class P>
DEMBARK_HOT unsigned partial_slip(const PairStep& s, const PairBlock& b, int first, unsigned there, const PackedCoefficients<P>& law,
                                  const PackVec<P>& normal, const P& twist, const PackVec<P>& velocity, NormalResponse<P>& response,
                                  FrictionState<P>& state, P& kept_slip) {
  constexpr int N = P::size;
  typedef SlipRings Rings;
  constexpr int axis = offsetof(Rings, axis) / 8, radius = offsetof(Rings, radius) / 8;
  static_assert(offsetof(Rings, across) / 8 == Rings::count && offsetof(Rings, outer) / 8 == axis + 3);
  const auto numbers = [=, &b, &s](int k) { return b.history[first + k] + s.rings; };
  const Quad<P> old = rows<P, 4>([=](int k) { return numbers(k) + axis; });
  const P old_radius = collect<P>([=](int k) { return numbers(k)[radius]; });
  const auto step = ring_step<P>({old.x, old.y, old.z}, old.w, old_radius, normal, twist, response.tangential_stiffness,
                                 response.contact_area, velocity, s.dt);
  const unsigned served = bits(step.goes_on) & there;

  // Lane by lane from here on: a lane's rings are a pack of their own.
  alignas(64) double motion[sizeof step.motion / sizeof(P)][N], limit[N], slip[N], slides[N] = {}, sums[3][N] = {}, frame[N][4], reach[N];
  __builtin_memcpy(motion, &step.motion, sizeof motion);
  first_limit(law, response.force).store(limit);
  state.slip.store(slip);
  step.radius.store(reach);
  store_rows(Quad<P>{step.axis.x, step.axis.y, step.axis.z, old.w}, [&frame](int k) { return frame[k]; });
  const auto other_limit = (state.slip > 0.0) | (law.interface_shear_strength < unlimited_strength);
  for (unsigned rest = bits(other_limit) & served; rest != 0; rest &= rest - 1) {
    const int k = __builtin_ctz(rest);
    limit[k] = s.memory->limit(b, first + k, response.force[k], response.contact_area[k], slip[k]);
  }
  for (int k = 0; k < N; ++k) {
    if (!(served >> k & 1)) continue;
    double* const rings = numbers(k);
    const RingMotion<double> lane{motion[0][k], motion[1][k], motion[2][k], motion[3][k], motion[4][k], motion[5][k]};
    RingSums found;
    while (move_rings<P>(lane, limit[k], slides[k] > 0.0, rings, rings + Rings::count, found)) {
      slides[k] = 1.0;
      limit[k] = s.memory->sliding_limit(b, first + k, lane, rings, response.force[k], response.contact_area[k], slip[k]);
    }
    sums[0][k] = found.along, sums[1][k] = found.across, sums[2][k] = found.lost;
    __builtin_memcpy(rings + axis, frame[k], sizeof frame[k]);
    rings[radius] = reach[k];
  }
  const auto all_slides = P::load(slides) > 0.0;
  const P lost = P::load(sums[2]);
  state.displacement = P::load(sums[0]) * step.axis + P::load(sums[1]) * step.other;
  state.slip = P::load(slip);
  state.dissipated_energy += select(lost > 0.0, lost, P(0.0));
  response.tangential_damping = select(all_slides, P(0.0), response.tangential_damping);
  kept_slip = select(all_slides, P(1.0), kept_slip);
  return served;
}

/// to += scale * row, both of three numbers.
template <class P>
DEMBARK_HOT void add(double* to, double scale, const double* row) {
  typedef Pack<2, typename P::InstructionSet> Two;
  (Two::load(to) + scale * Two::load(row)).store(to);
  to[2] += scale * row[2];
}

/// Adds `count` forces (on the first grain, with its lever arm) and moments (with the arm on the second).
template <class P>
DEMBARK_HOT void scatter(const PairStep& s, const int* grain, const int* partner, const double (*force)[4], const double (*moment)[4],
                         int count) {
  double nowhere[3] = {};
  for (int k = 0; k < count; ++k) {
    const long i = grain[k], j = partner[k];
    add<P>(s.f + 3 * i, 1.0, force[k]);
    add<P>(s.torque + 3 * i, -force[k][3], moment[k]);
    // Copies of other ranks' grains are strewn among the partners: no branch on it.
    const bool ours = j < s.owned;
    add<P>(ours ? s.f + 3 * j : nowhere, -1.0, force[k]);
    add<P>(ours ? s.torque + 3 * j : nowhere, -moment[k][3], moment[k]);
  }
}

/// The laws of a pack of contacts, for contact_order(). `Elastic`: friction is limited by the force of the spring alone.
template <class P, bool Elastic>
struct PackLaws {
  static constexpr int N = P::size;
  const PairStep& s;
  PairBlock& b;
  const PackedCoefficients<P>& law;
  const int first, count;
  const P effective_radius, effective_mass;
  const LaneMask<P> touching;
  const unsigned there = (1u << count) - 1, apart = ~bits(touching) & there;

  // All lanes are computed; act() drops what pairs apart have no part in.
  DEMBARK_HOT bool touches(const P&) const { return true; }

  DEMBARK_HOT NormalResponse<P> respond(const P& overlap, const P& normal_velocity) const {
    return adjusted(hertz<PackedCoefficients<P>, P>(law, effective_radius, effective_mass, overlap, normal_velocity), s.limit_force,
                    s.tangential_damping);
  }

  DEMBARK_HOT PackVec<P> friction(const PackVec<P>& normal, const P& twist, NormalResponse<P> response, const PackVec<P>& velocity) const {
    // Here the force is the one that limits friction.
    if constexpr (Elastic) response.force = response.elastic_force;
    const auto history = [this](int k) { return b.history[first + k] + s.offset; };
    const P dt = s.dt;
    const Quad<P> old = rows<P, 4>(history);
    FrictionState<P> state{{old.x, old.y, old.z}, old.w, collect<P>([=](int k) { return history(k)[4]; })};
    unsigned served = 0, slipping = 0;
    P kept_slip = law.kept_slip;
    Slip<P> slip;
    if (s.rings < 0) {
      const PackVec<P> increment = velocity * dt;
      state.displacement = rotate_to_plane<P>(state.displacement, normal, twist);
      state.displacement += increment;
      const auto sticks = plainly_sticks(law, response.force, response.tangential_stiffness, response.contact_area, state);
      served = bits(sticks);
      if (s.pack_friction && there & ~served & ~apart) {
        slip = slip_of<P>(law, response, increment, touching & !sticks, state);
        slipping = bits(slip.slips);
        served |= slip.sticks | slipping;
      }
    } else if (s.pack_friction) {
      served = partial_slip<P>(s, b, first, there & ~apart, law, normal, twist, velocity, response, state, kept_slip);
    }
    PackVec<P> tangential = sticking_force<P>(response.tangential_stiffness, response.tangential_damping, velocity, dt, kept_slip, state);
    if (slipping) {
      replace<P>(slip.slips, state.displacement, slip.moved.displacement);
      state.slip = select(slip.slips, slip.moved.slip, state.slip);
      state.dissipated_energy = select(slip.slips, slip.moved.dissipated_energy, state.dissipated_energy);
      replace<P>(slip.slips, tangential, -response.tangential_stiffness * state.displacement);
    }
    if (apart) {  // such a pair has forgotten its contact
      const auto forget = [this](P& part) __attribute__((always_inline)) { part = select(touching, part, P(0.0)); };
      forget(tangential.x), forget(tangential.y), forget(tangential.z);
      forget(state.displacement.x), forget(state.displacement.y), forget(state.displacement.z);
      forget(state.slip);
      forget(state.dissipated_energy);
      for (int k = 0; s.more >= 0 && k < count; ++k)
        if (apart >> k & 1) __builtin_memset(b.history[first + k] + s.more, 0, s.more_numbers * sizeof(double));
    }
    const unsigned packed = (s.pack_friction ? served | apart : apart) & there;
    const Quad<P> spring{state.displacement.x, state.displacement.y, state.displacement.z, state.slip};
    alignas(64) double energy[N];
    state.dissipated_energy.store(energy);
    // Lanes behind the last pair repeat it, but for its rings.
    if (__builtin_expect(packed == there && (s.rings < 0 || count == N), 1)) {
      store_rows(spring, history);
#pragma GCC unroll 8
      for (int k = 0; k < N; ++k) history(k)[4] = energy[k];
    } else {
      alignas(64) double rows[N][4];
      store_rows(spring, [&rows](int k) { return rows[k]; });
      for (int k = 0; k < N; ++k) {
        if (!(packed >> k & 1)) continue;
        __builtin_memcpy(history(k), rows[k], sizeof rows[k]);
        history(k)[4] = energy[k];
      }
      scalar_friction<P>(s, b, first, there & ~packed, normal, twist, velocity, response, tangential);
    }
    return tangential;
  }

  DEMBARK_HOT void roll(const PackVec<P>& normal, const P& twist, const NormalResponse<P>& response, const PackVec<P>& spin) const {
    if (s.rolls) scalar_rolling<P>(s, b, first, there & ~apart, normal, twist, spin, response);
  }

  DEMBARK_HOT P attract(const P& overlap) const {
    if (!s.wet) return 0.0;
    alignas(64) double gap[N], pull[N];
    (-overlap).store(gap);
    s.scalar.bridges(b, first, count, gap, pull);
    return P::load(pull);
  }

  DEMBARK_HOT void act(const PackVec<P>& normal, const P&, const SurfaceMotion<P>& motion, const NormalResponse<P>& response,
                       const PackVec<P>& friction, const P& attraction) const {
    P along_normal = response.force;
    if (apart) along_normal = select(touching, along_normal, P(0.0));
    along_normal -= attraction;
    const Assembly<P> all = assembled<P>(normal, along_normal, friction);
    alignas(64) double forces[N][4], moments[N][4];
    store_rows(Quad<P>{all.force.x, all.force.y, all.force.z, motion.arm_1}, [&forces](int k) { return forces[k]; });
    store_rows(Quad<P>{all.moment.x, all.moment.y, all.moment.z, motion.arm_2}, [&moments](int k) { return moments[k]; });
    if (s.f) scatter<P>(s, b.grain + first, b.partner + first, forces, moments, count);
    if (!s.results) return;
    const PackVec<P> along = all.force - friction;
    alignas(64) double normals[N][4], frictions[N][4];
    store_rows(Quad<P>{along.x, along.y, along.z, response.normal_stiffness}, [&normals](int k) { return normals[k]; });
    store_rows(Quad<P>{friction.x, friction.y, friction.z, response.tangential_stiffness}, [&frictions](int k) { return frictions[k]; });
    s.results->store(b, first, count, {forces, moments, normals, frictions});
  }
};

/// Forces of the picked pairs.
template <class P, bool Elastic>
inline void compute(const PairStep& s, PairBlock& b, int found) {
  constexpr int N = P::size;
  repeat_last<P>(b, found);
  PackedCoefficients<P> law = gathered_laws<P>(s.laws, b.law_index);
  for (int first = 0; first < found; first += N) {
    const int *i = b.grain + first, *j = b.partner + first;
    if (!s.one_law) law = gathered_laws<P>(s.laws, b.law_index + first);
    const P radius_i = values<P>(s.radius, i), radius_j = values<P>(s.radius, j), radius_sum = radius_i + radius_j;
    const ContactPair<P> pair{rows3<P>(s.x, i) - rows3<P>(s.x, j),
                              rows3<P>(s.v, i) - rows3<P>(s.v, j),
                              rows3<P>(s.omega, i),
                              rows3<P>(s.omega, j),
                              radius_i,
                              radius_j};
    const P mass_i = values<P>(s.mass, i), mass_j = values<P>(s.mass, j);
    P reduced_mass = mass_i * mass_j / (mass_i + mass_j);
    if (s.frozen) {
      const auto is_frozen = [&s](const int* grain) {
        return collect<P>([&s, grain](int k) { return s.mask[grain[k]] & s.frozen ? 1.0 : 0.0; }) > 0.0;
      };
      // Between two frozen grains there is no damping (ContactParameters::respond).
      const auto frozen_i = is_frozen(i), frozen_j = is_frozen(j);
      reduced_mass = select(frozen_i & frozen_j, P(0.0), reduced(mass_i, mass_j, frozen_i, frozen_j));
    }
    const PackLaws<P, Elastic> laws{s,
                                    b,
                                    law,
                                    first,
                                    found - first < N ? found - first : N,
                                    radius_i * radius_j / radius_sum,
                                    reduced_mass,
                                    dot(pair.separation, pair.separation) < radius_sum * radius_sum};
    contact_order<P>(pair, s.dt, laws);
  }
}

template <class P>
void compute_found(const PairStep& step, PairBlock& block, int found) {
  (step.elastic_limit ? compute<P, true> : compute<P, false>)(step, block, found);
}

template <class P>
void pair_packs(const PairStep& step, PairBlock& block) {
  typedef Part < P, P::size<4 ? P::size : 4> Picks;  // grains have few neighbours
  constexpr int ahead = 6;                           // grains for which the lists, strewn over the memory, are fetched early
  int found = 0;
  const auto finish = [&] {
    if (found == 0) return;
    gather<P>(step, block, found);
    compute_found<P>(step, block, found);
    found = 0;
  };
  for (int n = 0; n < step.count; ++n) {
    const int i = step.grains[n], later = step.grains[n + ahead < step.count ? n + ahead : n];
    __builtin_prefetch(step.neighbors[later]);
    __builtin_prefetch(step.flags[later]);
    for (int first = 0; first < step.numneigh[i]; first += Picks::size) {
      found = pick_pairs<Picks>(step, block, i, first, found);
      if (found >= PairBlock::capacity) finish();
    }
  }
  finish();
}

template <class P>
void picked_packs(const PairStep& step, PairBlock& block, int found) {
  if (found > 0) compute_found<P>(step, block, found);
}

}  // namespace dembark
