#include "shared_fix.h"

#include <algorithm>
#include <cctype>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

using namespace LAMMPS_NS;

namespace dembark_family {
namespace {

/// In one line, as states keep it.
std::string line_of(int count, char** words) {
  std::string line;
  for (int k = 0; k < count; ++k) line += (k ? " " : "") + std::string(words[k]);
  std::replace_if(line.begin(), line.end(), [](unsigned char c) { return std::isspace(c); }, ' ');
  return line;
}

}  // namespace

SharedFix::SharedFix(LAMMPS* lmp, int narg, char** arg)
    : EngineFix(lmp, narg, arg), words(line_of(std::max(narg - 3, 0), arg + std::min(narg, 3))) {}

std::string units_error(const Force& force, const Update& update) {
  if (force.ftm2v == 1.0 && force.mvv2e == 1.0) return "";
  return std::string("in units ") + update.unit_style +
         " force is not mass times acceleration, and the laws need that; use units si, cgs, micro, nano or lj";
}

std::string run_style_error(const Update& update) {
  const std::string style = update.integrate_style;
  if (style == "verlet" || style.rfind("verlet/kk", 0) == 0) return "";
  return "run_style " + style + " is not supported; use run_style verlet";
}

std::string new_numbers_error(const Atom& atom, const Update& update, int narg, char** arg) {
  if (atom.molecular || (!update.first_update && update.ntimestep == 0)) return "";
  std::string compress = "yes";
  for (int k = 2; k + 1 < narg; ++k)
    if (std::strcmp(arg[k], "compress") == 0) compress = arg[k + 1];
  if (compress == "no" || compress == "off" || compress == "false") return "";
  return "delete_atoms would give the atoms that stay other numbers, by which contacts and logs know each other; add 'compress no'";
}

SavedPart::SavedPart(const char* buffer) : at_(buffer + head) {
  std::uint64_t size = 0;
  if (std::memcmp(buffer, format, sizeof format - 1) != 0) refuse();
  std::memcpy(&size, buffer + sizeof format - 1, sizeof size);
  left_ = std::size_t(size);
}

void SavedPart::refuse() {
  throw std::runtime_error(
      "this restart file was written by another version of dembark; go on with that version, or give the fix another ID, with which it "
      "begins anew");
}

void SavedPart::take(void* to, std::size_t bytes) {
  if (bytes > left_) refuse();
  if (bytes > 0) std::memcpy(to, at_, bytes);
  at_ += bytes;
  left_ -= bytes;
}

std::string SavedPart::text() {
  const void* const zero = std::memchr(at_, 0, left_);
  if (!zero) refuse();
  const std::string found = at_;
  at_ += found.size() + 1;
  left_ -= found.size() + 1;
  return found;
}

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

bool SharedFix::meets(const Fix& fix) const {
  int here = 0, any = 0;
  for (int i = 0; i < atom->nlocal; ++i) here |= (atom->mask[i] & groupbit) && (atom->mask[i] & fix.groupbit);
  MPI_Allreduce(&here, &any, 1, MPI_INT, MPI_MAX, world);
  return any != 0;
}

void SharedFix::only_one() const {
  for (const Fix* const fix : fixes())
    if (fix != this && is(*fix, style) && std::strcmp(fix->id, id) != 0)
      fail(std::string("there can be one such fix only, and there is fix ") + fix->id);
}

void SharedFix::only_verlet() const {
  if (const std::string wrong = run_style_error(*update); !wrong.empty()) fail(wrong);
}

void SharedFix::only_coherent_units() const {
  if (const std::string wrong = units_error(*force, *update); !wrong.empty()) fail(wrong);
}

void SharedFix::only_constant_box(const std::string& does) const {
  for (const Fix* const fix : fixes())
    if (changes_box(*fix)) fail(does + " a box of constant size and shape, and fix " + fix->id + " (" + fix->style + ") changes it");
}

void SharedFix::only_spheres(const std::string& does) const {
  if (!has_spheres()) fail(does + " spheres only; use " + sphere_style);
}

void SharedFix::only_single_grains(const std::string& does) const {
  for (const Fix* const fix : fixes())
    if (moves_clusters(*fix)) fail(does + " single grains, and fix " + fix->id + " (" + fix->style + ") moves bodies made of several");
}

void SharedFix::write_part(FILE* file, const Pieces& pieces) const {
  std::uint64_t size = 0;
  for (const auto& piece : pieces) size += piece.second;
  if (size > INT_MAX - SavedPart::head)
    fail_alone("it has " + std::to_string(size) + " bytes for the restart file, and the engine stores up to 2 GiB of a fix");
  const int bytes = int(SavedPart::head + size);
  fwrite(&bytes, sizeof bytes, 1, file);
  fwrite(SavedPart::format, 1, sizeof SavedPart::format - 1, file);
  fwrite(&size, sizeof size, 1, file);
  for (const auto& [data, length] : pieces) fwrite(data, 1, length, file);
  if (std::fflush(file) != 0 || std::ferror(file)) fail_alone("the restart file cannot be written; is the disk full?");
}

std::string SharedFix::written(const std::function<void(FILE*)>& write) {
  char* text = nullptr;
  std::size_t size = 0;
  FILE* const file = open_memstream(&text, &size);
  if (!file) return "";
  write(file);
  std::fclose(file);
  std::string all(text, size);
  std::free(text);
  return all;
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
    if (begins_with(fix->style, "gravity")) gravities_.push_back({fix->groupbit, acceleration_of(fix)});
    if (is(*fix, "freeze")) frozen_ |= fix->groupbit;
    if (begins_with(fix->style, "nve/sphere")) movers_.emplace_back(fix->groupbit, inertia_of(*fix));
    if (is(*fix, "nve")) movers_.emplace_back(fix->groupbit, 0.0);
  }
  for (const auto& mover : movers_) moving_ |= mover.first;
}

void GrainFix::want_movers() const {
  if (movers_.empty()) fail("no grain follows its forces: it needs fix nve/sphere, or fix nve for grains that do not turn");
}

}  // namespace dembark_family
