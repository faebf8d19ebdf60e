// One step of the pairs of spheres under Hertz's law, Finnie-Rabinowicz friction and capillary bridges, computed in packs of contacts
// with the widest vectors that the processor has. What the loop needs of the engine comes as bare arrays, so that pair_packs.hpp can be
// compiled once for each instruction set; this file includes nothing, so that all that the loop inlines is compiled for the same one.
#ifndef DEMBARK_PAIR_PACKS_H
#define DEMBARK_PAIR_PACKS_H

namespace dembark_liggghts {

/// What the laws take of a pair of types; eight numbers, read as two rows of four.
struct PairLaw {
  double effective_youngs_modulus, effective_shear_modulus, damping;
  double static_friction, kinetic_friction, interface_shear_strength, kept_slip;
  double unused;
};

/// The pairs in work, as arrays; some room behind for whole packs.
struct PairBlock {
  static constexpr int capacity = 256, room = capacity + 16;
  alignas(64) int i[room], j[room], flag[room], run[room];  // neighbours as they come: grains, contact flag, which run below
  alignas(64) int pick[room];                               // those with a force: 2 * place above, + 1 if they touch
  int run_start[room];          // of each run of neighbours of one grain: place of what would be the grain's first neighbour
  int* run_flags[room];         // its flag
  double* run_histories[room];  // its history
  alignas(64) int grain[room], partner[room], kind[room];  // pairs with a force
  int* flags[room];
  double* history[room];
};

/// A contact whose lane is left to the scalar law.
struct FrictionInput {
  double normal[3], velocity[3];
  double twist, normal_force, stiffness, damping, area;
};

struct PairStep {
  // (grains, 3) or (grains)
  const double *x, *v, *omega, *radius, *mass;
  const int *type, *mask;
  double *f, *torque;
  int owned;  // grains from here on get no forces
  // neighbour list
  int count, stride, offset;  // grains; numbers in a history; place of friction's
  const int *grains, *numneigh;
  int* const* neighbors;
  int* const* flags;
  double* const* histories;
  // flags of a pair that touches; all that the models own
  int touching_flags, own_flags;
  const PairLaw* laws;  // one a pair of types, row by row
  int types;            // in a row; with 2, only the pair 1-1 is there
  double dt;
  bool limit_force, tangential_damping, pack_friction;  // the last: false leaves all friction to the scalar law
  int frozen;                                           // group bit
  void* caller;
  // Scalar friction of pair k, on the first grain; its state is stored there.
  void (*friction)(void* caller, const PairBlock& block, int k, const FrictionInput& input, double* force);
  // Pull of the bridges of pairs first ... first + count - 1, or nullptr without liquid.
  void (*bridges)(void* caller, const PairBlock& block, int first, int count, const double* gap, double* pull);
};

/// The loop with packs of the type `P`.
template <class P>
void pair_packs(const PairStep& step, PairBlock& block);

typedef void PairPacks(const PairStep& step, PairBlock& block);
/// The one for this processor, or a narrower one: the environment variable DEMBARK_LANES may hold 2, 4 or 8.
PairPacks* choose_pair_packs();

}  // namespace dembark_liggghts

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define DEMBARK_PAIR_PACKS_X86 1
#endif

#endif
