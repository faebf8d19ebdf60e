// The file of impacts: one line, or one record of float64, for each impact that has ended, written at once.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "types.hpp"

namespace dembark {
namespace impact {

/// What the numbers of the walls stand for.
inline std::string wall_legend(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t w = 0; w < names.size(); ++w) {
    const std::string number = std::to_string(w + 1);
    text += (w ? ", -" : "-") + number + " = " + (names[w].empty() ? "wall " + number : names[w]);
  }
  return text.empty() ? "there is none" : text;
}

/// Appends impacts and knows how many bytes are right, so that a run that is taken up again neither repeats what was written after its
/// state was saved nor loses what was written before. Throws std::runtime_error with one line.
class ImpactFile {
 public:
  const std::string& path() const { return path_; }
  long long bytes() const { return bytes_; }

  /// Where it is not open: a new file, or that of the saved run which goes on.
  void open(const std::string& path, const std::string& about) {
    if (std::exchange(open_, true) && path == path_) return;
    if (path == path_ && bytes_ > 0) return resume(path, bytes_);
    path_.clear();
    if (!path.empty()) begin(path, about);
  }

  /// A new file. about: what the numbers of the walls stand for. A name that ends in .bin: records only, of the machine's doubles.
  void begin(std::string path, const std::string& about) {
    path_ = std::move(path);
    bytes_ = 0;
    put("w", binary() ? ""
                      : "# impacts that have ended, SI units; id_b < 0 is a wall: " + about +
                            "\n# id_a id_b time duration peak_force impulse relative_speed dissipated x y z friction_loss nx ny nz "
                            "turn_a turn_b\n");
  }

  /// Goes on with the file behind its first `bytes`; the rest is cut off.
  void resume(std::string path, long long bytes) {
    path_ = std::move(path);
    bytes_ = bytes;
    std::error_code wrong;
    const auto size = std::filesystem::file_size(path_, wrong);
    if (wrong) fail("is not there; the saved run goes on with it");
    if (size < static_cast<std::uintmax_t>(bytes))
      fail("has " + std::to_string(size) + " bytes, the saved run goes on after " + std::to_string(bytes) +
           "; bring the file back or give another name");
    std::filesystem::resize_file(path_, static_cast<std::uintmax_t>(bytes), wrong);
    if (wrong) fail("cannot be cut: " + wrong.message());
  }

  void append(const std::vector<Impact>& impacts) {
    if (path_.empty() || impacts.empty()) return;
    std::string lines;
    for (const Impact& impact : impacts) {
      const std::vector<double> row = table_row(impact);
      if (binary()) {
        lines.append(reinterpret_cast<const char*>(row.data()), row.size() * sizeof(double));
        continue;
      }
      char number[32];
      for (const double x : row) lines.append(number, std::size_t(std::snprintf(number, sizeof number, "%.12g ", x)));
      lines.back() = '\n';
    }
    put("a", lines);
  }

  /// What saved runs keep.
  auto fields() { return std::tie(path_, bytes_); }

 private:
  bool binary() const { return path_.size() > 4 && path_.compare(path_.size() - 4, 4, ".bin") == 0; }

  [[noreturn]] void fail(const std::string& what) const { throw std::runtime_error("file " + path_ + " " + what); }

  void put(const char* mode, const std::string& lines) {
    std::FILE* file = std::fopen(path_.c_str(), mode);
    const bool written = file && std::fwrite(lines.data(), 1, lines.size(), file) == lines.size();
    int why = errno;
    const bool closed = file && std::fclose(file) == 0;
    if (written) why = errno;
    if (!written || !closed) fail(std::string("cannot be written: ") + std::strerror(why));
    bytes_ += static_cast<long long>(lines.size());
  }

  std::string path_;  ///< empty: none
  long long bytes_ = 0;
  bool open_ = false;
};

}  // namespace impact
}  // namespace dembark
