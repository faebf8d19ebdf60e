#include "shared_fix.h"

#include <cstring>

using namespace LAMMPS_NS;

namespace dembark_family {

std::vector<Fix*> SharedFix::fixes() const {
  std::vector<Fix*> all;
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k]) all.push_back(modify->fix[k]);
  return all;
}

Fix* SharedFix::fix_of_style(const char* style) const {
  for (Fix* const fix : fixes())
    if (is(*fix, style)) return fix;
  return nullptr;
}

void SharedFix::only_one() const {
  for (const Fix* const fix : fixes())
    if (fix != this && is(*fix, style) && std::strcmp(fix->id, id) != 0)
      fail(std::string("there can be one such fix only, and there is fix ") + fix->id);
}

void SharedFix::only_verlet() const {
  if (!is_verlet(*update)) fail("only run_style verlet is supported");
}

void SharedFix::only_single_grains(const std::string& does) const {
  for (const Fix* const fix : fixes())
    if (moves_clusters(*fix)) fail(does + " single grains, and fix " + fix->id + " (" + fix->style + ") moves bodies made of several");
}

void SharedFix::write_part(FILE* file, const std::vector<std::pair<const void*, std::size_t>>& pieces) {
  int bytes = 0;
  for (const auto& [data, size] : pieces) bytes += int(size);
  fwrite(&bytes, sizeof bytes, 1, file);
  for (const auto& [data, size] : pieces) fwrite(data, 1, size, file);
}

const double* SharedFix::restart_row(int i, int nth) const {
  const double* row = atom->extra[i];
  for (int k = 0; k < nth; ++k) row += int(row[0]);
  return row;
}

void GrainFix::find_movers(const std::string& does) {
  moving_ = frozen_ = 0;
  movers_.clear();
  gravities_.clear();
  only_single_grains(does);
  for (Fix* const fix : fixes()) {
    if (is(*fix, "gravity")) gravities_.push_back({fix->groupbit, acceleration_of(fix)});
    if (is(*fix, "freeze")) frozen_ |= fix->groupbit;
    if (is(*fix, "nve/sphere")) movers_.emplace_back(fix->groupbit, inertia_of(*fix));
    if (is(*fix, "nve")) movers_.emplace_back(fix->groupbit, 0.0);
  }
  for (const auto& [group, its] : movers_) moving_ |= group;
}

void GrainFix::want_movers() const {
  if (movers_.empty()) fail("no grain follows its forces: it needs fix nve/sphere, or fix nve for grains that do not turn");
}

}  // namespace dembark_family
