// The faces of a region that a device knows: a plane, the planes of a block, and a cylinder's inside with its ends.
#ifndef DEMBARK_WALL_FACES_H
#define DEMBARK_WALL_FACES_H

#include <cmath>
#include <string>
#include <vector>

#include "domain.h"
#include "region.h"

#include "dembark/vec3.hpp"

namespace dembark_lammps {

/// A plane, or the inner side of a cylinder without ends.
struct WallFace {
  int number = 0;                     ///< that the region gives it
  double radius = 0.0;                ///< m, 0 of a plane
  dembark::Vec3<double> point{};      ///< m, of the plane or the cylinder's axis
  dembark::Vec3<double> direction{};  ///< into the region, or along the axis

  /// From the face to a place: its length is how far away it is. `distance` (m) is negative on the other side.
  DEMBARK_FUNCTION dembark::Vec3<double> arm(const dembark::Vec3<double>& place, double& distance) const {
    const dembark::Vec3<double> from = place - point;
    const double along = dot(from, direction);
    if (radius == 0.0) {
      distance = along;
      return along * direction;
    }
    const dembark::Vec3<double> across = from - along * direction;
    const double r = norm(across);
    distance = radius - r;
    return (1.0 - radius / r) * across;
  }
};

constexpr int most_faces = 6;

/// Regions keep their numbers to themselves: they are read off from bounds and from what a region says of single places.
class FaceFinder {
  typedef dembark::Vec3<double> Vec3;

 public:
  FaceFinder(LAMMPS_NS::Region& region, const LAMMPS_NS::Domain& domain) : region_(region), domain_(domain) {}

  /// None of a region that a device does not know.
  std::vector<WallFace> faces() {
    const std::string style = std::string(region_.style).substr(0, std::string(region_.style).find('/'));
    if (region_.dynamic_check() || region_.varshape || region_.openflag) return {};
    if (style == "plane") return plane();
    if (!region_.bboxflag || !region_.interior) return {};
    if (style == "block") return ends({0, 1, 2}, 0);
    if (style == "cylinder") return cylinder();
    return {};
  }

 private:
  LAMMPS_NS::Region& region_;
  const LAMMPS_NS::Domain& domain_;

  static Vec3 unit(int k) { return {double(k == 0), double(k == 1), double(k == 2)}; }
  Vec3 middle() const { return {middle(0), middle(1), middle(2)}; }
  double middle(int k) const { return 0.5 * (domain_.boxlo[k] + domain_.boxhi[k]); }

  /// What the region says of `place` (m) and one of its faces, or nullptr.
  const LAMMPS_NS::Region::Contact* contact(const Vec3& place, int number) {
    if (!region_.match(place.x, place.y, place.z)) return nullptr;
    const int count = region_.surface(place.x, place.y, place.z, INFINITY);
    for (int c = 0; c < count; ++c)
      if (region_.contact[c].iwall == number) return &region_.contact[c];
    return nullptr;
  }
  static Vec3 arm(const LAMMPS_NS::Region::Contact& of) { return {of.delx, of.dely, of.delz}; }

  std::vector<WallFace> plane() {
    const double size = norm(Vec3{domain_.prd[0], domain_.prd[1], domain_.prd[2]});
    for (const double far : {1.0, 1e3})
      for (int k = 0; k < 3; ++k)
        for (const double sign : {-1.0, 1.0}) {
          const Vec3 place = middle() + (sign * far * size) * unit(k);
          const LAMMPS_NS::Region::Contact* there = contact(place, 0);
          if (!there || there->r == 0.0) continue;
          const Vec3 direction = (1.0 / norm(arm(*there))) * arm(*there);
          // Again from a place near the box, where round-off is small.
          const Vec3 near = middle() + (size - dot(middle() - (place - arm(*there)), direction)) * direction;
          there = contact(near, 0);
          if (there) return {{0, 0.0, near - arm(*there), direction}};
        }
    return {};
  }

  /// The planes across `axes`, with numbers from `first` on. LAMMPS has INF as 1e20.
  std::vector<WallFace> ends(const std::vector<int>& axes, int first) const {
    const double low[] = {region_.extent_xlo, region_.extent_ylo, region_.extent_zlo};
    const double high[] = {region_.extent_xhi, region_.extent_yhi, region_.extent_zhi};
    std::vector<WallFace> all;
    for (const int k : axes) {
      if (low[k] > -1e19) all.push_back({first, 0.0, low[k] * unit(k), unit(k)});
      if (high[k] < 1e19) all.push_back({first + 1, 0.0, high[k] * unit(k), -unit(k)});
      first += 2;
    }
    return all;
  }

  std::vector<WallFace> cylinder() {
    const double low[] = {region_.extent_xlo, region_.extent_ylo, region_.extent_zlo};
    const double high[] = {region_.extent_xhi, region_.extent_yhi, region_.extent_zhi};
    double at[3], narrowest = INFINITY;
    for (int k = 0; k < 3; ++k) {
      at[k] = low[k] > -1e19 && high[k] < 1e19 ? 0.5 * (low[k] + high[k]) : std::fmin(std::fmax(middle(k), low[k]), high[k]);
      narrowest = std::fmin(narrowest, high[k] - low[k]);
    }
    // Off the axis, and inside: the arm has no part along the axis.
    const Vec3 place = Vec3{at[0], at[1], at[2]} + (0.2 * narrowest) * Vec3{1.0, 0.9, 0.8};
    const LAMMPS_NS::Region::Contact* const side = contact(place, 2);
    if (!side) return {};
    const int axis = side->delx == 0.0 ? 0 : side->dely == 0.0 ? 1 : 2;
    std::vector<WallFace> all = ends({axis}, 0);
    all.push_back({2, -0.5 * side->radius, {at[0], at[1], at[2]}, unit(axis)});
    return all;
  }
};

}  // namespace dembark_lammps

#endif
