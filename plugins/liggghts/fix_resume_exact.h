// fix ID group resume/exact EVERY BASE [cut FILE ...]: states of the run at intervals, and a resumed run that goes on bit for bit.
//
// Stock restart files hold positions and velocities, but the set-up of a run computes the forces anew, from the velocities of the full
// step instead of those half a step before, and may sort the atoms. This fix keeps, rank by rank, the forces and torques, the
// histories of all contacts, and what other fixes store per atom, and puts them back after the set-up.
#ifdef FIX_CLASS

FixStyle(resume/exact,FixResumeExact)

#else

#ifndef LMP_FIX_RESUME_EXACT_H
#define LMP_FIX_RESUME_EXACT_H

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
  void write_state();
  void refuse_other_states();
  std::string broken_file(const std::string &part) const;
  void append_parts(const std::string &path, std::string &wrong);
  std::string read_parts(const double *counts);
  void save(std::vector<double> &to) const;
  template <class Stream>
  void of_atoms(Stream &stream) const;
  bool fits() const;
  void put_back();
  void set_next();

  bigint every_, state_step_;  // the step of the state that the run goes on from, -1: none
  std::string base_;
  std::vector<std::string> outputs_;
  std::vector<double> kept_;  // this rank's part of the state, until it is put back
  std::vector<double> part_;  // the same of a state that is being written
  std::string lacking_;       // why there is no part
  int saved_ranks_, sort_frequency_;
  bool begun_;
};

}  // namespace LAMMPS_NS

#endif
#endif
