// What plugins/lammps_family asks of LIGGGHTS where it differs from LAMMPS.
#ifndef DEMBARK_ENGINE_FIX_H
#define DEMBARK_ENGINE_FIX_H

#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "fix_gravity.h"
#include "force.h"
#include "modify.h"
#include "pair.h"
#include "update.h"

#include "dembark/vec3.hpp"

namespace dembark_engine {

class EngineFix : public LAMMPS_NS::Fix {
 public:
  EngineFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg) : Fix(lmp, narg, arg) {}

 protected:
  static constexpr int on_growth = 0, on_restart = 1;  // of Atom::add_callback()
  static constexpr const char* sphere_style = "atom_style granular (or sphere)";

  /// Ends the run with one line. Collective.
  [[noreturn]] void fail(const std::string& what) const {
    error->fix_error(FLERR, const_cast<EngineFix*>(this), what.c_str());
    std::abort();  // fix_error() does not return
  }
  /// On one rank.
  [[noreturn]] void fail_alone(const std::string& what) const {
    error->one(FLERR, ("Fix " + name() + what).c_str());
    std::abort();  // one() does not return
  }
  void warn(const std::string& what) const {
    if (comm->me == 0) error->warning(FLERR, ("fix " + name() + what).c_str());
  }
  bool has_spheres() const { return atom->sphere_flag && atom->rmass && !atom->superquadric_flag && !atom->shapetype_flag; }
  static bool moves_clusters(const Fix& fix) {
    return std::strncmp(fix.style, "rigid", 5) == 0 || std::strncmp(fix.style, "multisphere", 11) == 0;
  }
  static bool changes_box(const Fix& fix) { return fix.box_change_size || fix.box_change_shape; }
  /// Acceleration (m/s^2) of a fix gravity, as it is when it is asked.
  std::function<dembark::Vec3<double>()> acceleration_of(Fix* fix) const {
    auto* const gravity = static_cast<LAMMPS_NS::FixGravity*>(fix);
    return [gravity] {
      double a[3];
      gravity->get_gravity(a);
      return dembark::Vec3<double>{a[0], a[1], a[2]};
    };
  }
  /// Moment of inertia over m r^2 with which the engine turns grains: of spheres, in two dimensions of cylinders.
  double own_inertia() const { return domain->dimension == 2 ? 0.5 : 0.4; }
  double inertia_of(const Fix&) const { return own_inertia(); }
  void nearest_image(double* apart) const { domain->minimum_image(apart); }
  void copy_to_ghosts() { comm->forward_comm_fix(this); }

  /// As `fix dt/reset` does it.
  void set_time_step(double dt) {
    update->update_time();
    update->dt = dt;
    if (force->pair) force->pair->reset_dt();
    for (int k = 0; k < modify->nfix; ++k) modify->fix[k]->reset_dt();
  }

 private:
  std::string name() const { return std::string(style) + " (id " + id + "): "; }
};

}  // namespace dembark_engine

#endif
