#include "fix_resume_exact.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "output.h"
#include "pair.h"
#include "update.h"
#include "utils.h"

#include "dembark/restart/state_files.hpp"
#include "fix_order.h"
#include "restart_commands.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

constexpr double format = 1.0;
enum Head { head_format, head_ranks, head_time, head_time_step, head_next_sort, head_size };

}  // namespace

FixResumeExact::FixResumeExact(LAMMPS* lmp, int narg, char** arg) : Fix(lmp, narg, arg) {
  if (narg < 5 || !utils::is_integer(arg[3]) || (narg > 5 && std::strcmp(arg[5], "cut") != 0))
    fail("it is written 'resume/exact EVERY BASE [cut FILE ...]', EVERY a whole number of steps");
  every_ = utils::bnumeric(FLERR, arg[3], false, lmp);
  if (every_ < 0) fail("EVERY must be >= 0 steps; with 0 no states are written");
  base_ = arg[4];
  if (base_.find_first_of("*%") != std::string::npos) fail("the name of the states must not hold * or %");
  outputs_.assign(arg + std::min(narg, 6), arg + narg);
  restart_global = restart_peratom = 1;
  force_reneighbor = every_ > 0;
  next_reneighbor = -1;
  atom->add_callback(Atom::RESTART);
}

FixResumeExact::~FixResumeExact() { atom->delete_callback(id, Atom::RESTART); }

void FixResumeExact::fail(const std::string& what) const { error->all(FLERR, std::string("fix ") + id + " resume/exact: " + what); }

/// On one rank.
void FixResumeExact::fail_alone(const std::exception& wrong) const {
  error->one(FLERR, std::string("fix ") + id + " resume/exact: " + wrong.what());
}

// The engine calls the set-up of a stage for the fixes of that stage only.
int FixResumeExact::setmask() { return INITIAL_INTEGRATE | PRE_EXCHANGE | PRE_NEIGHBOR; }

void FixResumeExact::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0) fail("only run_style verlet is supported");
  if (!begun_ && state_step_ < 0 && every_ > 0) refuse_other_states();
  begun_ = true;
  if (every_ > 0) next_reneighbor = (update->ntimestep / every_ + 1) * every_;
  const int acting = PRE_FORCE | POST_FORCE | INITIAL_INTEGRATE | FINAL_INTEGRATE;
  bool before = false;
  for (int k = 0; k < modify->nfix; ++k) {
    if (before && modify->fmask[k] & acting)
      fail(std::string("it must come after fix ") + modify->fix[k]->id + ", whose set-up it has to undo");
    before = before || modify->fix[k] == this;
  }
}

/// States of another run would be resumed later in the place of those of this one, for their steps may be higher. Collective.
void FixResumeExact::refuse_other_states() const {
  long long newest = -1;
  if (comm->me == 0) {
    newest = dembark::restart::newest_state(base_).step;
    if (newest < 0) dembark::restart::delete_states(base_, 0);
  }
  MPI_Bcast(&newest, 1, MPI_LONG_LONG, 0, world);
  if (newest >= 0)
    fail("there is a state of an earlier run, " + dembark::restart::state_name(base_, newest) +
         "; go on from it by resume_state, move it away, or give the states another name than " + base_);
}

// The set-up would sort the atoms out of turn, and a run counts the time from its own beginning on, from a sum that is rounded otherwise.
void FixResumeExact::setup_pre_exchange() {
  sort_frequency_ = atom->sortfreq;
  if (state_step_ < 0) return;
  atom->sortfreq = 0;
  update->atime = time_;
  update->atimestep = time_step_;
}

void FixResumeExact::setup_pre_neighbor() { atom->sortfreq = sort_frequency_; }

/// Which atoms in which order, their candidates for contacts in which order.
FixResumeExact::Facts FixResumeExact::facts() const {
  std::uint64_t hash = 1469598103934665603u;  // FNV-1a, 32 bits at a time
  const auto mix = [&hash](tagint v) { hash = (hash ^ static_cast<std::uint32_t>(v)) * 1099511628211u; };
  for (int i = 0; i < atom->nlocal + atom->nghost; ++i) mix(atom->tag[i]);
  const NeighList* const list = force->pair ? force->pair->list : nullptr;
  for (int ii = 0; list && ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    mix(list->numneigh[i]);
    for (int k = 0; k < list->numneigh[i]; ++k) mix(list->firstneigh[i][k]);
  }
  return {double(atom->nlocal), double(atom->nghost), double(hash >> 32), double(hash & 0xffffffffu)};
}

/// Collective.
void FixResumeExact::check_state() const {
  const std::string other = "; to go on from its positions and velocities alone, give this fix another id";
  if (!known_format_) fail("the state was written by another version of dembark" + other);
  if (saved_ranks_ == 0) fail("the restart file was not written by this fix" + other);
  if (saved_ranks_ != comm->nprocs)
    fail("the state is of " + std::to_string(saved_ranks_) + " ranks, the run has " + std::to_string(comm->nprocs) + other);
  if (update->ntimestep != state_step_) fail("the run does not begin at the step of the state, " + std::to_string(state_step_) + other);
  int fits = forces_.size() == std::size_t(atom->nlocal) && facts() == own_facts_, all = 0;
  MPI_Allreduce(&fits, &all, 1, MPI_INT, MPI_MIN, world);
  if (!all) fail("the atoms or their candidates for contacts are others than in the state" + other);
}

void FixResumeExact::put_back() {
  check_state();
  for (int i = 0; i < atom->nlocal; ++i) {
    std::copy_n(forces_[std::size_t(i)].data(), 3, atom->f[i]);
    if (atom->torque) std::copy_n(forces_[std::size_t(i)].data() + 3, 3, atom->torque[i]);
  }
  atom->nextsort = next_sort_;
  // Output of the step of the state was written before the state.
  for (int k = 0; k < output->ndump; ++k) output->last_dump[k] = update->ntimestep;
  std::fflush(nullptr);
  std::error_code wrong;
  for (const auto& [path, size] : kept_)
    if (std::filesystem::resize_file(path, size, wrong); wrong) fail_alone(std::runtime_error("file " + path + ": " + wrong.message()));
  utils::logmesg(lmp, "dembark: resumed at step " + std::to_string(update->ntimestep) + " exactly\n");
  forces_ = {};
  kept_ = {};
  state_step_ = -1;
}

void FixResumeExact::setup(int) {
  if (state_step_ >= 0) put_back();
  dembark_lammps::begin_steps_first(modify, this);
}

/// The list of candidates was built anew for the step that has ended: here its output is written, and nothing of the next was done.
void FixResumeExact::initial_integrate(int) {
  if (every_ == 0 || update->ntimestep != next_reneighbor + 1) return;
  --update->ntimestep;
  write_state();
  ++update->ntimestep;
  next_reneighbor += every_;
}

void FixResumeExact::write_state() {
  const Facts own = facts();
  facts_.resize(std::size_t(comm->nprocs));
  MPI_Gather(own.data(), int(own.size()), MPI_DOUBLE, facts_.data(), int(own.size()), MPI_DOUBLE, 0, world);
  const std::string path = base_ + ".part";
  dembark_lammps::write_restart_file(lmp, path);
  facts_ = {};
  if (comm->me != 0) return;
  for (const std::string& output : outputs_) dembark::restart::sync_file(output);
  try {
    const int* const grid = comm->procgrid;
    dembark::restart::keep_state(path, base_, {update->ntimestep, {grid[0], grid[1], grid[2]}});
  } catch (const std::exception& wrong) {
    fail_alone(wrong);
  }
}

/// Other restart files than states have no facts.
void FixResumeExact::write_restart(FILE* file) {
  if (comm->me != 0) return;
  double head[head_size];
  head[head_format] = format;
  head[head_ranks] = double(facts_.size());
  head[head_time] = update->atime;
  head[head_time_step] = double(update->atimestep);
  head[head_next_sort] = double(atom->nextsort);
  const int bytes = int(sizeof head + facts_.size() * sizeof(Facts));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(head, sizeof head, 1, file);
  fwrite(facts_.data(), sizeof(Facts), facts_.size(), file);
}

void FixResumeExact::restart(char* buffer) {
  double head[head_size];
  std::memcpy(head, buffer, sizeof head);
  state_step_ = update->ntimestep;
  time_ = update->atime;
  time_step_ = update->atimestep;
  known_format_ = head[head_format] == format;
  saved_ranks_ = int(head[head_ranks]);
  if (!known_format_ || saved_ranks_ != comm->nprocs) return;
  std::memcpy(own_facts_.data(), buffer + sizeof head + std::size_t(comm->me) * sizeof(Facts), sizeof(Facts));
  time_ = head[head_time];
  time_step_ = bigint(head[head_time_step]);
  next_sort_ = bigint(head[head_next_sort]);
  if (comm->me != 0) return;
  try {
    for (const std::string& path : outputs_) {
      dembark::restart::cut_output(path, update->ntimestep);
      if (std::filesystem::exists(path)) kept_.emplace_back(path, std::filesystem::file_size(path));
    }
  } catch (const std::exception& wrong) {
    fail_alone(wrong);
  }
}

int FixResumeExact::pack_restart(int i, double* buffer) {
  buffer[0] = numbers;
  std::copy_n(atom->f[i], 3, buffer + 1);
  if (atom->torque) std::copy_n(atom->torque[i], 3, buffer + 4);
  else std::fill_n(buffer + 4, 3, 0.0);
  return numbers;
}

void FixResumeExact::unpack_restart(int i, int nth) {
  const double* values = atom->extra[i];
  for (int k = 0; k < nth; ++k) values += int(values[0]);
  forces_.resize(std::size_t(atom->nlocal));
  std::copy_n(values + 1, 6, forces_[std::size_t(i)].data());
}

double FixResumeExact::memory_usage() { return double(forces_.size() * sizeof forces_[0]); }

void ResumeState::command(int narg, char** arg) {
  if (narg != 1) error->all(FLERR, "resume_state: it is written 'resume_state BASE'");
  dembark::restart::State state;
  if (comm->me == 0) state = dembark::restart::newest_state(arg[0]);
  MPI_Bcast(&state, sizeof state, MPI_BYTE, 0, world);
  if (state.step < 0)
    error->all(FLERR, std::string("resume_state: there is no whole state ") + arg[0] +
                          ".<step>.restart in this folder; write states first (fix resume/exact, restart_every > 0 in dembark's decks)");
  const std::string file = dembark::restart::state_name(arg[0], state.step);
  const int ranks = state.grid[0] * state.grid[1] * state.grid[2];
  if (ranks != comm->nprocs)
    error->all(
        FLERR,
        "resume_state: {} is of {} ranks, the run has {}; start it on {}, or take read_restart and another id of fix resume/exact to "
        "go on from positions and velocities alone",
        file, ranks, comm->nprocs, ranks);
  int* const wanted = comm->user_procgrid;
  if (!wanted[0] && !wanted[1] && !wanted[2]) std::copy(state.grid, state.grid + 3, wanted);
  dembark_lammps::read_restart_file(lmp, file);
}
