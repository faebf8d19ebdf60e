// One step of the pairs of spheres under Hertz's law, Finnie-Rabinowicz friction and capillary bridges, computed in packs of contacts
// with the widest vectors that the processor has. pair_packs.hpp is compiled once for each instruction set; what it includes comes
// through this file, before the set is chosen.
#ifndef DEMBARK_PAIR_PACKS_H
#define DEMBARK_PAIR_PACKS_H

#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

#include "atom.h"
#include "contact_model_constants.h"
#include "neigh_list.h"
#include "pair_gran.h"

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

}  // namespace dembark

namespace dembark_liggghts {

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
  virtual dembark::Vec3<double> friction(const PairBlock& block, int k, const dembark::Vec3<double>& normal, double twist,
                                         const dembark::NormalResponse<double>& response, const dembark::Vec3<double>& velocity) = 0;
  /// Couple of rolling resistance on the first grain (N m); the state is stored.
  virtual dembark::Vec3<double> rolling(const PairBlock& block, int k, const dembark::Vec3<double>& normal, double twist,
                                        double normal_force, double tangential_stiffness, const dembark::Vec3<double>& spin) = 0;
  /// Limits of friction (N): of a contact that has slipped by `slip` (m), and of one that slides now (dembark::sliding_limit).
  virtual double limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) = 0;
  virtual double sliding_limit(const PairBlock& block, int k, const dembark::RingMotion<double>& motion, const double* rings,
                               double normal_force, double contact_area, double& slip) = 0;
  /// Pulls (N) of the bridges of `count` pairs over their gaps (m).
  virtual void bridges(const PairBlock& block, int first, int count, const double* gap, double* pull) = 0;
};

struct PairStep {
  LAMMPS_NS::Atom& atom;
  LAMMPS_NS::PairGran& pair;
  ScalarLaws& scalar;
  const PairLaw<double>* laws;  // one a pair of types, row by row
  int types;                    // in a row; with 2, only the pair 1-1 is there
  int owned;                    // grains from here on get no forces
  int offset;                   // of friction in a history
  int rings;                    // of partial slip; -1: there is none
  int more, more_numbers;       // of partial slip and of a rolling spring together; -1: there is neither
  double dt;
  bool wet, limit_force, tangential_damping;
  bool pack_friction;  // false leaves all friction to the scalar law
  bool rolls;

  // (grains, 3) or (grains)
  const double *x = atom.x[0], *v = atom.v[0], *omega = atom.omega[0], *radius = atom.radius, *mass = atom.rmass;
  const int *type = atom.type, *mask = atom.mask;
  double *f = atom.f[0], *torque = atom.torque[0];
  int count = pair.list->inum, stride = pair.dnum(), frozen = pair.freeze_group_bit();
  const int *grains = pair.list->ilist, *numneigh = pair.list->numneigh;
  int* const* neighbors = pair.list->firstneigh;
  int* const* flags = pair.listgranhistory->firstneigh;
  double* const* histories = pair.listgranhistory->firstdouble;
};

/// The loop with packs of the type `P`.
template <class P>
void pair_packs(const PairStep& step, PairBlock& block);

typedef void PairPacks(const PairStep& step, PairBlock& block);
/// The one for this processor, or a narrower one: the environment variable DEMBARK_LANES may hold 2, 4 or 8.
PairPacks* choose_pair_packs();

}  // namespace dembark_liggghts

#endif
