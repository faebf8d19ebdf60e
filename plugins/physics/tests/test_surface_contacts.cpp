// Triangles as one surface: what does not depend on how it is cut into triangles, and what edges, corners and grooves are.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>
#include "catch.hpp"

#include "dembark/constants.hpp"
#include "dembark/surface/point_grid.hpp"
#include "dembark/surface/surface_contacts.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

typedef Vec3<double> V;

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

namespace {

/// Two triangles of the rectangle x0 ... x1, y0 ... y1 at the height z.
void add_patch(std::vector<Triangle>& to, double x0, double x1, double y0, double y1, double z = 0.0) {
  add(to, {x0, y0, z}, {x1, y0, z}, {x1, y1, z});
  add(to, {x0, y0, z}, {x1, y1, z}, {x0, y1, z});
}

struct Soup {
  std::string name;
  std::vector<Triangle> triangles;
  double raised = 0.0;  ///< by how much parts of it stand above z = 0
};

/// One and the same floor z = 0, |x|, |y| <= 4, as CAD programs write it.
std::vector<Soup> soups() {
  std::vector<Soup> found;
  const auto make = [&](const std::string& name, auto change) {
    std::vector<Triangle> t;
    add_patch(t, -4, 0, -4, 4), add_patch(t, 0, 4, -4, 4);
    double raised = 0.0;
    change(t, raised);
    found.push_back({name, t, raised});
  };
  make("plain", [](auto&, double&) {});
  make("given twice", [](auto& t, double&) {
    for (int k = 0; k < 4; ++k) add(t, t[std::size_t(k)].node[0], t[std::size_t(k)].node[1], t[std::size_t(k)].node[2]);
  });
  make("given again in another order", [](auto& t, double&) {
    for (std::size_t k = 0; k < 4; ++k) add(t, t[k].node[1], t[k].node[2], t[k].node[0]), add(t, t[k].node[0], t[k].node[2], t[k].node[1]);
  });
  make("again, cut the other way",
       [](auto& t, double&) { add(t, {-4, -4, 0}, {4, -4, 0}, {-4, 4, 0}), add(t, {4, 4, 0}, {-4, 4, 0}, {4, -4, 0}); });
  make("a finer patch on it", [](auto& t, double&) {
    for (const Triangle& one : floor_of(7, 3, {-3.5, -3.5, 0})) add(t, one.node[0], one.node[1], one.node[2]);
  });
  make("patches that overlap", [](auto& t, double&) { add_patch(t, -0.7, 0.9, -4, 4), add_patch(t, -1.3, 0.4, -2, 3); });
  make("crossing bars, no corner inside another",
       [](auto& t, double&) { add_patch(t, -3.9, 3.9, -0.4, 0.3), add_patch(t, -0.3, 0.2, -3.9, 3.9); });
  make("a fold", [](auto& t, double&) { add(t, {0, -4, 0}, {0, 4, 0}, {-0.5, 1, 0}), add(t, {0, 4, 0}, {-0.5, 1, 0}, {1.5, 0.5, 0}); });
  make("slivers and needles", [](auto& t, double&) {
    add(t, {0, -4, 0}, {0, 0, 0}, {0, 4, 0}), add(t, {1, 1, 0}, {1, 1, 0}, {1, 1, 0}), add(t, {-1, 1, 0}, {1, 1, 0}, {1, 1, 0});
    add(t, {0, -4, 0}, {1e-9, 0, 0}, {0, 4, 0}), add(t, {0, -4, 0}, {1e-5, 0, 0}, {0, 4, 0}), add(t, {0, 0, 0}, {NAN, 0, 0}, {0, 1, 0});
  });
  for (const double gap : {1e-9, 1e-8, 3e-7, 1e-5, 1e-3})
    make("a seam open by " + std::to_string(gap), [gap](auto& t, double&) {
      t.clear();
      add_patch(t, -4, -0.5 * gap, -4, 4), add_patch(t, 0.5 * gap, 4, -4, 4);
    });
  for (const double up : {1e-12, 1e-9, 1e-7, 1e-5, 1e-3}) {
    make("a sheet above", [up](auto& t, double& raised) { add_patch(t, -3, 2, -1, 3, up), raised = up; });
    make("a sheet below", [up](auto& t, double&) { add_patch(t, -3, 2, -1, 3, -up); });
    make("a thin plate", [up](auto& t, double&) {
      add_patch(t, -4, 4, -4, 4, -up);
      for (const double x : {-4.0, 4.0}) add(t, {x, -4, 0}, {x, 4, 0}, {x, 4, -up}), add(t, {x, -4, 0}, {x, 4, -up}, {x, -4, -up});
    });
    make("ribs below", [up](auto& t, double&) {
      for (const double x : {-0.3, 0.05, 0.4}) add(t, {x, -4, -up}, {x, 4, -up}, {x, 4, -2}), add(t, {x, -4, -up}, {x, 4, -2}, {x, -4, -2});
    });
    make("two halves, one higher", [up](auto& t, double& raised) {
      t.clear();
      add_patch(t, -4, 0, -4, 4), add_patch(t, 0, 4, -4, 4, up), raised = up;
    });
  }
  return found;
}

}  // namespace

TEST_CASE("any soup of triangles of one floor is touched once") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double radius = 1.0, height = 0.99;
  for (const Soup& soup : soups()) {
    SurfaceContacts surface(SurfaceContacts::usual_smooth_angle, SurfaceContacts::usual_precision);
    surface.update(soup.triangles);
    SurfaceContacts expected = surface;
    expected.expect(radius);
    std::vector<SurfacePoint> found;
    const auto check = [&](double x, double y) {
      const V centre{x, y, height};
      INFO(soup.name << " at " << x << ", " << y);
      const std::vector<Touch> touching = touches(surface, centre, radius);
      REQUIRE(touching.size() == 1);
      CHECK_THAT(touching[0].at.distance, WithinAbs(height, soup.raised + 5e-7));
      CHECK(touching[0].at.arm.z > 0.999 * touching[0].at.distance);
      surface.contacts(centre, radius, radius, found);
      REQUIRE(found.size() == 1);
      CHECK(found[0].triangle == touching[0].triangle);
      const std::vector<Touch> same = touches(expected, centre, radius);
      REQUIRE(same.size() == 1);
      CHECK(same[0].triangle == touching[0].triangle);
    };
    for (int k = 0; k < 60; ++k) check(2.5 * unit(random), 2.5 * unit(random));
    for (const double off : {0.0, 1e-16, 1e-12, 1e-9, 5e-9, 1e-8, 2e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.03, 0.06, 0.1})
      for (const int side : {-1, 1})
        check(side * off, 0.4 * unit(random)), check(0.4 * unit(random), side * off), check(side * off, side * off);
  }
}

TEST_CASE("what lies on a surface twice does not change its edges, corners and grooves") {
  const auto twice = [](std::vector<Triangle> t, const V& shift) {
    for (std::size_t k = 0, n = t.size(); k < n; ++k) add(t, t[k].node[2] + shift, t[k].node[0] + shift, t[k].node[1] + shift);
    return t;
  };
  for (const V& shift : {V{}, V{0, 0, -1e-9}, V{1e-9, 2e-9, -1e-9}, V{0, 0, -1e-5}}) {
    const SurfaceContacts ridge = join(twice(bent(-0.6), shift), 0.05), groove = join(twice(bent(0.6), shift), 0.05);
    for (double x = -0.25; x < 0.05; x += 0.0101) CHECK(touches(ridge, {x, 0.5, 0.48}, 0.5).size() == 1);
    CHECK(touches(groove, {-0.45 * std::tan(0.3), 0.5, 0.45}, 0.5).size() == 2);
    std::vector<Triangle> corner;
    for (int k = 0; k < 3; ++k) {
      const auto turn = [k](double a, double b) { return k == 0 ? V{a, b, 0} : k == 1 ? V{0, a, b} : V{b, 0, a}; };
      add(corner, turn(0, 0), turn(1, 0), turn(1, 1)), add(corner, turn(0, 0), turn(1, 1), turn(0, 1));
    }
    CHECK(touches(join(twice(corner, V{-1e-9, -1e-9, shift.z}), 0.05), {0.09, 0.092, 0.094}, 0.1).size() == 3);
    CHECK(touches(join(twice(corner, V{-1e-9, -1e-9, shift.z}), 0.05), {0.09, 0.092, 0.5}, 0.1).size() == 2);
  }
}

TEST_CASE("precision joins what an exporter left apart, also without a smooth angle") {
  std::vector<Triangle> t;
  add_patch(t, -4, -1e-3, -4, 4), add_patch(t, 1e-3, 4, -4, 4);
  for (const auto& [precision, expected] : {std::pair<double, std::size_t>{1e-8, 2}, {1e-2, 1}}) {
    SurfaceContacts surface(0.0, precision);
    surface.update(t);
    CHECK(touches(surface, {0.0, 0.3, 0.9}, 1.0).size() == expected);
  }
}

TEST_CASE("what is expected changes the speed alone, also of parts that move against each other") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double radius = 0.4;
  SurfaceContacts plain(SurfaceContacts::usual_smooth_angle, SurfaceContacts::usual_precision), expected = plain;
  expected.expect(radius);
  int both = 0;
  for (int step = 0; step < 60; ++step) {
    // A box without lid over a floor, which sinks into it and turns.
    std::vector<Triangle> t = floor_of(4, 5, {-2, -2, 0});
    const std::size_t fixed = t.size();
    add_patch(t, -0.8, 0.8, -0.8, 0.8, 0.5 - 0.013 * step);
    for (const double x : {-0.8, 0.8}) {
      const double z = 0.5 - 0.013 * step;
      add(t, {x, -0.8, z}, {x, 0.8, z}, {x, 0.8, z + 1}), add(t, {x, -0.8, z}, {x, 0.8, z + 1}, {x, -0.8, z + 1});
    }
    for (std::size_t k = fixed; k < t.size(); ++k)
      for (V& p : t[k].node) p = turned(p, 0.02 * step);
    plain.update(t);
    expected.update(t);
    for (int k = 0; k < 60; ++k) {
      const V centre{1.5 * unit(random), 1.5 * unit(random), 0.6 + 0.5 * unit(random)};
      for (const double size : {0.2 * radius, radius, 1.5 * radius}) {
        const std::vector<Touch> one = touches(plain, centre, size), other = touches(expected, centre, size);
        REQUIRE(one.size() == other.size());
        for (std::size_t i = 0; i < one.size(); ++i) CHECK(one[i].triangle == other[i].triangle);
        both += one.size() > 1;
      }
    }
  }
  CHECK(both > 20);
}

TEST_CASE("a triangle without area has no contact") {
  std::vector<Triangle> t = bent(0.1);
  t[2].node[1] = t[2].node[0];
  SurfaceContacts surface;
  surface.update(t);
  const V centre{0.5, 0.25, 0.5};
  CHECK(surface.owner(2, closest_point(t[2], centre), centre, 1.0) == -1);
  CHECK(surface.follow(2, centre, 1.0) == -1);
  std::vector<SurfacePoint> found;
  surface.contacts(centre, 1.0, 1.0, found);
  for (const SurfacePoint& f : found) CHECK(f.triangle != 2);
  for (Triangle& each : t) each.node[1] = each.node[0];
  surface.update(t);
  surface.contacts(centre, 1.0, 1.0, found);
  CHECK(found.empty());
  surface.update({});
  surface.contacts(centre, 1.0, 1.0, found);
  CHECK((surface.triangles().empty() && found.empty()));
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
