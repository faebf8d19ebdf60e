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
#include "neighbor.h"
#include "update.h"

#include "fix_nve_sph_coupled.h"
#include "engine_access.h"
#include "fix_sph_body.h"
#include "dembark/keyword_reader.hpp"
#include "dembark/sph/best_loops.hpp"
#include "dembark/sph/crowding.hpp"
#include "pair_sph_options.h"

using namespace LAMMPS_NS;
using namespace dembark::sph;
using dembark_family::vector;
using dembark_liggghts::SphParticle;
using dembark_liggghts::SphRole;

/// Roles of the solids, in the order of Scene::solids.
static constexpr SphRole solid_roles[2] = {SphRole::solid, SphRole::repelling};

struct PairSphCoupled::Images {
  PairSphCoupled &own;

  void send_densities(Scene &) const { send(false); }
  void send_walls(Scene &) const { send(true); }
  const std::vector<double> &box_pressures(const Scene &) const { return own.films_.pressures(own.particle_); }

 private:
  void send(bool walls) const {
    own.walls_to_ghosts_ = walls;
    own.comm->forward_comm_pair(&own);
  }
};

PairSphCoupled::PairSphCoupled(LAMMPS *lmp) : Pair(lmp), films_(lmp, scene_) {
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
    scene_.settings = dembark_liggghts::read_fluid_settings(words, domain->dimension);
  } catch (const std::invalid_argument &wrong) {
    refuse(wrong.what());
  }
  passes_ = std::make_unique<Passes>(scene_.settings, best_loops());
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
  if (all_types_)  // of a restart file, which does not say which
    for (int i = 1; i <= n; ++i) std::fill_n(setflag[i] + 1, n, 0);
  all_types_ = false;
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
  for (const std::string &wrong : {dembark_family::run_style_error(*update), dembark_family::units_error(*force, *update)})
    if (!wrong.empty()) refuse(wrong);
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
  scene_.bodies.assign(solids_.size(), Body{});
  films_.clear();
  if (neighbor->includegroup) refuse("neigh_modify include leaves atoms out whose forces are needed; take it out");
  // Those that the engine gives a cutoff from here on are the pairs of this style, alone or in a hybrid one.
  for (int i = 1; i <= atom->ntypes; ++i) std::fill_n(cutsq[i] + 1, atom->ntypes, 0.0);
}

int PairSphCoupled::number(const FixSphBody *solid) const {
  return int(std::find(solids_.begin(), solids_.end(), solid) - solids_.begin());
}

double PairSphCoupled::init_one(int, int) { return support * scene_.settings.h(); }

void PairSphCoupled::find_gravity() {
  Vector gravity{};
  FixGravity *found = nullptr;
  for (int k = 0; k < modify->nfix; ++k) {
    auto *const fix = dynamic_cast<FixGravity *>(modify->fix[k]);
    if (fix && found) refuse("there are two fixes gravity; give the fluid one");
    if (fix) found = fix;
  }
  if (found) {
    if (dembark_liggghts::from_variables(*found))
      refuse(std::string("the gravity of fix ") + found->id +
             " comes from a variable, and the fluid takes a constant one; give numbers, such as ${g} for v_g");
    double g[3];
    found->get_gravity(g);
    gravity = vector(g);
    bool outside = false;
    for (int i = 0; i < atom->nlocal; ++i)
      outside = outside || ((atom->mask[i] & fluid_fix_->groupbit) && !(atom->mask[i] & found->groupbit));
    refuse_if_any(outside ? "the group of fix gravity must hold the whole fluid" : "");
  }
  scene_.settings.gravity = gravity;
}

void PairSphCoupled::begin(bool first) {
  const auto &s = scene_.settings;
  if (const std::string wrong = s.step_error(update->dt); !wrong.empty()) refuse(wrong);
  find_gravity();
  sort_particles();
  refuse_if_any(wrong_atom());
  if (s.boundary == Boundary::dynamic)
    for (int i = 0; i < atom->nlocal + atom->nghost; ++i)
      if (particle_[i].role != SphRole::fluid) atom->rho[i] = std::max(atom->rho[i], s.state.density);
  load();
  if (first) refuse_if_any(overlap());
  passes_->pressures(scene_);
  for (std::size_t k = 0; k < atoms_[0].size(); ++k) atom->p[atoms_[0][k]] = scene_.fluid.pressure[k];
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
  const auto &s = scene_.settings;
  const double due = s.mass();
  const bool fluid = particle_[i].role == SphRole::fluid;
  int groups = fluid;
  for (const FixSphBody *solid : solids_) groups += (atom->mask[i] & solid->groupbit) != 0;
  if (groups > 1) return "is in two groups of the fixes nve/sph/coupled, sph/wall and sph/body; it can be in one";
  if (groups == 0 && setflag[atom->type[i]][atom->type[i]])
    return "is in no group of the fixes nve/sph/coupled, sph/wall and sph/body; give it to one, or leave its type out of pair_coeff";
  if (groups > 0 && s.dimension == 2 && !(std::fabs(atom->x[i][2]) <= 1e-6 * s.spacing))
    return "is at z = " + text(atom->x[i][2]) + " m; in the plane all are at z = 0, one layer of the lattice";
  if (!fluid) return "";
  // The search for neighbours of the fluid finds all that takes part.
  for (int t = 1; t <= atom->ntypes; ++t)
    if (setflag[t][t] && !(cutsq[atom->type[i]][t] > 0.0))
      return "of the fluid has type " + std::to_string(atom->type[i]) + ", whose pairs with type " + std::to_string(t) +
             " are not of pair sph/coupled; give them to it by pair_coeff, or leave the pairs of type " + std::to_string(t) + " out, too";
  for (const auto &[one, other] : dembark_liggghts::excluded_types(*neighbor))
    if ((atom->type[i] == one && setflag[other][other]) || (atom->type[i] == other && setflag[one][one]))
      return "of the fluid is excluded from pairs by neigh_modify exclude type " + std::to_string(one) + " " + std::to_string(other) +
             "; leave what has no forces with the fluid out of pair_coeff instead";
  for (const auto &[one, other] : dembark_liggghts::excluded_groups(*neighbor))
    if (atom->mask[i] & (one | other))
      return "of the fluid is in a group of neigh_modify exclude group; leave what has no forces with the fluid out of pair_coeff instead";
  const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
  if (!(std::fabs(mass - due) <= 1e-6 * due))
    return "of the fluid has the mass " + text(mass) + " kg where density * spacing^" + std::to_string(s.dimension) + " is " + text(due) +
           " kg" + (atom->rmass ? "; set it by set group ... mass" : "; set it by mass TYPE ...");
  if (!(atom->rho[i] > 0.0) || std::isinf(atom->rho[i]))
    return "of the fluid has the density " + text(atom->rho[i]) + " kg/m^3; set it by set group ... meso_rho";
  return "";
}

/// Which particle of this rank was created where others are; "": none.
std::string PairSphCoupled::overlap() const {
  const Crowding found = crowding(scene_);
  const int worst = found.worst();
  return worst < 0 ? "" : "atom " + std::to_string(atom->tag[atoms_[0][worst]]) + " of the fluid " + found.line(worst);
}

/// After each search of neighbours.
void PairSphCoupled::sort_particles() {
  const int all = atom->nlocal + atom->nghost;
  FluidParticles &fluid = scene_.fluid;
  particle_.assign(std::size_t(all), SphParticle{});
  for (std::vector<int> &atoms : atoms_) atoms.clear();
  fluid.id.clear();
  for (Solids &set : scene_.solids) set.body.clear();
  for (int i = 0; i < all; ++i) {
    const int mask = atom->mask[i], type = atom->type[i];
    if (!setflag[type][type]) continue;
    const bool own = i < atom->nlocal;
    SphParticle &particle = particle_[i];
    if (mask & fluid_fix_->groupbit) {
      particle.role = SphRole::fluid;
      if (own) fluid.id.push_back(i);
    }
    for (std::size_t k = 0; k < solids_.size() && particle.role == SphRole::none; ++k)
      if (mask & solids_[k]->groupbit) {
        const bool repels = scene_.settings.contact.on() && solids_[k]->body().free;
        particle.role = solid_roles[repels];
        if (own) scene_.solids[repels].body.push_back(int(k));
      }
    if (particle.role == SphRole::none) continue;
    std::vector<int> &atoms = atoms_[int(particle.role)];
    particle.number = int(atoms.size());
    atoms.push_back(i);
  }
  const auto place = [this](auto &particles, const std::vector<int> &atoms) {
    particles.position.resize(atoms.size());
    particles.velocity.resize(atoms.size());
    particles.density.resize(atoms.size());
    particles.pressure.resize(atoms.size());
    for (std::size_t k = 0; k < atoms.size(); ++k) particles.position[k] = vector(atom->x[atoms[k]]);
  };
  place(fluid, atoms_[0]);
  fluid.shift.resize(fluid.id.size());
  for (std::size_t s = 0; s < 2; ++s) place(scene_.solids[s], atoms_[1 + s]);
  try {
    neighbours_.build(scene_, support * scene_.settings.h() + neighbor->skin);
  } catch (const std::runtime_error &wrong) {
    error->one(FLERR, (std::string("Pair sph/coupled: ") + wrong.what()).c_str());
  }
  // The fluid of this rank has been sorted.
  std::copy(fluid.id.begin(), fluid.id.end(), atoms_[0].begin());
  for (std::size_t k = 0; k < fluid.id.size(); ++k) particle_[fluid.id[k]].number = int(k);
}

/// The scene as the atoms and bodies are.
void PairSphCoupled::load() {
  const auto take = [this](auto &particles, const std::vector<int> &atoms) {
    for (std::size_t k = 0; k < atoms.size(); ++k) {
      const int i = atoms[k];
      particles.position[k] = vector(atom->x[i]);
      particles.velocity[k] = vector(atom->v[i]);
      particles.density[k] = atom->rho[i];
      particles.pressure[k] = atom->p[i];
    }
  };
  take(scene_.fluid, atoms_[0]);
  for (std::size_t s = 0; s < 2; ++s) take(scene_.solids[s], atoms_[1 + s]);
  for (std::size_t k = 0; k < solids_.size(); ++k) scene_.bodies[k] = solids_[k]->body();
}

/// To atoms and bodies what the passes have computed; moved: densities, too.
void PairSphCoupled::store(bool moved) {
  const FluidParticles &fluid = scene_.fluid;
  const Solids &walls = scene_.solids[0];
  const bool extrapolated = scene_.settings.boundary == Boundary::extrapolated;
  double *const *const shifts = fluid_fix_->shifts();
  for (int k = 0; moved && k < fluid.with_images(); ++k) {
    const int i = atoms_[0][k];
    atom->rho[i] = fluid.density[k];
    atom->p[i] = fluid.pressure[k];
    if (k >= fluid.size()) continue;
    atom->drho[i] = fluid.rate[k];
    if (shifts) shifts[i][0] = fluid.shift[k].x, shifts[i][1] = fluid.shift[k].y, shifts[i][2] = fluid.shift[k].z;
  }
  for (int k = 0; k < walls.with_images(); ++k) {
    const int i = atoms_[1][k];
    atom->rho[i] = extrapolated ? walls.records[k].b : walls.density[k];
    atom->p[i] = walls.pressure[k];
  }
  const auto push = [this](const std::vector<Quad> &sum, int own, const std::vector<int> &atoms) {
    for (int k = 0; k < own; ++k) dembark_family::add(atom->f[atoms[k]], {sum[k].x, sum[k].y, sum[k].z}, scene_.settings.mass());
  };
  push(fluid.sum, fluid.size(), atoms_[0]);
  for (std::size_t s = 0; s < 2; ++s) push(scene_.solids[s].sum, scene_.solids[s].size(), atoms_[1 + s]);
  for (std::size_t k = 0; k < solids_.size(); ++k) {
    const Body &body = scene_.bodies[k];
    solids_[k]->add_force(body.force, body.torque);
    solids_[k]->add_load(body.film, body.film_torque);
  }
}

/// Of each atom.
int PairSphCoupled::numbers_to_ghosts() const { return walls_to_ghosts_ ? 4 : scene_.settings.corrects() ? 2 : 1; }

int PairSphCoupled::pack_comm(int n, int *atoms, double *to, int, int *) {
  const Solids &walls = scene_.solids[0];
  double *at = to;
  for (int a = 0; a < n; ++a) {
    const auto [role, k] = particle_[atoms[a]];
    const bool wall = role == SphRole::solid;
    if (walls_to_ghosts_) {
      const Vector met = wall ? walls.met[k] : Vector{};
      *at++ = wall ? walls.pressure[k] : 0.0;
      *at++ = met.x, *at++ = met.y, *at++ = met.z;
    } else {
      *at++ = role == SphRole::fluid ? scene_.fluid.density[k] : wall ? walls.density[k] : 0.0;
      if (scene_.settings.corrects()) *at++ = role == SphRole::fluid ? scene_.fluid.correction[k] : 1.0;
    }
  }
  return numbers_to_ghosts();
}

void PairSphCoupled::unpack_comm(int n, int first, double *from) {
  Solids &walls = scene_.solids[0];
  const int size = numbers_to_ghosts();
  for (int i = first; i < first + n; ++i, from += size) {
    const auto [role, k] = particle_[i];
    if (walls_to_ghosts_) {
      if (role != SphRole::solid) continue;
      walls.pressure[k] = from[0];
      walls.met[k] = vector(from + 1);
    } else if (role == SphRole::fluid) {
      scene_.fluid.density[k] = from[0];
      if (scene_.settings.corrects()) scene_.fluid.correction[k] = from[1];
    } else if (role == SphRole::solid) {
      walls.density[k] = from[0];
    }
  }
}

void PairSphCoupled::compute(int eflag, int vflag) {
  if (eflag || vflag) ev_setup(eflag, vflag);
  else evflag = vflag_fdotr = 0;
  // In the set-up begin() has sorted the particles.
  const bool moved = !update->setupflag;
  if (moved && neighbor->ago == 0) sort_particles();
  for (FixSphBody *solid : solids_) solid->begin_forces(scene_.settings.gravity);
  load();
  scene_.step = long(update->ntimestep);
  passes_->compute(scene_, moved ? update->dt : 0.0, Images{*this});
  store(moved);
  if (evflag && eflag_global) eng_vdwl = energies().compression;
}

Energies PairSphCoupled::energies() const {
  Energies e = scene_.lost;
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & fluid_fix_->groupbit) add_energies(scene_.settings, vector(atom->x[i]), vector(atom->v[i]), atom->rho[i], e);
  return e;
}
