#include "resume_fix.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "output.h"

using namespace LAMMPS_NS;
using namespace FixConst;
namespace states = dembark::restart;

namespace dembark_family {

OrderHash::OrderHash(const Atom& atom, const NeighList* list) {
  for (int i = 0; i < atom.nlocal + atom.nghost; ++i) mix(atom.tag[i]);
  for (int ii = 0; list && ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    mix(list->numneigh[i]);
    for (int k = 0; k < list->numneigh[i]; ++k) mix(list->firstneigh[i][k]);
  }
}

ResumeFix::ResumeFix(LAMMPS* lmp, int narg, char** arg) : SharedFix(lmp, narg, arg) {
  char* end = nullptr;
  if (narg < 5 || (every_ = std::strtoll(arg[3], &end, 10)) < 0 || *end || end == arg[3] || (narg > 5 && std::strcmp(arg[5], "cut") != 0))
    fail("it must have the form fix ID group resume/exact EVERY BASE [cut FILE ...], with EVERY >= 0 steps");
  base_ = arg[4];
  if (base_.find_first_of("*%") != std::string::npos) fail("the name of the states must not hold * or %");
  outputs_.assign(arg + std::min(narg, 6), arg + narg);
  restart_global = 1;
  time_depend = 1;  // the newest state is that of the highest step
  force_reneighbor = every_ > 0;
  next_reneighbor = -1;
}

void ResumeFix::init() {
  only_verlet();
  if (!begun_ && state_step_ < 0 && every_ > 0) refuse_other_states();
  if (!begun_ && every_ > 0) announce_approximate();
  begun_ = true;
  if (every_ > 0) next_reneighbor = (update->ntimestep / every_ + 1) * every_;
  bool before = false;
  for (int k = 0; k < modify->nfix; ++k) {
    if (before && modify->fmask[k] & acting_stages)
      fail(std::string("it must come after fix ") + modify->fix[k]->id + ", whose set-up it has to undo");
    before = before || modify->fix[k] == this;
  }
}

/// States of another run would be resumed later in the place of those of this one, for their steps may be higher. Collective.
void ResumeFix::refuse_other_states() const {
  long long newest = -1;
  if (comm->me == 0) {
    newest = states::newest_state(base_).step;
    if (newest < 0) states::delete_states(base_, 0);
  }
  MPI_Bcast(&newest, 1, MPI_LONG_LONG, 0, world);
  if (newest >= 0)
    fail("there is a state of an earlier run, " + states::state_name(base_, newest) +
         "; go on from it by resume_state, move it away, or give the states another name than " + base_);
}

/// A run says beforehand that its states are not enough for all of its fixes.
void ResumeFix::announce_approximate() const {
  const std::vector<std::string> reasons = inexact((update->ntimestep / every_ + 1) * every_);
  if (reasons.empty()) return;
  std::string all;
  for (const std::string& reason : reasons) all += (all.empty() ? "" : "; ") + reason;
  warn("a run goes on from these states approximately: " + all);
}

// The set-up would sort the atoms out of turn.
void ResumeFix::setup_pre_exchange() {
  sort_frequency_ = atom->sortfreq;
  if (keeps_order()) atom->sortfreq = 0;
}

/// The list of candidates was built anew for the step that has ended: here its output is written, and nothing of the next was done.
void ResumeFix::begin_step() {
  if (cut_step_ >= 0) cut_outputs();
  if (every_ == 0 || update->ntimestep != next_reneighbor + 1) return;
  std::fflush(nullptr);  // what any rank holds back of its output
  --update->ntimestep;
  write_state();
  ++update->ntimestep;
  next_reneighbor += every_;
}

void ResumeFix::keep_state() const {
  for (const std::string& output : outputs_) states::sync_file(output);
  try {
    const int* const grid = comm->procgrid;
    states::keep_state(part_path(), base_, {update->ntimestep, {grid[0], grid[1], grid[2]}});
  } catch (const std::exception& wrong) {
    fail_alone(wrong.what());
  }
}

std::string ResumeFix::why_not_put_back(bool fits) const {
  if (!lacking_.empty()) return lacking_;
  if (update->ntimestep != state_step_) return "the run does not begin at the step of the state, " + std::to_string(state_step_);
  if (saved_ranks_ != comm->nprocs)
    return "the state is of " + std::to_string(saved_ranks_) + " ranks, the run has " + std::to_string(comm->nprocs);
  int here = fits, all = 0;
  MPI_Allreduce(&here, &all, 1, MPI_INT, MPI_MIN, world);
  return all ? "" : "the atoms or their candidates for contacts are others than in the state";
}

void ResumeFix::go_on(const std::string& why_approximate) {
  cut_exactly_ = why_approximate.empty();
  if (update->ntimestep == state_step_) {
    for (int k = 0; k < output->ndump; ++k) output->last_dump[k] = update->ntimestep;
    cut_step_ = update->ntimestep;
  }
  say("dembark: resumed at step " + std::to_string(update->ntimestep) + (cut_exactly_ ? " exactly" : " approximately: ") + why_approximate +
      "\n");
  state_step_ = -1;
}

void ResumeFix::keep_unappendable() const {
  try {
    for (const std::string& path : outputs_)
      if (const std::string what = states::keep_unappendable(path, saved_.files, update->ntimestep); !what.empty())
        say("dembark: " + what + "\n");
  } catch (const std::exception& wrong) {
    fail_alone(wrong.what());
  }
}

/// When the set-up has written its output, such as the titles of files that are appended to, and the first step has not begun.
void ResumeFix::cut_outputs() {
  const bigint step = std::exchange(cut_step_, -1);
  std::fflush(nullptr);
  if (comm->me != 0) return;
  try {
    for (const std::string& line : states::cut_outputs(outputs_, saved_.files, step, step, !cut_exactly_)) say("dembark: " + line + "\n");
  } catch (const std::exception& wrong) {
    fail_alone(wrong.what());
  }
}

void ResumeFix::say(const std::string& line) const {
  for (FILE* const to : {screen, logfile})
    if (comm->me == 0 && to) std::fputs(line.c_str(), to);
}

states::State find_state(int narg, char** arg, Comm& comm, Error* error, MPI_Comm world) {
  if (narg != 1) error->all(FLERR, "resume_state: it must have the form resume_state BASE");
  states::State state;
  if (comm.me == 0) state = states::newest_state(arg[0]);
  MPI_Bcast(&state, sizeof state, MPI_BYTE, 0, world);
  const std::string none = std::string("resume_state: there is no whole state ") + arg[0] +
                           ".<step>.restart in this folder; write states first (fix resume/exact, restart_every > 0 in dembark's decks)";
  if (state.step < 0) error->all(FLERR, none.c_str());
  int* const wanted = comm.user_procgrid;
  if (state.grid[0] * state.grid[1] * state.grid[2] == comm.nprocs && !wanted[0] && !wanted[1] && !wanted[2])
    std::copy(state.grid, state.grid + 3, wanted);
  return state;
}

}  // namespace dembark_family
