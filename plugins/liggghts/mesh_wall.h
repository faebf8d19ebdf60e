// Walls of liggghts-dembark's combinations: on a mesh, a grain has a contact where its distance to the surface has a minimum.
//
// The engine computes a contact with each triangle that a grain overlaps. Of coplanar triangles it keeps one and hands its history on.
// Beside an edge between triangles that are not coplanar it counts the edge as well as the face (twice the force, as far as
// sqrt(2 R overlap) from a convex edge), a slight groove counts both faces, and a contact that goes over any such edge begins anew.
// Here the edge or corner of a face that the grain touches beside it has no force, nor has the farther face of a slight groove, and the
// history moves along.
#ifndef DEMBARK_MESH_WALL_H
#define DEMBARK_MESH_WALL_H

#include <cmath>
#include <cstdint>
#include <vector>

#include "atom.h"
#include "fix_contact_history_mesh.h"
#include "fix_mesh_surface.h"
#include "fix_wall_gran_base.h"
#include "tri_mesh.h"

#include "dembark/vec3.hpp"

namespace dembark_liggghts {

/// The triangles of one mesh around one grain.
class MeshAround {
  typedef dembark::Vec3<double> Vec3;
  LAMMPS_NS::TriMesh& mesh_;
  int grain_;
  double radius_;
  double* centre_;
  std::vector<int>& visited_;

  static constexpr int face = 7;             // the engine's sign of a closest point inside a triangle
  static constexpr double smooth = 0.99875;  // cos(0.05 rad): planes at a smaller angle make one smooth surface
  static constexpr double reach = 0.06;      // of the radius: how far from an edge a sphere can touch both sides of such a groove

  struct Closest {
    Vec3 point;
    double distance;
    int sign;
  };

  Closest closest(int triangle, double* to) const {
    double delta[3] = {}, weight[3];
    int sign = 0;
    const double distance = mesh_.resolveTriSphereContactBary(grain_, triangle, 0.0, to, delta, weight, sign, false);
    return {{to[0] + delta[0], to[1] + delta[1], to[2] + delta[2]}, distance, sign};
  }

  Vec3 normal(int triangle) const {
    double n[3];
    mesh_.surfaceNorm(triangle, n);
    return {n[0], n[1], n[2]};
  }

  /// Calls `visit(local index)` for the edge neighbours of a triangle that this rank has, all images.
  template <class Visit>
  void neighbours(int triangle, Visit visit) const {
    for (int k = 0; k < mesh_.nNeighs(triangle); ++k) {
      const int id = mesh_.neighFaces(triangle, k);
      for (int image = 0; image < mesh_.map_size(id); ++image) {
        const int other = mesh_.map(id, image);
        if (other >= 0) visit(other);
      }
    }
  }

 public:
  MeshAround(LAMMPS_NS::TriMesh& mesh, int grain, double radius, double* centre, std::vector<int>& work)
      : mesh_(mesh), grain_(grain), radius_(radius), centre_(centre), visited_(work) {}

  /// The triangle that has the contact in place of this one, or itself: the closest point of a triangle is none of the surface when
  /// another triangle there is nearer, and a slight groove is touched on its nearer side only.
  int better(int triangle) const {
    const Closest mine = closest(triangle, centre_);
    const Vec3 own = normal(triangle);
    double point[3] = {mine.point.x, mine.point.y, mine.point.z};
    int best = triangle;
    double distance = INFINITY;
    visited_.assign(1, triangle);
    for (std::size_t next = 0; next < visited_.size(); ++next)
      neighbours(visited_[next], [&](int other) {
        for (const int known : visited_)
          if (known == other) return;
        const double apart = closest(other, point).distance;
        if (apart > reach * radius_) return;
        visited_.push_back(other);
        const Closest there = closest(other, centre_);
        bool nearer;
        if (mine.sign != face) nearer = apart < 1e-6 * radius_ && (there.sign == face || there.distance < mine.distance * (1.0 - 1e-13));
        else
          nearer = there.sign == face && std::abs(dot(own, normal(other))) >= smooth &&
                   !mesh_.areCoplanarNodeNeighs(mesh_.id(triangle), mesh_.id(other)) &&
                   (there.distance < mine.distance || (there.distance == mine.distance && mesh_.id(other) < mesh_.id(triangle)));
        if (nearer && there.distance < distance) best = other, distance = there.distance;
      });
    return best;
  }

  /// Whether the contact that was on triangle `from` is on triangle `to` now.
  bool moved(int from, int to) const {
    int now = from;
    for (int step = 0; step < 16; ++step) {
      const int next = better(now);
      if (next == now) break;
      now = next;
    }
    const Vec3 apart = closest(now, centre_).point - closest(to, centre_).point;
    return norm(apart) < 1e-6 * radius_;
  }
};

/// The engine's `Walls::Granular<Models>`, with mended meshes.
template <class Models>
class MeshWall : public LIGGGHTS::Walls::Granular<Models> {
  typedef LIGGGHTS::Walls::Granular<Models> Stock;
  LAMMPS_NS::LAMMPS* lmp_;
  std::vector<int> work_;

  static bool empty(const double* history, int count) {
    for (int k = 0; k < count; ++k)
      if (history[k] != 0.0) return false;
    return true;
  }

  /// A contact that begins takes over the history of the one that the grain had at a triangle beside it and has no more.
  void inherit(const MeshAround& around, LAMMPS_NS::FixContactHistoryMesh& contacts, LAMMPS_NS::TriMesh& mesh, int grain, int triangle,
               double* history) const {
    const int count = contacts.get_dnum();
    for (int k = 0; k < contacts.nneighs(grain); ++k) {
      const int id = contacts.partner(grain, k);
      if (id < 0 || id == mesh.id(triangle)) continue;
      double* const old = contacts.contacthistory(grain, k);
      const int other = mesh.map(id, 0);
      if (other < 0 || empty(old, count) || !around.moved(other, triangle)) continue;
      for (int n = 0; n < count; ++n) {
        history[n] = old[n];
        old[n] = 0.0;
      }
      return;
    }
  }

 public:
  MeshWall(LAMMPS_NS::LAMMPS* lmp, LAMMPS_NS::FixWallGran* parent, std::int64_t hash) : Stock(lmp, parent, hash), lmp_(lmp) {}

  void compute_force(LAMMPS_NS::FixWallGran* wall, LIGGGHTS::ContactModels::SurfacesIntersectData& contact, bool touching, double* velocity,
                     LAMMPS_NS::FixMeshSurface* fix = nullptr, int number = 0, LAMMPS_NS::TriMesh* mesh = nullptr,
                     int triangle = 0) override {
    if (mesh && !lmp_->atom->shapetype_flag && !lmp_->atom->superquadric_flag) {
      const int grain = contact.i;
      const MeshAround around(*mesh, grain, contact.radi, lmp_->atom->x[grain], work_);
      if (around.better(triangle) != triangle) return;
      LAMMPS_NS::FixContactHistoryMesh* const contacts = fix->contactHistory();
      if (contacts && contact.contact_history && empty(contact.contact_history, contacts->get_dnum()))
        inherit(around, *contacts, *mesh, grain, triangle, contact.contact_history);
    }
    Stock::compute_force(wall, contact, touching, velocity, fix, number, mesh, triangle);
  }
};

}  // namespace dembark_liggghts

#endif
