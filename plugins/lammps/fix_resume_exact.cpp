#include "fix_resume_exact.h"

#include <algorithm>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "input.h"
#include "pair.h"
#include "update.h"

#include "engine_access.h"
#include "fix_arguments.h"
#include "pair_dembark_granular.h"
#include "restart_commands.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

enum Head { head_ranks, head_time, head_time_step, head_next_sort, head_size };

}  // namespace

FixResumeExact::FixResumeExact(LAMMPS* lmp, int narg, char** arg) : ResumeFix(lmp, narg, arg) {
  restart_peratom = 1;
  atom->add_callback(on_restart);
}

FixResumeExact::~FixResumeExact() { atom->delete_callback(id, on_restart); }

// The engine calls the set-up of a stage for the fixes of that stage only.
int FixResumeExact::setmask() { return INITIAL_INTEGRATE | PRE_EXCHANGE | PRE_NEIGHBOR; }

// A run counts the time from its own beginning on, from a sum that is rounded otherwise.
void FixResumeExact::setup_pre_exchange() {
  ResumeFix::setup_pre_exchange();
  if (state_step_ < 0) return;
  update->atime = time_;
  update->atimestep = time_step_;
}

FixResumeExact::Facts FixResumeExact::facts() const {
  // Under pair_style hybrid the lists are those of its parts.
  Pair* const own = force->pair_match(dembark_lammps::ContactCoefficients::style_name, 1);
  Pair* const pair = own ? own : force->pair;
  const dembark_family::OrderHash order(*atom, pair ? pair->list : nullptr);
  return {double(atom->nlocal), double(atom->nghost), order.high(), order.low()};
}

void FixResumeExact::put_back() {
  const std::string why = why_not_put_back(forces_.size() == std::size_t(atom->nlocal) && facts() == own_facts_);
  if (!why.empty()) fail(why + "; to go on from its positions and velocities alone, give this fix another id");
  for (int i = 0; i < atom->nlocal; ++i) {
    std::copy_n(forces_[std::size_t(i)].data(), 3, atom->f[i]);
    if (atom->torque) std::copy_n(forces_[std::size_t(i)].data() + 3, 3, atom->torque[i]);
  }
  atom->nextsort = next_sort_;
  go_on(why_approximate(record()));
  forces_ = {};
}

void FixResumeExact::setup(int) {
  if (state_step_ >= 0) put_back();
  dembark_lammps::begin_steps_first(modify, this);
}

void FixResumeExact::write_state() {
  record_ = record().text();
  const Facts own = facts();
  facts_.resize(std::size_t(comm->nprocs));
  MPI_Gather(own.data(), int(own.size()), MPI_DOUBLE, facts_.data(), int(own.size()), MPI_DOUBLE, 0, world);
  dembark_lammps::write_restart_file(lmp, part_path());
  facts_ = {};
  record_.clear();
  if (comm->me == 0) keep_state();
}

/// Other restart files than states have no facts.
void FixResumeExact::write_restart(FILE* file) {
  if (comm->me != 0) return;
  double head[head_size];
  head[head_ranks] = double(facts_.size());
  head[head_time] = update->atime;
  head[head_time_step] = double(update->atimestep);
  head[head_next_sort] = double(atom->nextsort);
  write_part(file, {{head, sizeof head}, {facts_.data(), facts_.size() * sizeof(Facts)}, {record_.c_str(), record_.size() + 1}});
}

void FixResumeExact::restart(char* buffer) {
  state_step_ = update->ntimestep;
  time_ = update->atime;
  time_step_ = update->atimestep;
  try {
    dembark_family::SavedPart part(buffer);
    double head[head_size];
    part.read(head, head_size);
    saved_ranks_ = int(head[head_ranks]);
    std::vector<Facts> facts(static_cast<std::size_t>(saved_ranks_));
    part.read(facts.data(), facts.size());
    saved_ = dembark::restart::RunRecord::read(part.text());
    if (saved_ranks_ == 0)
      lacking_ =
          "this restart file has no exact state: it was written by restart or write_restart; read one that fix resume/exact has written";
    if (saved_ranks_ != comm->nprocs) return;
    own_facts_ = facts[std::size_t(comm->me)];
    time_ = head[head_time];
    time_step_ = bigint(head[head_time_step]);
    next_sort_ = bigint(head[head_next_sort]);
  } catch (const std::exception&) {
    lacking_ = other_version;
    return;
  }
  if (comm->me == 0) keep_unappendable();
}

std::string FixResumeExact::inexact_arguments(Fix& fix) const {
  const auto has = [&](const char* word) { return dembark_lammps::may_have_argument(lmp, fix, word); };
  if (is(fix, "wall/gran") && has("wiggle")) return "counts its time anew";
  return is(fix, "ave/time") && (has("running") || has("window")) ? "averages over more than one interval" : "";
}

std::vector<std::pair<std::string, std::string>> FixResumeExact::formulas() const { return dembark_lammps::formulas(input->variable); }

void FixResumeExact::add_facts(dembark::restart::RunRecord& run) const {
  const auto* const pair = dynamic_cast<PairDembarkGranular*>(force->pair_match(dembark_lammps::ContactCoefficients::style_name, 1));
  if (pair) run.facts.emplace_back("coefficients of the pair style", dembark::restart::hashed(pair->coefficients().given()));
}

int FixResumeExact::pack_restart(int i, double* buffer) {
  buffer[0] = numbers;
  std::copy_n(atom->f[i], 3, buffer + 1);
  if (atom->torque) std::copy_n(atom->torque[i], 3, buffer + 4);
  else std::fill_n(buffer + 4, 3, 0.0);
  return numbers;
}

void FixResumeExact::unpack_restart(int i, int nth) {
  forces_.resize(std::size_t(atom->nlocal));
  std::copy_n(restart_row(i, nth) + 1, 6, forces_[std::size_t(i)].data());
}

double FixResumeExact::memory_usage() { return double(forces_.size() * sizeof forces_[0]); }

void ResumeState::command(int narg, char** arg) {
  const dembark::restart::State state = dembark_family::find_state(narg, arg, *comm, error, world);
  const std::string file = dembark::restart::state_name(arg[0], state.step);
  const int ranks = state.grid[0] * state.grid[1] * state.grid[2];
  if (ranks != comm->nprocs)
    error->all(
        FLERR,
        "resume_state: {} is of {} ranks, the run has {}; start it on {}, or take read_restart and another id of fix resume/exact to "
        "go on from positions and velocities alone",
        file, ranks, comm->nprocs, ranks);
  dembark_lammps::read_restart_file(lmp, file);
}
