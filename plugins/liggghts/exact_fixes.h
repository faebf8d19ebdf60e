// Fixes of LIGGGHTS that go on exactly from a state of fix resume/exact. docs/how-to/restarts.md has the same list, which a test compares.
#ifndef DEMBARK_EXACT_FIXES_H
#define DEMBARK_EXACT_FIXES_H

#include "resume_fix.h"

namespace dembark_liggghts {

inline constexpr dembark_family::ExactFix exact_fixes[] = {
    {"addforce", "keeps nothing"},
    {"ave/time", "keeps nothing at the end of an interval; not with ave running or window, or with a file, which it writes anew"},
    {"capillary/liquid", "its liquid is in the restart file"},
    {"check/timestep/gran", "keeps nothing"},
    {"contacthistory", "histories of pairs are in the state"},
    {"contacthistory/mesh", "histories of meshes are in the state"},
    {"drag", "keeps nothing"},
    {"energy/account", "its sums are in the restart file"},
    {"enforce2d", "keeps nothing"},
    {"freeze", "keeps nothing"},
    {"gravity", "keeps nothing; its acceleration is compared"},
    {"integration/monitor", "its counts and past accelerations are in the restart file"},
    {"lcp/impact", "its contacts are in the restart file"},
    {"lineforce", "keeps nothing"},
    {"mesh/surface", "its nodes are in the restart file"},
    {"momentum", "keeps nothing"},
    {"move", "the positions and the step that it starts from are in the restart file"},
    {"move/mesh", "its time and the nodes of the mesh are in the restart file"},
    {"neighlist/mesh", "is built anew where the run that wrote the state built it"},
    {"nve", "keeps nothing"},
    {"nve/sph/coupled", "its sums are in the restart file"},
    {"nve/sphere", "keeps nothing"},
    {"planeforce", "keeps nothing"},
    {"print", "keeps nothing"},
    {"property/atom", "its values are in the state"},
    {"property/global", "its values are compared"},
    {"resume/exact", "this fix"},
    {"setforce", "keeps nothing"},
    {"sph/body", "its body is in the restart file"},
    {"sph/contact", "its springs are in the restart file"},
    {"sph/wall", "its sums are in the restart file"},
    {"viscous", "keeps nothing"},
    {"wall/gran", "histories of primitive walls and of meshes are in the state"},
    {"wall/motion", "its clock and sums are in the restart file"},
};

}  // namespace dembark_liggghts

#endif
