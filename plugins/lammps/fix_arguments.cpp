#include "fix_arguments.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "modify.h"

using namespace LAMMPS_NS;

namespace dembark_lammps {
namespace {

std::map<std::pair<const LAMMPS*, std::string>, std::vector<std::string>> arguments;  // of fixes by id

/// A creator has no data of its own, so there is one for each style.
template <int style>
struct Watched {
  static inline Modify::FixCreator original = nullptr;

  static Fix* create(LAMMPS* lammps, int narg, char** arg) {
    arguments[{lammps, arg[0]}].assign(arg, arg + narg);
    return original(lammps, narg, arg);
  }
  /// False: it is there already.
  static bool enter(LAMMPS* lammps, const char* name) {
    const auto found = lammps->modify->fix_map->find(name);
    if (found == lammps->modify->fix_map->end() || found->second == &create) return false;
    original = found->second;
    found->second = &create;
    return true;
  }
};

}  // namespace

void watch_fixes(LAMMPS* lammps) {
  const bool fresh = Watched<0>::enter(lammps, "ave/time");
  Watched<1>::enter(lammps, "wall/gran");
  if (!fresh) return;
  // Of a LAMMPS that was at the same address before.
  for (auto each = arguments.begin(); each != arguments.end();)
    each = each->first.first == lammps ? arguments.erase(each) : std::next(each);
}

bool may_have_argument(LAMMPS* lammps, const Fix& fix, const std::string& word) {
  const auto found = arguments.find({lammps, fix.id});
  return found == arguments.end() || std::find(found->second.begin(), found->second.end(), word) != found->second.end();
}

}  // namespace dembark_lammps
