#include "fix_lcp_impact_mesh.h"

#include <algorithm>
#include <cmath>

#include "fix_mesh_surface.h"
#include "multi_vector_container.h"
#include "tri_mesh.h"

namespace dembark_liggghts {

using dembark::impact::Triangle;
using LAMMPS_NS::MultiVectorContainer;

void ImpactMesh::gather(LAMMPS_NS::FixMeshSurface& fix, MPI_Comm world, double dt) {
  constexpr int width = 19;
  LAMMPS_NS::TriMesh& mesh = *fix.triMesh();
  const bool moving = mesh.isMoving();
  if (!moving && dt > 0.0) return;  // it stands, and its surface velocity is constant during a run
  MultiVectorContainer<double, 3, 3>* velocity = mesh.prop().getElementProperty<MultiVectorContainer<double, 3, 3>>("v");
  std::vector<double> own;
  own.reserve(std::size_t(mesh.sizeLocal()) * width);
  for (int i = 0; i < mesh.sizeLocal(); ++i) {
    own.push_back(mesh.id(i));
    for (int corner = 0; corner < 3; ++corner) {
      double x[3];
      mesh.node(i, corner, x);
      own.insert(own.end(), x, x + 3);
    }
    for (int corner = 0; corner < 3; ++corner)
      for (int axis = 0; axis < 3; ++axis) own.push_back(velocity ? (*velocity)(i)[corner][axis] : 0.0);
  }
  int ranks = 1, count = int(own.size());
  MPI_Comm_size(world, &ranks);
  std::vector<int> counts(std::size_t(ranks), 0), offsets(std::size_t(ranks), 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int r = 1; r < ranks; ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<double> all(std::size_t(offsets[ranks - 1] + counts[ranks - 1]));
  MPI_Allgatherv(own.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE, world);

  std::vector<Triangle> found(all.size() / width);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double* v = &all[i * width];
    found[i].id = static_cast<std::int64_t>(v[0]);
    for (int c = 0; c < 3; ++c) {
      found[i].node[c] = {v[1 + 3 * c], v[2 + 3 * c], v[3 + 3 * c]};
      found[i].velocity[c] = {v[10 + 3 * c], v[11 + 3 * c], v[12 + 3 * c]};
    }
  }
  std::sort(found.begin(), found.end(), [](const Triangle& a, const Triangle& b) { return a.id < b.id; });
  if (moving && dt > 0.0 && found.size() == triangles_.size())
    for (std::size_t i = 0; i < found.size(); ++i)
      for (int c = 0; c < 3; ++c) found[i].velocity[c] = (found[i].node[c] - triangles_[i].node[c]) * (1.0 / dt);
  triangles_.swap(found);
  velocity_known_ = !moving || dt > 0.0 || speed() > 0.0;
}

double ImpactMesh::speed() const {
  double square = 0.0;
  for (const Triangle& t : triangles_)
    for (const dembark::Vec3<double>& v : t.velocity) square = std::max(square, dot(v, v));
  return std::sqrt(square);
}

}  // namespace dembark_liggghts
