#include "fix_lcp_impact.h"

#include <algorithm>

#include "domain.h"
#include "fix_mesh_surface.h"
#include "modify.h"
#include "multi_vector_container.h"

#include "mesh_triangles.h"

using namespace LAMMPS_NS;
using namespace dembark::impact;
using dembark::Triangle;
using dembark_family::vector;
using Vec = dembark::Vec3<double>;

void FixLcpImpact::find_walls() {
  mesh_fix_.clear();
  mesh_.resize(impacts_->command.meshes.size());
  for (std::size_t k = 0; k < impacts_->command.meshes.size(); ++k) {
    const int found = modify->find_fix(impacts_->command.meshes[k].c_str());
    mesh_fix_.push_back(found < 0 ? nullptr : dynamic_cast<FixMeshSurface *>(modify->fix[found]));
    if (!mesh_fix_[k])
      fail("wall " + impacts_->command.walls[std::size_t(wall_number(impacts_->command.around.meshes[k].id))] +
           ": there is no fix mesh/surface with the ID " + impacts_->command.meshes[k] + "; define it before the run");
  }
}

/// Sends the meshes that may have moved to the first rank. dt (s): time since the last call, or 0 if there is none. Collective.
void FixLcpImpact::gather_walls(double dt) {
  for (std::size_t k = 0; k < mesh_.size(); ++k) {
    TriMesh &mesh = *mesh_fix_[k]->triMesh();
    mesh_[k].clear();
    if (!mesh.isMoving() && dt > 0.0) continue;  // it stands, and its surface velocity is constant during a run
    const auto *velocity = mesh.prop().getElementProperty<MultiVectorContainer<double, 3, 3>>("v");
    std::vector<Triangle> own;
    for (int i = 0; i < mesh.sizeLocal(); ++i) {
      Triangle &triangle = own.emplace_back(dembark_liggghts::triangle_of(mesh, i));
      for (int c = 0; velocity && c < 3; ++c) triangle.velocity[c] = vector((*velocity)(i)[c]);
    }
    ranks_.gather(own, mesh_[k]);
  }
}

/// The corners of a moving mesh get the velocity with which they came, that of the half step as the bodies have it; those of a mesh that
/// stands and has a surface velocity (a conveyor), and of all with dt = 0, the mesh's own. On the first rank.
void FixLcpImpact::take_walls(double dt) {
  for (std::size_t k = 0; k < mesh_.size(); ++k) {
    std::vector<Triangle> &now = mesh_[k];
    if (now.empty()) continue;
    std::sort(now.begin(), now.end(), [](const Triangle &a, const Triangle &b) { return a.id < b.id; });
    const bool moving = mesh_fix_[k]->triMesh()->isMoving();
    Mesh &mesh = impacts_->command.around.meshes[k];
    const std::vector<Triangle> &before = mesh.surface.triangles();
    for (std::size_t i = 0; moving && dt > 0.0 && now.size() == before.size() && i < now.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        // The engine takes a triangle that leaves a periodic box to the other end.
        const Vec way = now[i].node[c] - before[i].node[c];
        double nearest[3] = {way.x, way.y, way.z};
        domain->minimum_image(nearest);
        now[i].velocity[c] = vector(nearest) * (1.0 / dt);
      }
    mesh.update(std::move(now));
    // At the very first set-up nothing has moved yet, and the engine does not tell what will.
    mesh.velocity_known = !moving || dt > 0.0 || mesh.speed > 0.0;
  }
}
