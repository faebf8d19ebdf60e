#include "pair_sph_coupled.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_gravity.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"

#include "fix_nve_sph_coupled.h"
#include "fix_sph_body.h"
#include "dembark/keyword_reader.hpp"
#include "dembark/sph/crowding.hpp"
#include "pair_sph_options.h"

using namespace LAMMPS_NS;
using namespace dembark::sph;
using dembark_liggghts::SphRole;

namespace dembark::sph {
#if defined(__x86_64__)
extern const Loops avx2_loops;
#endif
}  // namespace dembark::sph

namespace {

const Loops &loops_of_processor() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return avx2_loops;
#endif
  return portable_loops();
}

using dembark_family::vector;

}  // namespace

PairSphCoupled::PairSphCoupled(LAMMPS *lmp) : Pair(lmp), loops_(&loops_of_processor()) {
  single_enable = 0;
  no_virial_fdotr_compute = 1;
  restartinfo = 1;
  comm_forward = 4;
}

PairSphCoupled::~PairSphCoupled() {
  if (!allocated) return;
  memory->destroy(setflag);
  memory->destroy(cutsq);
}

PairSphCoupled *PairSphCoupled::find(Force *force) { return dynamic_cast<PairSphCoupled *>(force->pair_match("sph/coupled", 1)); }

void PairSphCoupled::refuse(const std::string &what) const {
  error->all(FLERR, ("Pair sph/coupled: " + what).c_str());
  std::abort();  // all() does not return
}

void PairSphCoupled::read(const std::vector<std::string> &words) {
  words_ = words;
  try {
    settings_ = dembark_liggghts::read_fluid_settings(words, domain->dimension);
  } catch (const std::invalid_argument &wrong) {
    refuse(wrong.what());
  }
  numbers_ = loop_numbers(settings_);
}

void PairSphCoupled::settings(int narg, char **arg) { read(std::vector<std::string>(arg, arg + narg)); }

void PairSphCoupled::coeff(int narg, char **arg) {
  if (narg != 2) refuse("pair_coeff takes two types and nothing else: all numbers stand in the pair_style");
  const int n = atom->ntypes;
  if (!allocated) {
    allocated = 1;
    memory->create(setflag, n + 1, n + 1, "pair:setflag");
    memory->create(cutsq, n + 1, n + 1, "pair:cutsq");
    for (int i = 1; i <= n; ++i) std::fill_n(setflag[i] + 1, n, 0);
  }
  int low_i, high_i, low_j, high_j;
  force->bounds(arg[0], n, low_i, high_i);
  force->bounds(arg[1], n, low_j, high_j);
  for (int i = low_i; i <= high_i; ++i)
    for (int j = std::max(low_j, i); j <= high_j; ++j) setflag[i][j] = 1;
}

void PairSphCoupled::init_style() {
  if (!atom->rho_flag || !atom->p_flag) refuse("atoms have no density; use atom_style sph, or atom_style hybrid granular sph");
  if (force->newton_pair) refuse("set newton off: each rank computes all that acts on its own atoms");
  if (!comm->ghost_velocity) refuse("ghosts have no velocity; add the line communicate single vel yes");
  if (std::strcmp(update->integrate_style, "verlet") != 0) refuse("only run_style verlet is supported");
  if (domain->triclinic) refuse("the box must not be triclinic");
  fluid_fix_ = nullptr;
  solids_.clear();
  for (int k = 0; k < modify->nfix; ++k) {
    if (auto *const solid = dynamic_cast<FixSphBody *>(modify->fix[k])) solids_.push_back(solid);
    auto *const fluid = dynamic_cast<FixNveSphCoupled *>(modify->fix[k]);
    if (fluid && fluid_fix_) refuse("there are two fixes nve/sph/coupled; one moves all fluid");
    if (fluid) fluid_fix_ = fluid;
  }
  if (!fluid_fix_) refuse("nothing moves the fluid; add fix ID group nve/sph/coupled, with the group of the fluid");
  neighbor->request(this);
}

double PairSphCoupled::init_one(int, int) { return support * settings_.h(); }

void PairSphCoupled::find_gravity() {
  Vector gravity{};
  FixGravity *found = nullptr;
  for (int k = 0; k < modify->nfix; ++k) {
    auto *const fix = dynamic_cast<FixGravity *>(modify->fix[k]);
    if (fix && found) refuse("there are two fixes gravity; give the fluid one");
    if (fix) found = fix;
  }
  if (found) {
    double g[3];
    found->get_gravity(g);
    gravity = vector(g);
    bool outside = false;
    for (int i = 0; i < atom->nlocal; ++i)
      outside = outside || ((atom->mask[i] & fluid_fix_->groupbit) && !(atom->mask[i] & found->groupbit));
    refuse_if_any(outside ? "the group of fix gravity must hold the whole fluid" : "");
  }
  settings_.gravity = gravity;
}

void PairSphCoupled::begin(bool first) {
  if (update->dt > settings_.longest_step() * (1.0 + 1e-9))
    refuse("the time step must be at most 0.6 h/sound_speed = " + dembark::keywords::text(settings_.longest_step()) + " s, not " +
           dembark::keywords::text(update->dt) + " s");
  find_gravity();
  sort_particles();
  refuse_if_any(wrong_atom());
  if (first) refuse_if_any(overlap());
  for (int i = 0; i < atom->nlocal + atom->nghost; ++i) {
    if (role_[i] != SphRole::fluid && settings_.boundary == Boundary::dynamic && atom->rho[i] < settings_.state.density)
      atom->rho[i] = settings_.state.density;
    if (role_[i] == SphRole::fluid) atom->p[i] = settings_.state.pressure(atom->rho[i]);
  }
}

/// Ends the run with the line of the lowest rank that has one. Collective: what one rank prints alone may land within a line of another.
void PairSphCoupled::refuse_if_any(const std::string &line) const {
  int first = line.empty() ? comm->nprocs : comm->me;
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, world);
  if (first == comm->nprocs) return;
  char shown[512] = {};
  if (comm->me == first) snprintf(shown, sizeof shown, "%s", line.c_str());
  MPI_Bcast(shown, sizeof shown, MPI_CHAR, first, world);
  refuse(shown);
}

/// What is wrong with the first faulty atom of this rank; "": nothing.
std::string PairSphCoupled::wrong_atom() const {
  for (int i = 0; i < atom->nlocal; ++i)
    if (const std::string wrong = wrong_with(i); !wrong.empty()) return "atom " + std::to_string(atom->tag[i]) + " " + wrong;
  return "";
}

std::string PairSphCoupled::wrong_with(int i) const {
  using dembark::keywords::text;
  const double due = settings_.mass();
  int groups = role_[i] == SphRole::fluid;
  for (const FixSphBody *solid : solids_) groups += (atom->mask[i] & solid->groupbit) != 0;
  if (groups > 1) return "is in two groups of the fixes nve/sph/coupled, sph/wall and sph/body; it can be in one";
  if (groups == 0 && setflag[atom->type[i]][atom->type[i]])
    return "is in no group of the fixes nve/sph/coupled, sph/wall and sph/body; give it to one, or leave its type out of pair_coeff";
  if (groups > 0 && settings_.dimension == 2 && !(std::fabs(atom->x[i][2]) <= 1e-6 * settings_.spacing))
    return "is at z = " + text(atom->x[i][2]) + " m; in the plane all are at z = 0, one layer of the lattice";
  if (role_[i] != SphRole::fluid) return "";
  const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
  if (!(std::fabs(mass - due) <= 1e-6 * due))
    return "of the fluid has the mass " + text(mass) + " kg where density * spacing^" + std::to_string(settings_.dimension) + " is " +
           text(due) + " kg" + (atom->rmass ? "; set it by set group ... mass" : "; set it by mass TYPE ...");
  if (!(atom->rho[i] > 0.0) || std::isinf(atom->rho[i]))
    return "of the fluid has the density " + text(atom->rho[i]) + " kg/m^3; set it by set group ... meso_rho";
  return "";
}

/// Which particle of this rank was created where others are; "": none.
std::string PairSphCoupled::overlap() const {
  const auto place = [this](int i) { return vector(atom->x[i]); };
  Crowding crowding(settings_, std::size_t(atom->nlocal));
  const int none = int(role_.size());
  crowding.add(rows_.inner, none, true, place, place);
  for (const Rows *rows : {&rows_.border, &rows_.of_fluid, &rows_.repelling_fluid}) crowding.add(*rows, none, false, place, place);
  const int worst = crowding.worst();
  return worst < 0 ? "" : "atom " + std::to_string(atom->tag[worst]) + " of the fluid " + crowding.line(worst);
}

/// After each search of neighbours.
void PairSphCoupled::sort_particles() {
  const int all = atom->nlocal + atom->nghost;
  role_.assign(std::size_t(all), SphRole::none);
  solid_of_.assign(std::size_t(all), -1);
  for (int i = 0; i < all; ++i) {
    const int mask = atom->mask[i], type = atom->type[i];
    if (!setflag[type][type]) continue;
    if (mask & fluid_fix_->groupbit) role_[i] = SphRole::fluid;
    for (std::size_t k = 0; k < solids_.size() && role_[i] == SphRole::none; ++k)
      if (mask & solids_[k]->groupbit) {
        role_[i] = settings_.contact.on() && solids_[k]->body().free ? SphRole::repelling : SphRole::solid;
        solid_of_[i] = int(k);
      }
  }
  rows_.build(role_, atom->nlocal, all, [this](const auto &pair) {
    for (int ii = 0; ii < list->inum; ++ii) {
      const int i = list->ilist[ii];
      for (int k = 0; k < list->numneigh[i]; ++k) pair(i, list->firstneigh[i][k] & NEIGHMASK);
    }
  });
  resize();
}

void PairSphCoupled::resize() {
  const std::size_t n = role_.size() + 1;
  records_.resize(n);
  rate_.resize(n);
  sum_.resize(n);
  velocity_.resize(n);
  velocity_sum_.resize(n);
  wall_velocity_.resize(n);
  if (settings_.shifting.coefficient > 0.0) shift_sum_.resize(n);
  records_.back() = far_record(vector(domain->boxhi) + Vector{1e3 * (domain->xprd + settings_.h()), 0.0, 0.0});
}

LoopArguments PairSphCoupled::arguments(const Rows &rows) {
  LoopArguments in;
  in.own = in.others = records_.data();
  in.start = rows.start.data();
  in.neighbour = rows.neighbour.data();
  in.begin = rows.begin;
  in.end = rows.end;
  in.dimension = settings_.dimension;
  in.h = settings_.h();
  in.pair = numbers_.pair;
  in.volume = settings_.mass() / settings_.state.density;
  in.rate = rate_.data();
  in.shift = shift_sum_.data();
  in.sum = sum_.data();
  in.velocity_sum = velocity_sum_.data();
  return in;
}

void PairSphCoupled::advance(double dt, double **shifts) {
  if (neighbor->ago == 0) sort_particles();
  const int own = atom->nlocal, all = int(role_.size()), kernel = int(settings_.kernel), shifting = shifts != nullptr;
  for (int i = 0; i < all; ++i) {
    const Vector x = vector(atom->x[i]), v = vector(atom->v[i]);
    records_[i] = role_[i] == SphRole::fluid ? density_record(settings_, x, v, atom->rho[i], atom->p[i]) : solid_record(x, v);
  }
  std::fill(rate_.begin(), rate_.end(), 0.0);
  std::fill(shift_sum_.begin(), shift_sum_.end(), Quad{});
  // The other rank has the other half of what pairs across the border lose.
  const double lost = loops_->density_pairs[kernel][shifting](arguments(rows_.inner)) +
                      0.5 * loops_->density_pairs[kernel][shifting](arguments(rows_.border));
  lost_.diffusive += dt * settings_.mass() * lost;
  loops_->density_across[kernel][shifting](arguments(rows_.of_fluid));
  const bool dynamic = settings_.boundary == Boundary::dynamic;
  if (dynamic) loops_->density_across[kernel][0](arguments(rows_.near_fluid));
  for (int i = 0; i < own; ++i) {
    if (role_[i] == SphRole::solid && dynamic) {
      atom->rho[i] = boundary_density(settings_, atom->rho[i], rate_[i], dt);
    } else if (role_[i] == SphRole::fluid) {
      atom->drho[i] = rate_[i];
      atom->rho[i] = fluid_density(settings_, numbers_, atom->rho[i], rate_[i], dt);
      atom->p[i] = settings_.state.pressure(atom->rho[i]);
      if (!shifting) continue;
      const Quad &q = shift_sum_[i];
      const Vector by =
          shift(settings_.shifting, settings_.dimension, settings_.h(), settings_.spacing, dt, vector(atom->v[i]), {q.x, q.y, q.z}, q.w);
      shifts[i][0] = by.x, shifts[i][1] = by.y, shifts[i][2] = by.z;
    }
  }
  walls_to_ghosts_ = false;
  comm->forward_comm_pair(this);
}

int PairSphCoupled::pack_comm(int n, int *numbers, double *to, int, int *) {
  double *at = to;
  for (int k = 0; k < n; ++k) {
    const int i = numbers[k];
    if (walls_to_ghosts_) {
      *at++ = atom->p[i];
      *at++ = wall_velocity_[i].x, *at++ = wall_velocity_[i].y, *at++ = wall_velocity_[i].z;
    } else {
      *at++ = atom->rho[i];
    }
  }
  return walls_to_ghosts_ ? 4 : 1;
}

void PairSphCoupled::unpack_comm(int n, int first, double *from) {
  for (int i = first; i < first + n; ++i) {
    if (!walls_to_ghosts_) {
      atom->rho[i] = *from++;
      if (role_[i] == SphRole::fluid) atom->p[i] = settings_.state.pressure(atom->rho[i]);
      continue;
    }
    const double p = *from++;
    wall_velocity_[i] = vector(from);
    from += 3;
    if (role_[i] != SphRole::solid) continue;
    atom->p[i] = p;
    if (settings_.boundary == Boundary::extrapolated) atom->rho[i] = wall_density(settings_.state, p);
  }
}

/// Pressures of solid particles, and the records of all particles for the forces.
void PairSphCoupled::wall_states() {
  const int own = atom->nlocal, all = int(role_.size()), kernel = int(settings_.kernel);
  const bool extrapolated = settings_.boundary == Boundary::extrapolated;
  for (int i = 0; i < all; ++i) {
    const Vector x = vector(atom->x[i]), v = vector(atom->v[i]);
    records_[i] = role_[i] == SphRole::fluid ? force_record(x, v, atom->rho[i], atom->p[i]) : solid_record(x, {});
  }
  std::fill(sum_.begin(), sum_.end(), Quad{});
  std::fill(rate_.begin(), rate_.end(), 0.0);
  std::fill(velocity_sum_.begin(), velocity_sum_.end(), Vector{});
  if (extrapolated) loops_->wall_sums[kernel](arguments(rows_.near_fluid));
  for (int i = 0; i < own; ++i) {
    if (role_[i] != SphRole::solid) continue;
    velocity_[i] = wall_velocity_[i] = vector(atom->v[i]);
    if (!extrapolated) {
      atom->p[i] = settings_.state.pressure(atom->rho[i]);
      continue;
    }
    const Quad &q = sum_[i];
    const Body &body = solids_[std::size_t(solid_of_[i])]->body();
    const WallState wall = wall_state(settings_, {q.w, rate_[i], {q.x, q.y, q.z}, velocity_sum_[i]}, velocity_[i],
                                      body.acceleration_at(vector(atom->x[i]) - body.position));
    atom->p[i] = wall.pressure;
    atom->rho[i] = wall.density;
    wall_velocity_[i] = wall.velocity;
    sum_[i] = {};
  }
  walls_to_ghosts_ = true;
  comm->forward_comm_pair(this);
  for (int i = 0; i < all; ++i)
    if (role_[i] == SphRole::solid) records_[i] = force_record(vector(atom->x[i]), wall_velocity_[i], atom->rho[i], atom->p[i]);
}

/// Accelerations over dt (s) into sum_.
void PairSphCoupled::push(double dt) {
  const int kernel = int(settings_.kernel), slip = settings_.no_slip ? 0 : 1;
  const double per_mass = dt * settings_.mass();
  lost_.viscous +=
      per_mass * (loops_->force_pairs[kernel](arguments(rows_.inner)) + 0.5 * loops_->force_pairs[kernel](arguments(rows_.border)));
  loops_->force_across[kernel][slip](arguments(rows_.of_fluid));
  LoopArguments back = arguments(rows_.near_fluid);
  back.velocity = velocity_.data();
  lost_.boundary += per_mass * loops_->force_across[kernel][slip](back);
}

/// Accelerations of the contact potential into sum_, and its energy.
void PairSphCoupled::repel() {
  const int none = int(role_.size());
  const double mass = settings_.mass(), solid = mass / settings_.state.density;
  lost_.contact = 0.0;
  with_kernel(settings_, [&](const auto &kernel) {
    // Of the fluid particle.
    const auto acceleration = [&](int fluid, int other, double &r, double &volumes) {
      const Vector d = vector(atom->x[fluid]) - vector(atom->x[other]);
      r = norm(d);
      volumes = solid * mass / atom->rho[fluid];
      return (contact_factor(settings_.contact, kernel, r, volumes, numbers_.at_spacing) / mass) * d;
    };
    double r, volumes;
    rows_.repelling_fluid.each(none, [&](int i, int j) {
      const Vector a = acceleration(i, j, r, volumes);
      sum_[i] = {sum_[i].x + a.x, sum_[i].y + a.y, sum_[i].z + a.z, 0.0};
      lost_.contact += contact_energy(settings_.contact, kernel, r, volumes, numbers_.at_spacing);
    });
    rows_.fluid_of_repelling.each(none, [&](int j, int i) {
      const Vector a = acceleration(i, j, r, volumes);
      sum_[j] = {sum_[j].x - a.x, sum_[j].y - a.y, sum_[j].z - a.z, 0.0};
    });
  });
}

void PairSphCoupled::compute(int eflag, int vflag) {
  if (eflag || vflag) ev_setup(eflag, vflag);
  else evflag = vflag_fdotr = 0;
  for (FixSphBody *solid : solids_) solid->begin_forces(settings_.gravity);
  wall_states();
  push(update->setupflag ? 0.0 : update->dt);
  if (settings_.contact.on()) repel();
  const double mass = settings_.mass();
  for (int i = 0; i < atom->nlocal; ++i) {
    if (role_[i] == SphRole::none) continue;
    const Vector by = mass * Vector{sum_[i].x, sum_[i].y, sum_[i].z};
    atom->f[i][0] += by.x, atom->f[i][1] += by.y, atom->f[i][2] += by.z;
    if (role_[i] == SphRole::fluid) continue;
    FixSphBody *const solid = solids_[std::size_t(solid_of_[i])];
    solid->add_force(by, cross(vector(atom->x[i]) - solid->body().position, by));
  }
  if (evflag && eflag_global) eng_vdwl = energies().compression;
}

Energies PairSphCoupled::energies() const {
  Energies e = lost_;
  const double mass = settings_.mass();
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & fluid_fix_->groupbit)) continue;
    const Vector v = vector(atom->v[i]);
    e.kinetic += 0.5 * mass * dot(v, v);
    e.potential -= mass * dot(settings_.gravity, vector(atom->x[i]));
    e.compression += mass * settings_.state.energy(atom->rho[i]);
  }
  return e;
}
