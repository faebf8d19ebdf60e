#include "fix_lcp_impact.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "dump.h"
#include "error.h"
#include "memory.h"
#include "modify.h"
#include "output.h"
#include "update.h"

#include "fix_mesh_surface.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::impact::Body;
using dembark_liggghts::ImpactFriction;
using dembark_liggghts::ImpactWall;

namespace {

constexpr int local_columns = 13;

std::vector<std::string> words(int narg, char **arg) { return std::vector<std::string>(arg + std::min(3, narg), arg + narg); }

}  // namespace

FixLcpImpact::FixLcpImpact(LAMMPS *lmp, int narg, char **arg)
    : Fix(lmp, narg, arg),
      last_step_(-1),
      last_dt_(0.0),
      clock_time_(0.0),
      clock_step_(0),
      record_kept_(-1),
      me_(comm->me),
      local_capacity_(0),
      local_always_(true) {
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    refuse("atoms have no radius, mass, spin or torque of their own; use atom_style granular (or sphere)");
  if (!atom->tag_enable) refuse("atoms have no numbers; use atom_modify id yes");
  try {
    options_ = dembark_liggghts::read_impact_options(words(narg, arg), atom->ntypes);
  } catch (const std::invalid_argument &e) {
    refuse(e.what());
  }
  mesh_.resize(options_.walls.size());

  restart_global = 1;
  vector_flag = 1;
  size_vector = 13;
  extvector = 0;
  global_freq = 1;
  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = local_columns;
  local_freq = 1;
  // One row, so that a dump of a run without any contact finds an array.
  local_capacity_ = 1;
  memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
}

FixLcpImpact::~FixLcpImpact() { memory->destroy(array_local); }

void FixLcpImpact::refuse(const std::string &line) { error->fix_error(FLERR, this, line.c_str()); }

int FixLcpImpact::setmask() { return POST_FORCE | POST_RUN; }

dembark::impact::Settings FixLcpImpact::settings() const {
  dembark::impact::Settings s;
  s.dt = update->dt;
  s.theta = options_.theta;
  s.friction_sweeps = options_.sweeps;
  s.lcp.method = options_.method;
  // Walls follow the atom types, so that each has a friction of its own.
  const std::size_t types = options_.stiffness.size(), n = types + options_.walls.size();
  s.materials.resize(n);
  s.pairs.resize(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    s.materials[i].stiffness = i < types ? options_.stiffness[i] : options_.walls[i - types].stiffness;
    s.materials[i].damping = i < types ? options_.damping[i] : 0.0;
    for (std::size_t j = 0; j < n; ++j) {
      const std::size_t later = std::max(i, j);
      const ImpactFriction &f = later < types ? options_.friction : options_.walls[later - types].friction;
      dembark::impact::PairLaw &pair = s.pairs[i * n + j];
      pair.friction.static_friction = f.static_coefficient;
      pair.friction.kinetic_friction = f.kinetic_coefficient;
      pair.friction.critical_slip_distance = f.slip_distance;
      if (options_.shear_strength > 0.0) pair.friction.interface_shear_strength = options_.shear_strength;
      pair.contact_area = options_.shear_area;
      pair.tangential_stiffness_ratio = options_.tangential_ratio;
      pair.contact_damping = options_.contact_damping;
    }
  }
  return s;
}

void FixLcpImpact::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0)
    refuse(std::string("run_style ") + update->integrate_style + " is not supported; use run_style verlet");
  if (domain->triclinic) refuse("a triclinic box is not supported; use an orthogonal one");
  check_order();
  find_meshes();
  if (!system_ || update->dt != last_dt_) build_system();
  open_record();
  find_local_readers();
}

void FixLcpImpact::reset_dt() { build_system(); }

/// Makes the model, or tells it a new time step.
void FixLcpImpact::build_system() {
  const bool new_step = last_dt_ > 0.0 && last_dt_ != update->dt;
  try {
    if (system_) system_->set_dt(update->dt);
    else {
      system_.reset(new dembark::impact::System(settings()));
      if (!restored_.empty()) system_->restore(restored_);
      restored_.clear();
    }
  } catch (const std::exception &e) {
    refuse(e.what());
  }
  if (new_step) {
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
  const int mine = modify->find_fix(id);
  for (int i = mine + 1; i < modify->nfix; ++i) {
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
    if (wall.shape != ImpactWall::mesh) continue;
    const int found = modify->find_fix(wall.fix_id.c_str());
    mesh_fix_[w] = found < 0 ? nullptr : dynamic_cast<FixMeshSurface *>(modify->fix[found]);
    if (!mesh_fix_[w])
      refuse("wall " + wall.name + ": there is no fix mesh/surface with the ID " + wall.fix_id + "; define it before the run");
  }
}

/// Styles that may read the local array in any step; dumps tell their steps.
void FixLcpImpact::find_local_readers() {
  local_always_ = false;
  for (int i = 0; i < modify->nfix; ++i) local_always_ = local_always_ || std::strncmp(modify->fix[i]->style, "ave/histo", 9) == 0;
}

bool FixLcpImpact::local_is_read() const {
  if (local_always_) return true;
  for (int i = 0; i < output->ndump; ++i)
    if (output->next_dump[i] == update->ntimestep && std::strncmp(output->dump[i]->style, "local", 5) == 0) return true;
  return false;
}

void FixLcpImpact::open_record() {
  if (options_.impacts_file.empty() || !record_name_.empty()) return;
  record_name_ = options_.impacts_file;
  std::string wrong;
  if (me_ == 0) {
    std::string about;
    for (std::size_t w = 0; w < options_.walls.size(); ++w)
      about += (w ? ", " : " ") + std::to_string(-1 - static_cast<long>(w)) + " = " + options_.walls[w].name;
    wrong = record_.open(record_name_, record_kept_, about);
  }
  // Only the first process knows what is wrong; all of them stop, with one line.
  int length = int(wrong.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, world);
  wrong.resize(std::size_t(length));
  MPI_Bcast(&wrong[0], length, MPI_CHAR, 0, world);
  if (length > 0) refuse(wrong);
}

void FixLcpImpact::setup(int) {
  gather_bodies();
  gather_meshes(0.0);
  // A run that goes on where one has ended: the forces of this step are known. Computing them again would let the histories of the
  // contacts take the step twice.
  if (last_step_ == update->ntimestep && same_bodies()) {
    force_ = last_force_;
    torque_ = last_torque_;
  } else solve(0.5);  // half a kick follows, from the velocity of the full step
  apply();
  fill_local();
}

void FixLcpImpact::gather_meshes(double dt) {
  for (std::size_t w = 0; w < mesh_fix_.size(); ++w)
    if (mesh_fix_[w]) mesh_[w].gather(*mesh_fix_[w], world, dt);
}

void FixLcpImpact::post_force(int) {
  gather_bodies();
  gather_meshes(update->dt);
  solve(1.0);
  apply();
  if (local_is_read()) fill_local();
}

void FixLcpImpact::post_run() {
  take_snapshot();
  fill_local();
}

void FixLcpImpact::solve(double kick) {
  force_.assign(bodies_.size(), Vec());
  torque_.assign(bodies_.size(), Vec());
  const double time = clock_time_ + double(update->ntimestep - clock_step_) * update->dt;
  try {
    double wall_speed = 0.0;
    // The surface of a cylinder that turns moves along itself, not towards anything.
    for (const dembark_liggghts::ImpactMesh &mesh : mesh_) wall_speed = std::max(wall_speed, mesh.speed());
    const auto search = [this](double reach, std::vector<dembark::impact::Contact> &contacts) { find_contacts(reach, contacts); };
    report_ = system_->step(bodies_, search, wall_speed, time, kick, force_, torque_);
  } catch (const std::exception &e) {
    refuse(e.what());
  }
  results_.clear();
  const std::vector<dembark::impact::Impact> finished = system_->take_finished();
  if (record_.is_open() && !record_.write(finished))
    error->one(FLERR, ("Fix lcp/impact (id " + std::string(id) + "): impacts: file " + record_name_ + " cannot be written on").c_str());
  last_step_ = update->ntimestep;
  last_force_ = force_;
  last_torque_ = torque_;
  last_bodies_.clear();
}

/// Contacts of the last step; the model itself does not remember those of a restart file.
const std::vector<dembark::impact::ContactResult> &FixLcpImpact::results() const {
  return results_.empty() && system_ ? system_->contacts() : results_;
}

/// Each rank shows the contacts with a force of which it has the first body.
void FixLcpImpact::fill_local() {
  std::vector<char> mine(bodies_.size(), 0);
  for (const int b : own_body_) mine[std::size_t(b)] = 1;
  const std::vector<dembark::impact::ContactResult> &all = results();
  if (int(all.size()) > local_capacity_) {
    local_capacity_ = 2 * int(all.size());
    memory->destroy(array_local);
    memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
  }
  size_local_rows = 0;
  for (const dembark::impact::ContactResult &c : all) {
    if (!(c.normal_force > 0.0) || !mine[std::size_t(c.a)]) continue;
    const double row[local_columns] = {double(c.key_a), double(dembark_liggghts::outer_id(c.key_b)),
                                       c.normal.x,      c.normal.y,
                                       c.normal.z,      c.gap,
                                       c.normal_force,  c.tangential.x,
                                       c.tangential.y,  c.tangential.z,
                                       c.place.x,       c.place.y,
                                       c.place.z};
    std::copy(row, row + local_columns, array_local[size_local_rows++]);
  }
}

double FixLcpImpact::compute_vector(int i) {
  const dembark::impact::StepReport &r = report_;
  const double values[13] = {double(r.contacts),    double(r.active),       double(r.impacts_begun), r.peak_force,
                             r.impulse_sum,         r.dissipated_energy,    r.elastic_energy,        double(r.pivots),
                             double(r.block_steps), double(r.pivots_total), r.certificate,           r.worst_certificate,
                             r.peak_force_so_far};
  return values[i];
}

double FixLcpImpact::memory_usage() {
  return double(bodies_.size() * (sizeof(Body) + 4 * sizeof(Vec)) + std::size_t(report_.contacts) * sizeof(dembark::impact::Contact) +
                std::size_t(local_capacity_) * local_columns * sizeof(double));
}
