// fix energy/account: what it cannot account for, and its numbers in restart files.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_energy_account.h"
#include "fix_gravity.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "modify.h"
#include "pair_gran.h"
#include "update.h"

using namespace LAMMPS_NS;

namespace {

/// Which model of a pair style or a wall has no parts that are known, or nothing.
template <class Host>
std::string unknown_model(Host &host) {
  if (!host.contact_match("tangential", "finnie_rabinowicz")) return "tangential finnie_rabinowicz";
  if (!host.contact_match("normal", "hertz") && !host.contact_match("normal", "hooke")) return "model hertz or hooke";
  if (!host.contact_match("surface", "default")) return "surface default";
  return "";
}

bool is(const Fix *fix, const char *style) { return std::strcmp(fix->style, style) == 0; }

}  // namespace

void FixEnergyAccount::check_models() {
  if (force->newton_pair) refuse("newton must be off: each rank books for the grains that it owns");
  if (force->ftm2v != 1.0 || force->mvv2e != 1.0 || force->nktv2p != 1.0) refuse("units must be si or cgs");
  if (!atom->sphere_flag || !atom->rmass || atom->superquadric_flag || atom->shapetype_flag)
    refuse("it accounts for spheres only: atom_style granular");
  PairGran *const pair = dynamic_cast<PairGran *>(force->pair);
  if (!pair) refuse("it needs pair_style gran model hertz|hooke tangential finnie_rabinowicz ...");
  const std::string needed = unknown_model(*pair);
  if (!needed.empty()) refuse("the parts of the contact forces are known with " + needed + " only; the pair style has another model");
  for (int k = 0; k < modify->nfix; ++k)
    if (FixWallGran *const wall = dynamic_cast<FixWallGran *>(modify->fix[k])) {
      const std::string missed = unknown_model(*wall);
      if (!missed.empty())
        refuse("the parts of the contact forces are known with " + missed + " only; fix " + wall->id + " has another model");
    }
}

void FixEnergyAccount::check_motion() {
  moving_ = frozen_ = 0;
  gravities_.clear();
  std::vector<Fix *> movers;
  for (int k = 0; k < modify->nfix; ++k) {
    Fix *const fix = modify->fix[k];
    const std::string named = "fix " + std::string(fix->id) + " (" + fix->style + ")";
    if (std::strncmp(fix->style, "rigid", 5) == 0 || std::strncmp(fix->style, "multisphere", 11) == 0)
      refuse("it accounts for single grains, and " + named + " moves bodies made of several");
    if (is(fix, "gravity")) gravities_.push_back(static_cast<FixGravity *>(fix));
    if (is(fix, "freeze")) frozen_ |= fix->groupbit;
    if (!fix->time_integrate) continue;
    if (is(fix, "nve/sphere")) {
      moving_ |= fix->groupbit;
      if (k > modify->my_index(this)) refuse("it must come after " + named + ", which changes the velocities");
    } else if (!is(fix, "move") && !is(fix, "nve/noforce"))
      refuse(named + " moves atoms; only fix nve/sphere, fix move and fix nve/noforce are accounted for");
    movers.push_back(fix);
  }
  if (!moving_) refuse("no grain follows its forces: it needs fix nve/sphere");
  for (int i = 0; i < atom->nlocal; ++i) {
    const Fix *mover = nullptr;
    for (const Fix *fix : movers) {
      if (!(atom->mask[i] & fix->groupbit)) continue;
      if (mover) {
        const std::string line = "Fix energy/account (id " + std::string(id) + "): atom " + std::to_string(atom->tag[i]) +
                                 " is moved by both fix " + mover->id + " and fix " + fix->id + "; make their groups disjoint";
        error->one(FLERR, line.c_str());
      }
      mover = fix;
    }
  }
}

/// Collective. The sums of each rank by themselves: added up otherwise, they would round otherwise.
void FixEnergyAccount::write_restart(FILE *file) {
  const int ranks = comm->nprocs;
  std::vector<double> all(comm->me == 0 ? std::size_t(ranks) * state_size : 0);
  MPI_Gather(&now_, int(state_size), MPI_DOUBLE, all.data(), int(state_size), MPI_DOUBLE, 0, world);
  if (comm->me != 0) return;
  const double head[] = {double(begun_), double(ranks)};
  const int bytes = int(sizeof head + all.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(head, sizeof head, 1, file);
  fwrite(all.data(), sizeof(double), all.size(), file);
}

/// On another number of ranks the first has the sums of all.
void FixEnergyAccount::restart(char *buffer) {
  double head[2];
  std::memcpy(head, buffer, sizeof head);
  begun_ = head[0] != 0.0;
  const int ranks = int(head[1]);
  resumed_ = ranks == comm->nprocs;
  std::array<double, state_size> sum{};
  for (int r = 0; r < ranks; ++r) {
    if (resumed_ ? r != comm->me : comm->me != 0) continue;
    std::array<double, state_size> part;
    std::memcpy(part.data(), buffer + sizeof head + std::size_t(r) * sizeof part, sizeof part);
    for (std::size_t k = 0; k < state_size; ++k) sum[k] += part[k];
  }
  std::memcpy(&now_, sum.data(), sizeof now_);
  shown_ = now_;
}
