// Triangles of STL files, the cells that say which are near, and the frame that a wall carries along.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
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
  const std::vector<Triangle> found = read_stl(text.name);
  REQUIRE(found.size() == 2);
  CHECK(found[1].id == 1);
  CHECK(norm(found[1].node[2] - Vec3<double>{0.0, 2.0, 0.5}) == 0.0);

  std::string content(80, ' ');
  const std::uint32_t count = 1;
  const float numbers[12] = {0, 0, 1, 0, 0, 0.5, 1, 0, 0.5, 0, 2, 0.5};
  content.append(reinterpret_cast<const char*>(&count), sizeof count).append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  const File binary(content + std::string(2, '\0'));
  const std::vector<Triangle> same = read_stl(binary.name);
  REQUIRE(same.size() == 1);
  for (int k = 0; k < 3; ++k) CHECK(norm(same[0].node[k] - found[0].node[k]) == 0.0);
}

TEST_CASE("STL: one line says what is wrong", "[surface]") {
  CHECK(refused("nothing").find("holds no triangles") != std::string::npos);
  CHECK(refused("facet\nvertex 0 0\n").find("line 2: a vertex must have three numbers") != std::string::npos);
  CHECK(refused("facet\nvertex 0 0 up\n").find("line 2: 'up' is not a number") != std::string::npos);
  CHECK(refused("facet\nvertex 0 0 0\nendfacet\n").find("line 3: a facet must have three vertices") != std::string::npos);
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
  const double reach = 0.15;
  TriangleCells cells;
  cells.build(triangles, reach);
  std::size_t visits = 0, near = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vec3<double> p{2.0 * place(random), 2.0 * place(random), 2.0 * place(random)};
    std::vector<int> seen(triangles.size(), 0);
    cells.near(p, [&](int t) { ++seen[std::size_t(t)]; });
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const bool within = closest_point(triangles[t], p).distance < reach;
      REQUIRE(seen[t] <= 1);
      REQUIRE((!within || seen[t] == 1));
      visits += std::size_t(seen[t]);
      near += within;
    }
  }
  CHECK(near > 100);
  CHECK(visits < 40 * near);
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
