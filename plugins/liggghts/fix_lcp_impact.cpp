#include "fix_lcp_impact.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <stdexcept>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include "fix_mesh_surface.h"
#include "multi_vector_container.h"

#include "mesh_triangles.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace dembark::impact;
using dembark::Triangle;
using Vec = dembark::Vec3<double>;

namespace {

Vec vec(const double *of) { return {of[0], of[1], of[2]}; }

void add(const Vec &v, double *to) {
  to[0] += v.x;
  to[1] += v.y;
  to[2] += v.z;
}

}  // namespace

FixLcpImpact::FixLcpImpact(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg), ranks_(world) {
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    refuse("atoms have no radius, mass, spin or torque of their own; use atom_style granular (or sphere)");
  if (!atom->tag_enable) refuse("atoms have no numbers; use atom_modify id yes");
  checked([&] {
    const std::vector<std::string> words(arg + std::min(3, narg), arg + narg);
    impacts_ = std::make_unique<Coupling>(read_command(words, atom->ntypes, "the ID of a fix mesh/surface"));
  });
  restart_global = 1;
  vector_flag = 1;
  size_vector = int(to_numbers(impacts_->report).size());
  extvector = 0;
  global_freq = 1;
  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = local_columns;
  local_freq = peratom_freq = 1;  // compute reduce divides by that of atoms for a local array too
  // One row, so that a dump of a run without any contact finds an array.
  memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
}

FixLcpImpact::~FixLcpImpact() { memory->destroy(array_local); }

int FixLcpImpact::setmask() { return POST_FORCE | POST_RUN; }

void FixLcpImpact::refuse(const std::string &line) { error->fix_error(FLERR, this, line.c_str()); }

/// Runs `work`; what it throws ends the run with its line.
void FixLcpImpact::checked(const std::function<void()> &work) {
  std::string wrong;
  try {
    return work();
  } catch (const std::exception &e) {
    wrong = e.what();
  }
  refuse(wrong);
}

/// Runs `work` on the rank that knows all bodies; its report is that of all. What goes wrong there ends the run with its line. Collective.
void FixLcpImpact::on_root(const std::function<void()> &work) {
  const std::string wrong = ranks_.run(work, impacts_->report);
  if (!wrong.empty()) refuse(wrong);
}

void FixLcpImpact::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0)
    refuse(std::string("run_style ") + update->integrate_style + " is not supported; use run_style verlet");
  if (domain->triclinic) refuse("a triclinic box is not supported; use an orthogonal one");
  check_order();
  find_meshes();
  reset_dt();
  on_root([this] { impacts_->open_file(); });
}

void FixLcpImpact::reset_dt() {
  checked([this] { impacts_->set_dt(update->dt, update->ntimestep); });
}

/// The contact forces have to know all others, so fixes that add forces come first.
void FixLcpImpact::check_order() {
  const char *const observers[] = {"lcp/impact", "enforce2d", "store/force", "store/state", "property/",
                                   "ave/",       "print",     "mesh/",       "move/mesh"};
  for (int i = modify->find_fix(id) + 1; i < modify->nfix; ++i) {
    if (!(modify->fmask[i] & POST_FORCE)) continue;
    const std::string style = modify->fix[i]->style;
    const auto is = [&](const char *known) { return style.compare(0, std::strlen(known), known) == 0; };
    if (std::any_of(std::begin(observers), std::end(observers), is)) continue;
    refuse("fix " + std::string(modify->fix[i]->id) + " (" + style +
           ") may add forces after the contact forces are known; define it before this fix");
  }
}

PeriodicBox FixLcpImpact::box() const {
  PeriodicBox box;
  box.low = vec(domain->boxlo);
  box.length = vec(domain->prd);
  for (int k = 0; k < 3; ++k) box.periodic[k] = domain->periodicity[k] && (k < 2 || domain->dimension == 3);
  box.beyond = neighbor->skin;  // by what atoms move between two neighbour lists
  return box;
}

void FixLcpImpact::find_meshes() {
  mesh_fix_.clear();
  mesh_.resize(impacts_->command.meshes.size());
  for (std::size_t k = 0; k < impacts_->command.meshes.size(); ++k) {
    const int found = modify->find_fix(impacts_->command.meshes[k].c_str());
    mesh_fix_.push_back(found < 0 ? nullptr : dynamic_cast<FixMeshSurface *>(modify->fix[found]));
    if (!mesh_fix_[k])
      refuse("wall " + impacts_->command.walls[std::size_t(wall_number(impacts_->command.around.meshes[k].id))] +
             ": there is no fix mesh/surface with the ID " + impacts_->command.meshes[k] + "; define it before the run");
  }
}

/// Sends the meshes that may have moved to the first rank. dt (s): time since the last call, or 0 if there is none. Collective.
void FixLcpImpact::gather_meshes(double dt) {
  for (std::size_t k = 0; k < mesh_.size(); ++k) {
    TriMesh &mesh = *mesh_fix_[k]->triMesh();
    mesh_[k].clear();
    if (!mesh.isMoving() && dt > 0.0) continue;  // it stands, and its surface velocity is constant during a run
    const auto *velocity = mesh.prop().getElementProperty<MultiVectorContainer<double, 3, 3>>("v");
    std::vector<Triangle> own;
    for (int i = 0; i < mesh.sizeLocal(); ++i) {
      Triangle &triangle = own.emplace_back(dembark_liggghts::triangle_of(mesh, i));
      for (int c = 0; velocity && c < 3; ++c) triangle.velocity[c] = vec((*velocity)(i)[c]);
    }
    ranks_.gather(own, mesh_[k]);
  }
}

/// The corners of a moving mesh get the velocity with which they came, that of the half step as the bodies have it; those of a mesh that
/// stands and has a surface velocity (a conveyor), and of all with dt = 0, the mesh's own. On the first rank.
void FixLcpImpact::take_meshes(double dt) {
  for (std::size_t k = 0; k < mesh_.size(); ++k) {
    std::vector<Triangle> &now = mesh_[k];
    if (now.empty()) continue;
    std::sort(now.begin(), now.end(), [](const Triangle &a, const Triangle &b) { return a.id < b.id; });
    const bool moving = mesh_fix_[k]->triMesh()->isMoving();
    Mesh &mesh = impacts_->command.around.meshes[k];
    const std::vector<Triangle> &before = mesh.surface.triangles();
    for (std::size_t i = 0; moving && dt > 0.0 && now.size() == before.size() && i < now.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        // The engine takes a triangle that leaves a periodic box to the other end.
        const Vec way = now[i].node[c] - before[i].node[c];
        double nearest[3] = {way.x, way.y, way.z};
        domain->minimum_image(nearest);
        now[i].velocity[c] = vec(nearest) * (1.0 / dt);
      }
    mesh.update(std::move(now));
    // At the very first set-up nothing has moved yet, and the engine does not tell what will.
    mesh.velocity_known = !moving || dt > 0.0 || mesh.speed > 0.0;
  }
}

/// Sends the own atoms to the first rank. Collective.
void FixLcpImpact::gather_atoms() {
  own_atom_.clear();
  own_body_.clear();
  const Command &command = impacts_->command;
  const double turn = torque_scale();
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    own_atom_.push_back(i);
    const double mass = atom->rmass[i], radius = atom->radius[i];
    own_body_.push_back({atom->tag[i], mass, command.inertia(mass, radius), radius, atom->type[i] - 1, vec(atom->x[i]), vec(atom->v[i]),
                         vec(atom->omega[i]), vec(atom->f[i]), turn * vec(atom->torque[i])});
  }
  ranks_.gather(own_body_, all_body_);
}

/// The engine turns a torque into spin with its own inertia, that of spheres and in two dimensions that of cylinders.
double FixLcpImpact::torque_scale() const { return impacts_->command.torque_scale(domain->dimension == 2 ? 0.5 : 0.4); }

/// Hands the forces of the first rank out to the atoms. Collective.
void FixLcpImpact::apply() {
  if (ranks_.is_here()) impacts_->hand_out(all_push_);
  own_push_.resize(own_atom_.size());
  ranks_.scatter(all_push_, own_push_);
  const double turn = 1.0 / torque_scale();
  for (std::size_t k = 0; k < own_atom_.size(); ++k) {
    add(own_push_[k].force, atom->f[own_atom_[k]]);
    add(turn * own_push_[k].torque, atom->torque[own_atom_[k]]);
  }
}

/// All ranks' atoms and meshes to the first; dt as for gather_meshes(). Then `work` there, and its forces to the atoms. Collective.
void FixLcpImpact::do_step(double dt, const std::function<void()> &work) {
  gather_meshes(dt);
  gather_atoms();  // the last to be gathered: apply() goes the way back
  on_root([&] {
    take_meshes(dt);
    impacts_->take(all_body_, box());
    work();
  });
  apply();
}

void FixLcpImpact::setup(int) {
  do_step(0.0, [this] { impacts_->set_up(update->ntimestep); });
  fill_local();
}

void FixLcpImpact::post_force(int) {
  do_step(update->dt, [this] { impacts_->step(update->ntimestep); });
  if (local_is_read()) fill_local();
}

void FixLcpImpact::post_run() {
  keep_end_of_step();
  fill_local();
}

/// Collective.
void FixLcpImpact::keep_end_of_step() {
  gather_atoms();
  on_root([this] { impacts_->end_step(all_body_); });
}
