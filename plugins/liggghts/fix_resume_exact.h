// fix ID group resume/exact EVERY BASE [cut FILE ...]: states of the run at intervals, and a resumed run that goes on bit for bit.
// Input command `resume_state BASE`: read the newest whole state.
//
// Stock restart files hold positions and velocities, but the set-up of a run computes the forces anew, from the velocities of the full
// step instead of those half a step before, and may sort the atoms. This fix keeps, rank by rank, the forces and torques, the
// histories of all contacts, and what other fixes store per atom, and puts them back after the set-up.
#if defined(FIX_CLASS)

FixStyle(resume/exact,FixResumeExact)

#elif defined(COMMAND_CLASS)

CommandStyle(resume_state,ResumeState)

#else

#ifndef LMP_FIX_RESUME_EXACT_H
#define LMP_FIX_RESUME_EXACT_H

#include <exception>
#include <string>
#include <vector>

#include "fix.h"

namespace LAMMPS_NS {

class FixResumeExact : public Fix {
 public:
  FixResumeExact(class LAMMPS *, int, char **);

  int setmask();
  void init();
  void setup_pre_exchange();
  void setup_pre_neighbor();
  void setup(int);
  void pre_initial_integrate();
  void write_restart(FILE *);
  void restart(char *);
  double memory_usage();

 private:
  [[noreturn]] void refuse(const std::string &what);
  void refuse_alone(const std::exception &wrong);
  void refuse_other_states();
  void write_state();
  bool append_parts(const std::string &path);
  std::string read_parts(const double *lengths);

  bigint every_, state_step_ = -1;  // the step of the state that the run goes on from, -1: none
  std::string base_;
  std::vector<std::string> outputs_;
  std::vector<double> part_;     // this rank's part of a state that is being written, or that waits to be put back
  std::vector<double> lengths_;  // of the parts of all ranks, on the first
  std::string lacking_;          // why there is no part to put back
  int saved_ranks_ = 0, sort_frequency_ = 0;
  bool begun_ = false;
};

class ResumeState : protected Pointers {
 public:
  explicit ResumeState(class LAMMPS *lmp) : Pointers(lmp) {}
  void command(int, char **);

  inline static std::string file;  // that was read, for the fix, which is made afterwards; empty: none
};

}  // namespace LAMMPS_NS

#endif
#endif
