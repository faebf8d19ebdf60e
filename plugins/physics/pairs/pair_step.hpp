// One step of the pairs of spheres under Hertz's law, Finnie-Rabinowicz friction and capillary bridges, computed in packs of contacts
// with the widest vectors that the processor has, for engines whose neighbour lists are those of LAMMPS and LIGGGHTS. An engine compiles
// pair_packs.hpp once for each instruction set; what that includes of others comes through this file, before the set is chosen.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define DEMBARK_PAIR_PACKS_X86
#include <immintrin.h>
#endif

namespace dembark {

template <class Real>
struct NormalResponse;
template <class Real>
struct RingMotion;
template <class Real>
struct Vec3;
struct Portable;
struct Avx2;
struct Avx512;
template <int N, class Set>
struct Pack;

/// What the laws take of a pair of types; eight numbers, read as two rows of four.
template <class Real>
struct PairLaw {
  Real effective_youngs_modulus, effective_shear_modulus, damping;
  Real static_friction, kinetic_friction, interface_shear_strength, kept_slip;
  Real unused;
};

/// The pairs in work: those that touch, and those with a contact or a bridge stored, to hold or to end it.
struct PairBlock {
  static constexpr int capacity = 128, room = capacity + 16;  // some room behind for whole packs
  alignas(64) int grain[room], partner[room], kind[room];     // kind: place in the table of laws
  alignas(64) int pick[room];                                 // 2 * place among the grain's neighbours, + 1 if they touch
  int* flags[room];
  double* history[room];
};

/// The laws of single contacts, which the packs leave the rare ones to. `k`: place in the block.
struct ScalarLaws {
  /// Friction on the first grain (N); the state is stored.
  virtual Vec3<double> friction(const PairBlock& block, int k, const Vec3<double>& normal, double twist,
                                const NormalResponse<double>& response, const Vec3<double>& velocity) = 0;
  /// Couple of rolling resistance on the first grain (N m); the state is stored.
  virtual Vec3<double> rolling(const PairBlock& block, int k, const Vec3<double>& normal, double twist, double normal_force,
                               double tangential_stiffness, const Vec3<double>& spin) = 0;
  /// Limits of friction (N): of a contact that has slipped by `slip` (m), and of one that slides now (sliding_limit).
  virtual double limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) = 0;
  virtual double sliding_limit(const PairBlock& block, int k, const RingMotion<double>& motion, const double* rings, double normal_force,
                               double contact_area, double& slip) = 0;
  /// Pulls (N) of the bridges of `count` pairs over their gaps (m).
  virtual void bridges(const PairBlock& block, int first, int count, const double* gap, double* pull) = 0;
};

/// What a step works on. Arrays of grains are (grains, 3) or (grains), in SI units.
struct PairStep {
  ScalarLaws& scalar;
  const PairLaw<double>* laws;  ///< one a pair of types, row by row
  int types;                    ///< in a row; with 2, only the pair 1-1 is there
  int owned;                    ///< grains from here on get no forces
  int offset;                   ///< of friction in a history
  int rings;                    ///< of partial slip; -1: there is none
  int more, more_numbers;       ///< of partial slip and of a rolling spring together; -1: there is neither
  double dt;
  bool wet, limit_force, tangential_damping;
  bool pack_friction;  ///< false leaves all friction to the scalar law
  bool rolls;

  const double *x, *v, *omega, *radius, *mass;
  const int *type, *mask;
  double *f, *torque;
  int frozen;  ///< bit of `mask` of grains that never move

  int count, stride;  ///< grains with neighbours; numbers of a history
  const int *grains, *numneigh;
  int* const* neighbors;
  int* const* flags;
  double* const* histories;
  int number_bits;                 ///< of a neighbour in the list
  int contact_flags, bridge_flag;  ///< set while surfaces touch, and while a bridge holds
};

/// The loop with packs of the type `P`.
template <class P>
void pair_packs(const PairStep& step, PairBlock& block);

typedef void PairPacks(const PairStep& step, PairBlock& block);

extern template void pair_packs<Pack<2, Portable>>(const PairStep&, PairBlock&);
#ifdef DEMBARK_PAIR_PACKS_X86
extern template void pair_packs<Pack<4, Avx2>>(const PairStep&, PairBlock&);
extern template void pair_packs<Pack<8, Avx512>>(const PairStep&, PairBlock&);
#endif

/// The one for this processor, or a narrower one: the environment variable DEMBARK_LANES may hold 2, 4 or 8.
inline PairPacks* choose_pair_packs() {
#ifdef DEMBARK_PAIR_PACKS_X86
  const char* const asked = std::getenv("DEMBARK_LANES");
  const int lanes = asked ? std::atoi(asked) : 8;
  __builtin_cpu_init();
  if (lanes >= 8 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw"))
    return pair_packs<Pack<8, Avx512>>;
  if (lanes >= 4 && __builtin_cpu_supports("avx2")) return pair_packs<Pack<4, Avx2>>;
#endif
  return pair_packs<Pack<2, Portable>>;
}

}  // namespace dembark
