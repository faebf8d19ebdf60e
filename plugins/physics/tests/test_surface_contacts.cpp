// Triangles as one surface: what does not depend on how it is cut into triangles, and what edges, corners and grooves are.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>
#include "catch.hpp"

#include "dembark/surface/surface_contacts.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

typedef Vec3<double> V;
constexpr double pi = 3.14159265358979323846;

struct Touch {
  int triangle;
  ClosestPoint at;
};

SurfaceContacts join(const std::vector<Triangle>& triangles, double smooth_angle = 0.0) {
  SurfaceContacts surface(smooth_angle, 1e-6);
  surface.update(triangles);
  return surface;
}

/// Contacts of a sphere with all triangles.
std::vector<Touch> touches(const SurfaceContacts& surface, const V& centre, double radius) {
  std::vector<Touch> found;
  for (int t = 0; t < int(surface.triangles().size()); ++t) {
    const ClosestPoint here = closest_point(surface.triangles()[std::size_t(t)], centre);
    if (here.distance <= radius && surface.owner(t, here, centre, radius) == t) found.push_back({t, here});
  }
  return found;
}

void add(std::vector<Triangle>& to, const V& a, const V& b, const V& c) {
  Triangle t;
  t.node[0] = a, t.node[1] = b, t.node[2] = c;
  t.id = std::int64_t(to.size());
  to.push_back(t);
}

/// A floor of n x n quadrangles with moved corners, each cut along one of its diagonals, some upside down.
std::vector<Triangle> floor_of(int n, unsigned seed, const V& at = {}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-0.3, 0.3);
  std::vector<V> node;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) node.push_back(at + V{i + unit(random), j + unit(random), 0.0});
  std::vector<Triangle> found;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const auto corner = [&](int k, int l) { return node[std::size_t((i + k) * (n + 1) + j + l)]; };
      const V a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
      if ((i + j) % 2) add(found, a, b, c), add(found, d, c, a);
      else add(found, a, b, d), add(found, b, c, d);
    }
  return found;
}

/// Two squares of edge 1 that meet at x = 0, the second one raised by `angle` (rad).
std::vector<Triangle> bent(double angle) {
  const V along{std::cos(angle), 0, std::sin(angle)}, left{-1, 0, 0}, wide{0, 1, 0};
  std::vector<Triangle> t;
  for (const V& side : {left, along}) add(t, {}, side, side + wide), add(t, {}, side + wide, wide);
  return t;
}

/// Panels of the inside of a cylinder of radius 1 about z, each of 2 x 3 triangles.
std::vector<Triangle> cylinder(int panels) {
  std::vector<Triangle> t;
  for (int k = 0; k < panels; ++k)
    for (int row = 0; row < 3; ++row) {
      const auto corner = [&](int i, int j) {
        const double phi = 2 * pi * ((k + i) % panels) / panels;
        return V{std::cos(phi), std::sin(phi), 0.5 * (row + j)};
      };
      add(t, corner(0, 0), corner(1, 0), corner(1, 1));
      add(t, corner(0, 0), corner(1, 1), corner(0, 1));
    }
  return t;
}

V turned(const V& p, double angle) {
  return {p.x * std::cos(angle) - p.y * std::sin(angle), p.x * std::sin(angle) + p.y * std::cos(angle), p.z};
}

}  // namespace

TEST_CASE("a flat floor is one plane however it is cut") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const double far : {0.0, 1e3})
    for (unsigned seed = 0; seed < 4; ++seed) {
      const V at{far, -far, far};
      const std::vector<Triangle> triangles = floor_of(8, seed, at);
      const SurfaceContacts surface = join(triangles, seed % 2 ? 0.05 : 0.0);
      const auto one = [&](const V& foot, double radius) {
        const double height = (unit(random) < 0.5 ? -1 : 1) * 0.98 * radius;
        const std::vector<Touch> found = touches(surface, foot + V{0, 0, height}, radius);
        REQUIRE(found.size() == 1);
        CHECK_THAT(found[0].at.distance, WithinAbs(std::fabs(height), 1e-15 * (radius + 10 * norm(at)) + 1e-15));
      };
      for (int k = 0; k < 300; ++k) one(at + V{2 + 4 * unit(random), 2 + 4 * unit(random), 0}, std::exp(8 * unit(random) - 6));
      // Over corners and edges, and beside them by less and less.
      for (std::size_t k = 52; k < 62; ++k)
        for (int c = 0; c < 3; ++c)
          for (const double off : {0.0, 1e-16, 1e-13, 1e-10, 1e-8, 3e-7, 1e-6, 3e-6, 1e-4}) {
            const V &a = triangles[k].node[c], &b = triangles[k].node[(c + 1) % 3];
            for (const double share : {0.0, 0.3, 0.5}) one(a + share * (b - a) + V{off, -0.7 * off, 0}, 0.5);
          }
    }
}

TEST_CASE("corners on the edge of a neighbour make no seam") {
  std::vector<Triangle> t;
  add(t, {0, 0, 0}, {4, 0, 0}, {2, 4, 0});
  for (int k = 0; k < 4; ++k) add(t, {double(k), 0, 0}, {k + 1.0, 0, 0}, {k + 0.5, -2, 0});
  for (int k = 0; k < 3; ++k) add(t, {k + 0.5, -2, 0}, {k + 1.0, 0, 0}, {k + 1.5, -2, 0});
  const SurfaceContacts surface = join(t);
  for (double x = 1.0; x < 3.0; x += 0.125)
    for (const double y : {-0.3, -1e-9, 0.0, 1e-9, 0.3}) CHECK(touches(surface, {x, y, 0.9}, 1.0).size() == 1);
}

TEST_CASE("a ridge counts once, a groove twice") {
  for (const double angle : {-0.01, -0.3, -1.5, -2.5}) {
    const SurfaceContacts ridge = join(bent(angle), 0.05);
    for (double x = -0.25; x < 0.1; x += 0.0101) CHECK(touches(ridge, {x, 0.5, 0.4}, 0.5).size() == 1);
  }
  for (const double angle : {0.1, 0.5, pi / 2, 2.0}) {
    const SurfaceContacts groove = join(bent(angle), 0.05);
    const double h = 0.45, s = h * std::tan(0.5 * angle);  // as near to both sides
    const std::vector<Touch> found = touches(groove, {-s, 0.5, h}, 0.5);
    REQUIRE(found.size() == 2);
    for (const Touch& f : found) CHECK_THAT(f.at.distance, WithinRel(h, 1e-12));
  }
}

TEST_CASE("of a smooth groove the nearer side is touched, on all the way the same contact") {
  const std::vector<Triangle> t = bent(0.03);
  CHECK(touches(join(t), {-0.0075, 0.5, 0.45}, 0.5).size() == 2);
  const SurfaceContacts surface = join(t, 0.05);
  int last = -1, changes = 0;
  for (double x = -0.1; x < 0.1; x += 1e-4) {
    const V centre{x, 0.5, 0.45};
    const std::vector<Touch> found = touches(surface, centre, 0.5);
    REQUIRE(found.size() == 1);
    const auto nearest = [&](const Triangle& a, const Triangle& b) {
      return closest_point(a, centre).distance < closest_point(b, centre).distance;
    };
    const Triangle& least = *std::min_element(t.begin(), t.end(), nearest);
    CHECK_THAT(found[0].at.distance, WithinRel(closest_point(least, centre).distance, 1e-14));
    if (last >= 0) CHECK(surface.follow(last, centre, 0.5) == found[0].triangle);
    if (last >= 0 && last / 2 != found[0].triangle / 2) ++changes;
    last = found[0].triangle;
  }
  CHECK(changes == 1);
}

TEST_CASE("a smooth groove between small triangles is one contact") {
  std::vector<Triangle> t;
  for (const int side : {-1, 1})
    for (int i = 0; i < 20; ++i)
      for (int j = 0; j < 40; ++j) {
        const auto corner = [&](int k, int l) {
          const double x = 0.01 * (i + k);
          return V{side * x * std::cos(0.02), 0.01 * (j + l), x * std::sin(0.02)};
        };
        add(t, corner(0, 0), corner(1, 0), corner(1, 1)), add(t, corner(0, 0), corner(1, 1), corner(0, 1));
      }
  const SurfaceContacts surface = join(t, 0.05);
  for (double x = -0.06; x < 0.06; x += 0.0007) CHECK(touches(surface, {x, 0.2 + 0.3 * x, 0.98}, 1.0).size() == 1);
}

TEST_CASE("a box is its planes, edges and corners") {
  std::vector<Triangle> t;  // the cube 0 ... 1
  const std::array<V, 3> axis{V{1, 0, 0}, V{0, 1, 0}, V{0, 0, 1}};
  for (int k = 0; k < 3; ++k)
    for (const double end : {0.0, 1.0}) {
      const V o = end * axis[std::size_t(k)], a = axis[std::size_t((k + 1) % 3)], b = axis[std::size_t((k + 2) % 3)];
      add(t, o, o + a, o + a + b), add(t, o, o + a + b, o + b);
    }
  const SurfaceContacts surface = join(t, 0.05);
  CHECK(touches(surface, {0.1, 0.11, 0.12}, 0.2).size() == 3);  // inside, at a corner of three walls
  CHECK(touches(surface, {0.1, 0.11, 0.5}, 0.2).size() == 2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-0.3, 1.3);
  int outside = 0;
  for (int i = 0; i < 4000; ++i) {
    const V p{unit(random), unit(random), unit(random)};
    const auto beyond = [](double x) { return x - std::min(std::max(x, 0.0), 1.0); };
    const V away{beyond(p.x), beyond(p.y), beyond(p.z)};
    if (norm(away) < 1e-3) continue;
    ++outside;
    const std::vector<Touch> found = touches(surface, p, 0.6);
    // The far sides of the cube are other minima, on the other side of which the centre is not.
    const auto near = std::count_if(found.begin(), found.end(), [&](const Touch& f) { return norm(f.at.arm - away) < 1e-12; });
    CHECK(near == 1);
  }
  CHECK(outside > 1000);
}

TEST_CASE("the inside of a cylinder: one contact, with smooth panels or with many") {
  const SurfaceContacts fine = join(cylinder(180), 0.05), coarse = join(cylinder(24), 0.05), plain = join(cylinder(180));
  for (int k = 0; k < 1000; ++k) {
    const double phi = 2 * pi * k / 1000.0;
    const V out{std::cos(phi), std::sin(phi), 0}, centre = 0.81 * out + V{0, 0, 0.4 + 0.0007 * k};
    const std::vector<Touch> found = touches(fine, centre, 0.2);
    REQUIRE(found.size() == 1);
    CHECK_THAT(found[0].at.distance, WithinAbs(0.19, 2e-4));
    CHECK(dot(found[0].at.arm, out) < -0.999 * found[0].at.distance);
    for (const SurfaceContacts* other : {&coarse, &plain}) {
      const std::size_t sides = touches(*other, centre, 0.2).size();
      CHECK((sides == 1 || sides == 2));
    }
  }
}

TEST_CASE("triangles that move as one keep what stands beside them, those that move against each other are joined anew") {
  std::vector<Triangle> t = floor_of(6, 1), two = t;
  SurfaceContacts surface = join(t), parts(0.0, 1e-6);
  for (int step = 1; step <= 50; ++step) {
    std::vector<Triangle> now = t;
    for (Triangle& each : now)
      for (V& p : each.node) p = turned(p, 0.07 * step) + V{0.3 * step, 0, 1};
    surface.update(now);
    const V foot = turned({2.5, 3.0, 0}, 0.07 * step) + V{0.3 * step, 0, 1};
    CHECK(touches(surface, foot + V{0, 0, 1.1}, 1.2).size() == 1);
  }
  // The second half comes along x until it stands beside the first.
  for (const double apart : {1.0, 0.3, 0.01, 0.0}) {
    std::vector<Triangle> now = bent(0.0);
    for (std::size_t k = 2; k < 4; ++k)
      for (V& p : now[k].node) p.x += apart;
    parts.update(now);
    CHECK(touches(parts, {0.5 * apart, 0.5, 0.9}, 0.95).size() == (apart == 1.0 ? 0 : apart > 0.0 ? 2 : 1));
  }
}

TEST_CASE("a triangle without area is refused by its number") {
  std::vector<Triangle> t = bent(0.1);
  t[2].node[1] = t[2].node[0];
  SurfaceContacts surface;
  CHECK_THROWS_WITH(surface.update(t), "triangle 2 has no area");
  surface.update({});
  CHECK(surface.triangles().empty());
}

TEST_CASE("points far away on either side add no work to the grid, and none is lost") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<V> points(1000);
  for (V& p : points) p = {6 * unit(random), 6 * unit(random), 6 * unit(random)};
  const auto visits = [&points](std::vector<double> far) {
    std::vector<V> moved = points;
    for (std::size_t k = 0; k < far.size(); ++k) moved[7 * k].x += far[k];
    PointGrid grid;
    grid.build(moved.size(), [&](std::size_t i) { return moved[i]; }, 0.3);
    int count = 0, close = 0, pairs = 0;
    grid.pairs([&](int i, int j) { ++count, close += norm(moved[std::size_t(i)] - moved[std::size_t(j)]) <= 0.3; });
    for (std::size_t i = 0; i < moved.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) pairs += norm(moved[i] - moved[j]) <= 0.3;
    CHECK(close == pairs);
    int inside = 0;
    grid.in_box({-1e301, -1, -1}, {1e301, 7, 7}, [&](int) { ++inside; });
    CHECK(inside == 1000);
    return count;
  };
  const int plain = visits({});
  for (const std::vector<double>& far : {std::vector<double>{1e4}, {-1e4}, {1e300}, {-1e300}, {-1e300, 1e300, 1e5, -1e7}})
    CHECK(visits(far) <= plain + 50);
}
