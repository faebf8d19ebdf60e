// One step of the pairs of spheres under Hertz's law, Finnie-Rabinowicz friction and capillary bridges, computed in packs of contacts
// with the widest vectors that the processor has: of all that neighbour lists like those of LAMMPS and LIGGGHTS hold, or of those that an
// engine has picked. pair_packs.hpp is compiled once for each instruction set (packs_*.cpp); what it includes of others comes through this
// file, before the set is chosen.
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
struct PackedCoefficients {
  Real effective_youngs_modulus, effective_shear_modulus, damping;
  Real static_friction, kinetic_friction, interface_shear_strength, kept_slip;
  Real critical_slip_distance;
};

/// Those of dembark/contact.hpp, for steps of `dt` (s).
template <class Parameters>
PackedCoefficients<double> packed_coefficients(const Parameters& p, double dt) {
  return {p.elasticity.effective_youngs_modulus,
          p.elasticity.effective_shear_modulus,
          p.elasticity.damping,
          p.friction.static_friction,
          p.friction.kinetic_friction,
          p.friction.interface_shear_strength,
          kept_slip(p.friction, dt),
          p.friction.critical_slip_distance};
}

/// The pairs in work: those that touch, and those with a contact or a bridge stored, to hold or to end it.
struct PairBlock {
  static constexpr int capacity = 128, room = capacity + 16;    // some room behind for whole packs
  alignas(64) int grain[room], partner[room], law_index[room];  // law_index: place in the table of laws
  alignas(64) int pick[room];                                   // 2 * place among the grain's neighbours, + 1 if they touch
  int* flags[room];
  double* history[room];
};

/// The laws of single contacts, which the packs leave the rare ones to. `k`: place in the block.
struct ContactCallbacks {
  /// Friction on the first grain (N); the state is stored.
  virtual Vec3<double> friction(const PairBlock& block, int k, const Vec3<double>& normal, double twist,
                                const NormalResponse<double>& response, const Vec3<double>& velocity) = 0;
  /// Forces (N, > 0: pulls) of the bridges of `count` pairs over their gaps (m).
  virtual void bridges(const PairBlock& block, int first, int count, const double* gap, double* cohesive_force) = 0;
};

/// The same of contacts that remember more: the rings of partial slip, a rolling spring.
struct HistoryCallbacks {
  /// Couple of rolling resistance on the first grain (N m); the state is stored.
  virtual Vec3<double> rolling(const PairBlock& block, int k, const Vec3<double>& normal, double twist, double normal_force,
                               double tangential_stiffness, const Vec3<double>& spin) = 0;
  /// Limits of friction (N): of a contact that has slipped by `slip` (m), and of one that slides now (sliding_limit).
  virtual double limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) = 0;
  virtual double sliding_limit(const PairBlock& block, int k, const RingMotion<double>& motion, const double* rings, double normal_force,
                               double contact_area, double& slip) = 0;
};

/// What a pack of contacts has come to, for an engine that stores it or sums up its works: rows of four numbers, one a contact.
struct PackResults {
  const double (*force)[4];     ///< N, on the first grain, and its lever arm (m)
  const double (*moment)[4];    ///< N, normal x tangential force, and the lever arm (m) of the second grain
  const double (*normal)[4];    ///< N, the part of the force along the normal, and the normal stiffness (N/m)
  const double (*friction)[4];  ///< N, the part along the surface, and the tangential stiffness (N/m)
};
struct ResultStore {
  /// Of `count` contacts of the block; their states are in their histories.
  virtual void store(const PairBlock& block, int first, int count, const PackResults& results) = 0;
};

/// What a step works on. Arrays of grains are (grains, 3) or (grains), in SI units.
struct PairStep {
  ContactCallbacks& scalar;
  HistoryCallbacks* memory = nullptr;                ///< asked with `rings` or `rolls` only
  ResultStore* results = nullptr;                    ///< gets what the contacts have come to, unless null
  const PackedCoefficients<double>* laws = nullptr;  ///< one a pair of types, row by row
  int types = 0;                                     ///< in a row
  bool one_law = false;                              ///< for all contacts that come
  int owned = 0;                                     ///< grains from here on get no forces
  int offset = 0;                                    ///< of friction in a history
  int rings = -1;                                    ///< of partial slip; -1: there is none
  int more = -1, more_numbers = 0;                   ///< of partial slip and of a rolling spring together; -1: there is neither
  double dt = 0.0;
  bool wet = false, limit_force = false, tangential_damping = true;
  bool elastic_limit = false;  ///< FrictionLimit::elastic, of all laws
  bool pack_friction = true;   ///< false leaves all friction to the scalar law
  bool rolls = false;

  const double *x = nullptr, *v = nullptr, *omega = nullptr, *radius = nullptr, *mass = nullptr;
  const int *type = nullptr, *mask = nullptr;
  double *f = nullptr, *torque = nullptr;  ///< null: forces go nowhere but to `results`
  int frozen = 0;                          ///< bit of `mask` of grains that never move

  int count = 0, stride = 0;  ///< grains with neighbours; numbers of a history
  const int *grains = nullptr, *numneigh = nullptr;
  int* const* neighbors = nullptr;
  int* const* flags = nullptr;
  double* const* histories = nullptr;
  int number_bits = 0;                     ///< of a neighbour in the list
  int contact_flags = 0, bridge_flag = 0;  ///< set while surfaces touch, and while a bridge holds
};

/// All pairs of the neighbour lists, in packs of the type `P`.
template <class P>
void pair_packs(const PairStep& step, PairBlock& block);
/// The first `found` pairs of the block, whose grains, law indices and histories are filled in, and all of which touch.
template <class P>
void picked_packs(const PairStep& step, PairBlock& block, int found);

extern template void pair_packs<Pack<2, Portable>>(const PairStep&, PairBlock&);
extern template void picked_packs<Pack<2, Portable>>(const PairStep&, PairBlock&, int);
#ifdef DEMBARK_PAIR_PACKS_X86
extern template void pair_packs<Pack<4, Avx2>>(const PairStep&, PairBlock&);
extern template void picked_packs<Pack<4, Avx2>>(const PairStep&, PairBlock&, int);
extern template void pair_packs<Pack<8, Avx512>>(const PairStep&, PairBlock&);
extern template void picked_packs<Pack<8, Avx512>>(const PairStep&, PairBlock&, int);
#endif

struct PairLoops {
  void (*lists)(const PairStep&, PairBlock&);
  void (*picked)(const PairStep&, PairBlock&, int found);

  template <class P>
  static PairLoops of() {
    return {pair_packs<P>, picked_packs<P>};
  }
  /// The environment variable DEMBARK_LANES may hold 2, 4 or 8, for packs of no more, or 1: contacts one by one, by the engine's own loop.
  static int asked_lanes() {
    const char* const asked = std::getenv("DEMBARK_LANES");
    return asked ? int(std::strtol(asked, nullptr, 10)) : 8;
  }
  /// Those for this processor, or narrower ones.
  static PairLoops choose() {
#ifdef DEMBARK_PAIR_PACKS_X86
    const int lanes = asked_lanes();
    __builtin_cpu_init();
    if (lanes >= 8 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw"))
      return of<Pack<8, Avx512>>();
    if (lanes >= 4 && __builtin_cpu_supports("avx2")) return of<Pack<4, Avx2>>();
#endif
    return of<Pack<2, Portable>>();
  }
};

}  // namespace dembark
