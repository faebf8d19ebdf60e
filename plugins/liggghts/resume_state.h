// Input command `resume_state BASE`: read the newest whole state of fix resume/exact.
#ifdef COMMAND_CLASS

CommandStyle(resume_state,ResumeState)

#else

#ifndef LMP_RESUME_STATE_H
#define LMP_RESUME_STATE_H

#include "pointers.h"

namespace LAMMPS_NS {

class ResumeState : protected Pointers {
 public:
  explicit ResumeState(class LAMMPS *lmp) : Pointers(lmp) {}
  void command(int, char **);
};

}  // namespace LAMMPS_NS

#endif
#endif
