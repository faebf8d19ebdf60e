#include "fix_wall_dembark.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "region.h"
#include "update.h"
#include "utils.h"

#include "contact_call.h"
#include "fix_capillary_liquid.h"
#include "pair_dembark_granular.h"

using namespace LAMMPS_NS;
using dembark_lammps::add;
using dembark_lammps::Vec3;
using dembark_lammps::vector;

FixWallDembark::FixWallDembark(LAMMPS* lmp, int narg, char** arg) : RowsFix(lmp, narg, arg) {
  const auto word = [&](int k) { return k < narg ? std::string(arg[k]) : std::string(); };
  const std::string kind = word(3);
  const bool precise = kind == "stl" && word(7) == "precision";
  const int rest = precise ? 9 : 7;  // behind it is the motion
  if (narg < rest || (kind != "region" && kind != "stl") || word(5) != "type" || (narg > rest && word(rest) != "motion"))
    fail(
        "it is written 'wall/dembark region ID type T' or 'wall/dembark stl FILE type T [precision P]', and 'motion TERM ...' behind them");
  wall_type_ = utils::is_integer(word(6)) ? utils::inumeric(FLERR, word(6), false, lmp) : 0;
  if (wall_type_ < 1 || wall_type_ > atom->ntypes) fail("there is no atom type " + word(6));
  const double precision = precise ? utils::numeric(FLERR, word(8), false, lmp) : dembark::SurfaceContacts::usual_precision;
  if (!(precision >= 0.0 && std::isfinite(precision))) fail("precision " + word(8) + " must be a length >= 0 (m)");
  find_pair();
  checked([&] {
    if (kind == "region") surface_ = std::make_unique<dembark_lammps::RegionSurface>(lmp, word(4));
    else surface_ = std::make_unique<dembark_lammps::TriangleSurface>(lmp, word(4), precision);
    if (narg > rest) moving_ = std::make_unique<dembark_family::MovingWall>(std::vector<std::string>(arg + rest + 1, arg + narg));
  });
  layout_ = pair_->coefficients().layout();
  restart_global = 1;
  vector_flag = peratom_flag = 1;
  size_vector = int(totals_.size()) + (moving_ ? dembark_family::MovingWall::all_numbers : 0);
  size_peratom_cols = 3;
  nevery = global_freq = peratom_freq = 1;
  extvector = 1;
  time_depend = moving_ ? 1 : 0;
  make_rows(0);
}

FixWallDembark::~FixWallDembark() { memory->destroy(force_); }

void FixWallDembark::find_pair() {
  const std::string name = dembark_lammps::ContactCoefficients::style_name;
  Pair* const host = force->pair_match(name, 1);
  pair_ = dynamic_cast<PairDembarkGranular*>(host ? host : force->pair_match(name + "/kk", 1));
  if (!pair_) fail("its coefficients are those of pair_style dembark/granular, which must come first");
}

int FixWallDembark::setmask() { return FixConst::POST_FORCE | (moving_ ? FixConst::END_OF_STEP : 0); }

void FixWallDembark::init() {
  find_pair();
  liquid_ = layout_.imbalance ? dembark_lammps::find_liquid(modify) : nullptr;
  tally_ = dembark_lammps::find_energy_tally(modify);
  checked([&] {
    surface_->prepare(pair_->largest_radius() + (layout_.cohesion ? neighbor->skin : 0.0), moving_ ? &moving_->motion() : nullptr);
  });
  if (pair_->coefficients().layout().code() != layout_.code()) fail("pair_style has other options than before; define the fix again");
  check_types();
  if (!moving_) return;
  checked([&] { moving_->begin(*update); });
  // A gate may leave, but grains cannot follow.
  if (const std::string gone = moving_->outside(surface_->middles(), {}, *update, *domain, world); !gone.empty())
    warn("the motion takes its surface " + gone + "; grains that it takes along are lost");
}

/// Of grains with `pair_style hybrid` some may belong to another style.
void FixWallDembark::check_types() {
  std::vector<int> there(std::size_t(atom->ntypes + 1), 0);
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & groupbit) there[std::size_t(atom->type[i])] = 1;
  MPI_Allreduce(MPI_IN_PLACE, there.data(), int(there.size()), MPI_INT, MPI_MAX, world);
  for (int type = 1; type <= atom->ntypes; ++type)
    if (there[std::size_t(type)] && !pair_->coefficients().is_complete(type, wall_type_)) fail(not_for(type));
}

std::string FixWallDembark::not_for(int type) const {
  const std::string other = std::to_string(type), own = std::to_string(wall_type_);
  return "its group has grains of type " + other + ", and pair_coeff gives types " + other + " and " + own +
         " no dembark/granular; give it, or take a group without them";
}

void FixWallDembark::refuse_coincidence(int i) const {
  error->one(FLERR, "fix wall/dembark: the centre of grain {} lies on the wall", atom->tag[i]);
}

/// Takes up where the wall is now.
void FixWallDembark::move() {
  // The clock first sees the beginning of the step, from which on a time step may be a new one.
  const double dt = update->dt, before = moving_->time(update->ntimestep - 1, dt), now = moving_->time(update->ntimestep, dt);
  moving_->arrive(before, now, dt);
  frame_ = dembark::WallFrame(moving_->motion(), moving_->state());
}

void FixWallDembark::setup(int vflag) {
  post_force(vflag);
  if (moving_) moving_->begin_sums(load());
}

/// The history that a contact goes on with, or nullptr.
const double* FixWallDembark::history_of(const dembark_lammps::WallContact& contact, const Vec3& centre, double radius) const {
  const double* const end = before_.data() + before_.size();
  for (const double* slot = before_.data(); slot < end; slot += slot_size())
    if (slot[0] == contact.surface + 1) return slot + 1;
  for (const double* slot = before_.data(); slot < end; slot += slot_size())
    if (surface_->goes_on(int(slot[0]) - 1, contact, centre, radius)) return slot + 1;
  return nullptr;
}

Vec3 FixWallDembark::origin() const { return moving_ ? moving_->centre() : surface_->origin(); }

void FixWallDembark::post_force(int) {
  surface_->begin_step();
  if (moving_) move();
  totals_ = {};
  summed_ = -1;
  // The forces of the set-up are those of the present state, which stays.
  const bool advance = !update->setupflag;
  for (int i = 0; i < atom->nlocal; ++i) {
    std::fill_n(force_[i], 3, 0.0);
    if (atom->mask[i] & groupbit) act_on(i, advance);
  }
}

void FixWallDembark::act_on(int i, bool advance) {
  std::vector<double>& slots = row(i);
  double reach = 0.0;  // of its longest bridge
  for (std::size_t k = 0; layout_.cohesion && k < slots.size(); k += std::size_t(slot_size()))
    reach = std::max(reach, slots[k + 1 + std::size_t(layout_.cohesion_at()) + 1]);
  const Vec3 x = vector(atom->x[i]), centre = frame_.inside(x);
  const std::vector<dembark_lammps::WallContact>& contacts = surface_->contacts(centre, atom->radius[i], reach);
  if (contacts.empty() && slots.empty()) return;
  before_ = slots;
  if (advance) slots.clear();
  // Until the end of the step the liquid holds on to where bridges stand.
  slots.reserve(contacts.size() * std::size_t(slot_size()));
  if (!contacts.empty() && !pair_->coefficients().is_complete(atom->type[i], wall_type_)) fail_alone(not_for(atom->type[i]));
  for (const dembark_lammps::WallContact& contact : contacts) {
    const dembark::ContactParameters& p = pair_->coefficients()(atom->type[i], wall_type_);
    dembark::ContactBodies b;
    b.separation = frame_.outside(contact.separation);
    b.velocity_1 = vector(atom->v[i]);
    b.angular_velocity_1 = vector(atom->omega[i]);
    b.radius_1 = atom->radius[i];
    b.mass_1 = pair_->mass(i);
    b.velocity_2 = contact.velocity;
    b.wall_spin = surface_->spin();
    if (moving_) {
      b.wall_spin = moving_->spin();
      b.velocity_2 = moving_->velocity_at(x - b.separation);
    }
    dembark::ContactState state;
    const double* const history = history_of(contact, centre, atom->radius[i]);
    if (history) layout_.load(history, state);
    const double volume = state.cohesion.bridge_volume;
    const bool was_held = state.cohesion.held();
    const dembark::ContactForce out = contact_step(p, b, update->dt, state, advance);
    if (dembark::has_no_direction(out.normal)) refuse_coincidence(i);
    const bool touching = out.overlap > 0.0;
    if (advance && (state.cohesion.held() || (liquid_ && touching)))
      dembark_lammps::check_time_step(error, p.cohesion.liquid, b, update->dt);
    if (!out.interacting && !(volume > 0.0)) continue;
    if (tally_ && out.interacting)
      tally_->add(p, b, out, state, advance, i, x, moving_ ? moving_->acceleration() : dembark::WallAcceleration{});
    if (advance) {
      slots.resize(slots.size() + std::size_t(slot_size()));
      double* const next = slots.data() + slots.size() - slot_size();
      next[0] = contact.surface + 1;
      layout_.store(next + 1, state);
      if (liquid_) {
        double* const imbalance = next + 1 + layout_.imbalance_at();
        *imbalance = history ? history[layout_.imbalance_at()] : 0.0;
        liquid_->report({i, liquid_->wall_number(this), true}, atom->radius[i], INFINITY, p.cohesion.liquid, touching, volume,
                        next + 1 + layout_.cohesion_at(), imbalance);
      }
    }
    add(atom->f[i], out.force);
    add(atom->torque[i], out.torque_1);
    add(force_[i], out.force);
    add(totals_.data(), out.force);
    add(totals_.data() + 3, cross(x - origin(), out.force) + out.torque_1);
    totals_[6] += touching;
    totals_[7] += state.cohesion.held();
  }
  make_room(i);
}

const std::vector<double>& FixWallDembark::overlaps(int i) {
  overlaps_.clear();
  for (const dembark_lammps::WallContact& contact : surface_->contacts(frame_.inside(vector(atom->x[i])), atom->radius[i], 0.0))
    if (const double overlap = atom->radius[i] - norm(contact.separation); overlap > 0.0) overlaps_.push_back(overlap);
  return overlaps_;
}

/// Collective.
const std::array<double, 8>& FixWallDembark::totals() {
  if (summed_ != update->ntimestep) MPI_Allreduce(totals_.data(), all_totals_.data(), int(totals_.size()), MPI_DOUBLE, MPI_SUM, world);
  summed_ = update->ntimestep;
  return all_totals_;
}

dembark::WallLoad FixWallDembark::load() { return {vector(totals().data()), vector(totals().data() + 3)}; }

void FixWallDembark::end_of_step() { moving_->end_step(load(), update->dt); }

double FixWallDembark::compute_vector(int k) {
  const int count = int(totals_.size());
  return k < count ? totals()[std::size_t(k)] : moving_->number(k - count);
}

void FixWallDembark::grow_arrays(int count) {
  RowsFix::grow_arrays(count);
  memory->grow(force_, count, 3, "wall/dembark:force");
  array_atom = force_;
}

void FixWallDembark::copy_arrays(int from, int to, int mode) {
  RowsFix::copy_arrays(from, to, mode);
  std::copy_n(force_[from], 3, force_[to]);
}

void FixWallDembark::set_arrays(int i) {
  RowsFix::set_arrays(i);
  std::fill_n(force_[i], 3, 0.0);
}

int FixWallDembark::pack_restart(int i, double* buffer) {
  buffer[0] = size_restart(i);
  buffer[1] = layout_key();
  std::copy(row(i).begin(), row(i).end(), buffer + 2);
  return size_restart(i);
}

void FixWallDembark::unpack_restart(int i, int nth) {
  const double* const saved = restart_row(i, nth);
  if (saved[1] != layout_key()) fail_alone("the restart file was written with other options of pair_style, whose histories differ");
  row(i).assign(saved + 2, saved + int(saved[0]));
}

void FixWallDembark::write_restart(FILE* file) {
  if (comm->me != 0) return;
  dembark_family::Pieces pieces{{"", 1}};
  if (moving_) pieces = moving_->pieces();
  const std::string of_region = region_state();
  pieces.emplace_back(of_region.data(), of_region.size());
  write_part(file, pieces);
}

void FixWallDembark::restart(char* buffer) {
  checked([&] {
    dembark_family::SavedPart saved(buffer);
    if (moving_) moving_->restore(saved);
    else dembark_family::MovingWall::expect(saved, "");
    std::vector<char> of_region = saved.rest<char>();
    int read = 0;
    if (of_region.size() != region_state().size() || (!of_region.empty() && !surface_->region()->restart(of_region.data(), read)))
      throw std::invalid_argument("the restart file was written with another surface");
  });
}

/// How a region moved in the last step, as LAMMPS writes it; nothing of triangles.
std::string FixWallDembark::region_state() const {
  Region* const region = surface_->region();
  return region ? written([region](FILE* to) { region->write_restart(to); }) : "";
}
