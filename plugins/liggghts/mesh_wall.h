// Walls of liggghts-dembark's combinations: on a mesh, a grain has the contacts of dembark/surface.
//
// The engine computes a contact with each triangle that a grain overlaps. Of coplanar triangles it keeps one and hands its history on.
// Beside an edge between triangles that are not coplanar it counts the edge as well as the face, a slight groove counts both faces, and a
// contact that goes over any such edge begins anew. Here those contacts alone have a force that are minima of the distance to the surface,
// and the history moves along.
#ifndef DEMBARK_MESH_WALL_H
#define DEMBARK_MESH_WALL_H

#include <algorithm>
#include <cstdint>
#include <vector>

#include "atom.h"
#include "fix_contact_history_mesh.h"
#include "fix_mesh_surface.h"
#include "fix_wall_gran_base.h"
#include "neighbor.h"
#include "update.h"

#include "dembark/surface/surface_contacts.hpp"
#include "contact_data.h"
#include "engine_access.h"
#include "fix_wall_motion.h"
#include "mesh_triangles.h"

namespace dembark_liggghts {

/// The engine's `Walls::Granular<Models>`, with mended meshes.
template <class Models>
class MeshWall : public LIGGGHTS::Walls::Granular<Models> {
  typedef LIGGGHTS::Walls::Granular<Models> Stock;
  typedef LAMMPS_NS::FixContactHistoryMesh Histories;

  /// The triangles of a mesh that this rank knows, by their local index.
  struct Surface {
    LAMMPS_NS::TriMesh* mesh;
    LAMMPS_NS::bigint when;
    std::vector<dembark::Triangle> triangles;
    dembark::SurfaceContacts contacts;
    LAMMPS_NS::FixWallMotion* motion = nullptr;  // that moves it, or nullptr
  };

  LAMMPS_NS::LAMMPS* lmp_;
  std::vector<Surface> surfaces_;

  /// As the mesh is now: the engine numbers it anew with the neighbour lists, and moves it in any step.
  const Surface& surface_of(LAMMPS_NS::TriMesh& mesh) {
    auto found = std::find_if(surfaces_.begin(), surfaces_.end(), [&mesh](const Surface& s) { return s.mesh == &mesh; });
    if (found == surfaces_.end())
      found = surfaces_.insert(
          found, {&mesh, -1, {}, dembark::SurfaceContacts(dembark::SurfaceContacts::usual_smooth_angle, precision(mesh)), nullptr});
    const bool moves = mesh.isMoving() || mesh.isDeforming();
    const LAMMPS_NS::bigint now = moves ? lmp_->update->ntimestep : lmp_->neighbor->lastcall;
    const std::size_t count = std::size_t(mesh.sizeLocal() + mesh.sizeGhost());
    if (found->when != now || found->triangles.size() != count) {
      found->triangles.resize(count);
      for (std::size_t i = 0; i < count; ++i) found->triangles[i] = triangle_of(mesh, int(i));
      found->contacts.expect(0.5 * lmp_->neighbor->cutneighmax);
      found->contacts.update(found->triangles, moves);
      found->when = now;
      found->motion = moves ? find_wall_motion(lmp_->modify, &mesh) : nullptr;
    }
    return *found;
  }

  /// Whether the engine computes a contact with triangle `other` in a step in which it does so with `triangle`: it leaves out edges that
  /// are not active, and a face beside which another one of its plane has a contact already.
  static bool computed(LAMMPS_NS::TriMesh& mesh, const Histories* histories, int grain, double* centre, int triangle, int other) {
    double delta[3], weight[3];
    int sign = 0;
    if (mesh.resolveTriSphereContactBary(grain, other, 0.0, centre, delta, weight, sign) >= LARGE_TRIMESH) return false;
    constexpr int face = 7;
    if (!histories || sign != face || !mesh.areCoplanarNodeNeighs(mesh.id(triangle), mesh.id(other))) return true;
    for (int k = 0; k < histories->nneighs(grain); ++k)
      if (histories->get_partner_idTri(grain, k) == mesh.id(other)) return true;
    return false;
  }

  /// A contact that begins takes over the history of the one that the grain had on a triangle from which it came.
  static void inherit(const dembark::SurfaceContacts& surface, Histories& histories, LAMMPS_NS::TriMesh& mesh, int grain,
                      const dembark::Vec3<double>& centre, double radius, int triangle, int owner, double* history) {
    const int count = histories.get_dnum();
    const auto empty = [count](const double* h) { return std::all_of(h, h + count, [](double x) { return x == 0.0; }); };
    if (!empty(history)) return;
    for (int k = 0; k < histories.nneighs(grain); ++k) {
      const int id = histories.get_partner_idTri(grain, k);
      if (id < 0 || id == mesh.id(triangle)) continue;
      double* const old = histories.contacthistory(grain, k);
      if (empty(old)) continue;
      for (int image = 0; image < mesh.map_size(id); ++image) {
        const int from = mesh.map(id, image);
        if (from < 0 || surface.follow(from, centre, radius) != owner) continue;
        std::copy(old, old + count, history);
        std::fill(old, old + count, 0.0);
        return;
      }
    }
  }

 public:
  MeshWall(LAMMPS_NS::LAMMPS* lmp, LAMMPS_NS::FixWallGran* parent, std::int64_t hash) : Stock(lmp, parent, hash), lmp_(lmp) {
    LAMMPS_NS::FixWallMotion::walls_tell_loads = true;
  }

  /// Before a run: since the last one fixes may have come and gone that move meshes.
  void init_granular() override {
    surfaces_.clear();
    Stock::init_granular();
  }

  void compute_force(LAMMPS_NS::FixWallGran* wall, LIGGGHTS::ContactModels::SurfacesIntersectData& contact, bool touching, double* velocity,
                     LAMMPS_NS::FixMeshSurface* fix = nullptr, int number = 0, LAMMPS_NS::TriMesh* mesh = nullptr,
                     int triangle = 0) override {
    if (mesh && !lmp_->atom->shapetype_flag && !lmp_->atom->superquadric_flag) {
      double* const x = lmp_->atom->x[contact.i];
      const dembark::Vec3<double> centre{x[0], x[1], x[2]};
      const Surface& known = surface_of(*mesh);
      const dembark::SurfaceContacts& surface = known.contacts;
      const int owner = surface.follow(triangle, centre, contact.radi);
      if (owner < 0) return;  // on a triangle without area
      Histories* const histories = fix->contactHistory();
      if (owner != triangle && computed(*mesh, histories, contact.i, x, triangle, owner)) return;
      if (histories && contact.contact_history)
        inherit(surface, *histories, *mesh, contact.i, centre, contact.radi, triangle, owner, contact.contact_history);
      if (known.motion) {
        double* const force = lmp_->atom->f[contact.i];
        double* const torque = lmp_->atom->torque[contact.i];
        const dembark::Vec3<double> force_before = vector(force), torque_before = vector(torque);
        Stock::compute_force(wall, contact, touching, velocity, fix, number, mesh, triangle);
        known.motion->add_load(x, vector(force) - force_before, vector(torque) - torque_before);
        return;
      }
    }
    Stock::compute_force(wall, contact, touching, velocity, fix, number, mesh, triangle);
  }
};

}  // namespace dembark_liggghts

#endif
