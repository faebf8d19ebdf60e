// States of a run on disk: written whole or not at all, the last two kept, and the newest whole one found again.
//
// A state BASE.<step>.restart, or with another ending, counts when BASE.<step>.restart.crc next to it names its size and its CRC-32; the
// mark is written last. It also names the grid of processors, which the engine would choose anew by the shape that the box has by then.
// What goes wrong is thrown as std::runtime_error with one line.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "output_files.hpp"

namespace dembark::restart {

struct State {
  long long step = -1;  ///< -1: there is none
  int grid[3] = {0, 0, 0};
};

inline constexpr const char *state_end = ".restart", *mark_end = ".crc";

inline std::string state_name(const std::string& base, long long step, const char* ending = state_end) {
  return base + "." + std::to_string(step) + ending;
}

/// The whole number that `text` begins with; 0 where it begins with none.
inline long long leading_number(const std::string& text) { return std::strtoll(text.c_str(), nullptr, 10); }

inline std::string mark_text(long long bytes, std::uint32_t crc) {
  char text[40];
  std::snprintf(text, sizeof text, "%lld %08x", bytes, crc);
  return text;
}

/// Size and CRC-32 (of ISO 3309, as zlib's) of a file as its mark names them; empty when it cannot be read.
inline std::string check_sum(const std::string& path) {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      t[n] = n;
      for (int k = 0; k < 8; ++k) t[n] = t[n] & 1 ? 0xedb88320u ^ (t[n] >> 1) : t[n] >> 1;
    }
    return t;
  }();
  std::ifstream file(path, std::ios::binary);
  std::vector<char> buffer(1 << 20);
  std::uint32_t crc = 0xffffffffu;
  long long bytes = 0;
  while (file.read(buffer.data(), std::streamsize(buffer.size())), file.gcount() > 0) {
    for (std::streamsize k = 0; k < file.gcount(); ++k) crc = table[(crc ^ static_cast<unsigned char>(buffer[k])) & 0xff] ^ (crc >> 8);
    bytes += file.gcount();
  }
  return file.eof() && !file.bad() ? mark_text(bytes, crc ^ 0xffffffffu) : "";
}

inline fs::path folder_of(const std::string& base) {
  const fs::path folder = fs::path(base).parent_path();
  return folder.empty() ? "." : folder;
}

/// Steps of all files that are named like a state, the newest first.
inline std::vector<long long> all_states(const std::string& base, const char* ending = state_end) {
  const std::string own = fs::path(base).filename().string();
  std::vector<long long> steps;
  std::error_code unreadable;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_of(base), unreadable)) {
    const std::string name = entry.path().filename().string();
    const long long step = leading_number(name.substr(std::min(own.size() + 1, name.size())));
    if (name == state_name(own, step, ending)) steps.push_back(step);
  }
  std::sort(steps.rbegin(), steps.rend());
  return steps;
}

/// The newest state that is whole.
inline State newest_state(const std::string& base, const char* ending = state_end) {
  for (const long long step : all_states(base, ending)) {
    const std::string path = state_name(base, step, ending);
    std::ifstream mark(path + mark_end);
    long long bytes = 0;
    std::uint32_t crc = 0;
    State state{step};
    if (mark >> bytes >> std::hex >> crc >> std::dec >> state.grid[0] >> state.grid[1] >> state.grid[2] &&
        mark_text(bytes, crc) == check_sum(path))
      return state;
  }
  return {};
}

/// Delete all states, whole or not, but the newest `kept`.
inline void delete_states(const std::string& base, std::size_t kept, const char* ending = state_end) {
  const std::vector<long long> steps = all_states(base, ending);
  for (std::size_t k = kept; k < steps.size(); ++k)
    for (const char* const end : {mark_end, ""}) std::remove((state_name(base, steps[k], ending) + end).c_str());
}

/// Make the finished file `part` to a state, mark it, and delete all but the last two.
inline void keep_state(const std::string& part, const std::string& base, const State& state, const char* ending = state_end) try {
  const std::string path = state_name(base, state.step, ending), mark = path + mark_end, mark_part = mark + ".part", sum = check_sum(part);
  if (sum.empty()) fail_file(part, "read");
  sync_file(part);
  fs::remove(mark);
  fs::rename(part, path);
  std::ofstream file(mark_part);
  file << sum << ' ' << state.grid[0] << ' ' << state.grid[1] << ' ' << state.grid[2] << '\n';
  file.close();
  if (!file) fail_file(mark_part, "written");
  sync_file(mark_part);
  fs::rename(mark_part, mark);
  sync_file(folder_of(base));
  delete_states(base, 2, ending);
} catch (const fs::filesystem_error& error) {
  fail_file(error.path2().empty() ? error.path1() : error.path2(), "written", error.code());
}

}  // namespace dembark::restart
