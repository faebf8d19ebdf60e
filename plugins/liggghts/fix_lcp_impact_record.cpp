#include "fix_lcp_impact_record.h"

#include <cerrno>
#include <cstring>

#include <unistd.h>

namespace dembark_liggghts {

ImpactRecord::~ImpactRecord() {
  if (file_) std::fclose(file_);
}

std::string ImpactRecord::open(const std::string& path, long long kept, const std::string& about) {
  const std::string of = "impacts: file " + path;
  if (kept < 0) {
    file_ = std::fopen(path.c_str(), "w");
    if (!file_) return of + " cannot be written: " + std::strerror(errno);
    std::string header = "# impacts that have ended, SI units; id_b < 0 is a wall:" + (about.empty() ? " there is none" : about) +
                         "\n# id_a id_b time duration peak_force impulse relative_speed dissipated x y z\n";
    bytes_ = static_cast<long long>(header.size());
    if (std::fputs(header.c_str(), file_) < 0 || std::fflush(file_) != 0) return of + " cannot be written: " + std::strerror(errno);
    return "";
  }
  file_ = std::fopen(path.c_str(), "r+");
  if (!file_) return of + ", which the restart file goes on with, cannot be opened: " + std::strerror(errno);
  std::fseek(file_, 0, SEEK_END);
  const long long found = std::ftell(file_);
  if (found < kept)
    return of + " has " + std::to_string(found) + " bytes, the restart file goes on after " + std::to_string(kept) +
           "; bring the file back or give another name";
  if (ftruncate(fileno(file_), static_cast<off_t>(kept)) != 0) return of + " cannot be cut: " + std::strerror(errno);
  std::fseek(file_, 0, SEEK_END);
  bytes_ = kept;
  return "";
}

bool ImpactRecord::write(const std::vector<dembark::impact::Impact>& impacts) {
  if (!file_ || impacts.empty()) return true;
  for (const dembark::impact::Impact& i : impacts) {
    const int n = std::fprintf(file_, "%lld %lld %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g\n", static_cast<long long>(i.a),
                               static_cast<long long>(outer_id(i.b)), i.time, i.duration, i.peak_force, i.impulse, i.relative_speed,
                               i.dissipated, i.place.x, i.place.y, i.place.z);
    if (n < 0) return false;
    bytes_ += n;
  }
  return std::fflush(file_) == 0;
}

}  // namespace dembark_liggghts
