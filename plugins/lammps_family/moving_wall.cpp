#include "moving_wall.h"

#include <algorithm>
#include <stdexcept>

using namespace LAMMPS_NS;
using dembark::number_text;

namespace dembark_family {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + word;
  return line;
}

}  // namespace

MovingWall::MovingWall(const std::vector<std::string>& words) : words_(joined(words)), motion_(words_) {}

void MovingWall::begin(const Update& update) {
  if (const std::string wrong = motion_.step_error(update.dt); !wrong.empty()) throw std::invalid_argument(wrong);
  clock_.begin(update.atime, long(update.atimestep), long(update.ntimestep), update.dt);
  motion_.begin(clock_.begun);
  state_ = motion_.at(time(update.ntimestep, update.dt));
}

void MovingWall::arrive(double before, double now, double dt) {
  state_ = motion_.at(now);
  step_ = motion_.step(before, dt);
  acceleration_ = wall_acceleration(motion_, now, dt);
}

void MovingWall::begin_sums(const dembark::WallLoad& load) {
  if (!resumed_) sums_.begin(power(load), load.force);
  resumed_ = false;
}

double MovingWall::number(int k) const {
  const dembark::WallState& s = state_;
  const double all[all_numbers] = {s.displacement.x, s.displacement.y,       s.displacement.z, s.angle,          s.velocity.x,
                                   s.velocity.y,     s.velocity.z,           s.rate,           s.acceleration.x, s.acceleration.y,
                                   s.acceleration.z, s.angular_acceleration, sums_.power,      sums_.work,       sums_.impulse.x,
                                   sums_.impulse.y,  sums_.impulse.z};
  return all[k];
}

std::string MovingWall::outside(const std::vector<Vec3>& middles, const dembark::WallState& at, const Update& update, const Domain& box,
                                MPI_Comm world) {
  const double now = time(update.ntimestep, update.dt);
  const dembark::WallReach reach = motion_.reach(now, now + double(update.laststep - update.ntimestep) * update.dt);
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
  for (const Vec3& place : middles) {
    Vec3 from, to;
    motion_.bounds(place, at, reach, from, to);
    const double least[3] = {from.x, from.y, from.z}, most[3] = {to.x, to.y, to.z};
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], least[k]);
      high[k] = std::max(high[k], most[k]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, low, 3, MPI_DOUBLE, MPI_MIN, world);
  MPI_Allreduce(MPI_IN_PLACE, high, 3, MPI_DOUBLE, MPI_MAX, world);
  constexpr int fixed = 1;  // periodic is 0, faces that shrink are 2 and 3
  for (int k = 0; k < 3; ++k)
    if ((box.boundary[k][0] == fixed && low[k] < box.boxlo[k]) || (box.boundary[k][1] == fixed && high[k] > box.boxhi[k]))
      return std::string("out of the box along ") + "xyz"[k] + ": it comes from " + number_text(low[k]) + " to " + number_text(high[k]) +
             ", and the box is from " + number_text(box.boxlo[k]) + " to " + number_text(box.boxhi[k]);
  return "";
}

Pieces MovingWall::pieces() const { return {{words_.c_str(), words_.size() + 1}, {&clock_, sizeof clock_}, {&sums_, sizeof sums_}}; }

void MovingWall::expect(SavedPart& saved, const std::string& words) {
  if (const std::string before = saved.text(); before != words)
    throw std::invalid_argument("in the restart file its motion is '" + before +
                                "'; take that, or give the fix another ID: a motion that is new begins where the wall stands");
}

void MovingWall::restore(SavedPart& saved) {
  expect(saved, words_);
  saved.read(&clock_);
  saved.read(&sums_);
  resumed_ = sums_.begun > 0.0;
}

}  // namespace dembark_family
