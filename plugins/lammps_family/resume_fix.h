// fix ID group resume/exact EVERY BASE [cut FILE ...]: states of a run at intervals (dembark/restart/state_files.hpp), and a resumed run
// that goes on bit for bit. resume_state BASE: read the newest whole state.
//
// Restart files hold positions, velocities, and what fixes keep; but the set-up of a run computes the forces anew, from the velocities of
// the full step instead of those half a step before, and may sort the atoms. So forces and torques are kept with a state, and put back
// after the set-up.
#ifndef DEMBARK_RESUME_FIX_H
#define DEMBARK_RESUME_FIX_H

#include <cstdint>

#include "neigh_list.h"

#include "shared_fix.h"

#include "dembark/fnv.hpp"
#include "dembark/restart/run_record.hpp"
#include "dembark/restart/state_files.hpp"

namespace dembark_family {

/// Which atoms in which order, and their candidates for contacts in which order.
class OrderHash {
 public:
  OrderHash(const LAMMPS_NS::Atom& atom, const LAMMPS_NS::NeighList* list);
  void mix(std::uint64_t v) {  // 32 bits at a time
    hash_ = dembark::fnv1a_next(hash_, static_cast<std::uint32_t>(v));
    if (v >> 32) hash_ = dembark::fnv1a_next(hash_, v >> 32);
  }
  double high() const { return double(hash_ >> 32); }
  double low() const { return double(hash_ & 0xffffffffu); }

 private:
  std::uint64_t hash_ = dembark::fnv1a_start;
};

class ResumeFix : public SharedFix {
 public:
  ResumeFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg);

  void init() override;
  void setup_pre_exchange() override;
  void setup_pre_neighbor() override { atom->sortfreq = sort_frequency_; }

 protected:
  /// Before anything of a step, and after all output of the step before.
  void begin_step();
  /// The file that a state is written to first.
  std::string part_path() const { return base_ + ".part"; }
  /// Makes it to a state of this step. On the first rank.
  void keep_state() const;
  /// What is compared between a state and the run that goes on from it. Collective; complete on the first rank.
  dembark::restart::RunRecord record() const;
  /// Why a run that goes on from the state that was read is not exact, or nothing. On the first rank.
  std::string why_approximate(const dembark::restart::RunRecord& run) const;
  /// Why forces of the state are not those of this run, or nothing. `fits`: those of this rank belong to its atoms. Collective.
  std::string why_not_put_back(bool fits) const;
  /// From the step of the state the run goes on exactly, or approximately. Output of that step was written before the state.
  void go_on(const std::string& why_approximate);
  /// The engine cannot append to binary and compressed files: those of the run before keep what they have, under another name. On the first
  /// rank, before dumps open their files.
  void keep_unappendable() const;
  void say(const std::string& line) const;

  static constexpr const char* other_version = "the state was written by another version of dembark";

  LAMMPS_NS::bigint every_ = 0, state_step_ = -1;  // the step of the state that the run goes on from, -1: none
  int saved_ranks_ = 0;                            // that wrote it
  std::string lacking_;                            // why there are no forces to put back
  std::string base_;
  std::vector<std::string> outputs_;
  dembark::restart::RunRecord saved_;  // of the state that was read

 private:
  static constexpr int acting_stages = LAMMPS_NS::FixConst::PRE_FORCE | LAMMPS_NS::FixConst::POST_FORCE |
                                       LAMMPS_NS::FixConst::INITIAL_INTEGRATE | LAMMPS_NS::FixConst::FINAL_INTEGRATE;

  virtual void write_state() = 0;        ///< Collective.
  virtual bool keeps_order() const = 0;  ///< a state waits to be put back, and the set-up is not to sort the atoms
  /// Why a fix of the list does not go on exactly with its arguments, at any step; nothing if it does.
  virtual std::string inexact_arguments(Fix& fix) const = 0;
  /// Names and formulas of the variables of the script.
  virtual std::vector<std::pair<std::string, std::string>> formulas() const = 0;
  virtual void add_facts(dembark::restart::RunRecord&) const {}
  std::string inexact_fix(Fix& fix, LAMMPS_NS::bigint step) const;
  std::vector<std::string> inexact(LAMMPS_NS::bigint step) const;
  void refuse_other_states() const;
  void announce_approximate() const;
  void cut_outputs();

  int sort_frequency_ = 0;
  bool begun_ = false;
  LAMMPS_NS::bigint cut_step_ = -1;  // the outputs are cut behind this step before the next begins; -1: they are not
  bool cut_exactly_ = false;
};

/// The newest complete state, for the command resume_state with its arguments, as the first rank finds it. The grid of processors becomes
/// that of the state, unless the script has one or there are others. Collective.
dembark::restart::State find_state(int narg, char** arg, LAMMPS_NS::Comm& comm, LAMMPS_NS::Error* error, MPI_Comm world);

}  // namespace dembark_family

#endif
