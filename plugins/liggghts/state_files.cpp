#include "state_files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace dembark_liggghts {

namespace {

const std::string suffix = ".restart", mark_suffix = ".crc";
constexpr std::size_t kept_states = 2;
std::string read_state;

struct Close {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
typedef std::unique_ptr<std::FILE, Close> File;

/// Size and CRC-32 (of ISO 3309, as zlib's) of a file; false when it cannot be read.
bool check_sum(const std::string& path, std::uint64_t& bytes, std::uint32_t& crc) {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
      t[n] = c;
    }
    return t;
  }();
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) return false;
  std::vector<unsigned char> buffer(1 << 20);
  std::uint32_t c = 0xffffffffu;
  bytes = 0;
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
    for (std::size_t k = 0; k < n; ++k) c = table[(c ^ buffer[k]) & 0xff] ^ (c >> 8);
    bytes += n;
  }
  crc = c ^ 0xffffffffu;
  return !std::ferror(file.get());
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

/// Steps of all files that are named like a state, the newest first.
std::vector<long long> all_states(const std::string& base) {
  const std::string folder = folder_of(base), stem = base.substr(base.rfind('/') + 1) + ".";
  std::vector<long long> steps;
  DIR* const directory = opendir(folder.c_str());
  if (!directory) return steps;
  while (const dirent* entry = readdir(directory)) {
    const std::string name = entry->d_name;
    if (name.size() <= stem.size() + suffix.size() || name.compare(0, stem.size(), stem) != 0 ||
        name.compare(name.size() - suffix.size(), suffix.size(), suffix) != 0)
      continue;
    const std::string middle = name.substr(stem.size(), name.size() - stem.size() - suffix.size());
    if (middle.find_first_not_of("0123456789") == std::string::npos) steps.push_back(std::atoll(middle.c_str()));
  }
  closedir(directory);
  std::sort(steps.rbegin(), steps.rend());
  return steps;
}

void delete_state(const std::string& base, long long step) {
  unlink((state_name(base, step) + mark_suffix).c_str());
  unlink(state_name(base, step).c_str());
}

struct Mark {
  unsigned long long bytes = 0;
  unsigned crc = 0;
  int grid[3] = {0, 0, 0};
};

bool read_mark(const std::string& path, Mark& mark) {
  const File file(std::fopen((path + mark_suffix).c_str(), "r"));
  return file && std::fscanf(file.get(), "%llu %x %d %d %d", &mark.bytes, &mark.crc, mark.grid, mark.grid + 1, mark.grid + 2) == 5;
}

bool whole(const std::string& path) {
  Mark mark;
  std::uint64_t bytes = 0;
  std::uint32_t crc = 0;
  return read_mark(path, mark) && check_sum(path, bytes, crc) && bytes == mark.bytes && crc == mark.crc;
}

std::string failure(const std::string& path, const char* what) {
  return "file " + path + " cannot be " + what + ": " + std::strerror(errno);
}

/// Where the part of a table to keep ends: after the last whole row at or before `step`. The first line is the header.
long table_end(std::FILE* file, long long step) {
  std::vector<char> line(1 << 16);
  long end = 0;
  for (bool first = true; std::fgets(line.data(), int(line.size()), file); first = false) {
    const std::size_t length = std::strlen(line.data());
    if (line[length - 1] != '\n') break;
    char* rest = nullptr;
    const long long row = std::strtoll(line.data(), &rest, 10);
    if (!first && (rest == line.data() || row > step)) break;
    end = std::ftell(file);
  }
  return end;
}

/// Where the part of a dump to keep ends: after the last whole frame at or before `step`.
long dump_end(std::FILE* file, long long step) {
  std::vector<char> line(1 << 16);
  long end = 0;
  const auto next = [&] { return std::fgets(line.data(), int(line.size()), file) && line[std::strlen(line.data()) - 1] == '\n'; };
  while (next() && std::strcmp(line.data(), "ITEM: TIMESTEP\n") == 0) {
    if (!next() || std::atoll(line.data()) > step) break;
    if (!next() || !next()) break;                 // "ITEM: NUMBER OF ...", the number
    long long rows = std::atoll(line.data()) + 5;  // and the box, and the names of the columns
    while (rows > 0 && next()) --rows;
    if (rows > 0) break;
    end = std::ftell(file);
  }
  return end;
}

}  // namespace

std::string state_name(const std::string& base, long long step) { return base + "." + std::to_string(step) + suffix; }

std::vector<long long> whole_states(const std::string& base) {
  std::vector<long long> steps = all_states(base);
  steps.erase(std::remove_if(steps.begin(), steps.end(), [&](long long step) { return !whole(state_name(base, step)); }), steps.end());
  return steps;
}

void sync_file(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY);
  if (descriptor < 0) return;
  fsync(descriptor);
  ::close(descriptor);
}

std::string keep_state(const std::string& part, const std::string& base, long long step, const int (&grid)[3]) {
  const std::string state = state_name(base, step), mark = state + mark_suffix, mark_part = mark + ".part";
  std::uint64_t bytes = 0;
  std::uint32_t crc = 0;
  if (!check_sum(part, bytes, crc)) return failure(part, "read");
  sync_file(part);
  unlink(mark.c_str());
  if (std::rename(part.c_str(), state.c_str()) != 0) return failure(state, "written");
  std::FILE* const file = std::fopen(mark_part.c_str(), "w");
  if (!file) return failure(mark_part, "written");
  const bool told = std::fprintf(file, "%llu %08x %d %d %d\n", static_cast<unsigned long long>(bytes), static_cast<unsigned>(crc), grid[0],
                                 grid[1], grid[2]) > 0;
  if (std::fclose(file) != 0 || !told) return failure(mark_part, "written");
  sync_file(mark_part);
  if (std::rename(mark_part.c_str(), mark.c_str()) != 0) return failure(mark, "written");
  sync_file(folder_of(base));
  const std::vector<long long> steps = all_states(base);
  for (std::size_t k = kept_states; k < steps.size(); ++k) delete_state(base, steps[k]);
  return "";
}

void delete_broken_states(const std::string& base) {
  for (const long long step : all_states(base))
    if (!whole(state_name(base, step))) delete_state(base, step);
}

void name_state_that_is_read(const std::string& path) { read_state = path; }

std::string state_that_was_read(const std::string& base, long long step) {
  return read_state.empty() ? state_name(base, step) : read_state;
}

std::string not_whole(const std::string& path) { return "file " + path + " could not be written whole. No space left on the disk?"; }

std::string cut_output(const std::string& path, long long step) {
  std::fflush(nullptr);  // of whatever stream writes to the file
  File file(std::fopen(path.c_str(), "r"));
  if (!file) return errno == ENOENT ? "" : failure(path, "read");
  char start[6] = "";
  const bool dump = std::fread(start, 1, 5, file.get()) == 5 && std::strcmp(start, "ITEM:") == 0;
  std::rewind(file.get());
  const long end = dump ? dump_end(file.get(), step) : table_end(file.get(), step);
  file.reset();
  return truncate(path.c_str(), end) == 0 ? "" : failure(path, "cut");
}

bool processor_grid(const std::string& state, int (&grid)[3]) {
  Mark mark;
  if (!read_mark(state, mark)) return false;
  std::copy(mark.grid, mark.grid + 3, grid);
  return true;
}

}  // namespace dembark_liggghts
