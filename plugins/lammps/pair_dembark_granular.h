// LAMMPS adapter of whole contacts between grains: fetches the pairs, calls dembark/contact.hpp, adds the forces.
//
//   pair_style dembark/granular [normal hertz|hooke V] [presliding linear|exponential|partial_slip]
//              [rolling_resistance off|constant_torque|elastic_plastic] [capillary_model M surface_tension S] ...
//   pair_coeff I J keyword value ...
#ifndef DEMBARK_PAIR_DEMBARK_GRANULAR_H
#define DEMBARK_PAIR_DEMBARK_GRANULAR_H

#include <vector>

#include "pair.h"

#include "contact_coefficients.h"
#include "energy_tally.h"
#include "neighbor_history.h"
#include "packed_contacts.h"

namespace LAMMPS_NS {

class PairDembarkGranular : public Pair {
 public:
  PairDembarkGranular(LAMMPS* lmp);
  ~PairDembarkGranular() override;
  void settings(int narg, char** arg) override;
  void coeff(int narg, char** arg) override;
  void init_style() override;
  double init_one(int i, int j) override;
  void compute(int eflag, int vflag) override;
  double single(int i, int j, int itype, int jtype, double rsq, double factor_coul, double factor_lj, double& fforce) override;
  void transfer_history(double* from, double* to, int, int) override;

  const dembark_lammps::ContactCoefficients& coefficients() const { return coefficients_; }
  const dembark_lammps::NeighborHistory& history() const { return *history_; }
  /// kg; infinite for an atom of fix freeze.
  double mass(int i) const;
  /// m, of all grains, those that fixes will insert included.
  double largest_radius() const;

 private:
  static constexpr int single_numbers = 18;
  dembark_lammps::ContactCoefficients coefficients_;
  dembark_lammps::PackedContacts packs_;
  bool packed_ = false;  // packs know the law
  class FixCapillaryLiquid* liquid_ = nullptr;
  dembark_lammps::NeighborHistory* history_ = nullptr;
  dembark::HistoryLayout layout_;
  dembark_lammps::EnergyTally* tally_ = nullptr;
  int freeze_bit_ = 0;
  std::vector<double> largest_radius_;  // m, of each type

  std::string history_id() const;
  dembark::ContactBodies bodies(int i, int j) const;
  template <class Visit>
  void each_contact(Visit visit);
  void tally(int i, int j, const dembark::ContactBodies& bodies, const dembark::ContactForce& out);
  void find_radii();
};

}  // namespace LAMMPS_NS

#endif
