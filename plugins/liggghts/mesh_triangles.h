// The triangles of an engine's mesh for dembark/surface.
#ifndef DEMBARK_MESH_TRIANGLES_H
#define DEMBARK_MESH_TRIANGLES_H

#include "tri_mesh.h"

#include "dembark/surface/triangle.hpp"

namespace dembark_liggghts {

/// By its local index.
inline dembark::Triangle triangle_of(LAMMPS_NS::TriMesh& mesh, int index) {
  dembark::Triangle t;
  t.id = mesh.id(index);
  for (int corner = 0; corner < 3; ++corner) {
    double x[3];
    mesh.node(index, corner, x);
    t.node[corner] = {x[0], x[1], x[2]};
  }
  return t;
}

}  // namespace dembark_liggghts

#endif
