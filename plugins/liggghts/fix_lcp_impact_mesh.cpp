#include "fix_lcp_impact_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "domain.h"
#include "fix_mesh_surface.h"
#include "multi_vector_container.h"

#include "mesh_triangles.h"

namespace dembark_liggghts {

using dembark::Triangle;
using dembark::Vec3;
using LAMMPS_NS::MultiVectorContainer;

void ImpactMesh::gather(LAMMPS_NS::FixMeshSurface& fix, LAMMPS_NS::Domain& domain, MPI_Comm world, double dt) {
  LAMMPS_NS::TriMesh& mesh = *fix.triMesh();
  const bool moving = mesh.isMoving();
  if (!moving && dt > 0.0) return;  // it stands, and its surface velocity is constant during a run
  const auto* velocity = mesh.prop().getElementProperty<MultiVectorContainer<double, 3, 3>>("v");
  std::vector<Triangle> own;
  for (int i = 0; i < mesh.sizeLocal(); ++i) {
    own.push_back(triangle_of(mesh, i));
    for (int c = 0; velocity && c < 3; ++c) own.back().velocity[c] = {(*velocity)(i)[c][0], (*velocity)(i)[c][1], (*velocity)(i)[c][2]};
  }
  int ranks = 1;
  const int count = int(own.size() * sizeof(Triangle));
  MPI_Comm_size(world, &ranks);
  std::vector<int> counts(std::size_t(ranks), 0), offsets(std::size_t(ranks), 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int r = 1; r < ranks; ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<Triangle> all(std::size_t(offsets[ranks - 1] + counts[ranks - 1]) / sizeof(Triangle));
  MPI_Allgatherv(own.data(), count, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE, world);
  std::sort(all.begin(), all.end(), [](const Triangle& a, const Triangle& b) { return a.id < b.id; });

  const std::vector<Triangle>& before = surface.triangles();
  double square = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      Vec3<double>& v = all[i].velocity[c];
      if (moving && dt > 0.0 && all.size() == before.size()) {
        // The engine takes a triangle that leaves a periodic box to the other end.
        double way[3] = {all[i].node[c].x - before[i].node[c].x, all[i].node[c].y - before[i].node[c].y,
                         all[i].node[c].z - before[i].node[c].z};
        domain.minimum_image(way);
        v = Vec3<double>{way[0], way[1], way[2]} * (1.0 / dt);
      }
      square = std::max(square, dot(v, v));
    }
  surface.update(all);
  speed = std::sqrt(square);
  velocity_known = !moving || dt > 0.0 || speed > 0.0;
}

}  // namespace dembark_liggghts
