// Text of the loop, compiled once for each instruction set. All give the same bits: each lane is IEEE arithmetic without contraction, and
// forces are added one pair after the other, first to the first grain, then to the second, as the engine's loop does. All is a template
// of the pack, which names its instruction set: nothing that is compiled for a newer processor is shared with other files.
#include "pack_rows.hpp"
#include "pair_packs.h"

#include "dembark/finnie_rabinowicz.hpp"
#include "dembark/kinematics.hpp"
#include "dembark/normal_force.hpp"

namespace dembark_liggghts {

template <class P>
struct LawPack {
  P effective_youngs_modulus, effective_shear_modulus, damping, static_friction, kinetic_friction, interface_shear_strength, kept_slip;
};

template <class P>
DEMBARK_HOT LawPack<P> law_of_one_kind(const PairLaw& law) {
  return {law.effective_youngs_modulus, law.effective_shear_modulus,  law.damping,  law.static_friction,
          law.kinetic_friction,         law.interface_shear_strength, law.kept_slip};
}

template <class P>
DEMBARK_HOT LawPack<P> laws_of_kinds(const PairLaw* laws, const int* kind) {
  const Quad<P> a = rows4<P>([=](int k) { return &laws[kind[k]].effective_youngs_modulus; });
  const Quad<P> b = rows4<P>([=](int k) { return &laws[kind[k]].kinetic_friction; });
  return {a.x, a.y, a.z, a.w, b.x, b.y, b.z};
}

/// `count` integers, most often 8 or fewer; writes 8 at once.
template <class P>
DEMBARK_HOT void copy(int* to, const int* from, int count) {
  if constexpr (is_avx512<P>)
    if (__builtin_expect(count <= 8, 1)) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_maskz_loadu_epi32((1u << count) - 1, from));
      return;
    }
  for (int k = 0; k < count; ++k) to[k] = from[k];
}

template <class P>
DEMBARK_HOT void fill(int* to, int value, int count) {
  for (int first = 0; first < count; first += 8) {
#pragma GCC unroll 8
    for (int k = 0; k < 8; ++k) to[first + k] = value;
  }
}

/// Fills the block with the next neighbours of the grains, from `slot` of number `next` on; their number.
template <class P>
inline int take_neighbors(const PairStep& s, PairBlock& b, int& next, int& slot) {
  constexpr int ahead = 6;  // grains for which the lists, strewn over the memory, are fetched early
  int pairs = 0;
  for (int run = 0; next < s.count && pairs < PairBlock::capacity; ++run) {
    const int i = s.grains[next], all = s.numneigh[i], left = all - slot, space = PairBlock::capacity - pairs;
    const int count = left < space ? left : space, later = s.grains[next + ahead < s.count ? next + ahead : next];
    __builtin_prefetch(s.neighbors[later]);
    __builtin_prefetch(s.flags[later]);
    copy<P>(b.j + pairs, s.neighbors[i] + slot, count);
    copy<P>(b.flag + pairs, s.flags[i] + slot, count);
    fill<P>(b.i + pairs, i, count);
    fill<P>(b.run + pairs, run, count);
    b.run_start[run] = pairs - slot;
    b.run_flags[run] = s.flags[i];
    b.run_histories[run] = s.histories[i];
    pairs += count;
    run -= count == 0;
    if (count < left) slot += count;
    else slot = 0, ++next;
  }
  return pairs;
}

constexpr int neighbor_bits = 0x3FFFFFFF;  // the engine's NEIGHMASK

/// Picks the pairs that touch, and those that have a contact or a bridge stored, to hold or to end it. Which pairs touch cannot be
/// foreseen: no branch on it.
template <class P>
inline int pick_pairs(const PairStep& s, PairBlock& b, int pairs) {
  constexpr int N = P::size;
  for (int k = pairs; k % N; ++k) b.i[k] = b.j[k] = b.flag[k] = 0;
  int found = 0;
  for (int first = 0; first < pairs; first += N) {
    int* const j = b.j + first;
#pragma GCC unroll 8
    for (int k = 0; k < N; ++k) j[k] &= neighbor_bits;
    const PackVec<P> delta = rows3<P>(s.x, b.i + first) - rows3<P>(s.x, j);
    const P sum = values<P>(s.radius, b.i + first) + values<P>(s.radius, j);
    const unsigned there = pairs - first < N ? (1u << (pairs - first)) - 1 : (1u << N) - 1;
    const unsigned touching = bits(dot(delta, delta) < sum * sum) & there;
    if constexpr (is_avx512<P>) {
      const __m256i flag = _mm256_load_si256(reinterpret_cast<const __m256i*>(b.flag + first));
      const __m256i place = _mm256_add_epi32(_mm256_set1_epi32(2 * first), _mm256_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14));
      const unsigned taken = (touching | _mm256_test_epi32_mask(flag, flag)) & there;
      const __m256i marked = _mm256_mask_add_epi32(place, touching, place, _mm256_set1_epi32(1));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(b.pick + found), _mm256_maskz_compress_epi32(taken, marked));
      found += __builtin_popcount(taken);
    } else {
#pragma GCC unroll 8
      for (int k = 0; k < N; ++k) {
        const int touches = touching >> k & 1;
        b.pick[found] = 2 * (first + k) + touches;
        found += touches | (b.flag[first + k] != 0);
      }
    }
  }
  return found;
}

/// Brings what belongs to the picked pairs together.
template <class P>
inline void gather(const PairStep& s, PairBlock& b, int found) {
  for (int k = 0; k < found; ++k) {
    const int touches = b.pick[k] & 1, place = b.pick[k] >> 1, run = b.run[place], slot = place - b.run_start[run];
    const long j = b.j[place];
    b.grain[k] = b.i[place];
    b.partner[k] = b.j[place];
    b.history[k] = b.run_histories[run] + static_cast<long>(s.stride) * slot;
    b.flags[k] = b.run_flags[run] + slot;
    // By the time that the pair's turn has come these are there.
    __builtin_prefetch(b.history[k] + s.offset, 1);
    __builtin_prefetch(b.history[k] + s.offset + 4, 1);
    __builtin_prefetch(s.f + 3 * j, 1);
    __builtin_prefetch(s.torque + 3 * j, 1);
    *b.flags[k] = (*b.flags[k] & ~s.own_flags) | (-touches & s.touching_flags);
  }
  if (s.types != 2)
    for (int k = 0; k < found; ++k) b.kind[k] = s.type[b.grain[k]] * s.types + s.type[b.partner[k]];
  // Lanes behind the last pair repeat it.
  for (int k = found; k % 8; ++k) {
    b.grain[k] = b.grain[found - 1];
    b.partner[k] = b.partner[found - 1];
    b.kind[k] = b.kind[found - 1];
    b.history[k] = b.history[found - 1];
  }
}

/// Leaves the lanes `rest` of the pack at `first` to the scalar law, which gets their states as they were.
template <class P>
__attribute__((noinline)) void scalar_friction(const PairStep& s, const PairBlock& b, int first, unsigned rest, const PackVec<P>& normal,
                                               const P& twist, const PackVec<P>& velocity, const dembark::NormalResponse<P>& response,
                                               PackVec<P>& tangential) {
  for (int k = 0; k < P::size; ++k) {
    if (!(rest >> k & 1)) continue;
    double force[3];
    s.friction(s.caller, b, first + k,
               {{normal.x[k], normal.y[k], normal.z[k]},
                {velocity.x[k], velocity.y[k], velocity.z[k]},
                twist[k],
                response.force[k],
                response.tangential_stiffness[k],
                response.tangential_damping[k],
                response.contact_area[k]},
               force);
    tangential.x.lanes[k] = force[0];
    tangential.y.lanes[k] = force[1];
    tangential.z.lanes[k] = force[2];
  }
}

/// to += scale * row, both of three numbers.
template <class P>
DEMBARK_HOT void add(double* to, double scale, const double* row) {
  typedef dembark::Pack<2, typename P::InstructionSet> Two;
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

/// Forces of the picked pairs, by the stages of dembark/contact.hpp.
template <class P>
inline void compute(const PairStep& s, PairBlock& b, int found) {
  constexpr int N = P::size;
  const bool one_kind = s.types == 2;
  LawPack<P> law = law_of_one_kind<P>(s.laws[one_kind ? 3 : 0]);
  for (int first = 0; first < found; first += N) {
    const int *i = b.grain + first, *j = b.partner + first, count = found - first < N ? found - first : N;
    const unsigned there = (1u << count) - 1;
    if (!one_kind) law = laws_of_kinds<P>(s.laws, b.kind + first);
    const P radius_i = values<P>(s.radius, i), radius_j = values<P>(s.radius, j), radius_sum = radius_i + radius_j;
    const PackVec<P> delta = rows3<P>(s.x, i) - rows3<P>(s.x, j);
    const P squared = dot(delta, delta), distance = sqrt(squared), overlap = radius_sum - distance, half = 0.5 * overlap;
    const PackVec<P> normal = delta * (1.0 / distance);
    const auto touching = squared < radius_sum * radius_sum;
    const unsigned apart = ~bits(touching) & there;

    const P mass_i = values<P>(s.mass, i), mass_j = values<P>(s.mass, j);
    P reduced_mass = mass_i * mass_j / (mass_i + mass_j);
    if (s.frozen) {
      const auto is_frozen = [&s](const int* grain) {
        return collect<P>([&s, grain](int k) { return s.mask[grain[k]] & s.frozen ? 1.0 : 0.0; }) > 0.0;
      };
      reduced_mass = select(is_frozen(j), mass_i, select(is_frozen(i), mass_j, reduced_mass));
    }
    const PackVec<P> omega_i = rows3<P>(s.omega, i), omega_j = rows3<P>(s.omega, j);
    const dembark::SurfaceMotion<P> motion =
        dembark::surface_motion<P>(normal, rows3<P>(s.v, i) - rows3<P>(s.v, j), radius_i - half, omega_i, radius_j - half, omega_j);
    dembark::NormalResponse<P> response =
        adjusted(dembark::hertz<LawPack<P>, P>(law, radius_i * radius_j / radius_sum, reduced_mass, overlap, motion.normal_velocity),
                 s.limit_force, s.tangential_damping);

    const auto history = [=, &b, &s](int k) { return b.history[first + k] + s.offset; };
    const P dt = s.dt, twist = dembark::contact_twist<P>(normal, omega_i, omega_j, dt);
    const Quad<P> old = rows4<P>(history);
    dembark::FrictionState<P> state{{old.x, old.y, old.z}, old.w, collect<P>([=](int k) { return history(k)[4]; })};
    state.displacement = dembark::rotate_to_plane<P>(state.displacement, normal, twist);
    state.displacement += motion.tangential_velocity * dt;
    const auto sticks = dembark::plainly_sticks(law, response.force, response.tangential_stiffness, response.contact_area, state);
    PackVec<P> tangential = dembark::sticking_force<P>(response.tangential_stiffness, response.tangential_damping,
                                                       motion.tangential_velocity, dt, law.kept_slip, state);
    if (apart) {  // such a pair has forgotten its contact
      const auto forget = [&touching](P& part) __attribute__((always_inline)) { part = select(touching, part, P(0.0)); };
      forget(response.force);
      forget(tangential.x), forget(tangential.y), forget(tangential.z);
      forget(state.displacement.x), forget(state.displacement.y), forget(state.displacement.z);
      forget(state.slip);
      forget(state.dissipated_energy);
    }
    const unsigned packed = (s.pack_friction ? bits(sticks) | apart : apart) & there;
    const Quad<P> spring{state.displacement.x, state.displacement.y, state.displacement.z, state.slip};
    alignas(64) double energy[N];
    state.dissipated_energy.store(energy);
    if (__builtin_expect(packed == there, 1)) {
      store_rows4(spring, history);
#pragma GCC unroll 8
      for (int k = 0; k < N; ++k) history(k)[4] = energy[k];
    } else {
      alignas(64) double rows[N][4];
      store_rows4(spring, [&rows](int k) { return rows[k]; });
      for (int k = 0; k < N; ++k) {
        if (!(packed >> k & 1)) continue;
        __builtin_memcpy(history(k), rows[k], sizeof rows[k]);
        history(k)[4] = energy[k];
      }
      scalar_friction<P>(s, b, first, there & ~packed, normal, twist, motion.tangential_velocity, response, tangential);
    }

    if (s.bridges) {
      alignas(64) double gap[N], pull[N];
      (distance - radius_sum).store(gap);
      s.bridges(s.caller, b, first, count, gap, pull);
      response.force -= P::load(pull);
    }
    const PackVec<P> force = response.force * normal + tangential, moment = cross(normal, tangential);
    alignas(64) double forces[N][4], moments[N][4];
    store_rows4(Quad<P>{force.x, force.y, force.z, motion.arm_1}, [&forces](int k) { return forces[k]; });
    store_rows4(Quad<P>{moment.x, moment.y, moment.z, motion.arm_2}, [&moments](int k) { return moments[k]; });
    scatter<P>(s, i, j, forces, moments, count);
  }
}

template <class P>
void pair_packs(const PairStep& step, PairBlock& block) {
  for (int next = 0, slot = 0; next < step.count;) {
    const int pairs = take_neighbors<P>(step, block, next, slot), found = pick_pairs<P>(step, block, pairs);
    if (found == 0) continue;
    gather<P>(step, block, found);
    compute<P>(step, block, found);
  }
}

}  // namespace dembark_liggghts
