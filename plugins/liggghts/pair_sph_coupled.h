// pair_style sph/coupled spacing DX sound_speed C ...: weakly compressible fluid with walls and rigid bodies, the terms of dembark/sph.
//
// fix nve/sph/coupled says which atoms are fluid and moves them; fix sph/wall and fix sph/body say which are solid. A step is that of
// dembark/sph/solver.hpp: the fix has densities computed before the forces are. Ghosts get the new densities and the pressures of solid
// particles within the step.
#ifdef PAIR_CLASS

PairStyle(sph / coupled, PairSphCoupled)

#else

#ifndef LMP_PAIR_SPH_COUPLED_H
#define LMP_PAIR_SPH_COUPLED_H

#include <string>
#include <vector>

#include "pair.h"

#include "dembark/sph/ledger.hpp"
#include "dembark/sph/particle_records.hpp"
#include "sph_rows.h"

namespace LAMMPS_NS {

class PairSphCoupled : public Pair {
 public:
  explicit PairSphCoupled(class LAMMPS *);
  ~PairSphCoupled();

  void settings(int, char **);
  void coeff(int, char **);
  void init_style();
  double init_one(int, int);
  void compute(int, int);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);
  void write_restart(FILE *);
  void read_restart(FILE *, const int, const int);

  /// The pair style of this run, alone or in hybrid/overlay; nullptr if there is none.
  static PairSphCoupled *find(class Force *);

  const dembark::sph::Settings &fluid() const { return settings_; }
  /// At the beginning of a run, when there are ghosts and neighbours: checks, and pressures from the densities. first: no run was before.
  /// Collective.
  void begin(bool first);
  /// Densities after dt (s), and shifts (m) if there is room for them. Collective.
  void advance(double dt, double **shifts);
  /// Of this rank: what is stored, lost since the beginning.
  dembark::sph::Energies energies() const;

 private:
  [[noreturn]] void refuse(const std::string &what) const;
  void read(const std::vector<std::string> &words);
  void refuse_if_any(const std::string &line) const;
  void find_gravity();
  std::string wrong_atom() const;
  std::string wrong_with(int i) const;
  std::string overlap() const;
  void sort_particles();
  void resize();
  dembark::sph::LoopArguments arguments(const dembark::sph::Rows &rows);
  void wall_states();
  void push(double dt);
  void repel();

  std::vector<std::string> words_;
  dembark::sph::Settings settings_;
  dembark::sph::LoopNumbers numbers_;
  const dembark::sph::Loops *loops_;
  dembark::sph::Energies lost_{};
  class FixNveSphCoupled *fluid_fix_ = nullptr;
  std::vector<class FixSphBody *> solids_;
  std::vector<dembark_liggghts::SphRole> role_;
  std::vector<int> solid_of_;  // of each atom: its number in solids_, or -1
  dembark_liggghts::SphRows rows_;
  std::vector<dembark::sph::Record> records_;
  std::vector<double> rate_;
  std::vector<dembark::sph::Quad> sum_, shift_sum_;
  std::vector<dembark::sph::Vector> velocity_, velocity_sum_, wall_velocity_;
  bool walls_to_ghosts_ = false;  // what pack_comm() sends: pressures and velocities of solids, else densities
};

}  // namespace LAMMPS_NS

#endif
#endif
