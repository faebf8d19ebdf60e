// LIGGGHTS's side of fix ID group resume/exact and of resume_state (resume_fix.h). Beside the forces this fix keeps, rank by rank, the
// histories of all contacts, and what other fixes store per atom.
#if defined(FIX_CLASS)

FixStyle(resume/exact,FixResumeExact)

#elif defined(COMMAND_CLASS)

CommandStyle(resume_state,ResumeState)

#else

#ifndef LMP_FIX_RESUME_EXACT_H
#define LMP_FIX_RESUME_EXACT_H

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "per_instance.h"
#include "resume_fix.h"

namespace LAMMPS_NS {

class FixResumeExact : public dembark_family::ResumeFix {
 public:
  FixResumeExact(class LAMMPS *, int, char **);

  int setmask();
  void setup(int);
  void pre_initial_integrate() { begin_step(); }
  void write_restart(FILE *);
  void restart(char *);
  double memory_usage();

 private:
  bool keeps_order() const { return !part_.empty(); }
  void write_state();
  std::string inexact_arguments(Fix &fix) const;
  std::vector<std::pair<std::string, std::string>> formulas() const;
  void add_facts(dembark::restart::RunRecord &run) const;
  bool append_parts(const std::string &path);
  std::string read_parts(const double *lengths);

  std::vector<double> part_;           // this rank's part of a state that is being written, or that waits to be put back
  std::vector<double> lengths_;        // of the parts of all ranks, on the first
  std::vector<std::uint64_t> hashes_;  // of the same
  std::string record_;                 // of the run that writes a state
};

class ResumeState : protected Pointers {
 public:
  explicit ResumeState(class LAMMPS *lmp) : Pointers(lmp) {}
  void command(int, char **);

  inline static dembark_liggghts::PerInstance<std::string> file;  // that was read, for the fix, which is made afterwards; empty: none
};

}  // namespace LAMMPS_NS

#endif
#endif
