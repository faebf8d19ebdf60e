#include "fix_resume_exact.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sys/stat.h>

#include "atom.h"
#include "atom_vec.h"
#include "comm.h"
#include "error.h"
#include "fix_contact_history.h"
#include "fix_contact_history_mesh.h"
#include "fix_property_atom.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "output.h"
#include "pair_gran.h"
#include "update.h"
#include "write_restart.h"

#include "engine_access.h"
#include "state_files.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

constexpr double format = 2.0;
constexpr int header = 4;  // length of all, format, step, ranks; then how many numbers each rank has

PairGran *granular_pair(Force *force) { return static_cast<PairGran *>(force->pair_match("gran", 0)); }

/// The list of candidates with a history of each, if there is one.
NeighList *contact_list(Force *force) {
  PairGran *const pair = granular_pair(force);
  return pair && pair->list && pair->list->listgranhistory ? pair->list : nullptr;
}

std::vector<FixPropertyAtom *> atom_properties(Modify *modify) {
  std::vector<FixPropertyAtom *> found;
  for (int i = 0; i < modify->nfix; ++i)
    if (std::strcmp(modify->fix[i]->style, "property/atom") == 0)
      if (FixPropertyAtom *const property = dynamic_cast<FixPropertyAtom *>(modify->fix[i])) found.push_back(property);
  return found;
}

std::vector<FixContactHistoryMesh *> mesh_histories(Modify *modify) {
  std::vector<FixContactHistoryMesh *> found;
  for (int i = 0; i < modify->nfix; ++i)
    if (FixContactHistoryMesh *const history = dynamic_cast<FixContactHistoryMesh *>(modify->fix[i])) found.push_back(history);
  return found;
}

/// Numbers that have to be the same for the saved ones to belong to this run: which atoms in which order, their candidates in which order,
/// which properties and meshes.
std::vector<double> structure(Atom *atom, Force *force, Modify *modify) {
  std::uint64_t hash = 1469598103934665603u;  // FNV-1a, 32 bits at a time
  const auto mix = [&hash](int v) { hash = (hash ^ static_cast<std::uint32_t>(v)) * 1099511628211u; };
  for (int i = 0; i < atom->nlocal + atom->nghost; ++i) mix(atom->tag[i]);
  if (const NeighList *const list = contact_list(force))
    for (int ii = 0; ii < list->inum; ++ii) {
      const int i = list->ilist[ii];
      mix(list->numneigh[i]);
      for (int k = 0; k < list->numneigh[i]; ++k) mix(list->firstneigh[i][k]);
    }
  for (FixPropertyAtom *property : atom_properties(modify)) {
    for (const char *c = property->id; *c; ++c) mix(*c);
    mix(property->get_nvalues());
  }
  for (FixContactHistoryMesh *history : mesh_histories(modify))
    for (int i = 0; i < atom->nlocal; ++i) mix(history->nneighs(i));
  return {double(atom->nlocal), double(atom->nghost), double(hash >> 32), double(hash & 0xffffffffu)};
}

struct Saver {
  std::vector<double> &to;
  void numbers(const double *from, int count) { to.insert(to.end(), from, from + count); }
  template <class Integer>
  void integer(Integer from) {
    to.push_back(double(from));
  }
};

struct Loader {
  const double *from;
  void numbers(double *to, int count) { std::copy_n(from, count, to), from += count; }
  template <class Integer>
  void integer(Integer &to) {
    to = static_cast<Integer>(*from++);
  }
};

}  // namespace

FixResumeExact::FixResumeExact(LAMMPS *lmp, int narg, char **arg)
    : Fix(lmp, narg, arg), every_(0), state_step_(-1), saved_ranks_(0), sort_frequency_(0), begun_(false) {
  char *end = nullptr;
  if (narg < 5 || (every_ = std::strtoll(arg[3], &end, 10)) < 0 || *end || end == arg[3] || (narg > 5 && std::strcmp(arg[5], "cut") != 0))
    error->fix_error(FLERR, this, "it must have the form fix ID group resume/exact EVERY BASE [cut FILE ...], with EVERY >= 0 steps");
  base_ = arg[4];
  if (base_.find_first_of("*%") != std::string::npos) error->fix_error(FLERR, this, "the name of the states must not hold * or %");
  for (int k = 6; k < narg; ++k) outputs_.push_back(arg[k]);
  restart_global = 1;
  force_reneighbor = every_ > 0;
  next_reneighbor = -1;
}

// The engine calls the set-up of a stage for the fixes of that stage only.
int FixResumeExact::setmask() { return PRE_INITIAL_INTEGRATE | PRE_EXCHANGE | PRE_NEIGHBOR; }

void FixResumeExact::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0) error->fix_error(FLERR, this, "only run_style verlet is supported");
  if (!begun_ && state_step_ < 0 && every_ > 0) refuse_other_states();
  begun_ = true;
  set_next();
  const int acting = PRE_FORCE | POST_FORCE | INITIAL_INTEGRATE | FINAL_INTEGRATE;
  for (int i = modify->my_index(this) + 1; i < modify->nfix; ++i)
    if (modify->fmask[i] & acting) {
      const std::string line = "it must come after fix " + std::string(modify->fix[i]->id) + ", whose set-up it has to undo";
      error->fix_error(FLERR, this, line.c_str());
    }
}

/// States of another run would be resumed later in the place of those of this one, for their steps may be higher. Collective.
void FixResumeExact::refuse_other_states() {
  long long newest = -1;
  if (comm->me == 0) {
    const std::vector<long long> steps = dembark_liggghts::whole_states(base_);
    if (steps.empty()) dembark_liggghts::delete_broken_states(base_);
    else newest = steps.front();
  }
  MPI_Bcast(&newest, 1, MPI_LONG_LONG, 0, world);
  if (newest < 0) return;
  const std::string line = "there is a state of an earlier run, " + dembark_liggghts::state_name(base_, newest) +
                           "; go on from it by resume_state, move it away, or give the states another name than " + base_;
  error->fix_error(FLERR, this, line.c_str());
}

void FixResumeExact::set_next() {
  if (every_ > 0) next_reneighbor = (update->ntimestep / every_ + 1) * every_;
}

// The set-up would sort the atoms out of turn.
void FixResumeExact::setup_pre_exchange() {
  sort_frequency_ = atom->sortfreq;
  if (!kept_.empty()) atom->sortfreq = 0;
}

void FixResumeExact::setup_pre_neighbor() { atom->sortfreq = sort_frequency_; }

void FixResumeExact::setup(int) {
  if (state_step_ < 0) return;
  std::string why;
  if (update->ntimestep != state_step_) why = "the run does not begin at the step of the state";
  else if (!lacking_.empty()) why = lacking_;
  else if (saved_ranks_ != comm->nprocs)
    why = "the state is of " + std::to_string(saved_ranks_) + " ranks, the run has " + std::to_string(comm->nprocs);
  else {
    int good = fits(), all = 0;
    MPI_Allreduce(&good, &all, 1, MPI_INT, MPI_MIN, world);
    if (all) put_back();
    else why = "the atoms or their candidates for contacts are others than in the state";
  }
  // Output of the step of the state was written before the state.
  for (int k = 0; k < output->ndump; ++k) output->last_dump[k] = update->ntimestep;
  if (comm->me == 0 && screen)
    fprintf(screen, "dembark: resumed at step " BIGINT_FORMAT " %s%s\n", update->ntimestep,
            why.empty() ? "exactly" : "approximately: ", why.c_str());
  kept_.clear();
  kept_.shrink_to_fit();
  state_step_ = -1;
}

/// The list of candidates was built anew for the step that has ended: here its output is written, and nothing of the next was done.
void FixResumeExact::pre_initial_integrate() {
  if (every_ == 0 || update->ntimestep != next_reneighbor + 1) return;
  --update->ntimestep;
  write_state();
  ++update->ntimestep;
  next_reneighbor += every_;
}

void FixResumeExact::write_state() {
  // The histories of pairs are in the list; what is written are those of the atoms.
  if (contact_list(force)) granular_pair(force)->get_fix_history()->pre_exchange();
  std::string part = base_ + ".part";
  WriteRestart(lmp).write(&part[0]);
  std::string broken = broken_file(part);
  append_parts(part, broken);
  if (comm->me != 0) return;
  for (const std::string &path : outputs_) dembark_liggghts::sync_file(path);
  const std::string wrong = broken.empty() ? dembark_liggghts::keep_state(part, base_, update->ntimestep, comm->procgrid) : broken;
  if (!wrong.empty()) error->one(FLERR, ("Fix resume/exact (id " + std::string(id) + "): " + wrong).c_str());
}

/// The engine does not notice a full disk: whether the file ends with the atoms of the last rank.
std::string FixResumeExact::broken_file(const std::string &part) const {
  int last = atom->avec->size_restart();
  MPI_Bcast(&last, 1, MPI_INT, comm->nprocs - 1, world);
  if (comm->me != 0) return "";
  int found = -1;
  if (std::FILE *const file = std::fopen(part.c_str(), "rb")) {
    const bool there = std::fseek(file, -long(sizeof(int)) - long(last) * long(sizeof(double)), SEEK_END) == 0;
    if (!there || std::fread(&found, sizeof(int), 1, file) != 1) found = -1;
    std::fclose(file);
  }
  return found == last ? "" : dembark_liggghts::not_whole(part);
}

/// What this rank has to know to go on: structure, forces, properties, histories of meshes, histories of pairs.
void FixResumeExact::save(std::vector<double> &to) const {
  to = structure(atom, force, modify);
  Saver out{to};
  of_atoms(out);
  const NeighList *const list = contact_list(force);
  if (!list) return;
  // Nearly all candidates have no history: only those that have one are kept, by their place.
  const std::size_t width = granular_pair(force)->dnum();
  for (int ii = 0; ii < list->inum; ++ii) {
    const int i = list->ilist[ii], *const flags = list->listgranhistory->firstneigh[i];
    const double *const histories = list->listgranhistory->firstdouble[i];
    for (int k = 0; k < list->numneigh[i]; ++k) {
      const double *const history = histories + width * k;
      if (!flags[k] && std::all_of(history, history + width, [](double v) { return v == 0.0; })) continue;
      to.insert(to.end(), {double(i), double(k), double(flags[k])});
      to.insert(to.end(), history, history + width);
    }
  }
}

/// The opposite of save(), for a rank that fits.
void FixResumeExact::put_back() {
  Loader in{kept_.data() + structure(atom, force, modify).size()};
  of_atoms(in);
  NeighList *const list = contact_list(force);
  if (!list) return;
  const std::size_t width = granular_pair(force)->dnum();
  for (int ii = 0; ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    std::fill_n(list->listgranhistory->firstneigh[i], list->numneigh[i], 0);
    std::fill_n(list->listgranhistory->firstdouble[i], width * list->numneigh[i], 0.0);
  }
  for (const double *from = in.from, *const end = kept_.data() + kept_.size(); from < end; from += 3 + width) {
    const int i = static_cast<int>(from[0]), k = static_cast<int>(from[1]);
    list->listgranhistory->firstneigh[i][k] = static_cast<int>(from[2]);
    std::copy_n(from + 3, width, list->listgranhistory->firstdouble[i] + width * k);
  }
}

/// Saves or loads what is stored atom by atom.
template <class Stream>
void FixResumeExact::of_atoms(Stream &stream) const {
  const int n = atom->nlocal;
  stream.integer(atom->nextsort);
  if (n) stream.numbers(atom->f[0], 3 * n);
  if (n) stream.numbers(atom->torque[0], 3 * n);
  for (FixPropertyAtom *property : atom_properties(modify))
    for (int i = 0; i < n; ++i)
      stream.numbers(property->array_atom ? property->array_atom[i] : property->vector_atom + i, property->get_nvalues());
  for (FixContactHistoryMesh *history : mesh_histories(modify))
    for (int i = 0; i < n; ++i) {
      stream.integer(dembark_liggghts::partner_counts(*history)[i]);
      for (int k = 0; k < history->nneighs(i); ++k) {
        stream.integer(dembark_liggghts::partners(*history)[i][k]);
        stream.numbers(history->contacthistory(i, k), history->get_dnum());
      }
    }
}

bool FixResumeExact::fits() const {
  const std::vector<double> facts = structure(atom, force, modify);
  return kept_.size() > facts.size() && std::equal(facts.begin(), facts.end(), kept_.begin());
}

/// How long the parts of all ranks are. The engine counts the bytes of a fix in 31 bits, so the parts themselves come after its end of the
/// file, which it does not read.
void FixResumeExact::write_restart(FILE *file) {
  save(part_);
  const double mine = double(part_.size());
  std::vector<double> numbers(std::size_t(header + comm->nprocs));
  MPI_Gather(&mine, 1, MPI_DOUBLE, numbers.data() + header, 1, MPI_DOUBLE, 0, world);
  if (comm->me != 0) return;
  numbers[0] = double(numbers.size());
  numbers[1] = format;
  numbers[2] = double(update->ntimestep);
  numbers[3] = double(comm->nprocs);
  const int bytes = int(numbers.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(numbers.data(), sizeof(double), numbers.size(), file);
}

/// Collective: the parts of all ranks to the end of the file, one after the other; `wrong` (rank 0) tells when that is not possible.
void FixResumeExact::append_parts(const std::string &path, std::string &wrong) {
  if (comm->me != 0) {
    const long long mine = static_cast<long long>(part_.size());
    MPI_Send(&mine, 1, MPI_LONG_LONG, 0, 0, world);
    MPI_Send(part_.data(), int(mine), MPI_DOUBLE, 0, 0, world);
  } else {
    std::FILE *const file = wrong.empty() ? std::fopen(path.c_str(), "ab") : nullptr;
    bool whole = file;
    for (int r = 0; r < comm->nprocs; ++r) {
      if (r > 0) {
        long long count = 0;
        MPI_Recv(&count, 1, MPI_LONG_LONG, r, 0, world, MPI_STATUS_IGNORE);
        part_.resize(std::size_t(count));
        MPI_Recv(part_.data(), int(count), MPI_DOUBLE, r, 0, world, MPI_STATUS_IGNORE);
      }
      whole = whole && std::fwrite(part_.data(), sizeof(double), part_.size(), file) == part_.size();
    }
    if (file && std::fclose(file) != 0) whole = false;
    if (!whole && wrong.empty()) wrong = dembark_liggghts::not_whole(path);
  }
  part_.clear();
  part_.shrink_to_fit();
}

/// Collective: this rank's part of the state whose parts are `counts` numbers long. Returns why there is none.
std::string FixResumeExact::read_parts(const double *counts) {
  const std::string path = dembark_liggghts::state_that_was_read(base_, update->ntimestep);
  int whole = 1;
  if (comm->me == 0) {
    double total = 0.0;
    for (int r = 0; r < comm->nprocs; ++r) total += counts[r];
    std::FILE *const file = std::fopen(path.c_str(), "rb");
    whole = file && std::fseek(file, -long(total) * long(sizeof(double)), SEEK_END) == 0;
    std::vector<double> part;
    for (int r = 0; r < comm->nprocs; ++r) {
      part.assign(std::size_t(counts[r]), 0.0);
      whole = whole && std::fread(part.data(), sizeof(double), part.size(), file) == part.size();
      if (r > 0) MPI_Send(part.data(), int(part.size()), MPI_DOUBLE, r, 0, world);
      else kept_ = part;
    }
    if (file) std::fclose(file);
  } else {
    kept_.resize(std::size_t(counts[comm->me]));
    MPI_Recv(kept_.data(), int(kept_.size()), MPI_DOUBLE, 0, 0, world, MPI_STATUS_IGNORE);
  }
  MPI_Bcast(&whole, 1, MPI_INT, 0, world);
  return whole ? "" : "file " + path + " does not hold the forces and histories of its ranks";
}

void FixResumeExact::restart(char *buffer) {
  const double *const numbers = reinterpret_cast<const double *>(buffer);
  state_step_ = update->ntimestep;
  saved_ranks_ = static_cast<int>(numbers[3]);
  if (numbers[1] != format) lacking_ = "the state was written by another version of dembark";
  else if (static_cast<bigint>(numbers[2]) == update->ntimestep && saved_ranks_ == comm->nprocs) lacking_ = read_parts(numbers + header);
  if (comm->me != 0) return;
  for (const std::string &path : outputs_) {
    const std::string wrong = dembark_liggghts::cut_output(path, update->ntimestep);
    if (!wrong.empty()) error->one(FLERR, ("Fix resume/exact (id " + std::string(id) + "): " + wrong).c_str());
  }
}

double FixResumeExact::memory_usage() { return double((kept_.size() + part_.size()) * sizeof(double)); }
