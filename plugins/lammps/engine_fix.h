// What plugins/lammps_family asks of LAMMPS where it differs from LIGGGHTS.
#ifndef DEMBARK_ENGINE_FIX_H
#define DEMBARK_ENGINE_FIX_H

#include <functional>
#include <string>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "modify.h"
#include "output.h"
#include "pair.h"
#include "update.h"

#include "dembark/vec3.hpp"
#include "lammps_release.h"
#include "nve_sphere.h"

namespace dembark_engine {

class EngineFix : public LAMMPS_NS::Fix {
 public:
  EngineFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg) : Fix(lmp, narg, arg) {}

 protected:
  static constexpr int on_growth = LAMMPS_NS::Atom::GROW, on_restart = LAMMPS_NS::Atom::RESTART;  // of Atom::add_callback()
  static constexpr const char* sphere_style = "atom_style sphere";

  /// Ends the run with one line. Collective.
  [[noreturn]] void fail(const std::string& what) const { error->all(FLERR, name() + what); }
  /// On one rank.
  [[noreturn]] void fail_alone(const std::string& what) const { error->one(FLERR, name() + what); }
  void warn(const std::string& what) const {
    if (comm->me == 0) error->warning(FLERR, name() + what);
  }
  bool has_spheres() const { return atom->radius_flag && atom->rmass_flag && atom->omega_flag; }
  static bool moves_clusters(const Fix& fix) { return fix.rigid_flag; }
  static bool changes_box(const Fix& fix) { return (fix.box_change & ~BOX_CHANGE_DOMAIN) != 0; }
  /// Acceleration (m/s^2) of a fix gravity, as it is when it is asked.
  std::function<dembark::Vec3<double>()> acceleration_of(Fix* fix) const {
    int dimension = 0;
    const auto* const a = static_cast<const double*>(fix->extract("gvec", dimension));
    if (!a) fail(std::string("fix ") + fix->id + " (gravity) does not tell its acceleration");
    return [a] { return dembark::Vec3<double>{a[0], a[1], a[2]}; };
  }
  /// Moment of inertia over m r^2 with which the engine turns grains: of spheres.
  static double own_inertia() { return 0.4; }
  /// The same of a fix nve/sphere, which may turn cylinders.
  double inertia_of(const Fix& fix) const {
    const double inertia = static_cast<const dembark_lammps::NveSphere&>(fix).inertia;
    if (inertia != own_inertia() && inertia != 0.5)
      fail(std::string("fix ") + fix.id + " is no fix nve/sphere of the LAMMPS this was built for");
    return inertia;
  }
  void nearest_image(double* apart) const { dembark_lammps::nearest_image(domain, apart); }
  void copy_to_ghosts() { comm->forward_comm(this); }

  /// As `fix dt/reset` does it.
  void set_time_step(double dt) {
    update->update_time();
    update->dt = dt;
    update->dt_default = 0;
    if (force->pair) force->pair->reset_dt();
    for (int k = 0; k < modify->nfix; ++k) modify->fix[k]->reset_dt();
    output->reset_dt();
  }

 private:
  std::string name() const { return std::string("fix ") + id + " " + style + ": "; }
};

}  // namespace dembark_engine

#endif
