// fix ID group sph/wall, fix ID group sph/body mass M inertia I centre X Y Z: a wall or a free rigid body in the fluid of pair_style
// sph/coupled. Motion: dembark/sph/bodies.hpp; mass and inertia are given, not summed.
#ifdef FIX_CLASS

FixStyle(sph/wall,FixSphBody) FixStyle(sph/body,FixSphBody)

#else

#ifndef LMP_FIX_SPH_BODY_H
#define LMP_FIX_SPH_BODY_H

#include <string>

#include "atom.h"
#include "fix_property_atom.h"
#include "shared_fix.h"

#include "dembark/keyword_reader.hpp"
#include "dembark/sph/bodies.hpp"

namespace LAMMPS_NS {

/// Three numbers after the keyword `of`.
dembark::sph::Vector read_vector(dembark::keywords::Reader &in, const std::string &of, const std::string &what);

class FixSphBody : public dembark_family::SharedFix {
 public:
  FixSphBody(class LAMMPS *, int, char **);

  void post_create();
  void pre_delete(bool);
  int setmask();
  void init();
  void setup_pre_force(int);
  void initial_integrate(int);
  void final_integrate();
  double compute_vector(int);
  void write_restart(FILE *);
  void restart(char *);

  /// As all ranks have it.
  const dembark::sph::Body &body() const { return state_.body; }
  /// Calls visit(i, arm) for the particles i of this rank; arm (m): from the centre, in the frame of the body.
  template <class Visit>
  void each_arm(const Visit &visit) const;
  /// Work (J) done so far, by the motion of a wall or by what acts on a body beside fluid and gravity.
  double work() const { return state_.work; }
  /// Gravity (m/s^2), and no force of the fluid yet in this step.
  void begin_forces(const dembark::sph::Vector &gravity);
  /// Of the fluid on particles of this rank: N, and N m about the centre.
  void add_force(const dembark::sph::Vector &force, const dembark::sph::Vector &torque);
  /// Of something else on the body in this step, which all ranks know and add alike.
  void add_load(const dembark::sph::Vector &force, const dembark::sph::Vector &torque);

 private:
  void gather_forces();
  void place_particles();

  struct State {
    dembark::sph::Body body;
    double work = 0.0;
  } state_;
  class FixPropertyAtom *arms_ = nullptr;  // of the particles, in the frame of the body
  dembark::sph::Vector force_{}, torque_{}, load_{}, load_torque_{}, gravity_{};
  bool moved_by_others_ = false;           // another fix integrates particles of this one
  bool restarted_ = false, fresh_ = true;  // fresh: the forces of the set-up are not yet those of the body
};

template <class Visit>
void FixSphBody::each_arm(const Visit &visit) const {
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & groupbit) visit(i, dembark_family::vector(arms_->array_atom[i]));
}

}  // namespace LAMMPS_NS

#endif
#endif
