#include "wall_surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "comm.h"
#include "domain.h"
#include "region.h"
#include "utils.h"

#include "contact_call.h"
#include "engine_access.h"
#include "shared_stl.h"

using namespace LAMMPS_NS;
using dembark::Triangle;

namespace dembark_lammps {
namespace {

double Vec3::* const axes[3] = {&Vec3::x, &Vec3::y, &Vec3::z};

}  // namespace

RegionSurface::RegionSurface(LAMMPS* lmp, const std::string& id) : WallSurface(lmp), id_(id) {
  find();
  region_->reset_vel();
}

void RegionSurface::find() {
  region_ = domain->get_region_by_id(id_);
  if (!region_) throw std::invalid_argument("there is no region " + id_);
}

void RegionSurface::prepare(double, const dembark::PrescribedMotion* motion) {
  find();
  const std::string style = region_->style;
  if (region_->dynamic_check() && (style == "union" || style == "intersect"))
    throw std::invalid_argument("region " + id_ + " (" + style +
                                ") has moving parts, of whose velocity LAMMPS says nothing; take a fix wall/dembark for each part, " +
                                "or 'motion' for all");
  axis_length_ = region_->rotateflag ? axis_length(region_) : 1.0;
  if (region_->dynamic_check() && motion)
    throw std::invalid_argument("region " + id_ + " moves by itself; take 'move' and 'rotate' from it, or 'motion' from the fix");
}

void RegionSurface::begin_step() {
  moves_ = region_->dynamic_check();
  region_->prematch();
  if (moves_) region_->set_velocity();
}

Vec3 RegionSurface::spin() const { return moves_ && region_->rotateflag ? (1.0 / axis_length_) * vector(region_->omega) : Vec3{}; }

Vec3 RegionSurface::origin() const { return region_->rotateflag ? vector(region_->rpoint) : Vec3{}; }

const std::vector<WallContact>& RegionSurface::contacts(const Vec3& centre, double radius, double reach) {
  found_.clear();
  if (!region_->match(centre.x, centre.y, centre.z)) return found_;
  const int count = region_->surface(centre.x, centre.y, centre.z, radius + reach);
  for (int c = 0; c < count; ++c) {
    const Region::Contact& contact = region_->contact[c];
    WallContact one{contact.iwall, {contact.delx, contact.dely, contact.delz}};
    if (moves_) {
      double velocity[3], place[3] = {centre.x, centre.y, centre.z};
      region_->velocity_contact(velocity, place, c);
      one.velocity = vector(velocity);
      // With an axis of another length than 1.
      if (region_->rotateflag) one.velocity += cross(spin() - vector(region_->omega), centre - one.separation - origin());
    }
    found_.push_back(one);
  }
  return found_;
}

TriangleSurface::TriangleSurface(LAMMPS* lmp, const std::string& file, double precision)
    : WallSurface(lmp), surface_(dembark::SurfaceContacts::usual_smooth_angle, precision) {
  dembark::StlSurface read = dembark_family::read_shared_stl(file, precision, world);
  if (const std::string line = read.left_out(file); comm->me == 0 && !line.empty()) utils::logmesg(lmp, line + "\n");
  own_ = read.triangles.size();
  surface_.update(std::move(read.triangles));
}

void TriangleSurface::prepare(double reach, const dembark::PrescribedMotion* motion) {
  if (domain->triclinic) throw std::invalid_argument("an STL surface needs a box with right angles");
  for (int k = 0; k < 3; ++k) {
    if (!domain->periodicity[k]) continue;
    const std::string direction = std::string("direction ") + "xyz"[k];
    if (motion && motion->turns_out_of(k)) throw std::invalid_argument("its motion turns the surface out of the periodic " + direction);
    if (domain->box_change_size || domain->box_change_shape)
      throw std::invalid_argument("the box changes its size, and its surface is periodic along " + direction);
  }
  copy_across_periods(reach);
}

/// Grains in the box are near these copies alone.
void TriangleSurface::copy_across_periods(double reach) {
  reach_ = reach;
  surface_.expect(reach);
  if (!domain->xperiodic && !domain->yperiodic && !domain->zperiodic) return;
  std::vector<Triangle> all(surface_.triangles().begin(), surface_.triangles().begin() + std::ptrdiff_t(own_));
  for (int k = 0; k < 3; ++k) {
    if (!domain->periodicity[k]) continue;
    const std::size_t count = all.size();
    for (const int sign : {-1, 1})
      for (std::size_t i = 0; i < count; ++i) {
        Triangle copy = all[i];
        for (Vec3& node : copy.node) node.*axes[k] += sign * domain->prd[k];
        const auto [from, to] = box(copy, reach);
        if (to.*axes[k] > domain->boxlo[k] && from.*axes[k] < domain->boxhi[k]) all.push_back(copy);
      }
  }
  copies_.clear();
  for (std::size_t i = own_; i < all.size(); ++i) copies_.emplace_back(int(all[i].id), int(i));
  std::sort(copies_.begin(), copies_.end());
  surface_.update(std::move(all));
}

/// With a periodic wall, or a grain that is about to be, beyond the box.
Vec3 TriangleSurface::wrapped(Vec3 place) const {
  for (int k = 0; k < 3; ++k)
    if (domain->periodicity[k]) place.*axes[k] -= domain->prd[k] * std::floor((place.*axes[k] - domain->boxlo[k]) / domain->prd[k]);
  return place;
}

const std::vector<WallContact>& TriangleSurface::contacts(const Vec3& centre, double radius, double reach) {
  found_.clear();
  // Grains that enter or grow during a run may be larger than all before.
  if (radius + reach > reach_ && (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    copy_across_periods(1.25 * (radius + reach));
  surface_.contacts(wrapped(centre), radius, radius + reach, points_);
  for (const dembark::SurfacePoint& point : points_)
    found_.push_back({int(surface_.triangles()[std::size_t(point.triangle)].id), point.at.arm, {}, point.triangle});
  return found_;
}

bool TriangleSurface::goes_on(int before, const WallContact& now, const Vec3& centre, double radius) const {
  if (before == now.surface) return true;
  const Vec3 place = wrapped(centre);
  if (surface_.follow(before, place, radius) == now.triangle) return true;
  for (auto copy = std::lower_bound(copies_.begin(), copies_.end(), std::pair(before, 0)); copy != copies_.end() && copy->first == before;
       ++copy)
    if (surface_.follow(copy->second, place, radius) == now.triangle) return true;
  return false;
}

std::vector<Vec3> TriangleSurface::middles() const {
  std::vector<Vec3> all;
  for (std::size_t i = 0; i < own_; ++i) {
    const Triangle& triangle = surface_.triangles()[i];
    all.push_back((1.0 / 3.0) * (triangle.node[0] + triangle.node[1] + triangle.node[2]));
  }
  return all;
}

}  // namespace dembark_lammps
