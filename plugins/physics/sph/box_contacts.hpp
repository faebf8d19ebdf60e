// Contacts of boxes with each other and with planes: rounded corners and edges on springs and dashpots, with Coulomb's friction.
//
// A box is a core, smaller by the radius r on all sides, and what is within r of it: its faces are plane, its edges and corners round. Two
// boxes touch where a corner of one core is nearer than 2 r to the other core, and where two edges of the cores cross at such a distance:
// of faces on each other these are the corners of the polygon that they share. A box touches a plane with its corners. With the overlap d
// of such a point, its rate and the velocity v_t along the surface
//
//   F_n = k d + c d' >= 0,  F_t = -k_t xi - c_t v_t with |F_t| <= mu F_n,  xi' = v_t                                       (1)
//   c = 2 zeta sqrt(k m/4),  ln e = -zeta (pi - 2 asin zeta)/sqrt(1 - zeta^2),  k_t = 0.82 k,  c_t = 0.82 c                 (2)
//
// (1): P. A. Cundall & O. D. L. Strack, Geotechnique 29 (1979) 47. xi begins with the contact, turns with the boxes and is cut back where
// it slides. (2): e of a contact that does not pull, T. Schwager & T. Poeschel, Granul. Matter 9 (2007) 465. m is the reduced mass; of a
// face that lands flat each of four corners has a quarter of it, and about so much is the effective mass of one corner of a cube that lands
// on it. k_t/k: R. D. Mindlin, J. Appl. Mech. 16 (1949) 259, for a Poisson's ratio of 0.3. Crossings fade out within r of the ends of the
// edges, where corners take over: k there is w k, and w's gradient a force along the surface, so that springs conserve energy.
//
// Or, with a speed v_0 of friction, no spring, and what stands on a slope creeps:
//
//   F_t = -mu F_n tanh(|v_t|/v_0) v_t/|v_t|                                                                               (3)
//
// (3) with v_0 = 1/8 m/s bounds the friction in DualSPHysics (InteractionForcesDEM in JSphCpu.cpp of version 5): that is the lesser of (3)
// and a spring and dashpot whose spring is as long as one step slides, and has no memory. With that code the experiments on stacked
// cubes were simulated (R. B. Canelas et al., Comput. Phys. Commun. 202 (2016) 131).
//
// k is no property of the material: softer than that, so that steps of the fluid resolve impacts. Units SI; in space.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "../constants.hpp"
#include "../finnie_rabinowicz.hpp"  // rotate_to_plane
#include "../kinematics.hpp"
#include "bodies.hpp"

namespace dembark::sph {

/// Of two boxes, or of a box and a plane.
struct Touch {
  double restitution = 1.0;    ///< e
  double friction = 0.0;       ///< mu
  double damping_ratio = 0.0;  ///< zeta

  static Touch of(double restitution, double friction) {
    double low = 0.0, high = 1.0;
    for (int k = 0; k < 60; ++k) {
      const double z = 0.5 * (low + high), e = std::exp(-z * (pi - 2.0 * std::asin(z)) / std::sqrt(1.0 - z * z));
      (e > restitution ? low : high) = z;
    }
    return {restitution, friction, restitution < 1.0 ? low : 0.0};
  }
  const char* error() const {
    if (!(restitution >= 0.14 && restitution <= 1.0)) return "restitution must be between 0.14 (critical damping) and 1";
    if (!(friction >= 0.0) || std::isinf(friction)) return "friction must be a number >= 0";
    return nullptr;
  }
};

struct ContactPlane {
  Vector point{}, normal{};  ///< m; of length 1, into the space of the boxes
  Touch touch{};
};

/// What contacts do to a box: N, and N m about its centre.
struct ContactWrench {
  Vector force{}, torque{};
};

class BoxContacts {
 public:
  double stiffness = 1e5;       ///< k of one point, N/m
  double radius = 0.004;        ///< r, m, less than half of the shortest edge
  Touch between{};              ///< of two boxes
  double friction_speed = 0.0;  ///< v_0, m/s; 0: (1)
  std::vector<Vector> half;     ///< m, half of the edges of each box, along the axes of its body's frame
  std::vector<ContactPlane> planes;

  /// xi of all points, in the order in which they are looked at: what a state has to keep.
  std::vector<Vector> stretches;
  double stored = 0.0;   ///< J, in the springs
  double deepest = 0.0;  ///< m, the largest overlap
  int count = 0;         ///< points that touch

  /// Forces on the boxes at their places, after dt (s) with these velocities; `remember`: xi goes on.
  const std::vector<ContactWrench>& push(double dt, const std::vector<const Body*>& boxes, bool remember) {
    const std::size_t n = boxes.size();
    stretches.resize(of_pair * (n * (n - 1) / 2) + corners * n * planes.size());
    wrenches_.assign(n, ContactWrench{});
    stored = deepest = 0.0;
    count = 0;
    remember_ = remember;
    dt_ = dt;
    boxes_ = &boxes;
    std::size_t at = 0;
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = a + 1; b < n; ++b, at += of_pair) pair(a, b, &stretches[at]);
    for (std::size_t a = 0; a < n; ++a)
      for (const ContactPlane& plane : planes) {
        for (int k = 0; k < corners; ++k, ++at) {
          const Vector centre = place(a, corner(core(a), k));
          const double distance = dot(centre - plane.point, plane.normal);
          const Vector at_surface = centre - (0.5 * (distance + radius)) * plane.normal;
          touch(a, none, plane.normal, at_surface, radius - distance, 1.0, plane.touch, stretches[at]);
        }
      }
    return wrenches_;
  }

  /// Longest step (s) that resolves the fastest contact, a face of the lightest box on eight points: 0.5 over its frequency.
  double longest_step(const std::vector<const Body*>& boxes) const {
    double mass = boxes.empty() ? 1.0 : boxes[0]->mass;
    for (const Body* b : boxes) mass = std::min(mass, b->mass);
    return 0.5 * std::sqrt(0.5 * mass / (8.0 * stiffness));
  }

 private:
  static constexpr int corners = 8, edges = 12;
  static constexpr std::size_t of_pair = 2 * corners + edges * edges, none = std::size_t(-1);

  static double get(const Vector& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }
  static Vector corner(const Vector& h, int k) { return {k & 1 ? h.x : -h.x, k & 2 ? h.y : -h.y, k & 4 ? h.z : -h.z}; }
  static double norm_squared(const Vector& v) { return dot(v, v); }

  Vector core(std::size_t a) const { return half[a] - Vector{radius, radius, radius}; }
  Vector place(std::size_t a, const Vector& local) const {
    const Body& b = *(*boxes_)[a];
    return b.position + b.orientation(local);
  }

  void pair(std::size_t a, std::size_t b, Vector* xi) {
    const Vector apart = (*boxes_)[a]->position - (*boxes_)[b]->position;
    const double reach = norm(half[a]) + norm(half[b]);
    if (norm_squared(apart) > reach * reach) {
      if (remember_) std::fill_n(xi, of_pair, Vector{});
      return;
    }
    for (int k = 0; k < corners; ++k) corner_on(a, b, k, *xi++);
    for (int k = 0; k < corners; ++k) corner_on(b, a, k, *xi++);
    for (int k = 0; k < edges; ++k)
      for (int l = 0; l < edges; ++l) crossing(a, b, k, l, *xi++);
  }

  /// Corner k of the core of a on the core of b.
  void corner_on(std::size_t a, std::size_t b, int k, Vector& xi) {
    const Vector centre = place(a, corner(core(a), k)), h = core(b);
    const Body& other = *(*boxes_)[b];
    const Vector local = other.orientation.inverse()(centre - other.position);
    const Vector inside{std::clamp(local.x, -h.x, h.x), std::clamp(local.y, -h.y, h.y), std::clamp(local.z, -h.z, h.z)};
    Vector out = local - inside;
    double distance = norm(out);
    if (distance > 0.0) {
      out = (1.0 / distance) * out;
    } else {  // Within the core: out by the nearest face.
      int axis = 0;
      for (int m = 1; m < 3; ++m)
        if (get(h, m) - std::abs(get(local, m)) < get(h, axis) - std::abs(get(local, axis))) axis = m;
      const double side = get(local, axis) < 0.0 ? -1.0 : 1.0;
      out = {axis == 0 ? side : 0.0, axis == 1 ? side : 0.0, axis == 2 ? side : 0.0};
      distance = std::abs(get(local, axis)) - get(h, axis);
    }
    const Vector normal = other.orientation(out);
    touch(a, b, normal, centre - (0.5 * distance) * normal, 2.0 * radius - distance, 1.0, between, xi);
  }

  /// Edge k of a core: its middle and half of it, in space.
  std::array<Vector, 2> edge(std::size_t a, int k) const {
    const Vector h = core(a);
    const int along = k / 4;
    const double u = k & 1 ? 1.0 : -1.0, v = k & 2 ? 1.0 : -1.0;
    const Body& b = *(*boxes_)[a];
    const Vector middle = along == 0   ? Vector{0.0, u * h.y, v * h.z}
                          : along == 1 ? Vector{u * h.x, 0.0, v * h.z}
                                       : Vector{u * h.x, v * h.y, 0.0};
    const Vector way = along == 0 ? Vector{h.x, 0.0, 0.0} : along == 1 ? Vector{0.0, h.y, 0.0} : Vector{0.0, 0.0, h.z};
    return {b.position + b.orientation(middle), b.orientation(way)};
  }
  /// 1 inside of an edge, 0 at its end; t: -1 ... 1 along the edge of half-length h.
  double fade(double t, double h) const { return std::clamp((1.0 - std::abs(t)) * h / radius, 0.0, 1.0); }

  void crossing(std::size_t a, std::size_t b, int k, int l, Vector& xi) {
    const auto [from, p] = edge(a, k);
    const auto [to, q] = edge(b, l);
    const Vector d = from - to;
    const double pp = dot(p, p), qq = dot(q, q), pq = dot(p, q), all = pp * qq - pq * pq;
    const auto none_here = [&] { touch(a, b, {}, {}, -1.0, 1.0, between, xi); };
    // Edges that are nearly parallel have no crossing; corners stand for them.
    if (!(all > 0.04 * pp * qq)) return none_here();
    const double dp = dot(d, p), dq = dot(d, q), t = (pq * dq - qq * dp) / all, s = (pp * dq - pq * dp) / all;
    const double lp = std::sqrt(pp), lq = std::sqrt(qq), at_p = fade(t, lp), at_q = fade(s, lq);
    const double turned = std::min((all / (pp * qq) - 0.04) / 0.2, 1.0), weight = turned * at_p * at_q;
    if (!(weight > 0.0)) return none_here();
    const Vector apart = d + t * p - s * q;
    const double distance = norm(apart), overlap = 2.0 * radius - distance;
    if (!(distance > 0.0 && overlap > 0.0)) return none_here();
    const Vector point = from + t * p - 0.5 * apart;
    touch(a, b, (1.0 / distance) * apart, point, overlap, weight, between, xi);
    // t and s grow by these with a place of a.
    const Vector of_t = (1.0 / all) * (pq * q - qq * p), of_s = (1.0 / all) * (pp * q - pq * p);
    const auto slope = [this](double at, double u, double length) { return at < 1.0 ? (u > 0.0 ? -1.0 : 1.0) * length / radius : 0.0; };
    const Vector by =
        (-0.5 * stiffness * overlap * overlap * turned) * (at_q * slope(at_p, t, lp) * of_t + at_p * slope(at_q, s, lq) * of_s);
    add(wrenches_[a], *(*boxes_)[a], point, by);
    add(wrenches_[b], *(*boxes_)[b], point, -1.0 * by);
  }

  /// A point (m) at which a and b (or a plane) touch, with an overlap (m); normal: from b to a.
  void touch(std::size_t a, std::size_t b, const Vector& normal, const Vector& point, double overlap, double weight, const Touch& law,
             Vector& xi) {
    if (!(overlap > 0.0)) {
      if (remember_) xi = {};
      return;
    }
    const Body& one = *(*boxes_)[a];
    const Body* const other = b == none ? nullptr : (*boxes_)[b];
    Vector v = one.velocity_at(point - one.position);
    if (other) v -= other->velocity_at(point - other->position);
    const double mass = other ? one.mass * other->mass / (one.mass + other->mass) : one.mass;
    const double k = weight * stiffness, c = weight * 2.0 * law.damping_ratio * std::sqrt(0.25 * stiffness * mass);
    const double closing = dot(v, normal), force = std::max(k * overlap - c * closing, 0.0);
    const Vector slide = v - closing * normal;
    const double most = law.friction * force;
    Vector stretch{}, along{};
    if (friction_speed > 0.0) {
      const double speed = norm(slide);
      if (speed > 0.0) along = (-most * std::tanh(speed / friction_speed) / speed) * slide;
    } else {
      const double twist = contact_twist(normal, one.spin, other ? other->spin : Vector{}, dt_);
      stretch = rotate_to_plane(xi, normal, twist) + dt_ * slide;
      along = -(tangential_stiffness_ratio * k) * stretch - (tangential_stiffness_ratio * c) * slide;
      const double size = norm(along);
      if (size > most) {
        along = (most / size) * along;
        stretch = (-1.0 / (tangential_stiffness_ratio * k)) * along;
      }
    }
    if (remember_) xi = stretch;
    stored += 0.5 * k * (overlap * overlap + tangential_stiffness_ratio * dot(stretch, stretch));
    deepest = std::max(deepest, overlap);
    ++count;
    const Vector total = force * normal + along;
    add(wrenches_[a], one, point, total);
    if (other) add(wrenches_[b], *other, point, -1.0 * total);
  }
  static void add(ContactWrench& to, const Body& body, const Vector& point, const Vector& force) {
    to.force += force;
    to.torque += cross(point - body.position, force);
  }

  static constexpr double tangential_stiffness_ratio = 0.82;  ///< k_t/k and c_t/c
  const std::vector<const Body*>* boxes_ = nullptr;
  std::vector<ContactWrench> wrenches_;
  double dt_ = 0.0;
  bool remember_ = true;
};

}  // namespace dembark::sph
