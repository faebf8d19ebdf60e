// Lengths and directions of single logs, from a file.
#pragma once

#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "../message_text.hpp"
#include "attitude.hpp"

namespace dembark {
namespace impact {

/// By the logs' numbers, at rest. Lines: number, length (m, >= 0), direction (three components, not zero); what follows a # is a remark.
/// Throws std::runtime_error with one line.
inline std::map<std::int64_t, Attitude> read_logs(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("file " + path + " cannot be read");
  std::map<std::int64_t, Attitude> logs;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const auto wrong = [&](const std::string& what) {
      std::string text = "file ";
      text.append(path).append(", line ").append(std::to_string(number)).append(": ").append(what);
      throw std::runtime_error(text);
    };
    std::istringstream words(line.substr(0, line.find('#')));
    if ((words >> std::ws).eof()) continue;
    std::int64_t id = 0;
    double length = 0.0;
    Vec3<double> axis{};
    std::string more;
    if (!(words >> id >> length >> axis.x >> axis.y >> axis.z) || words >> more)
      wrong("it must have five numbers: that of the atom, the length (m) and the direction of the log");
    if (!(length >= 0.0 && std::isfinite(length))) wrong("the length (m) must be >= 0, not " + number_text(length));
    const double size = norm(axis);
    if (!(size > 0.0 && std::isfinite(size))) wrong("the direction of the log must not be zero");
    if (!logs.insert({id, {length, rotation_to(axis), {}}}).second) wrong("atom " + std::to_string(id) + " has a line already");
  }
  return logs;
}

}  // namespace impact
}  // namespace dembark
