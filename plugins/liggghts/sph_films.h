// Films of water in slits between boxes of fix sph/body and at planes, dembark/sph/slits.hpp: pressures that are spread over ranks.
#pragma once

#include <string>
#include <vector>

#include "pointers.h"

#include "dembark/sph/scene.hpp"
#include "sph_particle.h"

namespace LAMMPS_NS {
class FixSphBody;
}

namespace dembark_liggghts {

class SphFilms : protected LAMMPS_NS::Pointers {
 public:
  SphFilms(LAMMPS_NS::LAMMPS *lmp, dembark::sph::Scene &scene) : Pointers(lmp), scene_(scene) {}

  /// No films.
  void clear();
  /// Boxes of these bodies, which have those numbers in the scene, with half edges `half` (m), the lattices of their particles; planes; the
  /// share xi. Throws std::invalid_argument with the one clear line about a box whose particles are not that lattice. Collective.
  void begin(const std::vector<LAMMPS_NS::FixSphBody *> &fixes, const std::vector<std::string> &names, const std::vector<int> &numbers,
             const std::vector<dembark::sph::Vector> &half, const std::vector<dembark::sph::LatticePlane> &planes, double share);
  /// Pa, of all particles of the boxes. atoms: what the atoms of this rank are in the scene. Collective.
  const std::vector<double> &pressures(const std::vector<SphParticle> &atoms);

 private:
  dembark::sph::Scene &scene_;
  std::vector<LAMMPS_NS::FixSphBody *> fixes_;
  std::vector<double> pressures_;
};

}  // namespace dembark_liggghts
