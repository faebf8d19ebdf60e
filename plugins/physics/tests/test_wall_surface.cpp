// Triangles of STL files, the cells that say which are near, and the frame that a wall carries along.
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>
#include "catch.hpp"

#include "dembark/motion/wall_frame.hpp"
#include "dembark/surface/stl.hpp"
#include "dembark/surface/triangle_cells.hpp"

using namespace dembark;

namespace {

struct File {
  const std::string name = "dembark-test.stl";
  explicit File(const std::string& content) { std::ofstream(name, std::ios::binary) << content; }
  ~File() { std::remove(name.c_str()); }
};

/// The binary form of triangles (x, y, z of three corners each).
std::string binary(const std::vector<std::array<float, 9>>& corners, std::string head = "") {
  head.resize(80, ' ');
  const std::uint32_t count = std::uint32_t(corners.size());
  head.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (const auto& one : corners) {
    const float normal[3] = {NAN, 0, 0};
    head.append(reinterpret_cast<const char*>(normal), sizeof normal).append(reinterpret_cast<const char*>(one.data()), sizeof one);
    head.append("\xff\xff");
  }
  return head;
}

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(old, at)) != std::string::npos; at += by.size()) text.replace(at, old.size(), by);
  return text;
}

std::string refused(const std::string& content) {
  const File file(content);
  try {
    read_stl(file.name);
  } catch (const std::invalid_argument& wrong) {
    return wrong.what();
  }
  return "";
}

const std::string facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0.5\nvertex 1e0 0 0.5\nvertex 0 2 0.5\nendloop\nendfacet\n";

}  // namespace

TEST_CASE("STL: text and binary files have the same triangles", "[surface]") {
  const File text("solid a\n" + facet + facet + "endsolid a\n");
  const StlSurface surface = read_stl(text.name);
  const std::vector<Triangle>& found = surface.triangles;
  REQUIRE(found.size() == 1);
  CHECK(surface.again == 1);
  CHECK(surface.names == std::vector<std::string>{"a"});
  CHECK(norm(found[0].node[2] - Vec3<double>{0.0, 2.0, 0.5}) == 0.0);

  for (const char* const head : {"", "solid of a CAD program", "facet normal vertex"}) {
    const File file(binary({{0, 0, 0.5, 1, 0, 0.5, 0, 2, 0.5}}, head));
    const std::vector<Triangle> same = read_stl(file.name).triangles;
    REQUIRE(same.size() == 1);
    for (int k = 0; k < 3; ++k) CHECK(norm(same[0].node[k] - found[0].node[k]) == 0.0);
  }
}

TEST_CASE("STL: text in every form that programs write", "[surface]") {
  const std::string one = "solid a part (mm), facet normal\n" + facet + "endsolid a part\n";
  std::string upper = one;
  for (char& c : upper) c = char(std::toupper(c));
  for (const std::string& text :
       {one, upper, replaced(one, "\n", "\r\n"), replaced(one, "\n", "\r"), replaced(facet, "\n", " "), replaced(one, " ", "\t"),
        replaced(one, "endloop", "end loop"), replaced(one, "endfacet", "end facet"), replaced(one, "endsolid", "end solid"),
        replaced(one, "0 0 1", "nan nan nan"), replaced(one, "0 0 1", "0 0 0"), replaced(one, "facet normal 0 0 1", "facet"),
        replaced(one, "a part", ""), "\xEF\xBB\xBF" + one, "\n\n  " + one, replaced(one, "1e0", "+1.0E+00"),
        replaced(one, "vertex", "  Vertex"), replaced(one, "0.5", "0.5 "), one.substr(0, one.size() - 1)}) {
    INFO(text);
    const File file(text);
    const StlSurface found = read_stl(file.name, 0.0);
    CHECK(found.triangles.size() == 1);
  }
  const std::string other = replaced(replaced(facet, "0.5", "0.7"), "1e0", "3");
  const File two("solid first\n" + facet + "endsolid first\nsolid second one\n" + other + facet + "endsolid\n");
  const StlSurface found = read_stl(two.name);
  CHECK(found.solid == std::vector<int>{0, 1});
  CHECK(found.names == std::vector<std::string>{"first", "second one"});
  CHECK(found.line == std::vector<int>{2, 11});
  CHECK(found.again == 1);
}

TEST_CASE("STL: triangles without area and those given again are left out", "[surface]") {
  const auto f = [](const std::string& a, const std::string& b, const std::string& c) {
    return "facet normal 0 0 1\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c + "\nendloop\nendfacet\n";
  };
  const std::string a = "0 0 0", b = "1 0 0", c = "0 1 0", d = "0.5 0 0", near = "1e-9 0 -1e-9";
  const File file(f(a, b, c) + f(b, c, a) + f(c, b, a) + f(a, d, b) + f(a, a, b) + f(near, b, c) + f(b, c, "1 1 0"));
  const StlSurface exact = read_stl(file.name), merged = read_stl(file.name, 1e-8);
  CHECK((exact.triangles.size() == 3 && exact.flat == 2 && exact.again == 2));
  CHECK((merged.triangles.size() == 2 && merged.again == 3));
  CHECK(merged.triangles[1].id == 1);
  CHECK(exact.left_out("x.stl") == "file 'x.stl': left out 2 triangles without area and 2 given again");
  CHECK(refused(f(a, d, b)).find("holds no triangle with an area") != std::string::npos);
}

TEST_CASE("STL: one line says what is wrong", "[surface]") {
  CHECK(refused("nothing").find("holds no triangles") != std::string::npos);
  CHECK(refused("facet\nvertex 0 0\n").find("line 2: a vertex must have three numbers") != std::string::npos);
  CHECK(refused("facet\nvertex 0 0 up\n").find("line 2: 'up' is not a number") != std::string::npos);
  CHECK(refused("facet\nvertex 0 0 0\nendfacet\n").find("line 3: a facet must have three vertices") != std::string::npos);
  const std::string solid = "solid a\n" + facet, good = binary({{0, 0, 0.5, 1, 0, 0.5, 0, 2, 0.5}});
  CHECK(refused("").find("is empty") != std::string::npos);
  CHECK(refused(solid).find("ends before 'endsolid'") != std::string::npos);
  CHECK(refused(solid.substr(0, solid.size() - 10)).find("ends within a facet") != std::string::npos);
  CHECK(refused(solid + solid + "endsolid\n").find("line 9: a solid begins before") != std::string::npos);
  CHECK(refused(replaced(facet, "endloop", "vertex 1 1 1")).find("a facet must have three vertices") != std::string::npos);
  CHECK(refused(replaced(facet, "1e0", "nan")).find("line 4: 'nan' is not a number") != std::string::npos);
  CHECK(refused(replaced(facet, "1e0", "0,5")).find("'0,5' is not a number") != std::string::npos);
  CHECK(refused(replaced(facet, "1e0", "1e999")).find("'1e999' is not a number") != std::string::npos);
  CHECK(refused("solid a\nendsolid a\n").find("holds no triangles") != std::string::npos);
  CHECK(refused(binary({})).find("holds no triangles") != std::string::npos);
  for (const std::size_t cut : {1, 40, 50}) CHECK(refused(good.substr(0, good.size() - cut)).find("is cut off") != std::string::npos);
  CHECK(refused(good + "more").find("a binary one of 1 triangles has 134 bytes, this has 138") != std::string::npos);
  CHECK(refused(binary({{0, 0, NAN, 1, 0, 0, 0, 1, 0}})).find("triangle 1: a corner is not finite") != std::string::npos);
  CHECK_THROWS_AS(read_stl("."), std::invalid_argument);
  CHECK_THROWS_AS(read_stl("there-is-none.stl"), std::invalid_argument);
}

TEST_CASE("Cells visit every triangle within reach, once", "[surface]") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1.0, 1.0);
  std::vector<Triangle> triangles(60);
  for (Triangle& t : triangles) {
    const Vec3<double> at{place(random), place(random), place(random)};
    for (Vec3<double>& node : t.node) node = at + 0.4 * Vec3<double>{place(random), place(random), place(random)};
  }
  triangles[7].node[1] = triangles[7].node[0];  // without area
  // What is usual need not be what is asked for, and may not be known.
  for (const auto& [usual, reach] : {std::pair{0.15, 0.15}, {0.0, 0.15}, {0.15, 0.6}, {0.5, 0.01}, {0.0, 0.0}}) {
    TriangleCells cells;
    cells.build(triangles, usual);
    std::size_t visits = 0, near = 0;
    for (int n = 0; n < 1000; ++n) {
      const Vec3<double> p{2.0 * place(random), 2.0 * place(random), 2.0 * place(random)};
      std::vector<int> seen(triangles.size(), 0);
      cells.near(p, reach, [&](int t) { return ++seen[std::size_t(t)] > 0; });
      CHECK(seen[7] == 0);
      seen[7] = 1;
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        const bool within = closest_point(triangles[t], p).distance < reach;
        REQUIRE(seen[t] <= 1);
        REQUIRE((!within || seen[t] == 1));
        visits += std::size_t(seen[t]);
        near += within;
      }
    }
    if (reach > 0.1) CHECK(near > 100);
    if (usual == reach && reach > 0.0) CHECK(visits < 40 * near);
  }
}

TEST_CASE("A wall rests in its frame", "[motion]") {
  const PrescribedMotion motion("rotation point 1 2 3 axis 1 1 0 rate 2 uniform velocity 0.5 -1 2");
  const double t = 0.7, h = 1e-6;
  const WallState state = motion.at(t);
  const WallFrame frame(motion, state), later(motion, motion.at(t + h));
  const Vec3<double> place{4.0, -1.0, 2.5}, inside = frame.inside(place);
  // What moves with the wall keeps its place there.
  const Vec3<double> velocity = state.velocity + cross(state.rate * motion.axis(), place - motion.centre(state));
  CHECK(norm(later.inside(place + h * velocity) - inside) < 1e-10);
  CHECK(norm(frame.outside(inside - motion.centre({})) + motion.centre(state) - place) < 1e-14);
  CHECK(norm(WallFrame().inside(place) - place) == 0.0);
  CHECK(norm(WallFrame(motion, motion.at(0.0)).inside(place) - place) < 1e-15);
}
