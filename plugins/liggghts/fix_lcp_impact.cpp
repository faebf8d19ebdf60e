#include "fix_lcp_impact.h"

#include <algorithm>
#include <cmath>
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

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::impact::Archive;
using dembark::impact::Body;
using dembark::impact::Contact;
using dembark_liggghts::ImpactWall;

namespace {

// A body on its way to the first rank: tag, type, mass, radius, position, velocity, spin, force, torque; and back: force, torque.
constexpr int sent = 19, returned = 6;

std::vector<std::string> words(int narg, char **arg) { return std::vector<std::string>(arg + std::min(3, narg), arg + narg); }

}  // namespace

FixLcpImpact::FixLcpImpact(LAMMPS *lmp, int narg, char **arg)
    : Fix(lmp, narg, arg),
      me_(comm->me),
      file_kept_(-1),
      kept_(false),
      last_step_(-1),
      last_dt_(0.0),
      clock_time_(0.0),
      clock_step_(0),
      local_capacity_(1) {
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    refuse("atoms have no radius, mass, spin or torque of their own; use atom_style granular (or sphere)");
  if (!atom->tag_enable) refuse("atoms have no numbers; use atom_modify id yes");
  try {
    options_ = dembark_liggghts::read_impact_options(words(narg, arg), atom->ntypes);
    system_.reset(new dembark::impact::System(options_.settings));
  } catch (const std::invalid_argument &e) {
    refuse(e.what());
  }
  mesh_.resize(options_.walls.size());

  restart_global = 1;
  vector_flag = 1;
  size_vector = dembark::impact::StepReport::size;
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

/// Runs `work` on the rank that knows all bodies. What goes wrong there ends the run on all of them with one line, and its report is that
/// of all. Collective.
void FixLcpImpact::on_root(const std::function<void()> &work) {
  std::string wrong;
  try {
    if (me_ == 0) work();
  } catch (const std::exception &e) {
    wrong = e.what();
    if (comm->nprocs == 1) refuse(wrong);
  }
  if (comm->nprocs == 1) return;
  Archive out;
  std::size_t length = wrong.size();
  out(length), out(report_);
  std::vector<double> shared = out.numbers();
  MPI_Bcast(shared.data(), int(shared.size()), MPI_DOUBLE, 0, world);
  Archive in(shared);
  in(length), in(report_);
  if (length == 0) return;
  wrong.resize(length);
  MPI_Bcast(&wrong[0], int(length), MPI_CHAR, 0, world);
  refuse(wrong);
}

void FixLcpImpact::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0)
    refuse(std::string("run_style ") + update->integrate_style + " is not supported; use run_style verlet");
  if (domain->triclinic) refuse("a triclinic box is not supported; use an orthogonal one");
  check_order();
  find_meshes();
  take_time_step();
  on_root([this] {
    const std::string &path = options_.impacts_file;
    if (path.empty() || !file_.path().empty()) return;
    std::string about;
    for (std::size_t w = 0; w < options_.walls.size(); ++w)
      about += (w ? ", " : "") + std::to_string(-1 - static_cast<long>(w)) + " = " + options_.walls[w].name;
    try {
      if (file_kept_ < 0) file_.begin(path, about.empty() ? "there is none" : about);
      else file_.resume(path, file_kept_);
    } catch (const std::runtime_error &e) {
      throw std::runtime_error(std::string("impacts: ") + e.what());
    }
  });
}

void FixLcpImpact::reset_dt() { take_time_step(); }

void FixLcpImpact::take_time_step() {
  try {
    system_->set_dt(update->dt);
  } catch (const std::invalid_argument &e) {
    refuse(e.what());
  }
  if (last_dt_ > 0.0 && last_dt_ != update->dt) {
    last_step_ = -1;  // the forces of another time step are not those of this one
    clock_time_ += double(update->ntimestep - clock_step_) * last_dt_;
    clock_step_ = update->ntimestep;
  }
  last_dt_ = update->dt;
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

void FixLcpImpact::find_meshes() {
  mesh_fix_.assign(options_.walls.size(), nullptr);
  for (std::size_t w = 0; w < options_.walls.size(); ++w) {
    const ImpactWall &wall = options_.walls[w];
    if (wall.fix_id.empty()) continue;
    const int found = modify->find_fix(wall.fix_id.c_str());
    mesh_fix_[w] = found < 0 ? nullptr : dynamic_cast<FixMeshSurface *>(modify->fix[found]);
    if (!mesh_fix_[w])
      refuse("wall " + wall.name + ": there is no fix mesh/surface with the ID " + wall.fix_id + "; define it before the run");
  }
}

void FixLcpImpact::gather_meshes(double dt) {
  for (std::size_t w = 0; w < mesh_fix_.size(); ++w)
    if (mesh_fix_[w]) mesh_[w].gather(*mesh_fix_[w], *domain, world, dt);
}

dembark::impact::PeriodicBox FixLcpImpact::box() const {
  dembark::impact::PeriodicBox box;
  box.low = {domain->boxlo[0], domain->boxlo[1], domain->boxlo[2]};
  box.length = {domain->prd[0], domain->prd[1], domain->prd[2]};
  for (int k = 0; k < 3; ++k) box.periodic[k] = domain->periodicity[k] && (k < 2 || domain->dimension == 3);
  box.beyond = neighbor->skin;  // by what atoms move between two neighbour lists
  return box;
}

/// Sends the own atoms to the first rank. Collective.
void FixLcpImpact::gather_atoms() {
  own_atom_.clear();
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & groupbit) own_atom_.push_back(i);
  own_row_.resize(own_atom_.size() * sent);
  double *to = own_row_.data();
  for (const int i : own_atom_) {
    for (const double value : {double(atom->tag[i]), double(atom->type[i]), atom->rmass[i], atom->radius[i]}) *to++ = value;
    for (const double *v : {atom->x[i], atom->v[i], atom->omega[i], atom->f[i], atom->torque[i]}) to = std::copy(v, v + 3, to);
  }
  if (comm->nprocs == 1) return all_row_.swap(own_row_);
  const int count = int(own_row_.size());
  counts_.resize(std::size_t(comm->nprocs));
  offsets_.assign(std::size_t(comm->nprocs), 0);
  MPI_Gather(&count, 1, MPI_INT, counts_.data(), 1, MPI_INT, 0, world);
  if (me_ == 0) {
    std::partial_sum(counts_.begin(), counts_.end() - 1, offsets_.begin() + 1);
    all_row_.resize(std::size_t(offsets_.back() + counts_.back()));
  }
  MPI_Gatherv(own_row_.data(), count, MPI_DOUBLE, all_row_.data(), counts_.data(), offsets_.data(), MPI_DOUBLE, 0, world);
}

/// Fills bodies_ with what was gathered, sorted by tag; on the first rank.
void FixLcpImpact::take_bodies() {
  const std::size_t n = all_row_.size() / sent;
  const auto tag = [this](std::size_t row) { return all_row_[row * sent]; };
  // Atoms seldom change their places in the engine's arrays: the order of the last step is tried first.
  bool sorted = order_.size() == n;
  for (std::size_t i = 1; sorted && i < n; ++i) sorted = tag(order_[i - 1]) < tag(order_[i]);
  if (!sorted) {
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), std::size_t(0));
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) { return tag(a) < tag(b); });
  }
  bodies_.resize(n);
  const double turn = options_.torque_scale(domain->dimension);
  for (std::size_t i = 0; i < n; ++i) {
    const double *v = &all_row_[order_[i] * sent];
    const auto vector = [v](int k) { return Vec{v[k], v[k + 1], v[k + 2]}; };
    if (i > 0 && tag(order_[i - 1]) == v[0]) throw std::runtime_error("two atoms have the number " + std::to_string(std::int64_t(v[0])));
    bodies_[i] = {std::int64_t(v[0]), v[2], options_.inertia(v[2], v[3]), v[3], int(v[1]) - 1, vector(4), vector(7), vector(10), vector(13),
                  turn * vector(16)};
  }
}

/// Hands the forces of the first rank out to the atoms. Collective.
void FixLcpImpact::apply() {
  if (me_ == 0) {
    const double turn = 1.0 / options_.torque_scale(domain->dimension);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Vec f = force_[i], t = turn * torque_[i];
      const double row[returned] = {f.x, f.y, f.z, t.x, t.y, t.z};
      std::copy(row, row + returned, &all_row_[order_[i] * returned]);
    }
    for (std::vector<int> *list : {&counts_, &offsets_})
      for (int &n : *list) n = n / sent * returned;
  }
  const int count = int(own_atom_.size()) * returned;
  own_row_.resize(std::size_t(count));
  if (comm->nprocs == 1) own_row_.swap(all_row_);
  else MPI_Scatterv(all_row_.data(), counts_.data(), offsets_.data(), MPI_DOUBLE, own_row_.data(), count, MPI_DOUBLE, 0, world);
  for (std::size_t k = 0; k < own_atom_.size(); ++k)
    for (int axis = 0; axis < 3; ++axis) {
      atom->f[own_atom_[k]][axis] += own_row_[k * returned + axis];
      atom->torque[own_atom_[k]][axis] += own_row_[k * returned + 3 + axis];
    }
}

void FixLcpImpact::find_contacts(double reach, std::vector<Contact> &contacts) {
  pairs_.find(bodies_, box(), reach, contacts);
  for (std::size_t w = 0; w < options_.walls.size(); ++w) {
    const ImpactWall &wall = options_.walls[w];
    if (wall.plane) dembark::impact::plane_contacts(bodies_, *wall.plane, reach, contacts);
    if (wall.drum) dembark::impact::cylinder_contacts(bodies_, *wall.drum, reach, contacts);
    if (wall.fix_id.empty()) continue;
    // Without images: at the end of a mesh that goes through to a periodic boundary they would touch an edge that is none.
    const std::size_t from = contacts.size();
    triangles_.find(bodies_, wall.common, mesh_[w].surface, reach, contacts);
    if (mesh_[w].velocity_known) continue;
    for (std::size_t k = from; k < contacts.size(); ++k) {  // better no relative motion than a wrong one, which springs would remember
      const Body &b = bodies_[std::size_t(contacts[k].a)];
      contacts[k].point_velocity = b.velocity - b.radius * cross(b.spin, contacts[k].normal);
    }
  }
}

/// The forces of the moment, on the first rank.
void FixLcpImpact::solve(double kick) {
  force_.assign(bodies_.size(), Vec());
  torque_.assign(bodies_.size(), Vec());
  const double time = clock_time_ + double(update->ntimestep - clock_step_) * update->dt;
  double wall_speed = 0.0;
  // The surface of a cylinder that turns moves along itself, not towards anything.
  for (const dembark_liggghts::ImpactMesh &mesh : mesh_) wall_speed = std::max(wall_speed, mesh.speed);
  const auto search = [this](double reach, std::vector<Contact> &contacts) { find_contacts(reach, contacts); };
  report_ = system_->step(bodies_, search, wall_speed, time, kick, force_, torque_);
  file_.append(system_->take_finished());
  results_.clear();
  last_step_ = update->ntimestep;
  kept_ = false;
}

void FixLcpImpact::setup(int) {
  gather_atoms();
  gather_meshes(0.0);
  on_root([this] {
    take_bodies();
    // A run that goes on where one has ended: the forces of this step are known.
    if (last_step_ == update->ntimestep && last_.hold(bodies_, box())) {
      force_ = last_.force;
      torque_ = last_.torque;
    } else {
      solve(0.5);  // half a kick follows, from the velocity of the full step
    }
  });
  apply();
  fill_local();
}

void FixLcpImpact::post_force(int) {
  gather_atoms();
  gather_meshes(update->dt);
  on_root([this] {
    take_bodies();
    solve(1.0);
  });
  apply();
  if (local_is_read()) fill_local();
}

void FixLcpImpact::post_run() {
  keep_end_of_step();
  fill_local();
}

/// Collective.
void FixLcpImpact::keep_end_of_step() {
  gather_atoms();
  on_root([this] {
    if (!kept_) {  // of the step that has just been done
      last_.keep(bodies_);
      last_.force = force_;
      last_.torque = torque_;
      kept_ = true;
    }
    take_bodies();
    last_.move(bodies_);
  });
}
