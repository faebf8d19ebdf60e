#include "fix_sph_body.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_gravity.h"
#include "fix_property_atom.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include "pair_sph_coupled.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace dembark::sph;
using dembark::keywords::Reader;
using dembark_family::vector;

Vector LAMMPS_NS::read_vector(Reader &in, const std::string &of, const std::string &what) {
  const double x = in.number(of, what), y = in.number(of, what), z = in.number(of, what);
  return {x, y, z};
}

namespace {

/// Global vector: position, velocity, spin, orientation; force and torque of the fluid, of anything else but gravity; work.
constexpr int all_numbers = 26;

double read_inertia(Reader &in, const std::string &of) {
  if (!in.next_is("inf")) return in.positive(of, "a moment (kg m^2, or inf)");
  in.word(of, "");
  return std::numeric_limits<double>::infinity();
}

Body read_body(const std::vector<std::string> &words, bool free, int dimension) {
  Reader in(words);
  Body body;
  body.free = free;
  const double none = std::numeric_limits<double>::infinity();
  bool placed = false, turns = false;
  while (in.left()) {
    const std::string of = in.word(free ? "sph/body" : "sph/wall", "a keyword");
    if (of == "centre") {
      body.position = read_vector(in, of, "x, y and z (m)");
      placed = true;
    } else if (of == "velocity") {
      body.velocity = read_vector(in, of, "x, y and z (m/s)");
    } else if (of == "spin") {
      body.spin = read_vector(in, of, "x, y and z (rad/s)");
      turns = true;
    } else if (free && of == "mass") {
      body.mass = in.positive(of, dimension == 2 ? "the mass (kg for a metre of depth)" : "the mass (kg)");
    } else if (free && of == "inertia") {
      const double first = read_inertia(in, of);
      if (dimension == 2) {
        body.inertia = {none, none, first};
      } else {
        const double second = read_inertia(in, of);
        body.inertia = {first, second, read_inertia(in, of)};
      }
    } else {
      dembark::keywords::refuse("'" + of + "' is no keyword; known are " + (free ? "mass, inertia, " : "") + "centre, velocity and spin");
    }
  }
  if (dimension == 2 && (body.velocity.z != 0.0 || body.spin.x != 0.0 || body.spin.y != 0.0))
    dembark::keywords::refuse("in the plane bodies move along x and y and turn about z");
  if (free && !(body.mass > 0.0)) dembark::keywords::refuse("mass is missing");
  if (free && !(body.inertia.z > 0.0))
    dembark::keywords::refuse(dimension == 2 ? "inertia is missing: that about z"
                                             : "inertia is missing: about x, y and z, the principal axes");
  if (!placed && (free || turns)) dembark::keywords::refuse("centre is missing: the point about which it turns");
  return body;
}

}  // namespace

FixSphBody::FixSphBody(LAMMPS *lmp, int narg, char **arg) : SharedFix(lmp, narg, arg) {
  const bool free = std::strcmp(arg[2], "sph/body") == 0;
  if (!PairSphCoupled::find(force)) fail(PairSphCoupled::missing);
  state_.body = checked([&] { return read_body(std::vector<std::string>(arg + 3, arg + narg), free, domain->dimension); });
  restart_global = 1;
  vector_flag = 1;
  size_vector = all_numbers;
  global_freq = 1;
  extvector = 0;
}

/// Where the particles are in the body is part of restart files: there they may be anywhere.
void FixSphBody::post_create() {
  // Without defaults, which the first set-up would put in their place.
  const std::string name = "sph_arm_" + std::string(id);
  const char *words[] = {name.c_str(), "all", "property/atom", name.c_str(), "vector", "yes", "no", "no", "none", "none", "none"};
  arms_ = modify->add_fix_property_atom(11, const_cast<char **>(words), style);
  if (restarted_) return;
  for (int i = 0; i < atom->nlocal; ++i) {
    const Vector arm = atom->mask[i] & groupbit ? vector(atom->x[i]) - state_.body.position : Vector{};
    arms_->array_atom[i][0] = arm.x, arms_->array_atom[i][1] = arm.y, arms_->array_atom[i][2] = arm.z;
  }
}

void FixSphBody::pre_delete(bool unfixed) {
  if (unfixed && arms_) modify->delete_fix(arms_->id);
}

int FixSphBody::setmask() { return INITIAL_INTEGRATE | PRE_FORCE | FINAL_INTEGRATE; }

void FixSphBody::init() {
  if (!PairSphCoupled::find(force)) fail(PairSphCoupled::missing);
  double count = 0.0, all = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) count += (atom->mask[i] & groupbit) != 0;
  MPI_Allreduce(&count, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  if (all == 0.0) fail("its group has no atoms: a body is made of particles");
  place_particles();
  for (const Fix *const fix : fixes())
    if (is(*fix, "move") && meets(*fix))
      fail(std::string("fix ") + fix->id + " (move) moves its particles; " +
           (state_.body.free ? "a body moves by its forces, a wall by velocity and spin of fix sph/wall"
                             : "give this fix the motion by velocity, spin and centre"));
  // Then a wall must be put back in each step.
  moved_by_others_ = false;
  for (const Fix *const fix : fixes())
    if (fix->time_integrate && !dynamic_cast<const FixSphBody *>(fix)) moved_by_others_ = meets(*fix) || moved_by_others_;
}

/// A state of a restart file has its forces.
void FixSphBody::setup_pre_force(int) {
  fresh_ = !restarted_;
  restarted_ = false;
}

void FixSphBody::begin_forces(const Vector &gravity) {
  gravity_ = gravity;
  force_ = torque_ = load_ = load_torque_ = {};
}

void FixSphBody::add_force(const Vector &force, const Vector &torque) {
  force_ += force;
  torque_ += torque;
}

void FixSphBody::add_load(const Vector &force, const Vector &torque) {
  load_ += force;
  load_torque_ += torque;
}

/// Forces on the body from those on its particles, whoever has added them. Fix gravity adds the weight of particles, which is not the
/// body's. Collective.
void FixSphBody::gather_forces() {
  Body &body = state_.body;
  int weighed = 0;
  for (int k = 0; k < modify->nfix; ++k)
    if (dynamic_cast<FixGravity *>(modify->fix[k])) weighed |= modify->fix[k]->groupbit;
  Vector mine[4] = {force_, torque_, {}, {}}, sums[4];
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    Vector f = vector(atom->f[i]);
    if (atom->mask[i] & weighed) f -= (atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]) * gravity_;
    mine[2] += f;
    mine[3] += cross(vector(atom->x[i]) - body.position, f);
    if (atom->torque_flag) mine[3] += vector(atom->torque[i]);
  }
  static_assert(sizeof sums == 12 * sizeof(double), "numbers only");
  // All ranks must have the same bits, which MPI does not promise of MPI_Allreduce.
  MPI_Reduce(mine, sums, 12, MPI_DOUBLE, MPI_SUM, 0, world);
  MPI_Bcast(sums, 12, MPI_DOUBLE, 0, world);
  body.force = sums[0];
  body.torque = sums[1];
  body.load = sums[2] - sums[0] + load_;
  body.load_torque = sums[3] - sums[1] + load_torque_;
  body.accelerate(gravity_);
}

void FixSphBody::initial_integrate(int) {
  Body &body = state_.body;
  // Fixes may add forces in the set-up after this one.
  if (fresh_) gather_forces();
  fresh_ = false;
  state_.work += 0.5 * update->dt * body.first_half(update->dt);
  // A wall at rest stays where it is.
  const bool still = !moved_by_others_ && !body.free && norm(body.velocity) == 0.0 && norm(body.spin) == 0.0;
  if (!still) place_particles();
}

void FixSphBody::final_integrate() {
  gather_forces();
  state_.work += 0.5 * update->dt * state_.body.second_half(update->dt);
}

void FixSphBody::place_particles() {
  const Body &body = state_.body;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    const Vector arm = body.orientation(vector(arms_->array_atom[i])), x = body.position + arm, v = body.velocity_at(arm);
    const double place[] = {x.x, x.y, x.z}, speed[] = {v.x, v.y, v.z}, spin[] = {body.spin.x, body.spin.y, body.spin.z};
    for (int k = 0; k < 3; ++k) {
      if (domain->periodicity[k] && !(place[k] >= domain->boxlo[k] && place[k] <= domain->boxhi[k]))
        fail_alone(std::string("it crosses the periodic boundary along ") + "xyz"[k] + ", which bodies and walls cannot");
      atom->x[i][k] = place[k];
      atom->v[i][k] = speed[k];
      if (atom->omega_flag) atom->omega[i][k] = spin[k];
    }
  }
}

double FixSphBody::compute_vector(int n) {
  const Body &b = state_.body;
  const double all[all_numbers] = {b.position.x,    b.position.y, b.position.z, b.velocity.x,    b.velocity.y,    b.velocity.z,
                                   b.spin.x,        b.spin.y,     b.spin.z,     b.orientation.w, b.orientation.x, b.orientation.y,
                                   b.orientation.z, b.force.x,    b.force.y,    b.force.z,       b.torque.x,      b.torque.y,
                                   b.torque.z,      b.load.x,     b.load.y,     b.load.z,        b.load_torque.x, b.load_torque.y,
                                   b.load_torque.z, state_.work};
  return all[n];
}

void FixSphBody::write_restart(FILE *file) {
  if (comm->me == 0) write_part(file, {{&state_, sizeof state_}});
}

void FixSphBody::restart(char *buffer) {
  const Body given = state_.body;
  checked([&] {
    dembark_family::SavedPart part(buffer);
    part.read(&state_);
    part.end();
  });
  // Properties are those of the script, and the motion of a wall is one; place and turn go on, and the motion of what is free.
  state_.body.mass = given.mass;
  state_.body.inertia = given.inertia;
  if (!given.free) {
    if (norm(given.spin) > 0.0 && norm(state_.body.spin) == 0.0)
      fail(
          "it turns, and did not when the restart file was written, which has no centre for it; give the fix another ID, with which it "
          "begins anew");
    state_.body.velocity = given.velocity;
    state_.body.spin = given.spin;
  }
  restarted_ = true;
}
