// LAMMPS adapter of whole contacts between grains: fetches the pairs, calls dembark/contact.hpp, adds the forces.
//
//   pair_style dembark/granular [normal hertz|hooke V] [presliding linear|exponential|partial_slip]
//              [friction_limit total|elastic] [rolling_resistance off|constant_torque|elastic_plastic]
//              [capillary_model M surface_tension S] ...
//   pair_coeff I J keyword value ...
#ifndef DEMBARK_PAIR_DEMBARK_GRANULAR_H
#define DEMBARK_PAIR_DEMBARK_GRANULAR_H

#include <string>
#include <vector>

#include "atom.h"
#include "pair.h"

#include "contact_coefficients.h"
#include "energy_tally.h"
#include "neighbor_history.h"
#include "packed_contacts.h"

namespace LAMMPS_NS {

class PairDembarkGranular : public Pair, dembark_family::PackedContacts {
 public:
  PairDembarkGranular(LAMMPS* lmp);
  ~PairDembarkGranular() override;
  void settings(int narg, char** arg) override;
  void coeff(int narg, char** arg) override;
  void init_style() override;
  double init_one(int i, int j) override;
  /// m, of a grain and of two radii: for `neigh_modify collection/interval`. They override what Pair has before update 4 of 22 Jul 2025;
  /// later LAMMPS asks for the radii alone.
  double atom2cut(int i) { return 2.0 * atom->radius[i]; }
  double radii2cut(double radius_i, double radius_j) { return radius_i + radius_j + reach(); }
  void compute(int eflag, int vflag) override;
  double single(int i, int j, int itype, int jtype, double rsq, double factor_coul, double factor_lj, double& fforce) override;
  void transfer_history(double* from, double* to, int, int) override;
  int pack_forward_comm(int count, int* grains, double* buffer, int, int*) override;
  void unpack_forward_comm(int count, int first, double* buffer) override;

  const dembark_lammps::ContactCoefficients& coefficients() const { return coefficients_; }
  const dembark_lammps::NeighborHistory& history() const { return *history_; }
  /// kg, of a grain or its rigid body; infinite for an atom of fix freeze.
  double mass(int i) const;
  int freeze_bit() const { return freeze_bit_; }
  /// m, of all grains, those that fixes will insert included.
  double largest_radius() const;

 protected:
  dembark_lammps::ContactCoefficients coefficients_;
  dembark::HistoryLayout layout_;
  int freeze_bit_ = 0;
  /// The end of the fix's name, its group, its style, and how many numbers it keeps of a contact.
  virtual std::string history_fix() const;
  void check_radii();
  void refuse_double_contacts() const;
  void refuse_coincidence(int i, int j) const override;
  void check_reach(int i, int j, double rupture_distance) const override;

 private:
  static constexpr int single_numbers = 18;
  bool packed_ = false;  // packs know the law
  class FixCapillaryLiquid* liquid_ = nullptr;
  std::string history_name_;  // begins the name of the fix
  dembark_lammps::NeighborHistory* history_ = nullptr;
  dembark_lammps::EnergyTally* energies_ = nullptr;
  std::vector<double> largest_radius_;  // m, of each type, for which lists are made
  bool grains_grow_ = false;            // during a run
  struct Listed {
    dembark::Vec3<double> place;
    double radius;
  };
  std::vector<class Fix*> rigid_;
  std::vector<double> masses_;  // kg, of grains, or of the rigid bodies that they belong to, when there are such
  std::vector<Listed> listed_;  // of own grains that grow, when the lists were made

  dembark::ContactBodies bodies(int i, int j) const;
  template <class Visit>
  void each_contact(Visit visit);
  const dembark::ContactParameters& law(int type_i, int type_j) const override { return coefficients_(type_i, type_j); }
  void advance_packs();
  void tally(int i, int j, const dembark::ContactBodies& bodies, const dembark::ContactForce& out);
  /// m, between surfaces: no bridge is longer than the skin, and what lists pairs looks no further than this.
  double reach() const;
  const double* masses() const { return rigid_.empty() ? atom->rmass : masses_.data(); }
  void take_body_masses();
  void check_run();
  void find_radii();
  void watch_growth();
};

}  // namespace LAMMPS_NS

#endif
