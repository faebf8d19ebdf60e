// Films of fluid between faces of boxes, or between a face and a plane, that are narrower than the spacing: no particle gets in, and a
// block that stands on a floor or on another one would feel no pressure from below.
//
// In a film of constant thickness and constant viscosity, between surfaces that do not approach each other, the pressure obeys
// O. Reynolds' equation (Phil. Trans. R. Soc. 177 (1886) 157), here Laplace's,
//
//   p_uu + p_vv = 0  on the hidden part of the face,  p = p_w on its rim                                                  (1)
//   force on the face: -xi integral p n dA, and the reverse on what it faces
//
// p_w: pressure of the box's own particle at the rim (wall.hpp), carried to the plane of the face as in still water. Where the rim itself
// is covered nothing flows, and where it is dry p = 0. xi = 1: the film is full and connected to the water around it; xi = 0: it is dry.
// Neither is known of blocks that stand on each other: the difference is uncertainty of the model.
//
// A film that opens at the rate V lacks water. To fill it as far as the distance d from the rim, in a gap s, water must come in at V d/s;
// the pressure there is taken to be lower by what such a speed takes, down to that of the air:
//
//   p <- max(p - rho/2 (V d/max(s, thin))^2, 0),  V > 0                                                                   (2)
//
// That is an estimate of scale: flow that is not steady, and the profile along the film, are left out. Without (2) a block that leaves its
// floor would be pushed on over half of a spacing by water that is not there. thin, spacing/50, keeps V at which the pressure is gone
// within what time steps of the fluid resolve; in thinner films it would be gone at once.
//
// (1) is exact for pressures that are linear along the face; a box on the floor of still water feels Archimedes' force. Limits: xi = 0 is
// no force. Units SI; in space only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "../keyword_reader.hpp"
#include "solids.hpp"

namespace dembark::sph {

/// A box whose particles are a lattice of count[0] x count[1] x count[2], the last axis first to change.
struct LatticeBox {
  int body = 0;   ///< its number
  int first = 0;  ///< particle of the solids with which the lattice begins
  Vector half{};  ///< m, half of its edges, along the axes of the body's frame, whose origin is its centre
  std::array<int, 3> count{};

  int particle(const std::array<int, 3>& at) const { return first + (at[0] * count[1] + at[1]) * count[2] + at[2]; }
  /// Of the particle at `arm` (m) from the centre, in the body's frame; -1: it is not on the lattice.
  int particle_at(const Vector& arm) const {
    const std::array<double, 3> arms{arm.x, arm.y, arm.z}, halves{half.x, half.y, half.z};
    std::array<int, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double cells = 0.5 * count[k] * (arms[k] / halves[k] + 1.0) - 0.5;
      at[k] = int(std::lround(cells));
      if (std::fabs(cells - at[k]) > 0.01 || at[k] < 0 || at[k] >= count[k]) return -1;
    }
    return particle(at);
  }
};

/// Particles along the edges (m) of a box. Throws std::invalid_argument where an edge is no whole number of the spacing (m).
inline std::array<int, 3> lattice_counts(const Vector& edges, double spacing) {
  std::array<int, 3> counts{};
  const std::array<double, 3> lengths{edges.x, edges.y, edges.z};
  for (std::size_t k = 0; k < 3; ++k) {
    counts[k] = int(std::lround(lengths[k] / spacing));
    if (counts[k] < 1 || std::abs(counts[k] * spacing - lengths[k]) > 1e-3 * spacing)
      keywords::refuse("an edge of " + keywords::text(lengths[k]) + " m must be an integer multiple of the spacing, " +
                       keywords::text(spacing) + " m");
  }
  return counts;
}

/// A floor or side: solid where (x - point) . normal < 0.
struct LatticePlane {
  Vector point{}, normal{};
};

class Slits {
 public:
  std::vector<LatticeBox> boxes;
  std::vector<LatticePlane> planes;

  /// Forces of all films, `film` and `film_torque` of the bodies. factor: xi; spacing (m): films are narrower than half of it; density,
  /// kg/m^3; pressure (Pa): of the boxes' particles.
  void push(double factor, double spacing, double density, const Vector& gravity, const std::vector<double>& pressure,
            std::vector<Body>& bodies) {
    for (Body& b : bodies) b.film = b.film_torque = {};
    if (!(factor > 0.0)) return;
    for (const LatticeBox& box : boxes)
      for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
          const Face face(box, axis, side, bodies[std::size_t(box.body)]);
          if (!hidden(face, 0.5 * spacing, bodies)) continue;
          rims(face, 0.5 * spacing, density, gravity, pressure, bodies);
          relax(face);
          spread_distances(face);
          add(face, factor, spacing, density, bodies);
        }
  }

 private:
  static constexpr int open = -2, on_plane = -1, sweeps = 80;
  static constexpr double relaxation = 1.6, thin = 0.02;

  static double get(const Vector& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }
  static void set(Vector& v, int k, double value) { (k == 0 ? v.x : k == 1 ? v.y : v.z) = value; }

  /// A face of a box, in elements of its lattice, rows along u and columns along v.
  struct Face {
    const LatticeBox* box;
    const Body* body;
    int axis, u, v, rows, columns;
    double side, du, dv;
    Vector normal;

    Face(const LatticeBox& of, int axis_, double side_, const Body& body_)
        : box(&of),
          body(&body_),
          axis(axis_),
          u((axis_ + 1) % 3),
          v((axis_ + 2) % 3),
          rows(of.count[std::size_t(u)]),
          columns(of.count[std::size_t(v)]),
          side(side_),
          du(2.0 * get(of.half, u) / rows),
          dv(2.0 * get(of.half, v) / columns),
          normal(direction(axis_, side_)) {}

    int size() const { return rows * columns; }
    std::size_t at(int i, int j) const { return std::size_t(i) * std::size_t(columns) + std::size_t(j); }
    /// Middle of an element.
    Vector place(double i, double j) const {
      Vector local{};
      set(local, axis, side * get(box->half, axis));
      set(local, u, (i + 0.5) * du - get(box->half, u));
      set(local, v, (j + 0.5) * dv - get(box->half, v));
      return body->position + body->orientation(local);
    }
    Vector direction(int along, double sign) const {
      Vector local{};
      set(local, along, sign);
      return body->orientation(local);
    }
    /// Pressure of its own particle, carried to the plane of the face.
    double pressure(int i, int j, double density, const Vector& gravity, const std::vector<double>& pressures) const {
      std::array<int, 3> where{};
      where[std::size_t(axis)] = side > 0.0 ? box->count[std::size_t(axis)] - 1 : 0;
      where[std::size_t(u)] = i, where[std::size_t(v)] = j;
      const double p = pressures[std::size_t(box->particle(where))], inwards = get(box->half, axis) / box->count[std::size_t(axis)];
      return p > 0.0 ? std::max(p + density * inwards * dot(gravity, normal), 0.0) : 0.0;
    }
    template <class Work>
    void each(const Work& work) const {
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) work(i, j, at(i, j));
    }
  };

  /// What is at a place: a box, a plane, or nothing; and how deep (m) the place is below that face of it that is met along a normal.
  struct Cover {
    int what = open;
    double depth = 0.0;
  };

  Cover covers(const Vector& place, const Face& face, const std::vector<Body>& bodies) const {
    for (const LatticePlane& plane : planes) {
      const double depth = -dot(place - plane.point, plane.normal);
      if (depth > 0.0) return {on_plane, depth};
    }
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const LatticeBox& box = boxes[k];
      if (box.body == face.box->body) continue;
      const Body& b = bodies[std::size_t(box.body)];
      const Rotation back = b.orientation.inverse();
      const Vector d = back(place - b.position), n = back(face.normal);
      if (!(std::abs(d.x) < box.half.x && std::abs(d.y) < box.half.y && std::abs(d.z) < box.half.z)) continue;
      int faced = 0;
      for (int i = 1; i < 3; ++i)
        if (std::abs(get(n, i)) > std::abs(get(n, faced))) faced = i;
      return {int(k), get(box.half, faced) + (get(n, faced) > 0.0 ? get(d, faced) : -get(d, faced))};
    }
    return {};
  }

  /// What each element faces within `reach` (m); whether any faces something.
  bool hidden(const Face& face, double reach, const std::vector<Body>& bodies) {
    other_.resize(std::size_t(face.size()));
    bool any = false;
    face.each([&](int i, int j, std::size_t at) {
      other_[at] = covers(face.place(i, j) + reach * face.normal, face, bodies);
      any = any || other_[at].what != open;
    });
    return any;
  }

  /// What is known of each hidden element: its weight, the sum of the given pressures around it, and the distance to the rim.
  void rims(const Face& face, double reach, double density, const Vector& gravity, const std::vector<double>& pressures,
            const std::vector<Body>& bodies) {
    const std::size_t all = std::size_t(face.size());
    pressure_.assign(all, 0.0);
    weight_.assign(all, 0.0);
    given_.assign(all, 0.0);
    distance_.assign(all, std::numeric_limits<double>::infinity());
    const std::array<std::array<int, 2>, 4> steps{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    face.each([&](int i, int j, std::size_t at) {
      const double own = face.pressure(i, j, density, gravity, pressures);
      if (other_[at].what == open) {
        pressure_[at] = own;
        return;
      }
      for (const auto& step : steps) {
        const int ni = i + step[0], nj = j + step[1];
        const double half_step = 0.5 * (step[0] != 0 ? face.du : face.dv);
        if (ni >= 0 && ni < face.rows && nj >= 0 && nj < face.columns) {
          weight_[at] += 1.0;
          if (other_[face.at(ni, nj)].what == open) distance_[at] = std::min(distance_[at], half_step);
          continue;
        }
        // The rim is half a step away.
        const Vector rim = face.place(i + 0.5 * step[0], j + 0.5 * step[1]);
        const Vector out = step[0] != 0 ? face.direction(face.u, step[0]) : face.direction(face.v, step[1]);
        if (covers(rim + reach * out - 0.5 * reach * face.normal, face, bodies).what != open) continue;
        weight_[at] += 2.0;
        given_[at] += 2.0 * own;
        distance_[at] = std::min(distance_[at], half_step);
      }
    });
  }

  /// (1), by overrelaxation.
  void relax(const Face& face) {
    for (int sweep = 0; sweep < sweeps; ++sweep)
      face.each([&](int i, int j, std::size_t at) {
        if (other_[at].what == open || !(weight_[at] > 0.0)) return;
        double sum = given_[at];
        if (i > 0) sum += pressure_[face.at(i - 1, j)];
        if (i + 1 < face.rows) sum += pressure_[face.at(i + 1, j)];
        if (j > 0) sum += pressure_[face.at(i, j - 1)];
        if (j + 1 < face.columns) sum += pressure_[face.at(i, j + 1)];
        pressure_[at] += relaxation * (sum / weight_[at] - pressure_[at]);
      });
  }

  /// Distances (m) to the rim from element to element, where they are not known yet.
  void spread_distances(const Face& face) {
    const auto relax_distance = [&](int i, int j) {
      double& distance = distance_[face.at(i, j)];
      if (other_[face.at(i, j)].what == open) return;
      if (i > 0) distance = std::min(distance, distance_[face.at(i - 1, j)] + face.du);
      if (i + 1 < face.rows) distance = std::min(distance, distance_[face.at(i + 1, j)] + face.du);
      if (j > 0) distance = std::min(distance, distance_[face.at(i, j - 1)] + face.dv);
      if (j + 1 < face.columns) distance = std::min(distance, distance_[face.at(i, j + 1)] + face.dv);
    };
    for (int twice = 0; twice < 2; ++twice) {
      face.each([&](int i, int j, std::size_t) { relax_distance(i, j); });
      face.each([&](int i, int j, std::size_t) { relax_distance(face.rows - 1 - i, face.columns - 1 - j); });
    }
  }

  /// (2), and the forces.
  void add(const Face& face, double factor, double spacing, double density, std::vector<Body>& bodies) {
    Body& body = bodies[std::size_t(face.box->body)];
    face.each([&](int i, int j, std::size_t at) {
      const Cover& other = other_[at];
      if (other.what == open) return;
      const Vector here = face.place(i, j);
      Body* const back = other.what == on_plane ? nullptr : &bodies[std::size_t(boxes[std::size_t(other.what)].body)];
      const Vector velocity = back ? back->velocity_at(here - back->position) : Vector{};
      const double rate = dot(velocity - body.velocity_at(here - body.position), face.normal);
      const double speed = rate > 0.0 ? rate * distance_[at] / std::max(0.5 * spacing - other.depth, thin * spacing) : 0.0;
      const double p = std::max(pressure_[at] - 0.5 * density * speed * speed, 0.0);
      // Between two boxes each of both faces gives half.
      const Vector force = (-(back ? 0.5 : 1.0) * factor * p * face.du * face.dv) * face.normal;
      body.film += force;
      body.film_torque += cross(here - body.position, force);
      if (!back) return;
      back->film -= force;
      back->film_torque -= cross(here - back->position, force);
    });
  }

  std::vector<Cover> other_;
  std::vector<double> pressure_, weight_, given_, distance_;
};

}  // namespace dembark::sph
