// Which candidates of a step are solved for.
#include <algorithm>
#include <memory>
#include <set>
#include <utility>
#include <vector>
#include "catch.hpp"

#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;
using Catch::WithinAbs;

namespace {

std::unique_ptr<Scene> crowd_in_a_drum(double dt, double theta, double mu) {
  std::vector<Body> bodies = crowd(80);
  for (Body& b : bodies) b.material = 0;
  auto scene = std::make_unique<Scene>(two_materials(dt, theta, mu), bodies);
  Drum drum;
  drum.material = 1;
  drum.stiffness = 5e7;
  drum.omega = 3.0;
  scene->around.drums.push_back(drum);
  return scene;
}

}  // namespace

TEST_CASE("candidates beyond those that can close change nothing") {
  for (const double dt : {2e-4, 5e-3}) {
    const auto few_owner = crowd_in_a_drum(dt, 1.0, 0.4), all_owner = crowd_in_a_drum(dt, 1.0, 0.4);
    Scene &few = *few_owner, &all = *all_owner;
    all.reach = 3.0;
    for (int i = 0; i < 300; ++i) {
      few.forces();
      all.forces();
      REQUIRE(all.system().report().contacts >= 80 * 79 / 2);
      REQUIRE(few.system().report().contacts < all.system().report().contacts);
      REQUIRE(few.system().contacts().size() == all.system().contacts().size());
      REQUIRE(same_bits(few.system().state(), all.system().state()));
      few.advance();
      all.advance();
    }
  }
}

TEST_CASE("no pair closes unseen, however large the step") {
  for (const double dt : {1e-3, 2e-2}) {
    const auto owner = crowd_in_a_drum(dt, 1.0, 0.3);
    Scene& scene = *owner;
    int seen = 0;
    double closest = 0.0;
    for (int i = 0; i < 200; ++i) {
      scene.forces();
      std::set<std::pair<int, int>> rows;
      for (const ContactResult& c : scene.system().contacts()) rows.insert({c.a, c.b});
      std::vector<Vec3<double>> normals;
      std::vector<double> gaps;
      std::vector<std::pair<int, int>> left_out;
      const std::vector<Body> before = scene.bodies();
      for (std::size_t a = 0; a < before.size(); ++a)
        for (std::size_t b = a + 1; b < before.size(); ++b) {
          if (rows.count({int(a), int(b)})) continue;
          const Vec3<double> apart = before[a].position - before[b].position;
          left_out.emplace_back(int(a), int(b));
          normals.push_back(apart * (1.0 / norm(apart)));
          gaps.push_back(norm(apart) - before[a].radius - before[b].radius);
        }
      seen += scene.system().report().active;
      scene.advance();
      const std::vector<Body>& after = scene.bodies();
      for (std::size_t k = 0; k < left_out.size(); ++k) {
        const auto [a, b] = left_out[k];
        const Vec3<double> gain = after[std::size_t(a)].position - before[std::size_t(a)].position -
                                  (after[std::size_t(b)].position - before[std::size_t(b)].position);
        closest = std::min(closest, gaps[k] + dot(gain, normals[k]));
      }
    }
    CHECK(closest > -1e-12);
    CHECK(seen > 1000);
  }
}

TEST_CASE("a body that is knocked on reaches the next one within the step") {
  Settings s;
  s.dt = 1e-2;
  std::vector<Body> logs(3);
  const double at[3] = {0.0, 0.21, 0.43};
  for (int i = 0; i < 3; ++i) {
    logs[std::size_t(i)].id = i;
    logs[std::size_t(i)].mass = i == 0 ? 1000.0 : 10.0;
    logs[std::size_t(i)].radius = 0.1;
    logs[std::size_t(i)].position = {at[i], 0, 0};
  }
  logs[0].velocity = {5.0, 0, 0};
  Scene scene(s, logs);
  scene.reach = 0.1;
  scene.forces();
  REQUIRE(scene.system().contacts().size() == 2);
  CHECK(scene.system().contacts()[1].normal_force > 0.0);
  CHECK(scene.system().report().certificate < 1e-14);
  const double pushed = scene.system().contacts()[1].normal_force / 5e6;  // what the springs give
  scene.advance();
  CHECK_THAT(scene.bodies()[2].position.x - scene.bodies()[1].position.x, WithinAbs(0.2 - pushed, 1e-12));

  // The same pair listed twice is found out only then; the step leaves no trace.
  System system(s);
  std::vector<Contact> contacts;
  find_pairs(logs, 0.1, contacts);
  REQUIRE(contacts.size() == 2);
  std::vector<Vec3<double>> force(3), torque(3);
  std::vector<Body> still = logs;
  still[0].velocity = {};
  step(system, still, contacts, 0.0, 1.0, force, torque);
  const std::vector<double> before = system.state();
  contacts.push_back(contacts[1]);
  CHECK_THROWS_WITH(step(system, logs, contacts, 1e-2, 1.0, force, torque), Catch::Contains("twice"));
  CHECK(same_bits(system.state(), before));
  CHECK_THROWS_WITH(step(system, logs, contacts, 0.0, 1.0, force, torque), Catch::Contains("twice"));
  CHECK(same_bits(system.state(), before));
}

TEST_CASE("bodies that fly apart are searched for what lies beyond the first reach") {
  Settings s;
  s.dt = 1e-2;
  std::vector<Body> logs(3);
  const double at[3] = {0.0, 0.18, 0.385};  // the first two overlap by 20 mm; nothing moves yet, so the search begins with 1 mm
  for (int i = 0; i < 3; ++i) {
    logs[std::size_t(i)].id = i;
    logs[std::size_t(i)].mass = 10.0;
    logs[std::size_t(i)].radius = 0.1;
    logs[std::size_t(i)].position = {at[i], 0, 0};
  }
  REQUIRE(default_reach(logs, s.dt) < 2e-3);
  Scene scene(s, logs);
  scene.forces();
  REQUIRE(scene.system().contacts().size() == 2);
  const ContactResult beyond = scene.system().contacts()[1];
  CHECK(beyond.normal_force > 0.0);
  scene.advance();
  CHECK_THAT(scene.bodies()[2].position.x - scene.bodies()[1].position.x, WithinAbs(0.2 - beyond.normal_force / 5e6, 1e-12));
}
