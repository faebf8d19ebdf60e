// Private and protected members of the engine that liggghts-dembark uses, all of them, each with the reason why there is no other way.
//
// An explicit instantiation may name a private member (C++17 [temp.spec]/6): stock LIGGGHTS is used as it is installed.
#ifndef DEMBARK_ENGINE_ACCESS_H
#define DEMBARK_ENGINE_ACCESS_H

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fix_ave_time.h"
#include "fix_contact_history.h"
#include "fix_gravity.h"
#include "granular_pair_style.h"
#include "granular_wall.h"
#include "input.h"
#include "modify.h"
#include "neighbor.h"
#include "settings.h"
#include "tri_mesh.h"
#include "variable.h"

namespace dembark_liggghts {

/// Keywords of the contact models. A model can register those with on/off or a number only, not one with named values.
std::map<std::string, Setting*>& keywords(Settings& settings);

typedef LAMMPS_NS::Fix* (*FixCreator)(LAMMPS_NS::LAMMPS*, int, char**);
typedef void (*CommandCreator)(LAMMPS_NS::LAMMPS*, int, char**);
/// Fix styles and commands by name, filled when the engine is built: there is no way to add one later.
std::map<std::string, FixCreator>& fix_styles(LAMMPS_NS::Modify& modify);
std::map<std::string, CommandCreator>& commands(LAMMPS_NS::Input& input);

template <class Host>
using GranularCreators = std::map<std::pair<std::string, int>, Host* (*)(LAMMPS_NS::LAMMPS*, typename Host::ParentType*, std::int64_t)>;
/// Loops of the combinations of contact models. addStyle() adds one, but what is there, the slow one for all other combinations, can
/// neither be asked for nor be replaced.
GranularCreators<LIGGGHTS::PairStyles::IGranularPairStyle>& pair_loops();
GranularCreators<LIGGGHTS::Walls::IGranularWall>& wall_loops();

/// Styles of the fixes whose values for atoms a restart file had, as long as no run has begun: whether there are contact histories.
std::vector<std::string> restarted_fixes(LAMMPS_NS::Modify& modify);

/// Number of contacts of each atom and their partners: a state that is put back has to set them.
int* partner_counts(LAMMPS_NS::FixContactHistory& history);
int** partners(LAMMPS_NS::FixContactHistory& history);

/// Whether a mean is over the steps of one interval, and whether it is written to a file: then a run that goes on writes the file anew.
bool is_of_one_interval(LAMMPS_NS::FixAveTime& mean);
bool has_file(LAMMPS_NS::FixAveTime& mean);

/// Names and formulas of variables of styles equal and atom.
std::vector<std::pair<std::string, std::string>> formulas(LAMMPS_NS::Variable& variables);
/// m, of a mesh: its keyword `precision`, which only the mesh itself can read.
double precision(LAMMPS_NS::TriMesh& mesh);
/// Whether a gravity comes from variables: the fix itself alone can say, and it computes them after the forces of the pairs.
bool from_variables(LAMMPS_NS::FixGravity& gravity);
/// Pairs of types, and pairs of bits of groups, that `neigh_modify exclude` leaves out: the engine only says whether there are some.
std::vector<std::pair<int, int>> excluded_types(LAMMPS_NS::Neighbor& neighbor);
std::vector<std::pair<int, int>> excluded_groups(LAMMPS_NS::Neighbor& neighbor);

}  // namespace dembark_liggghts

#endif
