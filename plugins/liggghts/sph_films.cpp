#include "sph_films.h"

#include <algorithm>
#include <stdexcept>

#include "dembark/keyword_reader.hpp"
#include "fix_sph_body.h"

using namespace LAMMPS_NS;
using namespace dembark::sph;
using dembark::keywords::refuse;

namespace dembark_liggghts {

void SphFilms::clear() {
  fixes_.clear();
  scene_.slits.boxes.clear();
}

void SphFilms::begin(const std::vector<FixSphBody *> &fixes, const std::vector<std::string> &names, const std::vector<int> &numbers,
                     const std::vector<Vector> &half, const std::vector<LatticePlane> &planes, double share) {
  if (scene_.settings.contact.on()) refuse("slit_pressure is for boxes on which the fluid acts by pressure, not by the contact potential");
  fixes_ = fixes;
  scene_.settings.slit_pressure = share;
  scene_.slits.boxes.clear();
  scene_.slits.planes = planes;
  int particles = 0;
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    LatticeBox box{numbers[k], particles, half[k], {}};
    try {
      box.count = lattice_counts(2.0 * half[k], scene_.settings.spacing);
    } catch (const std::invalid_argument &wrong) {
      refuse("slit_pressure: box " + names[k] + ": " + wrong.what());
    }
    const int all = box.count[0] * box.count[1] * box.count[2];
    int found[2] = {0, 0};  // on the lattice, and in the body
    fixes[k]->each_arm([&](int, const Vector &arm) {
      found[0] += box.particle_at(arm) >= 0;
      ++found[1];
    });
    MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_INT, MPI_SUM, world);
    if (found[0] != all || found[1] != all)
      refuse("slit_pressure: the particles of box " + names[k] + " must be the lattice that fills it, " + std::to_string(all) +
             " of them; of its " + std::to_string(found[1]) + ", " + std::to_string(found[0]) + " are on that lattice");
    scene_.slits.boxes.push_back(box);
    particles += all;
  }
  pressures_.resize(std::size_t(particles));
}

const std::vector<double> &SphFilms::pressures(const std::vector<SphParticle> &atoms) {
  std::fill(pressures_.begin(), pressures_.end(), 0.0);
  for (std::size_t k = 0; k < fixes_.size(); ++k)
    fixes_[k]->each_arm([&](int i, const Vector &arm) {
      pressures_[std::size_t(scene_.slits.boxes[k].particle_at(arm))] =
          scene_.solids[0].pressure[std::size_t(atoms[std::size_t(i)].number)];
    });
  MPI_Allreduce(MPI_IN_PLACE, pressures_.data(), int(pressures_.size()), MPI_DOUBLE, MPI_SUM, world);
  return pressures_;
}

}  // namespace dembark_liggghts
