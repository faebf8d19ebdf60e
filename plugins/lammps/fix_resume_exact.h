// LAMMPS's side of fix ID group resume/exact and of resume_state (resume_fix.h). What fixes and pairs keep is in LAMMPS's own restart
// files; this fix adds forces and torques.
#ifndef DEMBARK_FIX_RESUME_EXACT_H
#define DEMBARK_FIX_RESUME_EXACT_H

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "command.h"

#include "resume_fix.h"

namespace LAMMPS_NS {

class FixResumeExact : public dembark_family::ResumeFix {
 public:
  FixResumeExact(LAMMPS* lmp, int narg, char** arg);
  ~FixResumeExact() override;
  int setmask() override;
  void setup_pre_exchange() override;
  void setup(int) override;
  void initial_integrate(int) override { begin_step(); }
  double memory_usage() override;

  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  int pack_restart(int i, double* buffer) override;
  void unpack_restart(int i, int nth) override;
  int size_restart(int) override { return numbers; }
  int maxsize_restart() override { return numbers; }

 private:
  static constexpr int numbers = 1 + 6;  // of each atom in the file
  typedef std::array<double, 4> Facts;   // numbers that have to be the same for the saved forces to belong to this run

  bool keeps_order() const override { return state_step_ >= 0; }
  void write_state() override;
  std::string inexact_arguments(Fix& fix) const override;
  std::vector<std::pair<std::string, std::string>> formulas() const override;
  void add_facts(dembark::restart::RunRecord& run) const override;
  Facts facts() const;
  void put_back();

  std::vector<Facts> facts_;                   // of all ranks, in a state; on the first one
  std::string record_;                         // of the run that writes a state
  Facts own_facts_{};                          // of this rank, in the state that was read
  std::vector<std::array<double, 6>> forces_;  // of the state that was read: N, N m
  double time_ = 0.0;                          // s, of the step `time_step_`, from which the run counts it
  bigint time_step_ = 0, next_sort_ = 0;
};

class ResumeState : public Command {
 public:
  explicit ResumeState(LAMMPS* lmp) : Command(lmp) {}
  void command(int narg, char** arg) override;
};

}  // namespace LAMMPS_NS

#endif
