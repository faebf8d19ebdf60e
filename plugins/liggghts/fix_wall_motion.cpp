#include "fix_wall_motion.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "comm.h"
#include "domain.h"
#include "fix_mesh_surface.h"
#include "fix_wall_gran.h"
#include "tri_mesh.h"
#include "update.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::Vec3;

namespace {

typedef MultiVectorContainer<double, 3, 3> NodeVectors;

/// Global vector: displacement, angle, velocity, rate, acceleration, angular acceleration; force, torque, power, work, impulse.
constexpr int motion_numbers = 12, all_numbers = 23;

NodeVectors *velocities(AbstractMesh &mesh) { return mesh.prop().getElementProperty<NodeVectors>("v"); }

}  // namespace

FixWallMotion::FixWallMotion(LAMMPS *lmp, int narg, char **arg) : SharedFix(lmp, narg, arg) {
  if (narg < 6 || std::strcmp(arg[3], "mesh") != 0) fail("it must have the form fix ID group wall/motion mesh ID MOTION ...");
  mesh_id_ = arg[4];
  auto *const fix = dynamic_cast<FixMeshSurface *>(modify->find_fix_id(arg[4]));
  if (!fix) fail("there is no fix mesh/surface '" + mesh_id_ + "'");
  mesh_ = fix->mesh();
  if (mesh_->isMoving()) fail("mesh '" + mesh_id_ + "' is moved by another fix already; give all terms of a motion to one fix");
  if (fix->surfaceVel()) fail("mesh '" + mesh_id_ + "' has a surface velocity, and cannot be moved too");
  for (int k = 5; k < narg; ++k) words_ += (k > 5 ? " " : "") + std::string(arg[k]);
  motion_ = checked([&] { return dembark::PrescribedMotion(words_); });
  restart_global = time_depend = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = all_numbers;
  extvector = 0;
}

void FixWallMotion::post_create() { mesh_->registerMove(false, true, motion_.turns()); }

void FixWallMotion::pre_delete(bool unfixed) {
  if (!unfixed || !modify->find_fix_id(mesh_id_.c_str())) return;
  mesh_->unregisterMove(false, true, motion_.turns());
  if (NodeVectors *const v = velocities(*mesh_)) v->setAll(0.0);
}

// The engine calls the set-up of a stage for the fixes of that stage only.
int FixWallMotion::setmask() { return INITIAL_INTEGRATE | PRE_FORCE | END_OF_STEP; }

void FixWallMotion::init() {
  only_verlet();
  const std::string wrong = motion_.step_error(update->dt);
  if (!wrong.empty()) fail(wrong);
  // Displacements are from where the mesh stands when the motion is run first; a restart file has the time of that.
  clock_.begin(update->atime, long(update->atimestep), long(update->ntimestep), update->dt);
  checked([&] { motion_.begin(clock_.begun); });
  if (static_cast<TriMesh *>(mesh_)->nMove() > 1)
    fail("mesh '" + mesh_id_ + "' is moved by another fix, too; give all terms of a motion to one fix");
  check_turn();
  state_ = motion_.at(clock_.time(update->ntimestep, update->dt));
  check_reach();
  knows_load_ = walls_tell_loads;
  for (Fix *const each : fixes()) {
    auto *const wall = dynamic_cast<FixWallGran *>(each);
    if (!wall || !wall->is_mesh_wall()) continue;
    for (int m = 0; m < wall->n_meshes(); ++m)
      if (wall->mesh_list()[m]->mesh() == mesh_ && !wall->contact_match("tangential", "finnie_rabinowicz") &&
          !wall->contact_match("cohesion", "capillary"))
        knows_load_ = false;
  }
}

/// A mesh that goes on across a periodic border cannot turn about an axis across it. Collective.
void FixWallMotion::check_turn() {
  auto *const mesh = static_cast<TriMesh *>(mesh_);
  for (int k = 0; k < 3; ++k) {
    if (!domain->periodicity[k] || !motion_.turns_out_of(k)) continue;
    int there = 0, any = 0;
    const double room = 1e-6 * domain->prd[k];
    for (int i = 0; i < mesh->sizeLocal(); ++i)
      for (int corner = 0; corner < 3; ++corner) {
        double node[3];
        mesh->node(i, corner, node);
        there |= node[k] < domain->boxlo[k] + room || node[k] > domain->boxhi[k] - room;
      }
    MPI_Allreduce(&there, &any, 1, MPI_INT, MPI_MAX, world);
    if (any)
      fail(std::string("the motion turns mesh '") + mesh_id_ + "' out of the periodic direction " + "xyz"[k] +
           ", in which it reaches the border; only the direction along the axis may be periodic there");
  }
}

/// Centres of triangles must stay in the box, where it is not periodic: the engine loses others in the middle of the run.
void FixWallMotion::check_reach() {
  double low[3] = {0.0, 0.0, 0.0}, high[3] = {0.0, 0.0, 0.0};
  for (int k = 0; k < 3; ++k) {
    low[k] = 1e300;
    high[k] = -1e300;
  }
  auto *const mesh = static_cast<TriMesh *>(mesh_);
  for (int i = 0; i < mesh->sizeLocal(); ++i) {
    double centre[3];
    mesh->center(i, centre);
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centre[k]);
      high[k] = std::max(high[k], centre[k]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, low, 3, MPI_DOUBLE, MPI_MIN, world);
  MPI_Allreduce(MPI_IN_PLACE, high, 3, MPI_DOUBLE, MPI_MAX, world);
  const double now = clock_.time(update->ntimestep, update->dt);
  Vec3<double> back, forth;
  motion_.reach(now, now + double(update->laststep - update->ntimestep) * update->dt, back, forth);
  back -= state_.displacement;
  forth -= state_.displacement;
  const double from[3] = {back.x, back.y, back.z}, to[3] = {forth.x, forth.y, forth.z};
  for (int k = 0; k < 3; ++k)
    if (!domain->periodicity[k] && domain->boundary[k][0] != 2 && domain->boundary[k][0] != 3 &&
        (low[k] + from[k] < domain->boxlo[k] || high[k] + to[k] > domain->boxhi[k]))
      fail(std::string("the motion takes mesh '") + mesh_id_ + "' out of the box along " + "xyz"[k] + ", from " +
           dembark::motion::text(low[k] + from[k]) + " to " + dembark::motion::text(high[k] + to[k]) + " m beside " +
           dembark::motion::text(domain->boxlo[k]) + " ... " + dembark::motion::text(domain->boxhi[k]) +
           " m: make the amplitude smaller or the box larger");
}

void FixWallMotion::set_velocities(const dembark::WallStep &step) {
  auto *const mesh = static_cast<TriMesh *>(mesh_);
  double ***const v = velocities(*mesh_)->begin();
  const Vec3<double> spin = step.rate * motion_.axis(), centre = motion_.centre(state_);
  for (int i = 0; i < mesh->sizeLocal() + mesh->sizeGhost(); ++i)
    for (int k = 0; k < 3; ++k) {
      double node[3];
      mesh->node(i, k, node);
      const Vec3<double> u = step.velocity + cross(spin, Vec3<double>{node[0], node[1], node[2]} - centre);
      v[i][k][0] = u.x;
      v[i][k][1] = u.y;
      v[i][k][2] = u.z;
    }
}

/// Takes up where the wall is at the time t (s), when it is there.
void FixWallMotion::arrive(double t) {
  state_ = motion_.at(t);
  acceleration_ = dembark::wall_acceleration(motion_, t, update->dt);
}

/// The forces of a set-up see the velocity of the half step before it, too.
void FixWallMotion::setup_pre_force(int) {
  if (!velocities(*mesh_)) mesh_->prop().addElementProperty<NodeVectors>("v", "comm_exchange_borders", "frame_invariant", "restart_no");
  const double now = clock_.time(update->ntimestep, update->dt);
  arrive(now);
  set_velocities(motion_.step(now - update->dt, update->dt));
  load_ = {};
}

void FixWallMotion::setup(int) {
  if (!resumed_) {
    const dembark::WallLoad load = whole_load();
    sums_.begin(wall_power(load, state_, motion_.axis()), load.force);
  }
  resumed_ = false;
}

void FixWallMotion::initial_integrate(int) {
  const double dt = update->dt, from = clock_.time(update->ntimestep - 1, dt), to = clock_.time(update->ntimestep, dt);
  const dembark::WallState before = state_;
  arrive(to);
  if (motion_.turns()) {
    const Vec3<double> axis = motion_.axis(), centre = motion_.centre(before);
    const double about[] = {axis.x, axis.y, axis.z}, through[] = {centre.x, centre.y, centre.z};
    if (state_.angle != before.angle) mesh_->rotate(state_.angle - before.angle, about, through);
  }
  const Vec3<double> by = state_.displacement - before.displacement;
  const double shift[] = {by.x, by.y, by.z};
  mesh_->move(shift);
  set_velocities(motion_.step(from, dt));
}

void FixWallMotion::pre_force(int) { load_ = {}; }

void FixWallMotion::add_load(const double *centre, const Vec3<double> &force, const Vec3<double> &torque) {
  load_.add(Vec3<double>{centre[0], centre[1], centre[2]} - motion_.centre(state_), force, torque);
}

/// Collective.
dembark::WallLoad FixWallMotion::whole_load() {
  dembark::WallLoad all;
  static_assert(sizeof all == 6 * sizeof(double), "numbers only");
  MPI_Allreduce(&load_, &all, 6, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

void FixWallMotion::end_of_step() {
  const dembark::WallLoad load = whole_load();
  sums_.step(update->dt, wall_power(load, state_, motion_.axis()), load.force);
}

/// Collective.
double FixWallMotion::compute_vector(int n) {
  if (n >= motion_numbers && !knows_load_)
    fail(
        "what the wall does to the grains is known in liggghts-dembark only, with 'tangential finnie_rabinowicz' or 'cohesion capillary' "
        "in its fix wall/gran");
  const dembark::WallLoad load = n >= motion_numbers ? whole_load() : dembark::WallLoad{};
  const auto &s = state_;
  const double all[all_numbers] = {s.displacement.x,
                                   s.displacement.y,
                                   s.displacement.z,
                                   s.angle,
                                   s.velocity.x,
                                   s.velocity.y,
                                   s.velocity.z,
                                   s.rate,
                                   s.acceleration.x,
                                   s.acceleration.y,
                                   s.acceleration.z,
                                   s.angular_acceleration,
                                   load.force.x,
                                   load.force.y,
                                   load.force.z,
                                   load.torque.x,
                                   load.torque.y,
                                   load.torque.z,
                                   wall_power(load, s, motion_.axis()),
                                   sums_.work,
                                   sums_.impulse.x,
                                   sums_.impulse.y,
                                   sums_.impulse.z};
  return all[n];
}

void FixWallMotion::write_restart(FILE *file) {
  if (comm->me == 0) write_part(file, {{&clock_, sizeof clock_}, {&sums_, sizeof sums_}, {words_.c_str(), words_.size() + 1}});
}

void FixWallMotion::restart(char *buffer) {
  std::memcpy(static_cast<void *>(&clock_), buffer, sizeof clock_);
  std::memcpy(static_cast<void *>(&sums_), buffer + sizeof clock_, sizeof sums_);
  if (const std::string before = buffer + sizeof clock_ + sizeof sums_; before != words_)
    fail("in the restart file its motion is '" + before +
         "'; take that, or give the fix another ID: a motion that is new begins where the "
         "mesh stands");
  resumed_ = true;
}

FixWallMotion *dembark_liggghts::find_wall_motion(Modify *modify, const AbstractMesh *mesh) {
  for (int k = 0; k < modify->nfix; ++k)
    if (auto *const fix = dynamic_cast<FixWallMotion *>(modify->fix[k]); fix && fix->mesh() == mesh) return fix;
  return nullptr;
}
