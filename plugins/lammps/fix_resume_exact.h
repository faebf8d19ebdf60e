// LAMMPS adapter of states on disk (dembark/restart/state_files.hpp): states of a run at intervals, and a resumed run that goes on bit for
// bit.
//
//   fix ID group resume/exact EVERY BASE [cut FILE ...]
//   resume_state BASE
//
// LAMMPS's restart files hold positions, velocities, and what fixes keep; but the set-up of a run computes the forces anew, from the
// velocities of the full step instead of those half a step before, and sorts the atoms. This fix has forces and torques written into the
// file, and puts them back after the set-up.
#ifndef DEMBARK_FIX_RESUME_EXACT_H
#define DEMBARK_FIX_RESUME_EXACT_H

#include <array>
#include <cstdint>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "command.h"
#include "fix.h"

namespace LAMMPS_NS {

class FixResumeExact : public Fix {
 public:
  FixResumeExact(LAMMPS* lmp, int narg, char** arg);
  ~FixResumeExact() override;
  int setmask() override;
  void init() override;
  void setup_pre_exchange() override;
  void setup_pre_neighbor() override;
  void setup(int) override;
  void initial_integrate(int) override;
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

  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_alone(const std::exception& wrong) const;
  void refuse_other_states() const;
  Facts facts() const;
  void check_state() const;
  void put_back();
  void write_state();

  bigint every_ = 0, state_step_ = -1;  // the step of the state that the run goes on from, -1: none
  std::string base_;
  std::vector<std::string> outputs_;
  std::vector<std::pair<std::string, std::uintmax_t>> kept_;  // outputs, and how much of them is before the state
  std::vector<Facts> facts_;                                  // of all ranks, in a state; on the first one
  Facts own_facts_{};                                         // of this rank, in the state that was read
  std::vector<std::array<double, 6>> forces_;                 // of the state that was read: N, N m
  double time_ = 0.0;                                         // s, of the step `time_step_`, from which the run counts it
  bigint time_step_ = 0, next_sort_ = 0;
  int saved_ranks_ = 0, sort_frequency_ = 0;
  bool known_format_ = true, begun_ = false;
};

class ResumeState : public Command {
 public:
  explicit ResumeState(LAMMPS* lmp) : Command(lmp) {}
  void command(int narg, char** arg) override;
};

}  // namespace LAMMPS_NS

#endif
