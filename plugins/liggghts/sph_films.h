// Films of water in slits between boxes of fix sph/body and at planes, dembark/sph/slits.hpp, on pressures that are spread over ranks.
#pragma once

#include <string>
#include <vector>

#include "dembark/sph/slits.hpp"
#include "pointers.h"

namespace LAMMPS_NS {
class FixSphBody;
}

namespace dembark_liggghts {

class SphFilms : protected LAMMPS_NS::Pointers {
 public:
  explicit SphFilms(LAMMPS_NS::LAMMPS *lmp) : Pointers(lmp) {}

  /// Boxes of these bodies with half edges `half` (m), the lattices of their particles. Throws std::invalid_argument with the one clear
  /// line about a box whose particles are not that lattice. Collective.
  void begin(const std::vector<LAMMPS_NS::FixSphBody *> &fixes, const std::vector<std::string> &names,
             const std::vector<dembark::sph::Vector> &half, const std::vector<dembark::sph::LatticePlane> &planes);
  /// Forces as they are now, at xi = `share`: loads of the bodies, which all ranks add alike. Collective.
  void push(double share);

 private:
  /// Place in the lattice of a particle at `arm` from the centre, or -1 beside it.
  int place(const dembark::sph::LatticeBox &box, const dembark::sph::Vector &arm) const;

  std::vector<LAMMPS_NS::FixSphBody *> fixes_;
  dembark::sph::Slits slits_;
  std::vector<dembark::sph::Body> bodies_;
  std::vector<double> pressures_;
};

}  // namespace dembark_liggghts
