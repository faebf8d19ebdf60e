// STL files of `fix mesh/surface`, read as all engines of dembark read them. These functions stand in front of the library's own, which
// know one spelling of the words, take any text for a number and any size for a binary file, and stop at triangles given twice.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "comm.h"
#include "error.h"
#include "input_mesh_tri.h"
#include "region.h"
#include "tri_mesh.h"

#include "engine_access.h"
#include "shared_stl.h"

namespace LAMMPS_NS {

void InputMeshTri::meshtrifile_stl(TriMesh* mesh, Region* region, const char* filename) {
  dembark::StlSurface read;
  try {
    read = dembark_family::read_shared_stl(filename, dembark_liggghts::precision(*mesh), world);
  } catch (const std::exception& wrong) {
    error->all(FLERR, wrong.what());
  }
  if (const std::string line = read.left_out(filename); me == 0 && !line.empty())
    for (FILE* const to : {screen, logfile})
      if (to) std::fprintf(to, "%s\n", line.c_str());
  std::vector<int> excluded(exclusion_list_, exclusion_list_ + size_exclusion_list_);
  std::sort(excluded.begin(), excluded.end());
  for (std::size_t i = 0; i < read.triangles.size(); ++i) {
    double x[3][3], *corner[3] = {x[0], x[1], x[2]};
    for (int k = 0; k < 3; ++k) {
      const dembark::Vec3<double>& n = read.triangles[i].node[k];
      x[k][0] = n.x, x[k][1] = n.y, x[k][2] = n.z;
    }
    if (std::binary_search(excluded.begin(), excluded.end(), read.line[i])) continue;
    if (region && !(region->match(x[0]) && region->match(x[1]) && region->match(x[2]))) continue;
    mesh->addElement(corner, read.line[i]);
  }
}

/// Both forms are read above.
void InputMeshTri::meshtrifile_stl_binary(TriMesh* mesh, Region* region, const char* filename) { meshtrifile_stl(mesh, region, filename); }

}  // namespace LAMMPS_NS
