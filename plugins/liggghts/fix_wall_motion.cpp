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
constexpr int load_numbers = 6, all_numbers = dembark_family::MovingWall::all_numbers + load_numbers;

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
  checked([&] { wall_ = std::make_unique<dembark_family::MovingWall>(std::vector<std::string>(arg + 5, arg + narg)); });
  restart_global = time_depend = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = all_numbers;
  extvector = 0;
}

void FixWallMotion::post_create() { mesh_->registerMove(false, true, wall_->motion().turns()); }

void FixWallMotion::pre_delete(bool unfixed) {
  if (!unfixed || !modify->find_fix_id(mesh_id_.c_str())) return;
  mesh_->unregisterMove(false, true, wall_->motion().turns());
  if (NodeVectors *const v = velocities(*mesh_)) v->setAll(0.0);
}

// The engine calls the set-up of a stage for the fixes of that stage only.
int FixWallMotion::setmask() { return INITIAL_INTEGRATE | PRE_FORCE | END_OF_STEP; }

void FixWallMotion::init() {
  only_verlet();
  checked([&] { wall_->begin(*update); });
  if (static_cast<TriMesh *>(mesh_)->nMove() > 1)
    fail("mesh '" + mesh_id_ + "' is moved by another fix, too; give all terms of a motion to one fix");
  check_turn();
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
    if (!domain->periodicity[k] || !wall_->motion().turns_out_of(k)) continue;
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
  auto *const mesh = static_cast<TriMesh *>(mesh_);
  std::vector<Vec3<double>> middles;
  for (int i = 0; i < mesh->sizeLocal(); ++i) {
    double centre[3];
    mesh->center(i, centre);
    middles.push_back(dembark_family::vector(centre));
  }
  if (const std::string gone = wall_->outside(middles, wall_->state(), *update, *domain, world); !gone.empty())
    fail("the motion takes mesh '" + mesh_id_ + "' " + gone + "; make the motion smaller or the box larger");
}

/// The corners have the velocity of the step that led here.
void FixWallMotion::set_velocities() {
  auto *const mesh = static_cast<TriMesh *>(mesh_);
  double ***const v = velocities(*mesh_)->begin();
  for (int i = 0; i < mesh->sizeLocal() + mesh->sizeGhost(); ++i)
    for (int k = 0; k < 3; ++k) {
      double node[3];
      mesh->node(i, k, node);
      const Vec3<double> u = wall_->velocity_at(dembark_family::vector(node));
      v[i][k][0] = u.x;
      v[i][k][1] = u.y;
      v[i][k][2] = u.z;
    }
}

/// The forces of a set-up see the velocity of the half step before it, too.
void FixWallMotion::setup_pre_force(int) {
  if (!velocities(*mesh_)) mesh_->prop().addElementProperty<NodeVectors>("v", "comm_exchange_borders", "frame_invariant", "restart_no");
  const double now = wall_->time(update->ntimestep, update->dt);
  wall_->arrive(now - update->dt, now, update->dt);
  set_velocities();
  load_ = {};
}

void FixWallMotion::setup(int) { wall_->begin_sums(total_load()); }

void FixWallMotion::initial_integrate(int) {
  const double dt = update->dt, from = wall_->time(update->ntimestep - 1, dt), to = wall_->time(update->ntimestep, dt);
  const dembark::WallState before = wall_->state();
  const Vec3<double> centre = wall_->centre();
  wall_->arrive(from, to, dt);
  const dembark::WallState &now = wall_->state();
  if (wall_->motion().turns()) {
    const Vec3<double> &axis = wall_->motion().axis();
    const double about[] = {axis.x, axis.y, axis.z}, through[] = {centre.x, centre.y, centre.z};
    if (now.angle != before.angle) mesh_->rotate(now.angle - before.angle, about, through);
  }
  const Vec3<double> by = now.displacement - before.displacement;
  const double shift[] = {by.x, by.y, by.z};
  mesh_->move(shift);
  set_velocities();
}

void FixWallMotion::pre_force(int) { load_ = {}; }

void FixWallMotion::add_load(const double *centre, const Vec3<double> &force, const Vec3<double> &torque) {
  load_.add(dembark_family::vector(centre) - wall_->centre(), force, torque);
}

/// Of all ranks. Collective.
dembark::WallLoad FixWallMotion::total_load() {
  dembark::WallLoad all;
  static_assert(sizeof all == load_numbers * sizeof(double), "numbers only");
  MPI_Allreduce(&load_, &all, load_numbers, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

void FixWallMotion::end_of_step() { wall_->end_step(total_load(), update->dt); }

/// Collective.
double FixWallMotion::compute_vector(int n) {
  const int of_load = n - dembark_family::MovingWall::state_numbers;
  if (of_load < 0) return wall_->number(n);
  if (!knows_load_)
    fail(
        "what the wall does to the grains is known in liggghts-dembark only, with 'tangential finnie_rabinowicz' or 'cohesion capillary' "
        "in its fix wall/gran");
  if (of_load > load_numbers) return wall_->number(n - load_numbers);
  // The sums may be of a restart file, and the load that of a set-up.
  const dembark::WallLoad load = total_load();
  const double now[] = {load.force.x, load.force.y, load.force.z, load.torque.x, load.torque.y, load.torque.z, wall_->power(load)};
  return now[of_load];
}

void FixWallMotion::write_restart(FILE *file) {
  if (comm->me == 0) write_part(file, wall_->pieces());
}

void FixWallMotion::restart(char *buffer) {
  checked([&] {
    dembark_family::SavedPart saved(buffer);
    wall_->restore(saved);
    saved.end();
  });
}

FixWallMotion *dembark_liggghts::find_wall_motion(Modify *modify, const AbstractMesh *mesh) {
  for (int k = 0; k < modify->nfix; ++k)
    if (auto *const fix = dynamic_cast<FixWallMotion *>(modify->fix[k]); fix && fix->mesh() == mesh) return fix;
  return nullptr;
}
