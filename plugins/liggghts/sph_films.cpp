#include "sph_films.h"

#include <cmath>

#include "atom.h"
#include "dembark/keyword_reader.hpp"
#include "fix_sph_body.h"
#include "force.h"
#include "pair_sph_coupled.h"

using namespace LAMMPS_NS;
using namespace dembark::sph;
using dembark::keywords::refuse;
using dembark::keywords::text;

namespace dembark_liggghts {

int SphFilms::place(const LatticeBox &box, const Vector &arm) const {
  const double arms[] = {arm.x, arm.y, arm.z}, half[] = {box.half.x, box.half.y, box.half.z};
  std::array<int, 3> at{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double cells = 0.5 * box.count[k] * (arms[k] / half[k] + 1.0) - 0.5;
    at[k] = int(std::lround(cells));
    if (std::fabs(cells - at[k]) > 0.01 || at[k] < 0 || at[k] >= box.count[k]) return -1;
  }
  return box.particle(at);
}

void SphFilms::begin(const std::vector<FixSphBody *> &fixes, const std::vector<std::string> &names, const std::vector<Vector> &half,
                     const std::vector<LatticePlane> &planes) {
  const Settings &fluid = PairSphCoupled::find(force)->fluid();
  if (fluid.contact.on()) refuse("slit_pressure is for boxes on which the fluid acts by pressure, not by the contact potential");
  const double dx = fluid.spacing;
  fixes_ = fixes;
  slits_.boxes.clear();
  slits_.planes = planes;
  int particles = 0;
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    LatticeBox box{int(k), particles, half[k], {}};
    const double edges[] = {2.0 * half[k].x, 2.0 * half[k].y, 2.0 * half[k].z};
    int all = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      box.count[i] = int(std::lround(edges[i] / dx));
      if (box.count[i] < 1 || std::fabs(box.count[i] * dx - edges[i]) > 1e-3 * dx)
        refuse("slit_pressure: an edge of box " + names[k] + ", " + text(edges[i]) + " m, must be a whole number of the spacing, " +
               text(dx) + " m");
      all *= box.count[i];
    }
    int found[2] = {0, 0};  // on the lattice, and in the body
    fixes[k]->each_arm([&](int, const Vector &arm) {
      found[0] += place(box, arm) >= 0;
      ++found[1];
    });
    MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_INT, MPI_SUM, world);
    if (found[0] != all || found[1] != all)
      refuse("slit_pressure: the particles of box " + names[k] + " must be the lattice that fills it, " + std::to_string(all) +
             " of them; of its " + std::to_string(found[1]) + ", " + std::to_string(found[0]) + " are on that lattice");
    slits_.boxes.push_back(box);
    particles += all;
  }
  pressures_.resize(std::size_t(particles));
  bodies_.resize(fixes.size());
}

void SphFilms::push(double share) {
  const Settings &fluid = PairSphCoupled::find(force)->fluid();
  pressures_.assign(pressures_.size(), 0.0);
  for (std::size_t k = 0; k < fixes_.size(); ++k) {
    bodies_[k] = fixes_[k]->body();
    fixes_[k]->each_arm([&](int i, const Vector &arm) { pressures_[std::size_t(place(slits_.boxes[k], arm))] = atom->p[i]; });
  }
  MPI_Allreduce(MPI_IN_PLACE, pressures_.data(), int(pressures_.size()), MPI_DOUBLE, MPI_SUM, world);
  slits_.push(share, fluid.spacing, fluid.state.density, fluid.gravity, pressures_, bodies_);
  for (std::size_t k = 0; k < fixes_.size(); ++k) fixes_[k]->add_load(bodies_[k].film, bodies_[k].film_torque);
}

}  // namespace dembark_liggghts
