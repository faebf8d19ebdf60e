#include "fix_resume_exact.h"

#include <algorithm>
#include <climits>
#include <cstring>
#include <fstream>
#include <numeric>

#include "atom.h"
#include "atom_vec.h"
#include "comm.h"
#include "error.h"
#include "fix_contact_history.h"
#include "fix_contact_history_mesh.h"
#include "fix_property_atom.h"
#include "fix_property_global.h"
#include "force.h"
#include "input.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "read_restart.h"
#include "update.h"
#include "variable.h"
#include "write_restart.h"

#include "dembark/fnv.hpp"
#include "engine_access.h"

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

// Then come how many numbers each rank has, their hashes, and the record of the run as text.
struct Head {
  double step, ranks, contact_distance_factor;
};

std::uint64_t hash_of(const std::vector<double> &numbers) {
  std::uint64_t hash = dembark::fnv1a_start;
  for (const double &number : numbers) {
    std::uint64_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    hash = dembark::fnv1a_next(hash, bits);
  }
  return hash;
}

PairGran *granular_pair(Force *force) { return static_cast<PairGran *>(force->pair_match("gran", 0)); }

/// The list of candidates with a history of each, if there is one.
NeighList *contact_list(Force *force) {
  PairGran *const pair = granular_pair(force);
  return pair && pair->list && pair->list->listgranhistory ? pair->list : nullptr;
}

template <class Style>
std::vector<Style *> fixes(Modify *modify) {
  std::vector<Style *> found;
  for (int i = 0; i < modify->nfix; ++i)
    if (Style *const fix = dynamic_cast<Style *>(modify->fix[i])) found.push_back(fix);
  return found;
}

/// Numbers that have to be the same for the saved ones to belong to this run: which atoms in which order, their candidates in which order,
/// which properties and meshes, with how many numbers a contact.
std::vector<double> structure(Atom *atom, Force *force, Modify *modify) {
  dembark_family::OrderHash order(*atom, contact_list(force));
  for (FixPropertyAtom *property : fixes<FixPropertyAtom>(modify)) {
    for (const char *c = property->id; *c; ++c) order.mix(*c);
    order.mix(property->get_nvalues());
  }
  order.mix(atom->torque_flag);
  for (FixContactHistoryMesh *history : fixes<FixContactHistoryMesh>(modify)) {
    order.mix(history->get_dnum());
    for (int i = 0; i < atom->nlocal; ++i) order.mix(history->nneighs(i));
  }
  return {double(atom->nlocal), double(atom->nghost), order.high(), order.low()};
}

/// Takes a rank's numbers out of the run, or puts them back in the same order.
struct Stream {
  std::vector<double> &data;
  bool loading;
  std::size_t at = data.size();  // of the next number

  void numbers(double *values, int count) {
    const std::size_t next = at + std::size_t(count);
    if (!loading) data.insert(data.end(), values, values + count);
    else if (next <= data.size()) std::copy_n(data.data() + at, count, values);
    at = next;  // beyond the end: the numbers are not those of this run
  }
  template <class Integer>
  void integer(Integer &value) {
    double number = double(value);
    numbers(&number, 1);
    value = static_cast<Integer>(number);
  }
};

/// What a rank has to know to go on: forces, properties, histories of meshes, histories of pairs. How many numbers these are.
std::size_t visit(Stream stream, Atom *atom, Force *force, Modify *modify) {
  const int n = atom->nlocal;
  stream.integer(atom->nextsort);
  if (n) stream.numbers(atom->f[0], 3 * n);
  if (n && atom->torque_flag) stream.numbers(atom->torque[0], 3 * n);
  for (FixPropertyAtom *property : fixes<FixPropertyAtom>(modify))
    for (int i = 0; i < n; ++i)
      stream.numbers(property->array_atom ? property->array_atom[i] : property->vector_atom + i, property->get_nvalues());
  for (FixContactHistoryMesh *history : fixes<FixContactHistoryMesh>(modify))
    for (int i = 0; i < n; ++i) {
      stream.integer(dembark_liggghts::partner_counts(*history)[i]);
      for (int k = 0; k < history->nneighs(i); ++k) {
        stream.integer(dembark_liggghts::partners(*history)[i][k]);
        stream.numbers(history->contacthistory(i, k), history->get_dnum());
      }
    }
  NeighList *const list = contact_list(force);
  if (!list) return stream.at;
  const int width = granular_pair(force)->dnum();
  for (int ii = 0; ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    for (int k = 0; k < list->numneigh[i]; ++k) {
      int &flag = list->listgranhistory->firstneigh[i][k];
      double *const history = list->listgranhistory->firstdouble[i] + width * k;
      // Nearly all candidates have no history.
      bool any = flag || std::any_of(history, history + width, [](double v) { return v != 0.0; });
      stream.integer(any);
      if (any) {
        stream.integer(flag);
        stream.numbers(history, width);
      } else if (stream.loading) {
        flag = 0;
        std::fill_n(history, width, 0.0);
      }
    }
  }
  return stream.at;
}

}  // namespace

FixResumeExact::FixResumeExact(LAMMPS *lmp, int narg, char **arg)
    : ResumeFix(lmp, narg, arg), lengths_(std::size_t(comm->nprocs)), hashes_(std::size_t(comm->nprocs)) {}

// The engine calls the set-up of a stage for the fixes of that stage only.
int FixResumeExact::setmask() { return PRE_INITIAL_INTEGRATE | PRE_EXCHANGE | PRE_NEIGHBOR; }

void FixResumeExact::setup(int) {
  if (state_step_ < 0) return;
  const std::vector<double> facts = structure(atom, force, modify);
  std::string why = why_not_put_back(part_.size() > facts.size() && std::equal(facts.begin(), facts.end(), part_.begin()));
  if (why.empty() && visit({part_, true, facts.size()}, atom, force, modify) != part_.size())
    fail_alone("the state holds other forces and histories than this run has; continue with the script that wrote it");
  const std::string differences = why_approximate(record());
  if (!differences.empty()) why += (why.empty() ? "" : "; ") + differences;
  go_on(why);
  part_ = {};
}

void FixResumeExact::write_state() {
  // The histories of pairs are in the list; what is written are those of the atoms.
  if (contact_list(force)) granular_pair(force)->get_fix_history()->pre_exchange();
  record_ = record().text();
  part_ = structure(atom, force, modify);
  visit({part_, false}, atom, force, modify);
  if (part_.size() > INT_MAX)
    fail_alone("a rank has " + std::to_string(part_.size()) + " numbers, and MPI sends up to 2^31; take more ranks");
  const std::uint64_t hash = hash_of(part_);
  MPI_Gather(&hash, 1, MPI_UINT64_T, hashes_.data(), 1, MPI_UINT64_T, 0, world);
  const double mine = double(part_.size());
  MPI_Gather(&mine, 1, MPI_DOUBLE, lengths_.data(), 1, MPI_DOUBLE, 0, world);
  std::string path = part_path();
  WriteRestart(lmp).write(&path[0]);
  const bool complete = append_parts(path);
  lengths_.assign(lengths_.size(), 0.0);
  record_.clear();
  if (comm->me != 0) return;
  if (!complete) fail_alone("file " + path + " cannot be written; is the disk full?");
  keep_state();
}

/// The parts of all ranks to the end of the restart file, one after the other. The engine counts the bytes of a fix in 31 bits, so they
/// come after its end of the file, which it does not read. Nor does it notice a full disk: whether the file ends with the atoms of the last
/// rank and then the parts, as the first rank knows. Collective.
bool FixResumeExact::append_parts(const std::string &path) {
  int last = atom->avec->size_restart(), found = -1;
  MPI_Bcast(&last, 1, MPI_INT, comm->nprocs - 1, world);
  if (comm->me != 0) {
    MPI_Send(part_.data(), int(part_.size()), MPI_DOUBLE, 0, 0, world);
    part_ = {};
    return true;
  }
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekg(-std::streamoff(sizeof(int)) - std::streamoff(last) * std::streamoff(sizeof(double)), std::ios::end);
  file.read(reinterpret_cast<char *>(&found), sizeof found);
  file.seekp(0, std::ios::end);
  for (int r = 0; r < comm->nprocs; ++r) {
    part_.resize(std::size_t(lengths_[r]));
    if (r > 0) MPI_Recv(part_.data(), int(part_.size()), MPI_DOUBLE, r, 0, world, MPI_STATUS_IGNORE);
    file.write(reinterpret_cast<const char *>(part_.data()), std::streamsize(part_.size() * sizeof(double)));
  }
  part_ = {};
  file.close();
  return file && found == last;
}

/// This rank's part of the state whose parts have these lengths. Returns why there is none. Collective.
std::string FixResumeExact::read_parts(const double *lengths) {
  const std::string path = ResumeState::file[lmp].empty() ? dembark::restart::state_name(base_, update->ntimestep) : ResumeState::file[lmp];
  int whole = 1;
  if (comm->me == 0) {
    const double all = std::accumulate(lengths, lengths + comm->nprocs, 0.0);
    std::ifstream file(path, std::ios::binary);
    file.seekg(-std::streamoff(all) * std::streamoff(sizeof(double)), std::ios::end);
    whole = all > 0.0;
    std::vector<double> part;
    for (int r = 0; r < comm->nprocs; ++r) {
      part.assign(std::size_t(lengths[r]), 0.0);
      file.read(reinterpret_cast<char *>(part.data()), std::streamsize(part.size() * sizeof(double)));
      if (r > 0) MPI_Send(part.data(), int(part.size()), MPI_DOUBLE, r, 0, world);
      else part_ = part;
    }
    whole = whole && file;
  } else {
    part_.resize(std::size_t(lengths[comm->me]));
    MPI_Recv(part_.data(), int(part_.size()), MPI_DOUBLE, 0, 0, world, MPI_STATUS_IGNORE);
  }
  MPI_Bcast(&whole, 1, MPI_INT, 0, world);
  int own = hash_of(part_) == hashes_[std::size_t(comm->me)], all = 0;
  MPI_Allreduce(&own, &all, 1, MPI_INT, MPI_MIN, world);
  return whole && all ? "" : "file " + path + " does not hold the forces and histories of its ranks";
}

/// How long the parts of all ranks are, which write_state() appends; a stock restart file has none.
void FixResumeExact::write_restart(FILE *file) {
  if (comm->me != 0) return;
  const Head head{double(update->ntimestep), double(comm->nprocs), neighbor->contactDistanceFactor};
  write_part(file, {{&head, sizeof head},
                    {lengths_.data(), lengths_.size() * sizeof lengths_[0]},
                    {hashes_.data(), hashes_.size() * sizeof hashes_[0]},
                    {record_.c_str(), record_.size() + 1}});
}

void FixResumeExact::restart(char *buffer) {
  state_step_ = update->ntimestep;
  Head head{};
  std::vector<double> lengths;
  std::vector<std::uint64_t> hashes;
  try {
    dembark_family::SavedPart part(buffer);
    part.read(&head);
    saved_ranks_ = static_cast<int>(head.ranks);
    lengths.resize(std::size_t(saved_ranks_));
    hashes.resize(lengths.size());
    part.read(lengths.data(), lengths.size());
    part.read(hashes.data(), hashes.size());
    saved_ = dembark::restart::RunRecord::read(part.text());
  } catch (const std::exception &) {
    lacking_ = other_version;
    return;
  }
  // Models register it when a run begins, by the liquid that there is then.
  neighbor->register_contact_dist_factor(head.contact_distance_factor);
  if (comm->me == 0) keep_unappendable();
  if (static_cast<bigint>(head.step) != update->ntimestep || saved_ranks_ != comm->nprocs) return;
  hashes_ = hashes;
  lacking_ = read_parts(lengths.data());
}

std::string FixResumeExact::inexact_arguments(Fix &fix) const {
  auto *const mean = dynamic_cast<FixAveTime *>(&fix);
  if (!mean) return "";
  if (!dembark_liggghts::is_of_one_interval(*mean)) return "averages over more than one interval";
  return dembark_liggghts::has_file(*mean) ? "writes its file anew" : "";
}

std::vector<std::pair<std::string, std::string>> FixResumeExact::formulas() const { return dembark_liggghts::formulas(*input->variable); }

/// Materials and contact models.
void FixResumeExact::add_facts(dembark::restart::RunRecord &run) const {
  if (PairGran *const pair = granular_pair(force))
    run.facts.emplace_back("contact models",
                           dembark::restart::hashed(std::to_string(pair->hashcode()) + " " + std::to_string(pair->dnum())));
  for (FixPropertyGlobal *property : ::fixes<FixPropertyGlobal>(modify)) {
    std::string values;
    if (property->get_array())
      for (int i = 0; i < property->size_array_rows; ++i)
        for (int k = 0; k < property->size_array_cols; ++k) values += dembark::restart::digits(property->get_array()[i][k]) + " ";
    else
      for (int i = 0; i < std::max(property->vector_flag ? property->size_vector : 1, 1); ++i)
        values += dembark::restart::digits(property->get_values()[i]) + " ";
    run.facts.emplace_back(std::string("values of fix ") + property->id, dembark::restart::hashed(values));
  }
}

double FixResumeExact::memory_usage() { return double(part_.size() * sizeof(double)); }

void ResumeState::command(int narg, char **arg) {
  const dembark::restart::State state = dembark_family::find_state(narg, arg, *comm, error, world);
  file[lmp] = dembark::restart::state_name(arg[0], state.step);
  char *words[] = {&file[lmp][0]};
  ReadRestart(lmp).command(1, words);
}
