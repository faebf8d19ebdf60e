// What adapters of engines share: tables of materials, pairs across a boundary, the forces of the last step, the file of impacts.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>
#include "catch.hpp"

#include "dembark/impact/impact_file.hpp"
#include "dembark/impact/last_forces.hpp"
#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;

TEST_CASE("a table of materials that differs in the two orders of a pair is refused, whichever parameter it is") {
  using Change = std::function<void(ImpactPairLaw&)>;
  const std::vector<Change> changes = {
      [](ImpactPairLaw& p) { p.friction.static_friction = 0.7; },
      [](ImpactPairLaw& p) { p.friction.kinetic_friction = 0.3; },
      [](ImpactPairLaw& p) { p.friction.critical_slip_distance = 2e-5; },
      [](ImpactPairLaw& p) { p.friction.interface_shear_strength = 1e6; },
      [](ImpactPairLaw& p) { p.friction.healing_time = 0.1; },
      [](ImpactPairLaw& p) { p.friction.presliding = Presliding::exponential; },
      [](ImpactPairLaw& p) { p.tangential_stiffness_ratio = 0.5; },
      [](ImpactPairLaw& p) { p.contact_damping = 10.0; },
      [](ImpactPairLaw& p) { p.contact_area = 1e-4; },
  };
  for (const Change& change : changes) {
    Settings s = two_materials(1e-4, 1.0, 0.5);
    REQUIRE(settings_error(s).empty());
    change(s.pairs[1]);
    CHECK(settings_error(s) == "materials 0 and 1: the pair laws must be the same in both orders");
    change(s.pairs[2]);
    CHECK(settings_error(s).empty());
  }
}

TEST_CASE("a material that is added has its law against all others, and theirs stay") {
  Settings s = two_materials(1e-4, 1.0, 0.4);
  ImpactPairLaw wall;
  wall.friction.static_friction = wall.friction.kinetic_friction = 0.2;
  s.add({3e7, 5.0}, wall);
  REQUIRE(settings_error(s).empty());
  CHECK(s.materials[2].stiffness == 3e7);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) CHECK(s.pairs[3 * i + j].friction.static_friction == (i == 2 || j == 2 ? 0.2 : 0.4));
}

TEST_CASE("pairs across a periodic boundary") {
  std::vector<Body> logs(3);
  const double at[3] = {-0.9, 0.9, 0.0};
  for (int i = 0; i < 3; ++i) {
    logs[std::size_t(i)].id = i;
    logs[std::size_t(i)].radius = 0.12;
    logs[std::size_t(i)].position = {at[i], 0.0, 0.0};
  }
  PairFinder pairs;
  PeriodicBox& box = pairs.box;
  box.low = {-1.0, -1.0, -1.0};
  box.length = {2.0, 2.0, 2.0};
  std::vector<Contact> contacts;
  pairs.find(logs, 0.01, contacts);
  CHECK(contacts.empty());
  box.periodic[0] = box.periodic[2] = true;
  pairs.find(logs, 0.01, contacts);
  REQUIRE(contacts.size() == 1);
  const Contact& c = contacts.front();
  CHECK((c.a == 0 && c.b == 1));
  CHECK(c.gap == Approx(-0.04));
  CHECK(c.normal.x == Approx(1.0));  // from b, which is at -1.1 for a, to a
  box.length.x = 0.45;
  CHECK_THROWS_WITH(pairs.find(logs, 0.01, contacts), Catch::Contains("periodic box is too short along x"));
  logs.resize(1);  // in one plane across the axis
  CHECK_NOTHROW(pairs.find(logs, 0.01, contacts));
}

TEST_CASE("the forces of the last step hold for the bodies that it left, and for no others") {
  const std::vector<Body> bodies = crowd(3);
  PeriodicBox box;
  box.length = {4.0, 4.0, 4.0};
  box.periodic[0] = true;
  LastForces last;
  CHECK_FALSE(last.hold(bodies, box));
  last.keep(bodies);
  last.wrenches.assign(3, {{1.0, 2.0, 3.0}, {}});
  std::vector<Body> end = bodies;
  for (Body& b : end) b.velocity.y -= 0.1;
  last.move(end);
  CHECK(last.hold(end, box));
  end[1].position.x += 4.0;
  CHECK(last.hold(end, box));
  const std::vector<std::function<void(Body&)>> changes = {
      [](Body& b) { b.mass *= 2.0; },      [](Body& b) { b.inertia *= 2.0; },    [](Body& b) { b.radius *= 1.1; },
      [](Body& b) { b.material = 7; },     [](Body& b) { b.position.y += 1.0; }, [](Body& b) { b.position.x += 1.0; },
      [](Body& b) { b.velocity.x = 0.0; }, [](Body& b) { b.spin.z += 1.0; },     [](Body& b) { b.force = {}; },
      [](Body& b) { b.torque.z += 1e-3; }, [](Body& b) { b.id += 100; },
  };
  for (const auto& change : changes) {
    std::vector<Body> other = end;
    change(other[1]);
    CHECK_FALSE(last.hold(other, box));
  }
  CHECK_FALSE(last.hold({end.begin(), end.begin() + 2}, box));

  Archive out;
  out(last);
  LastForces again;
  Archive in(out.numbers());
  in(again);
  in.end();
  CHECK(again.hold(end, box));
  CHECK(again.wrenches[2].force.z == 3.0);
  std::vector<double> broken = out.numbers();
  broken.pop_back();
  Archive few(broken);
  CHECK_THROWS_WITH(few(again), Catch::Contains("too few"));
}

TEST_CASE("state as numbers: integers are whole and in range") {
  enum class Kind : unsigned char { one, two };
  const auto read = [](double number, auto value) {
    from_numbers({number}, value);
    return value;
  };
  CHECK(read(7.0, 0) == 7);
  CHECK(read(-1.0, 0L) == -1L);
  CHECK(read(1.0, Kind::one) == Kind::two);
  CHECK(read(0.5, 0.0) == 0.5);
  for (const double wrong : {0.5, 1e10, -1e10, std::nan(""), std::numeric_limits<double>::infinity()}) {
    CHECK_THROWS_WITH(read(wrong, 0), Catch::Contains("an integer is due"));
    CHECK_THROWS_WITH(read(wrong, Kind::one), Catch::Contains("an integer is due"));
  }
  // The largest of 64 bits is no double: 2^63, its nearest, is beyond.
  CHECK_THROWS_WITH(read(std::ldexp(1.0, 63), std::int64_t{0}), Catch::Contains("an integer is due"));
  CHECK_THROWS_WITH(read(2.0, false), Catch::Contains("an integer is due"));
}

TEST_CASE("the file of impacts: begun, gone on with, gone") {
  const std::string path = (std::filesystem::temp_directory_path() / "dembark-test-impacts.txt").string();
  const auto text = [&] {
    std::stringstream all;
    all << std::ifstream(path).rdbuf();
    return all.str();
  };
  Impact one;
  one.a = 3, one.b = wall_key(1), one.time = 0.25, one.impulse = 2.0, one.point = {1.0, 2.0, 3.0};
  ImpactFile file;
  file.append({one});  // into none
  file.begin(path, "-1 = floor, -2 = shell");
  const std::string header = text();
  CHECK(header.find("-2 = shell\n# id_a id_b time") != std::string::npos);
  CHECK(wall_legend({"floor", "shell", ""}) == "-1 = floor, -2 = shell, -3 = wall 3");
  CHECK(wall_legend({}) == "there is none");
  file.append({one});
  CHECK(text() == header + "3 -2 0.25 0 0 2 0 0 1 2 3 0 0 0 0 0 0\n");
  CHECK(file.bytes() == static_cast<long long>(text().size()));

  ImpactFile again;
  again.resume(path, static_cast<long long>(header.size()));
  CHECK(text() == header);
  again.append({one, one});
  CHECK(again.bytes() == static_cast<long long>(text().size()));
  CHECK_THROWS_WITH(again.resume(path, 10000), Catch::Contains("bytes, the saved run goes on after 10000"));
  std::remove(path.c_str());
  CHECK_THROWS_WITH(again.resume(path, 1), Catch::Contains("is not there"));
  CHECK_THROWS_WITH(file.begin("/no/such/folder/file.txt", ""), Catch::Contains("cannot be written: No such file"));
  // A full disk, found when a line is written and when the file is closed.
  for (const std::size_t length : {std::size_t(1), std::size_t(100000)})
    CHECK_THROWS_WITH(file.begin("/dev/full", std::string(length, 'x')), Catch::Contains("cannot be written: No space left"));
}

TEST_CASE("the file of impacts as records of doubles, of the same numbers") {
  const std::string path = (std::filesystem::temp_directory_path() / "dembark-test-impacts.bin").string();
  Impact one;
  one.a = 3, one.b = wall_key(1), one.time = 0.1, one.turn_a = 2.0 / 3.0;
  ImpactFile file;
  file.begin(path, "-1 = floor");
  CHECK(std::filesystem::file_size(path) == 0);
  file.append({one, one});
  const std::vector<double> row = table_row(one);
  std::vector<double> found(2 * row.size());
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(found.data()), std::streamsize(found.size() * sizeof(double)));
  CHECK(std::filesystem::file_size(path) == found.size() * sizeof(double));
  CHECK(std::equal(row.begin(), row.end(), found.begin()));
  CHECK(std::equal(row.begin(), row.end(), found.begin() + std::ptrdiff_t(row.size())));
  ImpactFile again;
  again.resume(path, static_cast<long long>(row.size() * sizeof(double)));
  CHECK(std::filesystem::file_size(path) == row.size() * sizeof(double));
  std::remove(path.c_str());
}

TEST_CASE("a step done again loses once more what contacts held that are no candidates any more") {
  System system(two_materials(1e-4, 1.0, 0.0));
  std::vector<Body> logs(2);
  logs[0].radius = logs[1].radius = 0.1;
  logs[1].id = 1;
  logs[1].position = {0.2 - 1e-4, 0.0, 0.0};
  std::vector<Contact> contacts;
  find_pairs(logs, 1e-3, contacts);
  REQUIRE(contacts.size() == 1);
  std::vector<Vec3<double>> force(2), torque(2);
  step(system, logs, contacts, 0.0, 1.0, force, torque);
  const double held = system.report().elastic_energy, before = system.report().dissipated_energy;
  REQUIRE(held > 0.0);
  for (int again = 0; again < 2; ++again) {
    step(system, logs, {}, 1e-4, 1.0, force, torque);
    CHECK(system.report().dissipated_energy - before == Approx(held));
    CHECK(system.take_finished().size() == (again ? 0 : 1));
  }
}
