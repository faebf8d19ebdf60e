#include "fix_integration_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_gravity.h"
#include "fix_mesh_surface.h"
#include "fix_neighlist_mesh.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "pair_gran.h"
#include "primitive_wall.h"
#include "tri_mesh.h"
#include "update.h"

#include "fix_energy_account.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using dembark::AccelerationHistory;
using dembark::MonitorAction;
using dembark::MonitorRun;

namespace {

bool is(const Fix *fix, const char *style) { return std::strcmp(fix->style, style) == 0; }

}  // namespace

FixIntegrationMonitor::FixIntegrationMonitor(LAMMPS *lmp, int narg, char **arg)
    : Fix(lmp, narg, arg), run_(read({arg + std::min(3, narg), arg + narg})), monitor_(run_.monitor) {
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k] && modify->fix[k] != this && is(modify->fix[k], style) && std::strcmp(modify->fix[k]->id, id) != 0)
      refuse("there can be one such fix only, and there is fix " + std::string(modify->fix[k]->id));
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = MonitorRun::figures;
  extvector = 0;
}

void FixIntegrationMonitor::refuse(const std::string &what) {
  error->fix_error(FLERR, this, what.c_str());
  std::abort();  // fix_error() does not return
}

MonitorRun FixIntegrationMonitor::read(const std::vector<std::string> &words) {
  try {
    return MonitorRun(words, world);
  } catch (const std::invalid_argument &wrong) {
    refuse(wrong.what());
  }
}

int FixIntegrationMonitor::setmask() { return END_OF_STEP | (run_.impacts > 0 ? PRE_FORCE : 0); }

void FixIntegrationMonitor::post_create() {
  const std::string name = "accelerations_" + std::string(id);
  property_ = new char[name.size() + 1];
  std::strcpy(property_, name.c_str());
  std::vector<std::string> words{name, "all", "property/atom", name, "vector", "yes", "no", "no"};
  words.resize(words.size() + dembark::monitor_history_numbers, "0.");
  std::vector<char *> pointers;
  for (std::string &word : words) pointers.push_back(&word[0]);
  histories_ = modify->add_fix_property_atom(int(pointers.size()), pointers.data(), style);
}

void FixIntegrationMonitor::pre_delete(bool unfixed) {
  if (unfixed && histories_) modify->delete_fix(property_);
  delete[] property_;
  property_ = nullptr;
}

void FixIntegrationMonitor::init() {
  if (std::strcmp(update->integrate_style, "verlet") != 0) refuse("only run_style verlet is supported");
  if (force->ftm2v != 1.0 || force->mvv2e != 1.0) refuse("units must be si or cgs");
  if (!atom->sphere_flag || !atom->rmass || atom->superquadric_flag || atom->shapetype_flag)
    refuse("it judges spheres only: atom_style granular");
  check_motion();
  read_models();
  account_ = static_cast<FixEnergyAccount *>(modify->find_fix_style("energy/account", 0));
  if (run_.mean_length) {
    double sum = 0.0, count = 0.0;
    for (int i = 0; i < atom->nlocal; ++i)
      if (atom->mask[i] & groupbit) {
        sum += 2.0 * atom->radius[i];
        count += 1.0;
      }
    if (!run_.measure_length(sum, count)) refuse("there are no grains yet whose mean diameter could be taken; give 'length L' (m)");
  }
  run_.begin(update->dt, long(update->ntimestep));
  take_step();
}

void FixIntegrationMonitor::check_motion() {
  moving_ = frozen_ = 0;
  gravities_.clear();
  for (int k = 0; k < modify->nfix; ++k) {
    Fix *const fix = modify->fix[k];
    if (std::strncmp(fix->style, "rigid", 5) == 0 || std::strncmp(fix->style, "multisphere", 11) == 0)
      refuse("it judges single grains, and fix " + std::string(fix->id) + " (" + fix->style + ") moves bodies made of several");
    if (is(fix, "gravity")) gravities_.push_back(static_cast<FixGravity *>(fix));
    if (is(fix, "freeze")) frozen_ |= fix->groupbit;
    if (is(fix, "nve/sphere") || is(fix, "nve")) moving_ |= fix->groupbit;
  }
  if (!moving_) refuse("no grain follows its forces: it needs fix nve/sphere");
}

/// Stiffness is known of the normal models hertz and hooke. Without a granular pair style there are no contacts to judge.
void FixIntegrationMonitor::read_models() {
  walls_.clear();
  PairGran *const pair = dynamic_cast<PairGran *>(force->pair);
  contacts_ = pair != nullptr;
  if (!pair) return;
  for (int k = 0; k < modify->nfix; ++k)
    if (FixWallGran *const wall = dynamic_cast<FixWallGran *>(modify->fix[k])) walls_.push_back(wall);
  hertz_ = pair->contact_match("normal", "hertz");
  if (!hertz_ && !pair->contact_match("normal", "hooke"))
    refuse("it knows the stiffness of model hertz or hooke only; the pair style has another model");
  const dembark_liggghts::PropertyReader read(force->registry, modify, error, "fix integration/monitor");
  if (!hertz_) characteristic_velocity_ = read.scalar("characteristicVelocity");
  moduli_ = for_all_pairs(read, [&](int i, int j, const std::string &) {
    return dembark::effective_youngs_modulus(read.per_type("youngsModulus", i), read.per_type("poissonsRatio", i),
                                             read.per_type("youngsModulus", j), read.per_type("poissonsRatio", j));
  });
}

/// kg; infinite of grains that do not follow their forces.
double FixIntegrationMonitor::mass(int i) const {
  const int mask = atom->mask[i];
  return (mask & moving_) && !(mask & frozen_) ? atom->rmass[i] : INFINITY;
}

void FixIntegrationMonitor::end_of_step() {
  const long n = long(update->ntimestep);
  if (monitor_.settings.keeps(n)) take_bodies(n);
  if (monitor_.settings.samples(n)) {
    if (contacts_) {
      take_pairs();
      take_walls();
    }
    tell();
  }
  run_.end_step(n);
  take_step();
}

void FixIntegrationMonitor::take_bodies(long n) {
  // Moment of inertia as in fix nve/sphere.
  const double share = domain->dimension == 2 ? 0.5 : 0.4;
  double **const f = atom->f, **const torque = atom->torque, **const kept = histories_->array_atom;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit) || std::isinf(mass(i))) continue;
    const double radius = atom->radius[i], per_mass = 1.0 / atom->rmass[i], per_inertia = per_mass / (share * radius * radius);
    AccelerationHistory history;
    std::memcpy(static_cast<void *>(&history), kept[i], sizeof history);
    monitor_.take(history,
                  {f[i][0] * per_mass, f[i][1] * per_mass, f[i][2] * per_mass, torque[i][0] * per_inertia, torque[i][1] * per_inertia,
                   torque[i][2] * per_inertia},
                  radius, atom->tag[i], n, update->dt);
    std::memcpy(kept[i], &history, sizeof history);
  }
}

/// `radius_j` infinite: a wall.
void FixIntegrationMonitor::take_contact(int i, int j, double radius_j, int type_j, double overlap) {
  const double mass_j = j < 0 ? INFINITY : mass(j), own = dembark::reduced(mass(i), mass_j);
  if (std::isinf(own)) return;
  const double radius = dembark::reduced(atom->radius[i], radius_j);
  const dembark::HertzParameters elastic(moduli_(atom->type[i], type_j), 1.0, 1.0);
  const auto response = hertz_ ? dembark::hertz(elastic, radius, own, overlap, 0.0)
                               : dembark::hooke(elastic, characteristic_velocity_, radius, own, overlap, 0.0);
  monitor_.take_contact(own, response.normal_stiffness, update->dt, atom->tag[i], j < 0 ? dembark::monitor_wall : long(atom->tag[j]));
}

void FixIntegrationMonitor::take_pairs() {
  const NeighList *const list = static_cast<PairGran *>(force->pair)->list;
  for (int ii = 0; list && ii < list->inum; ++ii) {
    const int i = list->ilist[ii];
    const double *const x = atom->x[i];
    for (int k = 0; k < list->numneigh[i]; ++k) {
      const int j = list->firstneigh[i][k] & NEIGHMASK;
      const double a = x[0] - atom->x[j][0], b = x[1] - atom->x[j][1], c = x[2] - atom->x[j][2];
      const double reach = atom->radius[i] + atom->radius[j], squared = a * a + b * b + c * c;
      if (squared < reach * reach && ((atom->mask[i] | atom->mask[j]) & groupbit))
        take_contact(i, j, atom->radius[j], atom->type[j], reach - std::sqrt(squared));
    }
  }
}

void FixIntegrationMonitor::take_wall(FixWallGran &wall, int i, double distance) {
  if (distance < 0.0) take_contact(i, -1, INFINITY, wall.atom_type_wall(), -distance);
}

/// Grains and walls as in FixWallGran, by the lists of candidates that it has.
void FixIntegrationMonitor::take_walls() {
  double away[3];
  int side = 0;
  for (FixWallGran *const wall : walls_) {
    const auto takes = [&](int i) { return i < atom->nlocal && (atom->mask[i] & wall->groupbit) && (atom->mask[i] & groupbit); };
    if (!wall->is_mesh_wall()) {
      int *list = nullptr;
      const int count = wall->primitiveWall()->getNeighbors(list);
      for (int k = 0; k < count; ++k)
        if (takes(list[k])) take_wall(*wall, list[k], wall->primitiveWall()->resolveContact(atom->x[list[k]], atom->radius[list[k]], away));
      continue;
    }
    for (int m = 0; m < wall->n_meshes(); ++m) {
      FixMeshSurface *const surface = wall->mesh_list()[m];
      TriMesh *const mesh = surface->triMesh();
      const int triangles = mesh->sizeLocal() + mesh->sizeGhost();
      for (int t = 0; surface->meshNeighlist() && t < triangles; ++t)
        for (const int i : surface->meshNeighlist()->get_contact_list(t)) {
          if (!takes(i)) continue;
          const double distance = mesh->resolveTriSphereContact(i, t, atom->radius[i], atom->x[i], away, side);
          if (distance < 0.0) take_contact(i, -1, INFINITY, surface->atomTypeWall(), -distance);
        }
    }
  }
}

/// Collective.
void FixIntegrationMonitor::tell() {
  for (const std::string &found : run_.new_findings(long(update->ntimestep), "atom")) {
    const std::string line = "fix integration/monitor (id " + std::string(id) + "): " + found;
    if (monitor_.settings.action == MonitorAction::stop) error->all(FLERR, line.c_str());
    if (comm->me == 0) error->warning(FLERR, line.c_str());
  }
}

/// As `fix dt/reset` does it. Accelerations of steps of another length are no history.
void FixIntegrationMonitor::take_step() {
  if (update->dt == run_.step()) return;
  update->dt = run_.step();
  if (force->pair) force->pair->reset_dt();
  for (int k = 0; k < modify->nfix; ++k) modify->fix[k]->reset_dt();
  histories_->set_all(0.0, false);
}

/// Collective.
double FixIntegrationMonitor::compute_vector(int n) {
  if (n != MonitorRun::energy_error) return run_.figure(n, long(update->ntimestep));
  if (!account_) return 0.0;
  const double step_error = account_->compute_vector(15), turned_over = account_->compute_vector(16);
  return turned_over > 0.0 ? step_error / turned_over : 0.0;
}

/// Collective.
void FixIntegrationMonitor::write_restart(FILE *file) {
  const std::vector<double> saved = run_.saved();
  if (comm->me != 0) return;
  const int bytes = int(saved.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(saved.data(), sizeof(double), saved.size(), file);
}

void FixIntegrationMonitor::restart(char *buffer) { run_.restore(buffer); }
