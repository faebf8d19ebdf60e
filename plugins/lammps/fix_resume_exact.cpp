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
#include "exact_fixes.h"
#include "fix_arguments.h"
#include "pair_dembark_granular.h"
#include "restart_commands.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

constexpr double format = 2.0;
enum Head { head_format, head_ranks, head_time, head_time_step, head_next_sort, head_size };

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
  const std::string why = why_approximate(record());
  resume_outputs(why.empty());
  say("dembark: resumed at step " + std::to_string(update->ntimestep) + (why.empty() ? " exactly" : " approximately: ") + why + "\n");
  forces_ = {};
  state_step_ = -1;
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
  head[head_format] = format;
  head[head_ranks] = double(facts_.size());
  head[head_time] = update->atime;
  head[head_time_step] = double(update->atimestep);
  head[head_next_sort] = double(atom->nextsort);
  write_part(file, {{head, sizeof head}, {facts_.data(), facts_.size() * sizeof(Facts)}, {record_.c_str(), record_.size() + 1}});
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
  saved_ = dembark::restart::RunRecord::read(buffer + sizeof head + std::size_t(saved_ranks_) * sizeof(Facts));
  if (comm->me == 0) keep_unappendable();
}

std::string FixResumeExact::inexact_fix(Fix& fix, bigint step) const {
  const auto known = std::find_if(std::begin(dembark_lammps::exact_fixes), std::end(dembark_lammps::exact_fixes),
                                  [&](const auto& exact) { return is(fix, exact.style); });
  if (known == std::end(dembark_lammps::exact_fixes)) return "begins anew or differently";
  const auto has = [&](const char* word) { return dembark_lammps::may_have_argument(lmp, fix, word); };
  if (is(fix, "wall/gran") && has("wiggle")) return "counts its time anew";
  if (!is(fix, "ave/time")) return "";
  if (has("running") || has("window")) return "averages over more than one interval";
  return step % fix.global_freq == 0 ? "" : "is within an interval at step " + std::to_string(step);
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
  if (narg != 1) error->all(FLERR, "resume_state: it must have the form resume_state BASE");
  const dembark::restart::State state = dembark_family::find_state(arg[0], *comm, world);
  if (state.step < 0) error->all(FLERR, dembark_family::no_state(arg[0]));
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
