// Fixes of LAMMPS that go on exactly from a state of fix resume/exact. docs/how-to/restarts.md has the same list, which a test compares.
#ifndef DEMBARK_EXACT_FIXES_H
#define DEMBARK_EXACT_FIXES_H

#include "resume_fix.h"

namespace dembark_lammps {

inline constexpr dembark_family::ExactFix exact_fixes[] = {
    {"DUMMY", "does nothing"},
    {"NEIGH_HISTORY", "histories of pairs are in the restart file"},
    {"addforce", "keeps nothing"},
    {"ave/time", "keeps nothing at the end of an interval; not with ave running or window"},
    {"capillary/liquid", "its liquid is in the restart file"},
    {"drag", "keeps nothing"},
    {"energy/account", "its sums are in the restart file"},
    {"enforce2d", "keeps nothing"},
    {"freeze", "keeps nothing"},
    {"gravity", "keeps nothing; its acceleration is compared"},
    {"integration/monitor", "its counts and past accelerations are in the restart file"},
    {"lcp/impact", "its contacts are in the restart file"},
    {"lineforce", "keeps nothing"},
    {"momentum", "keeps nothing"},
    {"move", "the positions and the step that it starts from are in the restart file"},
    {"nve", "keeps nothing"},
    {"nve/limit", "keeps nothing but a count"},
    {"nve/sphere", "keeps nothing"},
    {"planeforce", "keeps nothing"},
    {"print", "keeps nothing"},
    {"property/atom", "its values are in the restart file"},
    {"resume/exact", "this fix"},
    {"setforce", "keeps nothing"},
    {"viscous", "keeps nothing"},
    {"wall/dembark", "its histories, its clock and its sums are in the restart file"},
    {"wall/gran", "its histories are in the restart file; not with wiggle, which counts from where the fix is defined"},
    {"wall/reflect", "keeps nothing"},
};

}  // namespace dembark_lammps

#endif
