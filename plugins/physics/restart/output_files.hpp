// Output files of a run that goes on from a state: what the run wrote behind the state is cut off, for it comes again.
//
// A state keeps how long each file was (OutputFile), so the place to cut does not depend on what the file holds. A file that the state does
// not know is cut by its format (output_formats.hpp). A file whose length or format does not say where to cut is left as it is. Failures
// are thrown as std::runtime_error with one line.
#pragma once

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "../fnv.hpp"
#include "output_formats.hpp"

namespace dembark::restart {

namespace fs = std::filesystem;

[[noreturn]] inline void fail_file(const fs::path& path, const char* what, const std::error_code& why = {errno, std::generic_category()}) {
  throw std::runtime_error("file " + path.string() + " cannot be " + what + ": " + why.message());
}

/// Flush what `path` holds to the disk.
inline void sync_file(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY);
  if (descriptor < 0) return;
  fsync(descriptor);
  ::close(descriptor);
}

/// The length of a file, and a hash of its last bytes, by which the file is known again.
struct OutputFile {
  std::string path;
  std::int64_t bytes = 0;
  std::uint64_t hash = 0;
};

inline constexpr std::int64_t hashed_bytes = 1 << 16;

/// FNV-1a, of the last bytes before `end`; 0 where the file is shorter.
inline std::uint64_t hash_before(const std::string& path, std::int64_t end) {
  const std::int64_t count = std::min(end, hashed_bytes);
  std::vector<char> bytes(static_cast<std::size_t>(count));
  std::ifstream file(path, std::ios::binary);
  file.seekg(end - count);
  file.read(bytes.data(), count);
  if (!file || file.gcount() != count) return 0;
  return fnv1a(bytes);
}

/// Files that are there, as they are. What streams of this process hold back is written first.
inline std::vector<OutputFile> output_files(const std::vector<std::string>& paths) {
  std::fflush(nullptr);
  std::vector<OutputFile> files;
  for (const std::string& path : paths) {
    std::error_code missing;
    const auto bytes = static_cast<std::int64_t>(fs::file_size(path, missing));
    if (!missing && fs::is_regular_file(path)) files.push_back({path, bytes, hash_before(path, bytes)});
  }
  return files;
}

/// Whether a program has packed the file: it ends in the middle of a block, so nothing can be appended behind a cut.
inline bool is_compressed(const std::string& path) {
  unsigned char first[4] = {};
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(first), sizeof first);
  const bool gzip = first[0] == 0x1f && first[1] == 0x8b;
  return gzip || (first[0] == 0x28 && first[1] == 0xb5 && first[2] == 0x2f && first[3] == 0xfd);
}

/// Whether LIGGGHTS and LAMMPS append to a dump of this name, if they are asked to. Others they write anew.
inline bool can_append(const std::string& path) {
  const std::string end = fs::path(path).extension().string();
  for (const char* const other : {".bin", ".gz", ".bz2", ".zst", ".xz", ".lzma", ".lz4"})
    if (end == other) return false;
  return true;
}

/// `name`, or the first of name.2, name.3, ... that is no file.
inline std::string free_name(const std::string& name) {
  std::string free = name;
  for (int k = 2; fs::exists(free); ++k) free = name + "." + std::to_string(k);
  return free;
}

/// Copy all behind `at` into a file of its own next to `path`; its name.
inline std::string keep_behind(const std::string& path, std::int64_t at, long long step) {
  const std::string name = path + ".after-" + std::to_string(step), part = name + ".part";
  const std::string kept = free_name(name);
  std::ifstream from(path, std::ios::binary);
  std::ofstream to(part, std::ios::binary);
  from.seekg(at);
  to << from.rdbuf();
  to.close();
  if (!from || !to) fail_file(part, "written");
  sync_file(part);
  fs::rename(part, kept);
  return kept;
}

/// Shorten `path` to `at` bytes, in one step. `keep`: what is cut off stays in a file of its own, which is complete before. What there is
/// to say, or nothing.
inline std::string shorten(const std::string& path, std::int64_t at, long long step, bool keep) {
  if (std::int64_t(fs::file_size(path)) == at) return "";
  const std::string kept = keep ? keep_behind(path, at, step) : "";
  std::error_code wrong;
  fs::resize_file(path, std::uintmax_t(at), wrong);
  if (wrong) fail_file(path, "cut", wrong);
  return keep ? "file " + path + " is cut behind step " + std::to_string(step) + "; what was cut off is in " + kept : "";
}

inline std::string left(const std::string& path, const std::string& why) { return "file " + path + " is left as it is: " + why; }

/// Cut `path` by its format after the last frame or row at or before `step`, and keep what is cut off in a file of its own. What there is
/// to say, or nothing. A file that does not exist is left alone.
inline std::string cut_output(const std::string& path, long long step) {
  std::fflush(nullptr);
  if (!fs::is_regular_file(path) || fs::file_size(path) == 0) return "";
  if (is_compressed(path)) return left(path, "it is compressed");
  const FileEnd end = end_of_kept(path, step);
  if (end.unread) fail_file(path, "read");
  if (!end.understood) return left(path, "nothing in it says which lines are of which step; look for what stands there twice");
  return shorten(path, end.at, step, true);
}

/// Cut a file to its length in the state of `step`.
inline std::string cut_output(const OutputFile& file, long long step, bool keep) {
  std::fflush(nullptr);
  if (!fs::is_regular_file(file.path))
    return "file " + file.path + " is gone; up to step " + std::to_string(step) + " it is not written again";
  const auto bytes = std::int64_t(fs::file_size(file.path));
  if (bytes < file.bytes)
    return left(file.path, "it has " + std::to_string(bytes) + " bytes, and had " + std::to_string(file.bytes) + " at step " +
                               std::to_string(step) + "; was it opened anew instead of to append?");
  if (is_compressed(file.path)) return left(file.path, "it is compressed");
  if (hash_before(file.path, file.bytes) != file.hash) return left(file.path, "it is another one than at step " + std::to_string(step));
  return shorten(file.path, file.bytes, step, keep);
}

/// Cut the files at `paths` that can be appended to: those that are known from the state of `step` to their length then, and the others
/// behind the rows and frames of step `last`. `keep`: as in shorten(). What there is to say, a line each.
inline std::vector<std::string> cut_outputs(const std::vector<std::string>& paths, const std::vector<OutputFile>& known, long long step,
                                            long long last, bool keep) {
  std::vector<std::string> lines;
  for (const std::string& path : paths) {
    if (!can_append(path)) continue;
    const auto found = std::find_if(known.begin(), known.end(), [&](const OutputFile& file) { return file.path == path; });
    const std::string line = found == known.end() ? cut_output(path, last) : cut_output(*found, step, keep);
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}

/// Give a file that cannot be appended to another name, cut to its length in the state if it is known and not packed. What there is to say,
/// or nothing.
inline std::string keep_unappendable(const std::string& path, const std::vector<OutputFile>& known, long long step) {
  if (can_append(path) || !fs::is_regular_file(path) || fs::file_size(path) == 0) return "";
  const std::string kept = free_name(path + ".until-" + std::to_string(step));
  fs::rename(path, kept);
  for (const OutputFile& file : known)
    if (file.path == path && !is_compressed(kept) && hash_before(kept, file.bytes) == file.hash) shorten(kept, file.bytes, step, false);
  return "nothing can be appended to file " + path + "; what was written up to step " + std::to_string(step) + " is in " + kept;
}

}  // namespace dembark::restart
