// Triangles of an STL file, written as text or in binary form. Normals are not read: both sides of a wall are solid.
//
// Text: words in any case and between any blanks, tabs and line ends; `end loop` for `endloop`; several solids, each with a name up to the
// end of its line. A file is binary if its size is that of the number of triangles in its head, whatever it begins with. Triangles without
// area, and those given again, in any order of their corners, are left out and counted. What is cut off, or is no triangle, is refused.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "../decimal.hpp"
#include "point_grid.hpp"
#include "triangle.hpp"

namespace dembark {

struct StlSurface {
  std::vector<Triangle> triangles;  ///< with the ids 0, 1, ...; in the unit of the file
  std::vector<int> line;            ///< of each: of its `facet` in a text, its number from 1 on in a binary file
  std::vector<int> solid;           ///< of each: number of its solid
  std::vector<std::string> names;   ///< of the solids of a text; "" where there is none
  int flat = 0, again = 0;          ///< left out: without area, and given again

  /// What was left out, for the user, or nothing.
  std::string left_out(const std::string& file) const {
    if (flat == 0 && again == 0) return "";
    return "file '" + file + "': left out " + std::to_string(flat) + " triangles without area and " + std::to_string(again) +
           " given again";
  }
};

namespace stl {

constexpr std::size_t head = 80, facet = 50;  ///< bytes, of the binary form

[[noreturn]] inline void refuse(const std::string& name, const std::string& what) {
  throw std::invalid_argument("file '" + name + "'" + what + "; it must be an STL file");
}

inline void read_binary(const std::string& content, std::uint32_t count, StlSurface& found) {
  found.triangles.resize(count);
  found.line.resize(count);
  found.solid.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    float numbers[12];  // the normal, then the corners
    std::memcpy(numbers, content.data() + head + sizeof count + facet * i, sizeof numbers);
    for (int k = 0; k < 3; ++k) found.triangles[i].node[k] = {numbers[3 + 3 * k], numbers[4 + 3 * k], numbers[5 + 3 * k]};
    found.line[i] = int(i) + 1;
  }
}

class TextReader {
 public:
  TextReader(const std::string& content, const std::string& name, StlSurface& found)
      : at_(content.data()), end_(at_ + content.size()), name_(name), found_(found) {}

  void read() {
    if (end_ - at_ >= 3 && std::memcmp(at_, "\xEF\xBB\xBF", 3) == 0) at_ += 3;  // mark of UTF-8
    while (next()) {
      if (is("solid")) open_solid();
      else if (is("endsolid")) close_solid();
      else if (is("end")) close(next());
      else if (is("facet")) open_facet();
      else if (is("endfacet")) close_facet();
      else if (is("vertex")) add_corner();
      // Others (normal, its numbers, outer, loop, color) mean nothing here.
    }
    if (in_facet_) wrong("the file ends within a facet");
    if (in_solid_) wrong("the file ends before 'endsolid'");
  }

 private:
  [[noreturn]] void wrong(const std::string& what) const { refuse(name_, ", line " + std::to_string(line_) + ": " + what); }

  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v'; }
  void step() {
    if (*at_ == '\n' || (*at_ == '\r' && (at_ + 1 == end_ || at_[1] != '\n'))) ++line_;
    ++at_;
  }
  bool next() {
    while (at_ < end_ && is_blank(*at_)) step();
    first_ = at_;
    while (at_ < end_ && !is_blank(*at_)) ++at_;
    return first_ < at_;
  }
  bool is(const char* word) const {
    const std::size_t length = std::strlen(word);
    if (std::size_t(at_ - first_) != length) return false;
    for (std::size_t k = 0; k < length; ++k)
      if ((first_[k] >= 'A' && first_[k] <= 'Z' ? char(first_[k] - 'A' + 'a') : first_[k]) != word[k]) return false;
    return true;
  }
  std::string rest_of_line() {
    while (at_ < end_ && (*at_ == ' ' || *at_ == '\t')) ++at_;
    const char* const from = at_;
    while (at_ < end_ && *at_ != '\n' && *at_ != '\r') ++at_;
    const char* to = at_;
    while (to > from && is_blank(to[-1])) --to;
    return std::string(from, to);
  }

  void open_solid() {
    if (in_facet_ || in_solid_) wrong("a solid begins before the one before it ends");
    in_solid_ = true;
    found_.names.push_back(rest_of_line());
  }
  void close_solid() {
    if (in_facet_) wrong("a solid ends within a facet");
    in_solid_ = false;
    rest_of_line();
  }
  /// `end loop`, `end facet`, `end solid`.
  void close(bool more) {
    if (more && is("facet")) close_facet();
    else if (more && is("solid")) close_solid();
  }
  void open_facet() {
    if (in_facet_) wrong("a facet begins before the one before it ends");
    in_facet_ = true;
    corners_ = 0;
    if (found_.names.empty()) found_.names.emplace_back();
    found_.triangles.emplace_back();
    found_.line.push_back(line_);
    found_.solid.push_back(int(found_.names.size()) - 1);
  }
  void close_facet() {
    if (!in_facet_ || corners_ != 3) wrong("a facet must have three vertices");
    in_facet_ = false;
  }
  void add_corner() {
    if (!in_facet_ || corners_ == 3) wrong("a facet must have three vertices");
    double x[3];
    for (double& each : x) {
      const int here = line_;
      const char* const before = at_;
      if (!next() || line_ != here) {
        at_ = before, line_ = here;
        wrong("a vertex must have three numbers");
      }
      const char* const from = first_ + (*first_ == '+' && first_ + 1 < at_ && first_[1] != '-');
      if (read_decimal(from, at_, each) != at_ || !std::isfinite(each)) wrong("'" + std::string(first_, at_) + "' is not a number");
    }
    found_.triangles.back().node[corners_++] = {x[0], x[1], x[2]};
  }

  const char *at_, *end_, *first_ = nullptr;
  const std::string& name_;
  StlSurface& found_;
  int line_ = 1, corners_ = 0;
  bool in_solid_ = false, in_facet_ = false;
};

inline bool same_place(const Vec3<double>& a, const Vec3<double>& b, double precision) {
  return std::fabs(a.x - b.x) <= precision && std::fabs(a.y - b.y) <= precision && std::fabs(a.z - b.z) <= precision;
}

/// Whether the corners are the same, in any order.
inline bool same_corners(const Triangle& a, const Triangle& b, double precision) {
  static constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  return std::any_of(orders, orders + 6, [&](const int* order) {
    for (int k = 0; k < 3; ++k)
      if (!same_place(a.node[k], b.node[order[k]], precision)) return false;
    return true;
  });
}

/// Leaves out what has no area and what is given again.
inline void clean(StlSurface& surface, double precision) {
  std::vector<Triangle>& t = surface.triangles;
  std::vector<char> out(t.size(), 0);
  const auto middle = [&t](std::size_t i) { return (1.0 / 3.0) * (t[i].node[0] + t[i].node[1] + t[i].node[2]); };
  double sum = 0.0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    out[i] = is_flat(t[i]);
    surface.flat += out[i];
    sum += norm(t[i].node[1] - t[i].node[0]);
  }
  PointGrid grid;
  grid.build(t.size(), middle, t.empty() ? 0.0 : 0.5 * sum / double(t.size()));
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (out[i]) continue;
    const Vec3<double> place = middle(i);
    const double near = precision + 1e-15 * (std::fabs(place.x) + std::fabs(place.y) + std::fabs(place.z));
    grid.in_box(place - Vec3<double>{near, near, near}, place + Vec3<double>{near, near, near}, [&](int k) {
      const std::size_t j = std::size_t(k);
      if (j <= i || out[j] || !same_corners(t[i], t[j], precision)) return;
      out[j] = 1;
      ++surface.again;
    });
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (out[i]) continue;
    t[kept] = t[i];
    t[kept].id = std::int64_t(kept);
    surface.line[kept] = surface.line[i];
    surface.solid[kept++] = surface.solid[i];
  }
  t.resize(kept);
  surface.line.resize(kept);
  surface.solid.resize(kept);
}

}  // namespace stl

/// precision: in the unit of the file; corners nearer to each other than this along each axis are the same. Throws std::invalid_argument
/// with one line that says what is wrong.
inline StlSurface read_stl(const std::string& name, double precision = 0.0) {
  std::ifstream file(name, std::ios::binary);
  // A folder can be opened, but not read.
  if (!file || file.peek() == std::ifstream::traits_type::eof()) {
    if (file.eof() && !file.bad()) stl::refuse(name, " is empty");
    throw std::invalid_argument("file '" + name + "' cannot be read");
  }
  const std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  StlSurface found;
  std::uint32_t count = 0;
  const std::size_t start = stl::head + sizeof count;
  if (content.size() >= start) std::memcpy(&count, content.data() + stl::head, sizeof count);
  if (content.size() >= start && content.size() == start + stl::facet * std::size_t(count)) {
    stl::read_binary(content, count, found);
  } else if (content.find('\0') != std::string::npos) {
    stl::refuse(name, " is cut off or no STL file: a binary one of " + std::to_string(count) + " triangles has " +
                          std::to_string(start + stl::facet * std::size_t(count)) + " bytes, this has " + std::to_string(content.size()));
  } else {
    stl::TextReader(content, name, found).read();
  }
  if (found.triangles.empty()) stl::refuse(name, " holds no triangles");
  for (std::size_t i = 0; i < found.triangles.size(); ++i)
    for (const Vec3<double>& n : found.triangles[i].node)
      if (!std::isfinite(n.x + n.y + n.z)) stl::refuse(name, ", triangle " + std::to_string(i + 1) + ": a corner is not finite");
  stl::clean(found, precision);
  if (found.triangles.empty()) stl::refuse(name, " holds no triangle with an area");
  return found;
}

}  // namespace dembark
