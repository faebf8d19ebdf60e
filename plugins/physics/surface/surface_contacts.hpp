// Triangles as one surface: a sphere has a contact where its distance to the surface has a minimum, however the surface is cut into
// triangles, and whatever lies on it twice.
//
// Each triangle that a sphere reaches has a point closest to the sphere's centre. It gives way to a triangle that is nearer to the centre
// if
//   - both points are one, within the precision: one of them lies on the other triangle (an edge, a corner, a triangle given twice, patches
//     that overlap);
//   - the nearer one stands before the point: from the centre it is seen in the same direction, within the smooth angle, and no farther
//     away (a slight groove, an open seam, sheets one above the other, a rib below a floor).
// What remains are the contacts. Equal distances are settled by the triangles' order. As that order is the same for all, the nearest
// triangle always remains, so that no contact is lost and none counts twice: a flat patch is a plane, an edge counts once, and a groove is
// touched on both sides unless it is smooth. Both sides of a triangle are solid. A triangle without area has no contact.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "triangle.hpp"
#include "triangle_cells.hpp"

namespace dembark {

/// A triangle, by its place in the surface, and its point closest to a sphere.
struct SurfacePoint {
  int triangle;
  ClosestPoint at;
};

class SurfaceContacts {
 public:
  /// rad, of walls under forces: sides of a slighter groove are one contact. Springs on both would be twice as stiff.
  static constexpr double usual_smooth_angle = 0.05;
  /// m: points of the surface nearer to each other than this are one point.
  static constexpr double usual_precision = 1e-8;

  SurfaceContacts() = default;
  /// smooth_angle: rad, 0 ... pi/4; conditions on the gap (impacts) need none. precision: m.
  SurfaceContacts(double smooth_angle, double precision)
      : smooth_(smooth_angle > 0.0), cosine_(std::cos(smooth_angle + 1e-9)), tangent_(std::tan(smooth_angle)), precision_(precision) {}

  /// The triangles as they are now. They are sorted anew only when they are others, have changed their shape or have moved against each
  /// other. moved: whether any has since the last call.
  void update(std::vector<Triangle> triangles, bool moved = true) {
    const bool same = std::equal(triangles.begin(), triangles.end(), triangles_.begin(), triangles_.end(),
                                 [](const Triangle& a, const Triangle& b) { return a.id == b.id; });
    if (same && moved && seen_.empty())
      for (const Triangle& t : triangles_) seen_.insert(seen_.end(), t.node, t.node + 3);
    triangles_.swap(triangles);
    if (!same || (moved && !moved_as_one())) sort();
  }
  /// usual: m, of the distances that are asked for. It matters for the speed alone.
  void expect(double usual) {
    if (!(usual > usual_)) return;
    usual_ = usual;
    sort();
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }

  /// Calls visit(t) for each triangle whose box is within `distance` (m) of the place, until one of the calls returns false.
  template <class Visit>
  void near(const Vec3<double>& place, double distance, Visit visit) const {
    // Equal distances differ by round-off.
    const double within = distance + 1e-9 * (distance + cells_.edge()), square = within * within;
    cells_.near(turned_ ? as_sorted(place) : place, turned_ ? within + slack * cells_.edge() : within, [&](int t) {
      const Vec3<double>* n = triangles_[std::size_t(t)].node;
      const auto beyond = [](double p, double a, double b, double c) {
        const double below = std::min(std::min(a, b), c) - p, above = p - std::max(std::max(a, b), c);
        return std::max(std::max(below, above), 0.0);
      };
      const double x = beyond(place.x, n[0].x, n[1].x, n[2].x), y = beyond(place.y, n[0].y, n[1].y, n[2].y);
      const double z = beyond(place.z, n[0].z, n[1].z, n[2].z);
      return x * x + y * y + z * z > square || visit(t);
    });
  }

  /// Contacts of a sphere with all of the surface within `distance` (m) of its centre, the nearest one first.
  void contacts(const Vec3<double>& centre, double radius, double distance, std::vector<SurfacePoint>& found) const {
    found.clear();
    near(centre, distance, [&](int t) {
      const ClosestPoint here = closest_point(triangles_[std::size_t(t)], centre);
      if (here.distance <= distance) found.push_back({t, here});
      return true;
    });
    if (found.size() < 2) return;
    std::sort(found.begin(), found.end(), [](const SurfacePoint& a, const SurfacePoint& b) {
      return a.at.distance != b.at.distance ? a.at.distance < b.at.distance : a.triangle < b.triangle;
    });
    const double touch = touch_of(radius);
    thread_local std::vector<char> gives_way;
    gives_way.assign(found.size(), 0);
    for (std::size_t k = 1; k < found.size(); ++k) {
      // Of many small triangles most give way to one that they touch.
      if (found.size() > many) gives_way[k] = nearer_around(found[k].at.point, touch, found[k], centre, touch) != found[k].triangle;
      for (std::size_t j = k; j-- > 0 && !gives_way[k];) gives_way[k] = yields(found[k], found[j], centre, touch);
    }
    std::size_t kept = 1;
    for (std::size_t k = 1; k < found.size(); ++k)
      if (!gives_way[k]) found[kept++] = found[k];
    found.resize(kept);
  }

  /// Triangle t, if it has a contact with a sphere there; otherwise one to which it gives way; -1 if it has no area.
  /// here: of t, to the centre.
  int owner(int t, const ClosestPoint& here, const Vec3<double>& centre, double radius) const {
    const double touch = touch_of(radius);
    if (is_alone(t, here, radius, touch)) return t;
    if (is_flat(triangles_[std::size_t(t)])) return -1;
    const int next = here.feature == 0 ? t : nearer_around(here.point, touch, {t, here}, centre, touch);
    return next != t ? next : nearer_around(centre, here.distance, {t, here}, centre, touch);
  }

  /// The triangle that a sphere's contact with triangle t is on now.
  int follow(int t, const Vec3<double>& centre, double radius) const {
    for (int next = t; t >= 0; t = next) {
      next = owner(t, closest_point(triangles_[std::size_t(t)], centre), centre, radius);
      if (next == t) break;
    }
    return t;
  }

 private:
  double touch_of(double radius) const { return std::max(1e-6 * radius, precision_); }

  /// Whether no triangle can stand before this point of t: nothing lies over the triangle, and its edges are far enough.
  bool is_alone(int t, const ClosestPoint& here, double radius, double touch) const {
    if (here.feature != 0 || !clear_[std::size_t(t)] || radius + drift_ > usual_) return false;
    const double reach = touch + radius * tangent_ + std::sqrt(2.0 * radius * touch) + drift_;
    const Vec3<double>* n = triangles_[std::size_t(t)].node;
    const Vec3<double> ab = n[1] - n[0], bc = n[2] - n[1], ca = n[0] - n[2], normal = cross(ab, bc);
    const double area2 = dot(normal, normal), limit = reach * reach;
    const auto far = [&](double weight, const Vec3<double>& opposite) { return weight * weight * area2 > limit * dot(opposite, opposite); };
    return far(here.weight[0], bc) && far(here.weight[1], ca) && far(here.weight[2], ab);
  }

  /// Finds the triangles over which no other one lies, as far as `usual_` from them on either side.
  void find_clear() {
    clear_.assign(triangles_.size(), 0);
    if (!(usual_ > 0.0)) return;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (is_flat(triangles_[t])) continue;
      const Vec3<double>* n = triangles_[t].node;
      Vec3<double> normal = cross(n[1] - n[0], n[2] - n[0]);
      normal *= 1.0 / norm(normal);
      const Vec3<double> middle = (1.0 / 3.0) * (n[0] + n[1] + n[2]);
      const double size = std::max({norm(n[0] - middle), norm(n[1] - middle), norm(n[2] - middle)});
      const auto extent = [](const Vec3<double>* nodes, const Vec3<double>& axis) {
        const double p = dot(nodes[0], axis), q = dot(nodes[1], axis), r = dot(nodes[2], axis);
        return std::pair(std::min({p, q, r}), std::max({p, q, r}));
      };
      // Apart along an axis by no less than `by`, an edge that both share not counted.
      const auto apart = [&](const Vec3<double>* other, const Vec3<double>& axis, double by) {
        const double length = norm(axis), least = (by - 1e-9 * size) * length;
        const auto own = extent(n, axis), its = extent(other, axis);
        return length > 0.0 && (its.first - own.second >= least || own.first - its.second >= least);
      };
      std::size_t seen = 0;
      bool clear = true;
      near(middle, std::sqrt(size * size + usual_ * usual_), [&](int k) {
        if (std::size_t(k) == t) return true;
        const Vec3<double>* const other = triangles_[std::size_t(k)].node;
        bool separate = apart(other, normal, usual_);
        for (int e = 0; e < 3 && !separate; ++e)
          separate =
              apart(other, cross(n[(e + 1) % 3] - n[e], normal), 0.0) || apart(other, cross(other[(e + 1) % 3] - other[e], normal), 0.0);
        // Among many small triangles it is not worth its time.
        return clear = separate && ++seen < most_around;
      });
      clear_[t] = clear;
    }
  }

  /// Of the triangles within `distance` (m) of the place one to which `own` gives way, else its own.
  int nearer_around(const Vec3<double>& place, double distance, const SurfacePoint& own, const Vec3<double>& centre, double touch) const {
    int found = own.triangle;
    near(place, distance, [&](int other) {
      if (other == own.triangle) return true;
      const ClosestPoint there = closest_point(triangles_[std::size_t(other)], centre);
      if (there.distance > own.at.distance || (there.distance == own.at.distance && other > own.triangle)) return true;
      if (!yields(own, {other, there}, centre, touch)) return true;
      found = other;
      return false;
    });
    return found;
  }

  /// Whether `far` gives way to `close`, which is nearer to the centre.
  bool yields(const SurfacePoint& far, const SurfacePoint& close, const Vec3<double>& centre, double touch) const {
    const double same = cosine_ * far.at.distance;
    if (smooth_ && dot(far.at.arm, close.at.arm) >= same * close.at.distance) return true;
    const Triangle &t = triangles_[std::size_t(far.triangle)], &other = triangles_[std::size_t(close.triangle)];
    const ClosestPoint there = closest_point(other, far.at.point);
    if (there.distance <= touch) return true;
    const Vec3<double> to = centre - there.point;
    if (smooth_ && dot(far.at.arm, to) >= same * norm(to)) {
      // From there to its closest point the other triangle comes nearer. Where that way leaves the smooth angle:
      const Vec3<double> way = close.at.arm - to;
      const double c2 = same * same, along = dot(far.at.arm, to), more = dot(far.at.arm, way);
      const double a = more * more - c2 * dot(way, way), b = along * more - c2 * dot(to, way), c = along * along - c2 * dot(to, to);
      const double root = std::sqrt(std::max(b * b - a * c, 0.0)), share = b < 0.0 ? c / (root - b) : a < 0.0 ? -(b + root) / a : 1.0;
      const Vec3<double> nearest = to + std::clamp(share, 0.0, 1.0) * way;
      if (dot(nearest, nearest) <= far.at.distance * far.at.distance) return true;
    }
    const Vec3<double> normal = cross(other.node[1] - other.node[0], other.node[2] - other.node[0]);
    const double above = dot(normal, centre - other.node[0]), below = dot(normal, far.at.point - other.node[0]);
    if (above * below < 0.0) {
      const Vec3<double> through = centre + (above / (above - below)) * (far.at.point - centre);
      if (closest_point(other, through).distance <= touch) return true;
    }
    return far.at.distance <= close.at.distance + touch && closest_point(t, close.at.point).distance <= touch;
  }

  /// Place and directions of the first triangle with an area, by which a motion of all is known.
  struct Frame {
    Vec3<double> at{}, x{1.0, 0.0, 0.0}, y{0.0, 1.0, 0.0}, z{0.0, 0.0, 1.0};
  };
  Frame frame() const {
    Frame f;
    for (const Triangle& t : triangles_) {
      if (is_flat(t)) continue;
      f.at = t.node[0];
      f.x = t.node[1] - t.node[0], f.z = cross(f.x, t.node[2] - t.node[0]);
      f.x *= 1.0 / norm(f.x), f.z *= 1.0 / norm(f.z);
      f.y = cross(f.z, f.x);
      break;
    }
    return f;
  }
  Vec3<double> as_sorted(const Vec3<double>& place) const {
    const Vec3<double> p = place - now_.at;
    return sorted_.at + dot(p, now_.x) * sorted_.x + dot(p, now_.y) * sorted_.y + dot(p, now_.z) * sorted_.z;
  }

  bool moved_as_one() {
    now_ = frame();
    turned_ = true;
    const double limit = slack * cells_.edge();
    double most = 0.0;
    for (std::size_t k = 0; k < seen_.size(); ++k) {
      const Vec3<double> moved = as_sorted(triangles_[k / 3].node[k % 3]) - seen_[k];
      if (!(dot(moved, moved) <= limit * limit)) return false;
      most = std::max(most, dot(moved, moved));
    }
    drift_ = 2.0 * std::sqrt(most);
    return true;
  }

  void sort() {
    cells_.build(triangles_, usual_);
    now_ = sorted_ = frame();
    turned_ = false;
    drift_ = 0.0;
    seen_.clear();
    find_clear();
  }

  static constexpr std::size_t many = 16;         ///< triangles about one sphere
  static constexpr std::size_t most_around = 64;  ///< of which it is asked whether they lie over another one
  static constexpr double slack = 0.1;            ///< of the cells' edge, by which triangles may have moved against each other

  bool smooth_ = false;
  double cosine_ = 1.0, tangent_ = 0.0, precision_ = usual_precision, usual_ = 0.0;
  std::vector<Triangle> triangles_;
  TriangleCells cells_;             ///< of the triangles where they were when they were sorted
  Frame sorted_, now_;              ///< then, and now
  bool turned_ = false;             ///< they have moved since
  double drift_ = 0.0;              ///< m, at most, of two against each other since then
  std::vector<char> clear_;         ///< of each triangle: nothing lay over it then
  std::vector<Vec3<double>> seen_;  ///< corners then; empty if they have not moved since
};

}  // namespace dembark
