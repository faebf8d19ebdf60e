#include "liquid_fix.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <utility>

#include "neighbor.h"

using namespace LAMMPS_NS;
namespace capillary = dembark::capillary;

namespace dembark_family {
namespace {

std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

}  // namespace

LiquidFix::LiquidFix(LAMMPS* lmp, int narg, char** arg, const char* wall_style, const char* walls_with, bool keeps_grains)
    : SharedFix(lmp, narg, arg), walls_with_(walls_with), wall_style_(wall_style), keeps_grains_(keeps_grains) {
  only_one();
  if (std::strcmp(arg[1], "all") != 0) fail("the group must be 'all': every grain owns its liquid");
  content_ = checked([&] { return capillary::read_liquid({arg + 3, arg + narg}, wall_style_, ledger_); });
  for (const capillary::LiquidWall& wall : ledger_.walls) unmet_.push_back(wall.name);
  restart_global = restart_peratom = create_attribute = 1;
  nevery = global_freq = 1;
  vector_flag = 1;
  size_vector = 8;
  extvector = 1;
  comm_forward = 1;
  atom->add_callback(on_growth);
  atom->add_callback(on_restart);
  // Reduced on one rank, so that the walls hold the same numbers on all of them.
  ledger_.sum_over_processes = [this](std::vector<long double>& sums) {
    std::vector<long double> mine(sums);
    MPI_Reduce(mine.data(), sums.data(), int(sums.size()), MPI_LONG_DOUBLE, MPI_SUM, 0, world);
    MPI_Bcast(sums.data(), int(sums.size()), MPI_LONG_DOUBLE, 0, world);
  };
  ledger_.copy_to_others = [this](std::vector<double>& grants) {
    granted_ = &grants;
    copy_to_ghosts();
  };
}

LiquidFix::~LiquidFix() {
  atom->delete_callback(id, on_growth);
  atom->delete_callback(id, on_restart);
}

std::string LiquidFix::amount(double volume) const {
  const std::string units = update->unit_style;
  return digits(volume) + (units == "si" ? " m^3" : units == "cgs" ? " cm^3" : "");
}

void LiquidFix::init() {
  if (force->newton_pair) fail("newton must be off: each rank settles the contacts of the grains that it owns");
  only_verlet();
}

void LiquidFix::take_walls(const std::vector<std::string>& names) {
  const auto there = [&](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  for (const std::string& name : unmet_)
    if (!there(name)) fail("there is no " + wall_style_ + " " + name + walls_with_);
  unmet_.clear();
  for (const capillary::LiquidWall& wall : ledger_.walls)
    if (!there(wall.name) && wall.pool > 0.0) warn("wall " + wall.name + " is gone, and with it " + amount(wall.pool) + " of liquid");
  ledger_.change_walls(names, grains());
}

void LiquidFix::setup_pre_force(int) {
  requests_.clear();
  broken_.clear();
  after_new_list();
}

void LiquidFix::report(const capillary::BridgeSides& sides, double radius, double other_radius, const dembark::Liquid& law, bool touching,
                       double before, double* bridge, double* imbalance, bool primitive_wall) {
  if (bridge[0] > 0.0) return;
  if (before > 0.0) bridge_broke({sides, before, std::exchange(*imbalance, 0.0)});
  if (!touching) return;
  Request request;
  request.sides = sides;
  request.radius = radius;
  request.other_radius = other_radius;
  request.bridge = bridge;
  request.imbalance = imbalance;
  request.force = law.force;
  request.primitive_wall = primitive_wall;
  requests_.push_back(request);
}

void LiquidFix::pre_force(int) {
  if (neighbor->ago == 0) after_new_list();
}

/// Grains have come, left or gone to other ranks, and the lists may have lost bridges to partners that left or jumped out of reach.
void LiquidFix::after_new_list() {
  const auto grain = [this](int i) { return "grain " + std::to_string(atom->tag[i]); };
  const int wrong = ledger_.admit(grains(), [this](int i) { return content_.of(atom->radius[i]); });
  if (wrong >= 0) fail_alone(grain(wrong) + " has liquid " + amount(grains().volume[wrong]) + "; it must be >= 0");
  double excess = 0.0;
  const int full = ledger_.reconcile_pairs(grains(), [this](const auto& visit) { each_pair_bridge(visit); }, excess);
  if (full >= 0)
    fail_alone(
        "the bridges of " + grain(full) + " hold " + amount(excess) +
        " more than it gave to them: they are older than this fix, or it touches a grain and an image of it in a box smaller than two "
        "cut-offs");
  const double missing = ledger_.audit(grains(), !update->setupflag && update->ntimestep > update->firststep);
  if (missing != 0.0)
    fail("there is " + amount(ledger_.expected) + " of liquid, and " + amount(ledger_.expected + missing) +
         " is due: the liquid of grains was changed during the run; look for fixes and commands that set it or that delete and create "
         "grains in one step");
}

void LiquidFix::end_of_step() {
  ledger_.give_back(broken_, grains());
  ledger_.reconcile_walls(grains(), [this](int i, std::size_t wall, const auto& visit) { each_wall_bridge(i, wall, visit); });
  ledger_.form(requests_, grains(), [this](const Request& r, const capillary::NewBridge<double>& bridge) {
    const double rupture = r.force->rupture_distance(r.radius, r.other_radius, bridge.volume);
    check_reach(r, rupture);
    r.bridge[0] = bridge.volume;
    r.bridge[1] = rupture;
    *r.imbalance = bridge.imbalance;
  });
}

/// Number of all bridges. Collective.
double LiquidFix::count_bridges() const {
  double mine = 0.0, all = 0.0;
  each_pair_bridge([&](int, int j, double, double) { mine += j < atom->nlocal ? 1.0 : 0.5; });
  for (std::size_t w = 0; w < ledger_.walls.size(); ++w) {
    const capillary::LiquidWall& wall = ledger_.walls[w];
    // Between two runs a wall may be gone already.
    if (!wall_is_there(w)) continue;
    for (int i = 0; i < atom->nlocal; ++i)
      if (wall.of_grain[std::size_t(i)] + wall.own[std::size_t(i)] > 0.0) each_wall_bridge(i, w, [&](double&, double&) { mine += 1.0; });
  }
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  return all;
}

double LiquidFix::compute_vector(int n) {
  const capillary::LiquidLedger::Totals now = ledger_.totals(grains());
  const double count = n == 4 ? count_bridges() : 0.0;
  const double values[] = {now.grains, now.bridges,   now.walls,  ledger_.lost,
                           count,      ledger_.added, now.held(), now.held() - ledger_.expected};
  return values[n];
}

void LiquidFix::copy_arrays(int from, int to, int) {
  std::vector<double> row(static_cast<std::size_t>(row_size()));
  LiquidFix::pack_exchange(from, row.data());
  LiquidFix::unpack_exchange(to, row.data());
}

void LiquidFix::set_arrays(int i) {
  if (keeps_grains_) volumes()[i] = capillary::GrainLiquid::unset;
  ledger_.each_number(i, [](double& number) { number = 0.0; });
}

int LiquidFix::pack_exchange(int i, double* buffer) {
  if (keeps_grains_) *buffer++ = volumes()[i];
  ledger_.each_number(i, [&](double number) { *buffer++ = number; });
  return row_size();
}

int LiquidFix::unpack_exchange(int i, double* buffer) {
  if (keeps_grains_) volumes()[i] = *buffer++;
  ledger_.each_number(i, [&](double& number) { number = *buffer++; });
  return row_size();
}

int LiquidFix::pack_restart(int i, double* buffer) {
  buffer[0] = 1 + row_size();
  return 1 + LiquidFix::pack_exchange(i, buffer + 1);
}

/// Of walls that the file does not know nothing is there.
void LiquidFix::unpack_restart(int i, int nth) {
  const double* from = restart_row(i, nth);
  const double* const end = from + int(*from);
  if (keeps_grains_) volumes()[i] = *++from;
  ledger_.each_number(i, [&](double& number) {
    if (++from < end) number = *from;
  });
}

void LiquidFix::write_restart(FILE* file) {
  if (comm->me != 0) return;
  const std::string saved = ledger_.saved(false);
  write_part(file, {{saved.c_str(), saved.size() + 1}});
}

/// init() finds the fixes of the walls.
void LiquidFix::restart(char* buffer) {
  checked([&] { restore_liquid(ledger_, SavedPart(buffer).text()); });
  ledger_.resize(std::size_t(atom->nmax));
}

double LiquidFix::memory_usage() { return double((ledger_.numbers() + 2) * std::size_t(atom->nmax) * sizeof(double)); }

}  // namespace dembark_family
