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

#include "state_files.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

constexpr double format = 1.0;

// The slots of mesh contacts are protected; an explicit instantiation may name a protected member.
struct PartnerCounts {
  typedef int *FixContactHistory::*type;
  friend type open(PartnerCounts);
};
struct Partners {
  typedef int **FixContactHistory::*type;
  friend type open(Partners);
};
template <class Tag, typename Tag::type Member>
struct Reach {
  friend typename Tag::type open(Tag) { return Member; }
};
template struct Reach<PartnerCounts, &FixContactHistory::npartner_>;
template struct Reach<Partners, &FixContactHistory::partner_>;

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
  if (!begun_ && state_step_ < 0 && every_ > 0 && comm->me == 0) dembark_liggghts::forget_states(base_);
  begun_ = true;
  set_next();
  const int acting = PRE_FORCE | POST_FORCE | INITIAL_INTEGRATE | FINAL_INTEGRATE;
  for (int i = modify->my_index(this) + 1; i < modify->nfix; ++i)
    if (modify->fmask[i] & acting) {
      const std::string line = "it must come after fix " + std::string(modify->fix[i]->id) + ", whose set-up it has to undo";
      error->fix_error(FLERR, this, line.c_str());
    }
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
  else if (saved_ranks_ != comm->nprocs)
    why = "the state is of " + std::to_string(saved_ranks_) + " ranks, the run has " + std::to_string(comm->nprocs);
  else {
    int good = !kept_.empty() && fits(kept_.data(), kept_.data() + kept_.size()), all = 0;
    MPI_Allreduce(&good, &all, 1, MPI_INT, MPI_MIN, world);
    if (all) put_back(kept_.data());
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
  const std::string broken = broken_file(part);
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
  return found == last ? "" : "file " + part + " could not be written whole. No space left on the disk?";
}

/// What this rank has to know to go on: structure, order of sorting, forces, histories of pairs, properties, histories of meshes.
void FixResumeExact::save(std::vector<double> &to) const {
  const int n = atom->nlocal;
  const std::vector<double> facts = structure(atom, force, modify);
  to.insert(to.end(), facts.begin(), facts.end());
  to.push_back(double(atom->nextsort));
  if (n) {
    to.insert(to.end(), atom->f[0], atom->f[0] + 3 * n);
    to.insert(to.end(), atom->torque[0], atom->torque[0] + 3 * n);
  }
  if (const NeighList *const list = contact_list(force)) {
    // Nearly all candidates have no history: only those that have one are kept, by their place.
    const std::size_t width = granular_pair(force)->dnum();
    const std::size_t count_at = to.size();
    to.push_back(0.0);
    for (int ii = 0; ii < list->inum; ++ii) {
      const int i = list->ilist[ii], *const flags = list->listgranhistory->firstneigh[i];
      const double *const histories = list->listgranhistory->firstdouble[i];
      for (int k = 0; k < list->numneigh[i]; ++k) {
        const double *const history = histories + width * k;
        if (!flags[k] && std::all_of(history, history + width, [](double v) { return v == 0.0; })) continue;
        to[count_at] += 1.0;
        to.push_back(i);
        to.push_back(k);
        to.push_back(flags[k]);
        to.insert(to.end(), history, history + width);
      }
    }
  }
  for (FixPropertyAtom *property : atom_properties(modify))
    for (int i = 0; i < n; ++i) {
      const double *const from = property->array_atom ? property->array_atom[i] : property->vector_atom + i;
      to.insert(to.end(), from, from + property->get_nvalues());
    }
  for (FixContactHistoryMesh *history : mesh_histories(modify)) {
    const int width = history->get_dnum();
    for (int i = 0; i < n; ++i) {
      to.push_back(history->n_partner(i));
      for (int k = 0; k < history->nneighs(i); ++k) {
        to.push_back(history->get_partner_idTri(i, k));
        to.insert(to.end(), history->contacthistory(i, k), history->contacthistory(i, k) + width);
      }
    }
  }
}

bool FixResumeExact::fits(const double *from, const double *end) const {
  const std::vector<double> facts = structure(atom, force, modify);
  return end - from > std::ptrdiff_t(facts.size()) && std::equal(facts.begin(), facts.end(), from);
}

/// The opposite of save(), for a rank that fits.
void FixResumeExact::put_back(const double *from) {
  const int n = atom->nlocal;
  from += structure(atom, force, modify).size();
  atom->nextsort = static_cast<bigint>(*from++);
  if (n) {
    std::copy(from, from + 3 * n, atom->f[0]);
    std::copy(from + 3 * n, from + 6 * n, atom->torque[0]);
    from += 6 * n;
  }
  if (NeighList *const list = contact_list(force)) {
    const std::size_t width = granular_pair(force)->dnum();
    for (int ii = 0; ii < list->inum; ++ii) {
      const int i = list->ilist[ii];
      std::fill_n(list->listgranhistory->firstneigh[i], list->numneigh[i], 0);
      std::fill_n(list->listgranhistory->firstdouble[i], width * list->numneigh[i], 0.0);
    }
    for (std::size_t count = static_cast<std::size_t>(*from++); count > 0; --count) {
      const int i = static_cast<int>(from[0]), k = static_cast<int>(from[1]);
      list->listgranhistory->firstneigh[i][k] = static_cast<int>(from[2]);
      std::copy(from + 3, from + 3 + width, list->listgranhistory->firstdouble[i] + width * k);
      from += 3 + width;
    }
  }
  for (FixPropertyAtom *property : atom_properties(modify))
    for (int i = 0; i < n; ++i) {
      const int width = property->get_nvalues();
      std::copy(from, from + width, property->array_atom ? property->array_atom[i] : property->vector_atom + i);
      from += width;
    }
  for (FixContactHistoryMesh *history : mesh_histories(modify)) {
    const int width = history->get_dnum();
    for (int i = 0; i < n; ++i) {
      (history->*open(PartnerCounts()))[i] = static_cast<int>(*from++);
      for (int k = 0; k < history->nneighs(i); ++k) {
        (history->*open(Partners()))[i][k] = static_cast<int>(*from++);
        std::copy(from, from + width, history->contacthistory(i, k));
        from += width;
      }
    }
  }
}

/// Collective: the parts of all ranks, one after the other.
void FixResumeExact::write_restart(FILE *file) {
  std::vector<double> mine, all;
  save(mine);
  int count = int(mine.size());
  std::vector<int> counts(std::size_t(comm->nprocs), 0), offsets(std::size_t(comm -> nprocs), 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  std::int64_t total = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    offsets[r] = int(total);
    total += counts[r];
  }
  const std::int64_t header = 4 + comm->nprocs;
  if (std::int64_t((total + header) * sizeof(double)) > INT32_MAX) {
    // The engine counts the bytes of a fix in 31 bits. Without the parts a resumed run is approximate.
    if (comm->me == 0) error->warning(FLERR, "fix resume/exact: too many atoms for an exact state; a resumed run will be approximate");
    counts.assign(counts.size(), 0);
    total = count = 0;
  }
  all.resize(comm->me == 0 ? std::size_t(total) : 0);
  MPI_Gatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE, 0, world);
  if (comm->me != 0) return;
  std::vector<double> head = {double(header + total), format, double(update->ntimestep), double(comm->nprocs)};
  head.insert(head.end(), counts.begin(), counts.end());
  const int bytes = int((total + header) * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(head.data(), sizeof(double), head.size(), file);
  fwrite(all.data(), sizeof(double), all.size(), file);
}

void FixResumeExact::restart(char *buffer) {
  const double *const numbers = reinterpret_cast<const double *>(buffer);
  state_step_ = update->ntimestep;
  if (numbers[1] == format && static_cast<bigint>(numbers[2]) == update->ntimestep) {
    saved_ranks_ = static_cast<int>(numbers[3]);
    if (saved_ranks_ == comm->nprocs) {
      const double *part = numbers + 4 + saved_ranks_;
      for (int r = 0; r < comm->me; ++r) part += static_cast<std::ptrdiff_t>(numbers[4 + r]);
      kept_.assign(part, part + static_cast<std::ptrdiff_t>(numbers[4 + comm->me]));
    }
  }
  if (comm->me != 0) return;
  for (const std::string &path : outputs_) {
    const std::string wrong = dembark_liggghts::cut_output(path, update->ntimestep);
    if (!wrong.empty()) error->one(FLERR, ("Fix resume/exact (id " + std::string(id) + "): " + wrong).c_str());
  }
}

double FixResumeExact::memory_usage() { return double(kept_.size() * sizeof(double)); }
