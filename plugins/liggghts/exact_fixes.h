// Fixes of LIGGGHTS alone that go on exactly from a state of fix resume/exact, and why; resume_record.cpp has those of both engines.
#ifndef DEMBARK_EXACT_FIXES_H
#define DEMBARK_EXACT_FIXES_H

namespace dembark_engine {

constexpr const char* exact_fixes[][2] = {
    {"ave/time", "keeps nothing at the end of an interval; not with ave running or window, or with a file, which it writes anew"},
    {"check/timestep/gran", "keeps nothing"},
    {"contacthistory", "histories of pairs are in the state"},
    {"contacthistory/mesh", "histories of meshes are in the state"},
    {"mesh/surface", "its nodes are in the restart file"},
    {"move/mesh", "its time and the nodes of the mesh are in the restart file"},
    {"neighlist/mesh", "is built anew where the run that wrote the state built it"},
    {"nve/sph/coupled", "its sums are in the restart file"},
    {"property/atom", "its values are in the state"},
    {"property/global", "its values are compared"},
    {"sph/body", "its body is in the restart file"},
    {"sph/contact", "its springs are in the restart file"},
    {"sph/wall", "its sums are in the restart file"},
    {"wall/gran", "histories of primitive walls and of meshes are in the state"},
    {"wall/motion", "its clock and sums are in the restart file"},
};

}  // namespace dembark_engine

#endif
