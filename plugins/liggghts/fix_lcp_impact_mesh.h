// The triangles of a stock fix mesh/surface for fix lcp/impact.
#pragma once

#include <mpi.h>

#include "dembark/surface/surface_contacts.hpp"

namespace LAMMPS_NS {
class Domain;
class FixMeshSurface;
}  // namespace LAMMPS_NS

namespace dembark_liggghts {

/// All triangles of a mesh, the same on every rank, sorted by their number.
struct ImpactMesh {
  dembark::SurfaceContacts surface;
  double speed = 0.0;  ///< m/s, of the fastest corner
  /// False at the very first set-up of a moving mesh: nothing has moved yet, and the engine does not tell what will.
  bool velocity_known = true;

  /// Collective. `dt` (s): time since the last call, or 0 if there is none. The corners of a moving mesh get the velocity with which
  /// they came, that of the half step as the bodies have it; those of a mesh that stands and has a surface velocity (a conveyor), and of
  /// all with dt = 0, the mesh's own.
  void gather(LAMMPS_NS::FixMeshSurface& fix, LAMMPS_NS::Domain& domain, MPI_Comm world, double dt);
};

}  // namespace dembark_liggghts
