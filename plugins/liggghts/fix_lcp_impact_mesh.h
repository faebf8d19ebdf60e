// The triangles of a stock fix mesh/surface for fix lcp/impact.
#pragma once

#include <vector>

#include <mpi.h>

#include "dembark/impact/triangles.hpp"

namespace LAMMPS_NS {
class FixMeshSurface;
}

namespace dembark_liggghts {

/// All triangles of a mesh, the same on every rank, sorted by their number.
class ImpactMesh {
 public:
  /// Collective. `dt` (s): time since the last call, or 0 if there is none. The corners of a moving mesh get the velocity with which
  /// they came, that of the half step as the bodies have it; those of a mesh that stands and has a surface velocity (a conveyor), and of
  /// all with dt = 0, the mesh's own.
  void gather(LAMMPS_NS::FixMeshSurface& fix, MPI_Comm world, double dt);

  /// Appends the contacts with the bodies.
  void contacts(const std::vector<dembark::impact::Body>& bodies, const dembark::impact::Wall& wall, double reach,
                std::vector<dembark::impact::Contact>& contacts) {
    finder_.find(bodies, wall, triangles_, reach, contacts);
  }

  /// Fastest corner, m/s.
  double speed() const;

  /// False at the very first set-up of a moving mesh: nothing has moved yet, and the engine does not tell what will.
  bool velocity_known() const { return velocity_known_; }

 private:
  std::vector<dembark::impact::Triangle> triangles_;
  dembark::impact::TriangleFinder finder_;
  bool velocity_known_ = true;
};

}  // namespace dembark_liggghts
