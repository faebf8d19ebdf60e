// fix ID all sph/contact stiffness K [rounding R] [friction MU] [friction_speed V] [restitution E] [slit_pressure XI] box FIX A B C ...
// plane PX PY PZ NX NY NZ MU E ...: contacts of box-shaped bodies of fix sph/body with each other and with planes,
// dembark/sph/box_contacts.hpp, and the films of water between them, dembark/sph/slits.hpp.
#ifdef FIX_CLASS

FixStyle(sph/contact,FixSphContact)

#else

#ifndef LMP_FIX_SPH_CONTACT_H
#define LMP_FIX_SPH_CONTACT_H

#include <string>
#include <vector>

#include "dembark/sph/box_contacts.hpp"
#include "shared_fix.h"

namespace LAMMPS_NS {

class FixSphContact : public dembark_family::SharedFix {
 public:
  FixSphContact(class LAMMPS *, int, char **);

  int setmask();
  void init();
  void setup(int);
  void post_force(int);
  double compute_vector(int);
  void write_restart(FILE *);
  void restart(char *);

 private:
  void read(const std::vector<std::string> &words);
  void push(bool remember);

  dembark::sph::BoxContacts contacts_;
  double slit_pressure_ = 0.0;
  /// What the stretches of a state belong to.
  std::string written_boxes() const;

  std::vector<std::string> names_;  // of the fixes of the boxes
  std::vector<class FixSphBody *> fixes_;
  std::vector<const dembark::sph::Body *> bodies_;
};

}  // namespace LAMMPS_NS

#endif
#endif
