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
// Exact for pressures that are linear along the face; a box on the floor of still water feels Archimedes' force. Limits: xi = 0 is no
// force. Units SI; in space only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "solids.hpp"

namespace dembark::sph {

/// A box whose particles are a lattice of count[0] x count[1] x count[2], the last axis first to change.
struct LatticeBox {
  int body = 0;   ///< its number
  int first = 0;  ///< particle of the solids with which the lattice begins
  Vector half{};  ///< m, half of its edges, along the axes of the body's frame, whose origin is its centre
  std::array<int, 3> count{};

  int particle(const std::array<int, 3>& at) const { return first + (at[0] * count[1] + at[1]) * count[2] + at[2]; }
};

/// A floor or side: solid where (x - point) . normal < 0.
struct LatticePlane {
  Vector point{}, normal{};
};

class Slits {
 public:
  std::vector<LatticeBox> boxes;
  std::vector<LatticePlane> planes;

  /// Adds the forces of all films to those of the bodies. factor: xi; spacing (m): films are narrower than half of it; density, kg/m^3.
  void push(double factor, double spacing, double density, const Vector& gravity, const Solids& solids, std::vector<Body>& bodies) {
    for (Body& b : bodies) b.film = b.film_torque = {};
    if (!(factor > 0.0)) return;
    for (const LatticeBox& box : boxes)
      for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) face(box, axis, side, factor, spacing, density, gravity, solids, bodies);
    for (Body& b : bodies) {
      b.force += b.film;
      b.torque += b.film_torque;
    }
  }

 private:
  static constexpr int open = -2, on_plane = -1, sweeps = 80;
  static constexpr double relaxation = 1.6;

  static double get(const Vector& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }
  static void set(Vector& v, int k, double value) { (k == 0 ? v.x : k == 1 ? v.y : v.z) = value; }

  /// What is at a place: a box but `own`, a plane, or nothing.
  int covers(const Vector& place, const LatticeBox& own, const std::vector<Body>& bodies) const {
    for (const LatticePlane& plane : planes)
      if (dot(place - plane.point, plane.normal) < 0.0) return on_plane;
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const LatticeBox& box = boxes[k];
      if (box.body == own.body) continue;
      const Body& b = bodies[std::size_t(box.body)];
      const Vector d = b.orientation.inverse()(place - b.position);
      if (std::abs(d.x) < box.half.x && std::abs(d.y) < box.half.y && std::abs(d.z) < box.half.z) return int(k);
    }
    return open;
  }

  void face(const LatticeBox& box, int axis, double side, double factor, double spacing, double density, const Vector& gravity,
            const Solids& solids, std::vector<Body>& bodies) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const int rows = box.count[std::size_t(u)], columns = box.count[std::size_t(v)];
    Body& body = bodies[std::size_t(box.body)];
    const double du = 2.0 * get(box.half, u) / rows, dv = 2.0 * get(box.half, v) / columns, reach = 0.5 * spacing;
    const auto place = [&](double i, double j) {
      Vector local{};
      set(local, axis, side * get(box.half, axis));
      set(local, u, (i + 0.5) * du - get(box.half, u));
      set(local, v, (j + 0.5) * dv - get(box.half, v));
      return body.position + body.orientation(local);
    };
    const auto direction = [&](int along, double sign) {
      Vector local{};
      set(local, along, sign);
      return body.orientation(local);
    };
    const Vector normal = direction(axis, side);
    const std::size_t width = std::size_t(columns), all = std::size_t(rows) * width;
    other_.assign(all, open);
    pressure_.assign(all, 0.0);
    bool hidden = false;
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        const std::size_t at = std::size_t(i) * width + std::size_t(j);
        other_[at] = covers(place(i, j) + reach * normal, box, bodies);
        hidden = hidden || other_[at] != open;
      }
    if (!hidden) return;
    const auto of_particle = [&](int i, int j) {
      std::array<int, 3> at{};
      at[std::size_t(axis)] = side > 0.0 ? box.count[std::size_t(axis)] - 1 : 0;
      at[std::size_t(u)] = i, at[std::size_t(v)] = j;
      const int k = box.particle(at);
      const double p = solids.pressure[std::size_t(k)];
      return p > 0.0 ? std::max(p + density * dot(gravity, place(i, j) - solids.position[std::size_t(k)]), 0.0) : 0.0;
    };
    // What is known of each hidden element: its weight and the sum of the given pressures around it.
    weight_.assign(all, 0.0);
    given_.assign(all, 0.0);
    const std::array<std::array<int, 2>, 4> steps{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        const std::size_t at = std::size_t(i) * width + std::size_t(j);
        if (other_[at] == open) {
          pressure_[at] = of_particle(i, j);
          continue;
        }
        for (const auto& step : steps) {
          const int ni = i + step[0], nj = j + step[1];
          if (ni >= 0 && ni < rows && nj >= 0 && nj < columns) {
            weight_[at] += 1.0;
            continue;
          }
          // The rim is half a step away.
          const Vector rim = place(i + 0.5 * step[0], j + 0.5 * step[1]);
          const Vector out = step[0] != 0 ? direction(u, step[0]) : direction(v, step[1]);
          if (covers(rim + reach * out - 0.5 * reach * normal, box, bodies) != open) continue;
          weight_[at] += 2.0;
          given_[at] += 2.0 * of_particle(i, j);
        }
      }
    for (int sweep = 0; sweep < sweeps; ++sweep)
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
          const std::size_t at = std::size_t(i) * width + std::size_t(j);
          if (other_[at] == open || !(weight_[at] > 0.0)) continue;
          double sum = given_[at];
          if (i > 0) sum += pressure_[at - width];
          if (i + 1 < rows) sum += pressure_[at + width];
          if (j > 0) sum += pressure_[at - 1];
          if (j + 1 < columns) sum += pressure_[at + 1];
          pressure_[at] += relaxation * (sum / weight_[at] - pressure_[at]);
        }
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        const std::size_t at = std::size_t(i) * width + std::size_t(j);
        if (other_[at] == open) continue;
        // Between two boxes each of both faces gives half.
        const double weight = other_[at] == on_plane ? 1.0 : 0.5;
        const Vector force = (-weight * factor * std::max(pressure_[at], 0.0) * du * dv) * normal, here = place(i, j);
        body.film += force;
        body.film_torque += cross(here - body.position, force);
        if (other_[at] == on_plane) continue;
        Body& back = bodies[std::size_t(boxes[std::size_t(other_[at])].body)];
        back.film -= force;
        back.film_torque -= cross(here - back.position, force);
      }
  }

  std::vector<int> other_;
  std::vector<double> pressure_, weight_, given_;
};

}  // namespace dembark::sph
