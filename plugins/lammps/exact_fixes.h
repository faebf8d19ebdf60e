// Fixes of LAMMPS alone that go on exactly from a state of fix resume/exact, and why; resume_record.cpp has those of both engines.
#ifndef DEMBARK_EXACT_FIXES_H
#define DEMBARK_EXACT_FIXES_H

namespace dembark_engine {

constexpr const char* exact_fixes[][2] = {
    {"DUMMY", "does nothing"},
    {"NEIGH_HISTORY", "histories of pairs are in the restart file"},
    {"ave/time", "keeps nothing at the end of an interval; not with ave running or window"},
    {"nve/limit", "keeps nothing but a count"},
    {"property/atom", "its values are in the restart file"},
    {"wall/dembark", "its histories, its clock and its sums are in the restart file"},
    {"wall/gran", "its histories are in the restart file; not with wiggle, which counts from where the fix is defined"},
    {"wall/reflect", "keeps nothing"},
};

}  // namespace dembark_engine

#endif
