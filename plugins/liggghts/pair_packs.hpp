// Text of the loop; included once for each instruction set with PAIR_PACKS set to the function's name and DEMBARK_LANES to the doubles
// in a vector (8 and 4 stand for AVX-512 and AVX2). All give the same bits: each lane is IEEE arithmetic without contraction, and forces
// are added one pair after the other, first to the first grain, then to the second, as the engine's loop does.
#include "pack_rows.hpp"
#include "pair_packs.h"

#include "dembark/finnie_rabinowicz.hpp"
#include "dembark/kinematics.hpp"
#include "dembark/normal_force.hpp"

namespace dembark_liggghts {
namespace {

template <int N>
struct LawPack {
  Pack<N> effective_youngs_modulus, effective_shear_modulus, damping, static_friction, kinetic_friction, interface_shear_strength,
      kept_slip;
};

template <int N>
DEMBARK_HOT LawPack<N> law_of_one_kind(const PairLaw& law) {
  return {law.effective_youngs_modulus, law.effective_shear_modulus,  law.damping,  law.static_friction,
          law.kinetic_friction,         law.interface_shear_strength, law.kept_slip};
}

template <int N>
DEMBARK_HOT LawPack<N> laws_of_kinds(const PairLaw* laws, const int* kind) {
  const Quad<N> a = rows4<N>([=](int k) { return &laws[kind[k]].effective_youngs_modulus; });
  const Quad<N> b = rows4<N>([=](int k) { return &laws[kind[k]].kinetic_friction; });
  return {a.x, a.y, a.z, a.w, b.x, b.y, b.z};
}

/// `count` integers, most often 8 or fewer; writes 8 at once.
DEMBARK_HOT void copy(int* to, const int* from, int count) {
#if DEMBARK_LANES == 8
  if (__builtin_expect(count <= 8, 1)) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_maskz_loadu_epi32((1u << count) - 1, from));
    return;
  }
#endif
  for (int k = 0; k < count; ++k) to[k] = from[k];
}

DEMBARK_HOT void fill(int* to, int value, int count) {
  for (int first = 0; first < count; first += 8) {
#pragma GCC unroll 8
    for (int k = 0; k < 8; ++k) to[first + k] = value;
  }
}

/// Fills the block with the next neighbours of the grains, from `slot` of number `next` on; their number.
inline int take_neighbors(const PairStep& s, PairBlock& b, int& next, int& slot) {
  int pairs = 0;
  for (int run = 0; next < s.count && pairs < PairBlock::capacity; ++run) {
    const int i = s.grains[next], all = s.numneigh[i], left = all - slot, space = PairBlock::capacity - pairs;
    const int count = left < space ? left : space;
    copy(b.j + pairs, s.neighbors[i] + slot, count);
    copy(b.flag + pairs, s.flags[i] + slot, count);
    fill(b.i + pairs, i, count);
    fill(b.run + pairs, run, count);
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

/// Picks the pairs that touch, and those near enough to have to forget a contact, or to keep a bridge, when they have anything stored.
/// Which pairs touch cannot be foreseen: no branch on it.
template <int N>
inline int pick_pairs(const PairStep& s, PairBlock& b, int pairs) {
  for (int k = pairs; k % N; ++k) b.i[k] = b.j[k] = b.flag[k] = 0;
  int found = 0;
  for (int first = 0; first < pairs; first += N) {
    int* const j = b.j + first;
#pragma GCC unroll 8
    for (int k = 0; k < N; ++k) j[k] &= neighbor_bits;
    const PackVec<N> delta = rows3<N>(s.x, b.i + first) - rows3<N>(s.x, j);
    const Pack<N> sum = values<N>(s.radius, b.i + first) + values<N>(s.radius, j), squared = dot(delta, delta), limit = sum * sum;
    const unsigned there = pairs - first < N ? (1u << (pairs - first)) - 1 : (1u << N) - 1;
    const unsigned touching = bits(squared < limit) & there, close = bits(squared < s.reach_squared * limit) & there;
#if DEMBARK_LANES == 8
    const __m256i flag = _mm256_load_si256(reinterpret_cast<const __m256i*>(b.flag + first));
    const __m256i place = _mm256_add_epi32(_mm256_set1_epi32(2 * first), _mm256_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14));
    const unsigned taken = touching | (close & _mm256_test_epi32_mask(flag, flag));
    const __m256i marked = _mm256_mask_add_epi32(place, touching, place, _mm256_set1_epi32(1));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(b.pick + found), _mm256_maskz_compress_epi32(taken, marked));
    found += __builtin_popcount(taken);
#else
#pragma GCC unroll 8
    for (int k = 0; k < N; ++k) {
      const int touches = touching >> k & 1;
      b.pick[found] = 2 * (first + k) + touches;
      found += touches | ((close >> k & 1) & (b.flag[first + k] != 0));
    }
#endif
  }
  return found;
}

/// Brings what belongs to the picked pairs together.
inline void gather(const PairStep& s, PairBlock& b, int found) {
  for (int k = 0; k < found; ++k) {
    const int touches = b.pick[k] & 1, place = b.pick[k] >> 1, run = b.run[place], slot = place - b.run_start[run];
    b.grain[k] = b.i[place];
    b.partner[k] = b.j[place];
    b.history[k] = b.run_histories[run] + static_cast<long>(s.stride) * slot;
    b.flags[k] = b.run_flags[run] + slot;
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

template <int N>
DEMBARK_HOT void store(const PackVec<N>& v, double (*to)[N]) {
  v.x.store(to[0]);
  v.y.store(to[1]);
  v.z.store(to[2]);
}

/// Leaves the lanes `rest` of the pack at `first` to the scalar law, which gets their states as they were.
template <int N>
__attribute__((noinline)) void scalar_friction(const PairStep& s, const PairBlock& b, int first, unsigned rest, const PackVec<N>& normal,
                                               const PackVec<N>& spin, const PackVec<N>& velocity,
                                               const dembark::NormalResponse<Pack<N>>& response, const Pack<N>& radius_overlap,
                                               PackVec<N>& tangential) {
  alignas(64) double n[3][N], w[3][N], v[3][N], t[3][N];
  store(normal, n);
  store(spin, w);
  store(velocity, v);
  store(tangential, t);
  for (int k = 0; k < N; ++k) {
    if (!(rest >> k & 1)) continue;
    double force[3];
    s.friction(s.caller, b, first + k,
               {{n[0][k], n[1][k], n[2][k]},
                {w[0][k], w[1][k], w[2][k]},
                {v[0][k], v[1][k], v[2][k]},
                response.force[k],
                response.tangential_stiffness[k],
                response.tangential_damping[k],
                radius_overlap[k]},
               force);
    for (int axis = 0; axis < 3; ++axis) t[axis][k] = force[axis];
  }
  tangential = {Pack<N>::load(t[0]), Pack<N>::load(t[1]), Pack<N>::load(t[2])};
}

/// Forces and moments of the picked pairs.
template <int N>
inline void compute(const PairStep& s, PairBlock& b, int found) {
  typedef Pack<N> P;
  const bool one_kind = s.types == 2;
  LawPack<N> law = law_of_one_kind<N>(s.laws[one_kind ? 3 : 0]);
  for (int first = 0; first < found; first += N) {
    const int *i = b.grain + first, *j = b.partner + first;
    const unsigned there = found - first < N ? (1u << (found - first)) - 1 : (1u << N) - 1;
    if (!one_kind) law = laws_of_kinds<N>(s.laws, b.kind + first);
    const P radius_i = values<N>(s.radius, i), radius_j = values<N>(s.radius, j), radius_sum = radius_i + radius_j;
    const PackVec<N> delta = rows3<N>(s.x, i) - rows3<N>(s.x, j);
    const P squared = dot(delta, delta), distance = sqrt(squared), reduced_radius = radius_i * radius_j / radius_sum;
    const PackVec<N> normal = delta * (1.0 / distance);
    const auto touching = squared < radius_sum * radius_sum;
    const unsigned apart = ~bits(touching) & there;

    const P mass_i = values<N>(s.mass, i), mass_j = values<N>(s.mass, j);
    P reduced_mass = mass_i * mass_j / (mass_i + mass_j);
    if (s.frozen) {
      reduced_mass = select(collect<N>([=, &s](int k) { return s.mask[i[k]] & s.frozen ? 1.0 : 0.0; }) > 0.0, mass_j, reduced_mass);
      reduced_mass = select(collect<N>([=, &s](int k) { return s.mask[j[k]] & s.frozen ? 1.0 : 0.0; }) > 0.0, mass_i, reduced_mass);
    }
    const P overlap = radius_sum - distance, arm_i = radius_i - 0.5 * overlap, arm_j = radius_j - 0.5 * overlap;
    const PackVec<N> omega_i = rows3<N>(s.omega, i), omega_j = rows3<N>(s.omega, j), spin = omega_i + omega_j;
    const dembark::ContactMotion<P> motion =
        dembark::contact_motion<P>(normal, rows3<N>(s.v, i) - rows3<N>(s.v, j), arm_i * omega_i + arm_j * omega_j);
    dembark::NormalResponse<P> response = dembark::hertz(law, reduced_radius, reduced_mass, overlap, motion.normal);
    if (s.limit_force) response.force = select(response.force < 0.0, P(0.0), response.force);
    if (!s.tangential_damping) response.tangential_damping = 0.0;

    const auto history = [=, &b, &s](int k) { return b.history[first + k] + s.offset; };
    const P radius_overlap = reduced_radius * overlap, dt = s.dt;
    const Quad<N> old = rows4<N>(history);
    dembark::FrictionState<P> state{{old.x, old.y, old.z}, old.w, collect<N>([=](int k) { return history(k)[4]; })};
    state.displacement = dembark::rotate_to_plane<P>(state.displacement, normal, 0.5 * dt * dot(spin, normal));
    state.displacement += motion.tangential * dt;
    const auto sticks = dembark::plainly_sticks(law, response.force, response.tangential_stiffness, dembark::pi * radius_overlap, state);
    PackVec<N> tangential =
        dembark::sticking_force<P>(response.tangential_stiffness, response.tangential_damping, motion.tangential, dt, law.kept_slip, state);
    if (apart) {  // such a pair has forgotten its contact
      const P none = 0.0;
      response.force = select(touching, response.force, none);
      tangential = {select(touching, tangential.x, none), select(touching, tangential.y, none), select(touching, tangential.z, none)};
      state = {{select(touching, state.displacement.x, none), select(touching, state.displacement.y, none),
                select(touching, state.displacement.z, none)},
               select(touching, state.slip, none),
               select(touching, state.dissipated_energy, none)};
    }
    const unsigned packed = s.pack_friction ? bits(sticks) | apart : apart;
    alignas(64) double energy[N];
    state.dissipated_energy.store(energy);
    if (__builtin_expect((packed & there) == there, 1)) {
      store_rows4<N>(Quad<N>{state.displacement.x, state.displacement.y, state.displacement.z, state.slip}, history);
#pragma GCC unroll 8
      for (int k = 0; k < N; ++k) history(k)[4] = energy[k];
    } else {
      alignas(64) double rows[N][4];
      store_rows4<N>(Quad<N>{state.displacement.x, state.displacement.y, state.displacement.z, state.slip},
                     [&rows](int k) { return rows[k]; });
      for (int k = 0; k < N; ++k) {
        if (!(packed & there & 1u << k)) continue;
        double* const to = history(k);
        __builtin_memcpy(to, rows[k], sizeof rows[k]);
        to[4] = energy[k];
      }
      scalar_friction<N>(s, b, first, there & ~packed, normal, spin, motion.tangential, response, radius_overlap, tangential);
    }

    if (s.bridges) {
      alignas(64) double gap[N], pull[N];
      (distance - radius_sum).store(gap);
      s.bridges(s.caller, b, first, found - first < N ? found - first : N, gap, pull);
      response.force -= P::load(pull);
    }
    const PackVec<N> force = response.force * normal + tangential, moment = cross(normal, tangential);
    store_rows4<N>(Quad<N>{force.x, force.y, force.z, arm_i}, [first, &b](int k) { return b.force[first + k]; });
    store_rows4<N>(Quad<N>{moment.x, moment.y, moment.z, arm_j}, [first, &b](int k) { return b.moment[first + k]; });
  }
}

/// to += scale * row, both of three numbers.
DEMBARK_HOT void add(double* to, double scale, const double* row) {
  (Pack<2>::load(to) + scale * Pack<2>::load(row)).store(to);
  to[2] += scale * row[2];
}

inline void scatter(const PairStep& s, const PairBlock& b, int found) {
  double nowhere[3] = {};
  for (int k = 0; k < found; ++k) {
    const double *force = b.force[k], *moment = b.moment[k];
    const long i = b.grain[k], j = b.partner[k];
    add(s.f + 3 * i, 1.0, force);
    add(s.torque + 3 * i, -force[3], moment);
    // Copies of other ranks' grains are strewn among the partners: no branch on it.
    const bool ours = j < s.owned;
    add(ours ? s.f + 3 * j : nowhere, -1.0, force);
    add(ours ? s.torque + 3 * j : nowhere, -moment[3], moment);
  }
}

}  // namespace

void PAIR_PACKS(const PairStep& step, PairBlock& block) {
  for (int next = 0, slot = 0; next < step.count;) {
    const int pairs = take_neighbors(step, block, next, slot), found = pick_pairs<DEMBARK_LANES>(step, block, pairs);
    if (found == 0) continue;
    gather(step, block, found);
    compute<DEMBARK_LANES>(step, block, found);
    scatter(step, block, found);
  }
}

}  // namespace dembark_liggghts
