#include "fix_integration_monitor.h"

#include <cmath>
#include <cstdlib>
#include <cstring>

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
using dembark::MonitorTally;
using dembark::ShadowImpact;

namespace {

constexpr int history_numbers = sizeof(AccelerationHistory) / sizeof(double);
static_assert(history_numbers * sizeof(double) == sizeof(AccelerationHistory));
constexpr int outputs = 24;

bool is(const Fix *fix, const char *style) { return std::strcmp(fix->style, style) == 0; }

}  // namespace

FixIntegrationMonitor::FixIntegrationMonitor(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg) {
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k] && modify->fix[k] != this && is(modify->fix[k], style) && std::strcmp(modify->fix[k]->id, id) != 0)
      refuse("there can be one such fix only, and there is fix " + std::string(modify->fix[k]->id));
  dembark::MonitorSettings &s = monitor_.settings;
  s.scales.length = 1.0;
  for (int k = 3; k < narg; ++k) {
    const std::string word = arg[k];
    if (word == "speed") s.scales.speed = number(k, narg, arg);
    else if (word == "length") {
      s.scales.length = number(k, narg, arg);
      mean_length_ = false;
    } else if (word == "limit") s.scales.limit = number(k, narg, arg);
    else if (word == "contact_steps") s.least_steps = number(k, narg, arg);
    else if (word == "every") s.every = whole(k, narg, arg);
    else if (word == "impacts") {
      impacts_ = whole(k, narg, arg);
      if (impacts_ < 0) refuse("impacts must be 0 (none) or more: every how many an impact is integrated anew");
    } else if (word == "rows") {
      rows_ = whole(k, narg, arg);
      if (rows_ < 1) refuse("rows must be 1 step or more");
    } else if (word == "action") {
      const std::string value = ++k < narg ? arg[k] : "";
      if (!dembark::option_from_name(dembark::monitor_action_names(), value, s.action))
        refuse("action '" + value + "' is unknown; it can be report, warn, stop, adapt");
    } else refuse("keyword '" + word + "' is unknown; it can be speed, length, limit, every, contact_steps, impacts, action, rows");
  }
  if (s.scales.speed == 0.0) refuse("it needs 'speed V', the speed (m/s) that errors of velocities are measured by");
  if (const char *const wrong = s.error()) refuse(wrong);
  if (s.action == MonitorAction::adapt && rows_ == 0) refuse("action adapt needs 'rows N': steps of the deck between two rows of output");
  if (s.action != MonitorAction::adapt && rows_ > 0) refuse("rows belongs to action adapt");
  restart_global = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = outputs;
  extvector = 0;
}

void FixIntegrationMonitor::refuse(const std::string &what) {
  error->fix_error(FLERR, this, what.c_str());
  std::abort();  // fix_error() does not return
}

double FixIntegrationMonitor::number(int &k, int narg, char **arg) {
  const std::string word = arg[k];
  char *end = nullptr;
  const double value = ++k < narg ? std::strtod(arg[k], &end) : 0.0;
  if (!end || *end || end == arg[k])
    refuse("after " + word + " there must be a number" + (k < narg ? ", not '" + std::string(arg[k]) + "'" : ""));
  return value;
}

long FixIntegrationMonitor::whole(int &k, int narg, char **arg) {
  const std::string word = arg[k];
  const double value = number(k, narg, arg);
  if (value != std::floor(value) || std::abs(value) > 1e9) refuse(word + " must be a whole number of steps, not '" + arg[k] + "'");
  return long(value);
}

int FixIntegrationMonitor::setmask() { return END_OF_STEP | (impacts_ > 0 ? PRE_FORCE : 0); }

void FixIntegrationMonitor::post_create() {
  const std::string name = "accelerations_" + std::string(id);
  property_ = new char[name.size() + 1];
  std::strcpy(property_, name.c_str());
  std::vector<std::string> words{name, "all", "property/atom", name, "vector", "yes", "no", "no"};
  words.resize(words.size() + history_numbers, "0.");
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
  if (mean_length_) {
    double mine[] = {0.0, 0.0}, all[2];
    for (int i = 0; i < atom->nlocal; ++i)
      if (atom->mask[i] & groupbit) {
        mine[0] += 2.0 * atom->radius[i];
        mine[1] += 1.0;
      }
    MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);
    if (all[1] == 0.0) refuse("there are no grains yet whose mean diameter could be taken; give 'length L' (m)");
    monitor_.settings.scales.length = all[0] / all[1];
    mean_length_ = false;
  }
  // A time step that the script has set since is the new one of the deck.
  if (state_.step == 0.0 || update->dt != std::ldexp(state_.step, -state_.level)) {
    if (update->dt != state_.step) state_.level = 0;
    state_.step = update->dt;
    set_step(state_.level);
  }
  if (rows_ > 0 && state_.next_row <= double(update->ntimestep))
    state_.next_row = double(update->ntimestep) + std::ldexp(rows_, state_.level);
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
  merged_at_ = -1;
  if (monitor_.settings.keeps(n)) take_bodies(n);
  if (monitor_.settings.samples(n)) {
    if (contacts_) {
      take_pairs();
      take_walls();
    }
    if (monitor_.settings.action == MonitorAction::warn || monitor_.settings.action == MonitorAction::stop) act();
  }
  if (rows_ > 0 && double(update->ntimestep) >= state_.next_row) end_row();
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

/// Collective. The ranks' in their order, so that all have the same bits.
MonitorTally FixIntegrationMonitor::merged(bool whole_run) const {
  const MonitorTally mine = whole_run ? monitor_.all() : monitor_.row;
  std::vector<MonitorTally> each(std::size_t(comm->nprocs));
  MPI_Allgather(&mine, int(sizeof mine), MPI_BYTE, each.data(), int(sizeof mine), MPI_BYTE, world);
  MonitorTally all;
  for (const MonitorTally &one : each) all.merge(one);
  return all;
}

/// Tells what is found for the first time. Collective.
void FixIntegrationMonitor::act() {
  int mine = 0, found = 0;
  for (int kind = 0; kind < dembark::monitor_kinds; ++kind)
    if (finding(monitor_.row, monitor_.settings, kind)) mine |= 1 << kind;
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_BOR, world);
  found &= ~state_.said;
  if (!found) return;
  state_.said |= found;
  const MonitorTally all = merged(false);
  for (int kind = 0; kind < dembark::monitor_kinds; ++kind) {
    if (!(found >> kind & 1)) continue;
    const std::string line = "fix integration/monitor (id " + std::string(id) + "): at step " + std::to_string(update->ntimestep) + ' ' +
                             finding_text(all, monitor_.settings, kind, "atom");
    if (monitor_.settings.action == MonitorAction::stop) error->all(FLERR, line.c_str());
    if (comm->me == 0) error->warning(FLERR, line.c_str());
  }
}

/// Collective.
void FixIntegrationMonitor::end_row() {
  const int level = adapted_level(merged(false), monitor_.settings, state_.level);
  monitor_.close_row();
  if (level != state_.level) set_step(level);
  state_.next_row = double(update->ntimestep) + std::ldexp(rows_, state_.level);
}

/// As `fix dt/reset` does it. Accelerations of steps of another length are no history.
void FixIntegrationMonitor::set_step(int level) {
  state_.level = level;
  if (update->dt == std::ldexp(state_.step, -level)) return;
  update->dt = std::ldexp(state_.step, -level);
  if (force->pair) force->pair->reset_dt();
  for (int k = 0; k < modify->nfix; ++k) modify->fix[k]->reset_dt();
  histories_->set_all(0.0, false);
}

/// Collective.
double FixIntegrationMonitor::compute_vector(int n) {
  if (merged_at_ != update->ntimestep) merged_ = merged(true);
  merged_at_ = update->ntimestep;
  const dembark::ErrorTally *const errors[] = {&merged_.errors.position, &merged_.errors.velocity, &merged_.errors.spin};
  if (n < 12) {
    const dembark::ErrorTally &e = *errors[n / 4];
    const double values[] = {e.largest, e.rms(), double(e.body), e.exceeded};
    return values[n % 4];
  }
  const bool none = std::isinf(merged_.contact.steps);
  switch (n) {
    case 12: return errors[0]->count;
    case 13: return none ? 0.0 : merged_.contact.steps;
    case 14: return double(merged_.contact.one);
    case 15: return double(merged_.contact.two);
    case 16: {
      if (!account_) return 0.0;
      const double step_error = account_->compute_vector(15), turned_over = account_->compute_vector(16);
      return turned_over > 0.0 ? step_error / turned_over : 0.0;
    }
    case 17: return update->dt;
    case 18: return state_.level;
    case 19: return state_.next_row;
    case 20: return merged_.impacts.count;
    case 21: return merged_.impacts.largest;
    case 22: return merged_.impacts.rms();
    default: return double(merged_.impacts.body);
  }
}

/// Collective. The tallies of each rank by themselves: a run that goes on adds to the same ones.
void FixIntegrationMonitor::write_restart(FILE *file) {
  drop_impacts();
  State mine = state_;
  mine.run = monitor_.run;
  mine.row = monitor_.row;
  std::vector<State> all(std::size_t(comm->nprocs));
  MPI_Gather(&mine, int(sizeof mine), MPI_BYTE, all.data(), int(sizeof mine), MPI_BYTE, 0, world);
  if (comm->me != 0) return;
  const double head[] = {double(comm->nprocs), double(sizeof(State)), double(shadows_.size()), monitor_.settings.scales.length};
  const int bytes = int(sizeof head + all.size() * sizeof(State) + shadows_.size() * sizeof(ShadowImpact));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(head, sizeof head, 1, file);
  fwrite(all.data(), sizeof(State), all.size(), file);
  fwrite(shadows_.data(), sizeof(ShadowImpact), shadows_.size(), file);
}

/// On another number of ranks the first has the tallies of all.
void FixIntegrationMonitor::restart(char *buffer) {
  double head[4];
  std::memcpy(head, buffer, sizeof head);
  if (head[1] != double(sizeof(State))) return;
  const int ranks = int(head[0]);
  if (mean_length_) monitor_.settings.scales.length = head[3];
  mean_length_ = false;
  std::vector<State> all(std::size_t(ranks), State{});
  std::memcpy(static_cast<void *>(all.data()), buffer + sizeof head, all.size() * sizeof(State));
  shadows_.resize(std::size_t(head[2]));
  over_.assign(shadows_.size(), 0);
  std::memcpy(static_cast<void *>(shadows_.data()), buffer + sizeof head + all.size() * sizeof(State),
              shadows_.size() * sizeof(ShadowImpact));
  state_ = all[0];
  monitor_.run = monitor_.row = {};
  for (int r = 0; r < ranks; ++r)
    if (ranks == comm->nprocs ? r == comm->me : comm->me == 0) {
      monitor_.run.merge(all[std::size_t(r)].run);
      monitor_.row.merge(all[std::size_t(r)].row);
    }
}
