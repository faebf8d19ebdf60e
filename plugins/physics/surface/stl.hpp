// Triangles of an STL file, written as text or in binary form. Its numbers are metres here; its normals are not read.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "triangle.hpp"

namespace dembark {
namespace stl {

constexpr std::size_t head = 80, facet = 50;  ///< bytes, of the binary form

/// How many facets a binary file says that it has; it is one if that fits its size.
inline bool is_binary(const std::string& content, std::uint32_t& count) {
  if (content.size() < head + sizeof count) return false;
  std::memcpy(&count, content.data() + head, sizeof count);
  return content.size() == head + sizeof count + facet * std::size_t(count);
}

inline std::vector<Triangle> read_binary(const std::string& content, std::uint32_t count) {
  std::vector<Triangle> found(count);
  for (std::size_t i = 0; i < found.size(); ++i) {
    float numbers[12];  // the normal, then the corners
    std::memcpy(numbers, content.data() + head + sizeof count + facet * i, sizeof numbers);
    for (int k = 0; k < 3; ++k) found[i].node[k] = {numbers[3 + 3 * k], numbers[4 + 3 * k], numbers[5 + 3 * k]};
  }
  return found;
}

inline std::vector<Triangle> read_text(const std::string& content, const std::string& name) {
  std::istringstream lines(content);
  std::vector<Triangle> found;
  int number = 0, corners = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream stream(line);
    std::string word;
    if (!(stream >> word)) continue;
    const auto refuse = [&](const std::string& what) {
      std::ostringstream text;
      text << "file '" << name << "', line " << number << ": " << what;
      throw std::invalid_argument(text.str());
    };
    if (word == "facet") {
      found.emplace_back();
      corners = 0;
    } else if (word == "vertex") {
      if (found.empty() || corners == 3) refuse("a facet must have three vertices");
      double x[3];
      for (double& each : x) {
        if (!(stream >> word)) refuse("a vertex must have three numbers");
        char* end = nullptr;
        each = std::strtod(word.c_str(), &end);
        if (*end || !std::isfinite(each)) refuse("'" + word + "' is not a number");
      }
      found.back().node[corners++] = {x[0], x[1], x[2]};
    } else if (word == "endfacet" && corners != 3) refuse("a facet must have three vertices");
  }
  return found;
}

}  // namespace stl

/// With the ids 0, 1, ... in the order of the file. Throws std::invalid_argument with one line about what is wrong.
inline std::vector<Triangle> read_stl(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  if (!file) throw std::invalid_argument("file '" + name + "' cannot be read");
  const std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::uint32_t count = 0;
  std::vector<Triangle> found = stl::is_binary(content, count) ? stl::read_binary(content, count) : stl::read_text(content, name);
  if (found.empty()) throw std::invalid_argument("file '" + name + "' holds no triangles; it must be an STL file");
  for (std::size_t i = 0; i < found.size(); ++i) found[i].id = std::int64_t(i);
  return found;
}

}  // namespace dembark
