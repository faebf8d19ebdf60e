// pair_style sph/coupled spacing DX sound_speed C ...: weakly compressible fluid with walls and rigid bodies, the terms of dembark/sph.
//
// fix nve/sph/coupled says which atoms are fluid and moves them; fix sph/wall and fix sph/body say which are solid. The passes of a step
// are those of dembark/sph/passes.hpp; here atoms become its scene, and ghosts get what the passes have computed of their atoms on other
// ranks. Neighbours are found by dembark/sph/neighbours.hpp when the engine rebuilds its lists: those would hold walls, too, with all their
// neighbours in walls.
#ifdef PAIR_CLASS

PairStyle(sph / coupled, PairSphCoupled)

#else

#ifndef LMP_PAIR_SPH_COUPLED_H
#define LMP_PAIR_SPH_COUPLED_H

#include <memory>
#include <string>
#include <vector>

#include "pair.h"

#include "dembark/sph/neighbours.hpp"
#include "dembark/sph/passes.hpp"
#include "sph_films.h"

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
  static constexpr const char *missing = "it needs pair_style sph/coupled, alone or in hybrid/overlay, before it";

  const dembark::sph::Settings &fluid() const { return scene_.settings; }
  /// At the beginning of a run, when there are ghosts and neighbours: checks, and pressures from the densities. first: no run was before.
  /// Collective.
  void begin(bool first);
  /// Of this rank: what is stored, lost since the beginning.
  dembark::sph::Energies energies() const;

  dembark_liggghts::SphFilms &films() { return films_; }
  /// Number of a wall or body in the scene.
  int number(const class FixSphBody *) const;

 private:
  /// Sends what passes have computed to ghosts (dembark/sph/passes.hpp).
  struct Images;

  [[noreturn]] void refuse(const std::string &what) const;
  void read(const std::vector<std::string> &words);
  void refuse_if_any(const std::string &line) const;
  void find_gravity();
  std::string wrong_atom() const;
  std::string wrong_with(int i) const;
  std::string overlap() const;
  void sort_particles();
  void load();
  void store(bool moved);
  int numbers_to_ghosts() const;

  std::vector<std::string> words_;
  bool all_types_ = false;  // until the first pair_coeff behind a restart file
  dembark::sph::Scene scene_;
  std::unique_ptr<dembark::sph::Passes> passes_;
  dembark_liggghts::SphFilms films_;
  class FixNveSphCoupled *fluid_fix_ = nullptr;
  std::vector<class FixSphBody *> solids_;               // the bodies of the scene
  std::vector<dembark_liggghts::SphParticle> particle_;  // of each atom
  std::vector<int> atoms_[3];                            // of each role
  dembark::sph::Neighbours neighbours_;
  bool walls_to_ghosts_ = false;  // what pack_comm() sends: pressures and velocities of solids, else densities
};

}  // namespace LAMMPS_NS

#endif
#endif
