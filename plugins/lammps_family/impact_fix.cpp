#include "impact_fix.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "compute.h"
#include "memory.h"
#include "neighbor.h"
#include "output.h"

using namespace LAMMPS_NS;
using namespace dembark::impact;

namespace dembark_family {

ImpactFix::ImpactFix(LAMMPS* lmp, int narg, char** arg, const char* mesh) : SharedFix(lmp, narg, arg), ranks_(world) {
  only_spheres("it knows");
  if (!atom->tag_enable) fail("atoms have no numbers; use atom_modify id yes");
  checked([&] { impacts_ = std::make_unique<Coupling>(read_command({arg + std::min(3, narg), arg + narg}, atom->ntypes, mesh)); });
  restart_global = 1;
  time_depend = 1;
  vector_flag = 1;
  size_vector = int(dembark::to_numbers(impacts_->report).size());
  extvector = 0;
  global_freq = 1;
  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = local_columns;
  local_freq = peratom_freq = 1;  // LIGGGHTS's compute reduce divides by that of atoms for a local array too
  // One row, so that a dump of a run without any contact finds an array.
  memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
  peratom_flag = impacts_->command.has_lengths();
  size_peratom_cols = atom_columns;
}

ImpactFix::~ImpactFix() {
  memory->destroy(array_local);
  memory->destroy(array_atom);
}

/// Runs `work` on the rank that knows all bodies; its report is that of all. What goes wrong there ends the run with its line. Collective.
void ImpactFix::on_first(const std::function<void()>& work) {
  const std::string wrong = ranks_.run(work, impacts_->report);
  if (!wrong.empty()) fail(wrong);
}

void ImpactFix::init() {
  only_verlet();
  only_coherent_units();
  if (domain->triclinic) fail("a triclinic box is not supported; use an orthogonal one");
  only_constant_box("it knows logs in");
  only_single_grains("it knows");
  if (impacts_->command.has_lengths() && domain->dimension == 2)
    fail("logs with a length move in space; use dimension 3, or without length and logs the model of the cross-section");
  check_order();
  find_movers();
  torque_scale_ = find_torque_scale();
  find_walls();
  reset_dt();
  on_first([this] { impacts_->open_files(); });
}

void ImpactFix::reset_dt() {
  checked([this] { impacts_->set_dt(update->dt, update->ntimestep); });
}

/// The contact forces have to know all others, so fixes that add forces come first.
void ImpactFix::check_order() const {
  const char* const observers[] = {"lcp/impact", "enforce2d",      "store/",       "property/",          "ave/", "print", "mesh/",
                                   "move/mesh",  "energy/account", "resume/exact", "integration/monitor"};
  bool after = false;
  for (int k = 0; k < modify->nfix; ++k) {
    const Fix* const fix = modify->fix[k];
    if (fix == this) after = true;
    if (!after || !(modify->fmask[k] & FixConst::POST_FORCE)) continue;
    const auto observes = [fix](const char* known) { return begins_with(fix->style, known); };
    if (std::none_of(std::begin(observers), std::end(observers), observes))
      fail(std::string("fix ") + fix->id + " (" + fix->style +
           ") may add forces after the contact forces are known; define it before this fix");
  }
}

/// Which logs follow their forces: the others are held, or driven by fix move. Collective.
void ImpactFix::find_movers() {
  moved_ = frozen_ = 0;
  for (const Fix* const fix : fixes()) {
    if (is(*fix, "freeze")) frozen_ |= fix->groupbit;
    if (begins_with(fix->style, "nve/sphere")) moved_ |= fix->groupbit;
    else if (fix->time_integrate && !is(*fix, "move") && !is(*fix, "nve/noforce") && meets(*fix))
      fail(std::string("fix ") + fix->id + " (" + fix->style +
           ") moves logs; fix nve/sphere moves those that follow their forces, fix move those that are driven");
  }
}

/// Of the fixes that move grains of this one, which have to agree. Collective.
double ImpactFix::find_torque_scale() const {
  const Fix* mover = nullptr;
  bool found = false;  // whether it moves grains; without any yet, the last fix counts
  for (const Fix* const fix : fixes()) {
    if (!begins_with(fix->style, "nve/sphere")) continue;
    const bool any = meets(*fix);
    if (any && found && inertia_of(*fix) != inertia_of(*mover))
      fail(std::string("fixes ") + mover->id + " and " + fix->id + " (nve/sphere) turn its grains with different moments of inertia");
    if (any || !found) mover = fix;
    found = found || any;
  }
  return impacts_->command.torque_scale(mover ? inertia_of(*mover) : own_inertia());
}

PeriodicBox ImpactFix::box() const {
  PeriodicBox box;
  box.low = vector(domain->boxlo);
  box.length = vector(domain->prd);
  for (int k = 0; k < 3; ++k) box.periodic[k] = domain->periodicity[k] && (k < 2 || domain->dimension == 3);
  box.beyond = neighbor->skin;  // by what atoms move between two neighbour lists
  return box;
}

/// Sends the own atoms to the first rank. Collective.
void ImpactFix::gather_atoms() {
  own_atom_.clear();
  own_body_.clear();
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    own_atom_.push_back(i);
    const bool held = !(atom->mask[i] & moved_) || (atom->mask[i] & frozen_);
    const double mass = held ? INFINITY : atom->rmass[i], radius = atom->radius[i];
    own_body_.push_back({atom->tag[i], mass, held ? INFINITY : impacts_->command.inertia(mass, radius), radius, atom->type[i] - 1,
                         vector(atom->x[i]), vector(atom->v[i]), vector(atom->omega[i]), vector(atom->f[i]),
                         torque_scale_ * vector(atom->torque[i])});
  }
  ranks_.gather(own_body_, all_body_);
}

/// All ranks' walls and atoms to the first, then `work` there, and its forces to the atoms. Collective.
void ImpactFix::do_step(double dt, const std::function<void()>& work) {
  gather_walls(dt);
  gather_atoms();  // the last to be gathered: the forces go the way back
  on_first([&] {
    take_walls(dt);
    impacts_->take(all_body_, box());
    work();
    impacts_->hand_out(all_update_);
  });
  own_update_.resize(own_atom_.size());
  ranks_.scatter(all_update_, own_update_);
  update_atoms();
}

/// Forces, spins and the array of atoms. The engine's torques turn a log with a length as they would a sphere, and its axis not at all.
void ImpactFix::update_atoms() {
  if (peratom_flag && atom->nmax > atom_capacity_) {
    atom_capacity_ = atom->nmax;
    memory->destroy(array_atom);
    memory->create(array_atom, atom_capacity_, atom_columns, "lcp/impact:array_atom");
  }
  for (int i = 0; peratom_flag && i < atom->nlocal; ++i) std::fill_n(array_atom[i], int(atom_columns), 0.0);
  for (std::size_t k = 0; k < own_atom_.size(); ++k) {
    const int i = own_atom_[k];
    const BodyUpdate& update = own_update_[k];
    // Fix freeze, which came before this one, has taken all forces away.
    if (!(atom->mask[i] & frozen_)) {
      add(atom->f[i], update.force);
      add(atom->torque[i], update.torque, 1.0 / torque_scale_);
    }
    if (!peratom_flag) continue;
    std::fill_n(atom->omega[i], 3, 0.0);
    add(atom->omega[i], update.spin);
    const auto row = table_row(update.attitude);
    std::copy(row.begin(), row.end(), array_atom[i]);
  }
}

void ImpactFix::setup(int) {
  std::string doubtful;
  do_step(0.0, [&] {
    impacts_->set_up(update->ntimestep);
    doubtful = impacts_->step_warning();
  });
  if (!doubtful.empty()) warn(doubtful);
  fill_local();
}

void ImpactFix::post_force(int) {
  do_step(update->dt, [this] { impacts_->step(update->ntimestep); });
  if (local_is_read()) fill_local();
}

void ImpactFix::post_run() {
  keep_end_of_step();
  fill_local();
}

/// Collective.
void ImpactFix::keep_end_of_step() {
  gather_atoms();
  on_first([this] { impacts_->end_step(all_body_); });
}

/// Whether something reads the local array in this step; dumps tell their steps.
bool ImpactFix::local_is_read() const {
  if (output->next_dump_any == update->ntimestep) return true;
  for (int k = 0; k < modify->ncompute; ++k)
    if (begins_with(modify->compute[k]->style, "reduce")) return true;
  for (const Fix* const fix : fixes())
    if (begins_with(fix->style, "ave/histo")) return true;
  return false;
}

/// The contacts with a force, all of them on the first rank.
void ImpactFix::fill_local() {
  size_local_rows = 0;
  if (!ranks_.is_here()) return;
  const std::vector<ContactResult>& all = impacts_->contacts();
  if (int(all.size()) > local_capacity_) {
    local_capacity_ = 2 * int(all.size());
    memory->destroy(array_local);
    memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
  }
  for (const ContactResult& c : all)
    if (c.normal_force > 0.0) std::copy_n(table_row(c).begin(), int(local_columns), array_local[size_local_rows++]);
}

double ImpactFix::compute_vector(int k) { return dembark::to_numbers(impacts_->report)[std::size_t(k)]; }

double ImpactFix::memory_usage() {
  return impacts_->memory() + double(local_capacity_ * local_columns + atom_capacity_ * atom_columns) * sizeof(double);
}

void ImpactFix::write_restart(FILE* file) {
  keep_end_of_step();
  if (!ranks_.is_here()) return;
  const std::vector<double> state = impacts_->state();
  write_part(file, {{state.data(), state.size() * sizeof(double)}});
}

void ImpactFix::restart(char* buffer) {
  checked([&] { impacts_->restore(SavedPart(buffer).rest<double>()); });
}

}  // namespace dembark_family
