// Steps with many coupled contacts, by each way of solving.
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>
#include "catch.hpp"

#include "impact_scenes.hpp"

using namespace dembark;
using namespace dembark::impact;
using namespace impact_scenes;

namespace {

Settings by_blocks(Settings settings) {
  settings.lcp.method = LcpMethod::block;
  return settings;
}

/// The same step by relaxation and by the block method.
struct RelaxedAndExact {
  System relaxing, exact;
  StepReport report[2];
  std::vector<Vec3<double>> force[2], torque[2];
  RelaxedAndExact(const Settings& settings, const std::vector<Body>& bodies, const std::vector<Contact>& contacts)
      : relaxing(settings), exact(by_blocks(settings)) {
    for (int k = 0; k < 2; ++k) {
      force[k].resize(bodies.size());
      torque[k].resize(bodies.size());
      report[k] = step(k ? exact : relaxing, bodies, contacts, 0.0, 1.0, force[k], torque[k]);
    }
  }
};

}  // namespace

TEST_CASE("relaxation and the exact solver find the same forces, in the plane and out of it") {
  for (const bool tilted : {false, true})
    for (const double mu : {0.0, 0.4}) {
      const std::vector<Body> bodies = lattice(8, 8, 2e-4, tilted, 3);
      std::vector<Contact> contacts;
      find_pairs(bodies, 1e-3, contacts);
      const RelaxedAndExact both(two_materials(2e-4, 0.5, mu, 300.0), bodies, contacts);
      const StepReport &a = both.report[0], &b = both.report[1];
      CHECK(a.contacts > 100);
      CHECK(a.active > 30);
      CHECK(a.active == b.active);
      CHECK(a.block_steps == 0);  // so it was relaxed
      CHECK(b.block_steps > 0);
      CHECK(a.certificate < 1e-14);
      // Friction knows the normal forces between its sweeps to four digits.
      const double close = mu > 0.0 ? 1e-5 : 1e-11;
      REQUIRE(both.relaxing.contacts().size() == both.exact.contacts().size());
      for (std::size_t i = 0; i < both.exact.contacts().size(); ++i) {
        CHECK(std::fabs(both.relaxing.contacts()[i].normal_force - both.exact.contacts()[i].normal_force) < close * b.peak_force);
        if (mu == 0.0) CHECK(std::fabs(both.relaxing.contacts()[i].deformed_gap - both.exact.contacts()[i].deformed_gap) < 1e-15);
      }
      for (std::size_t i = 0; i < bodies.size(); ++i) CHECK(norm(both.force[0][i] - both.force[1][i]) < close * b.peak_force);
    }
}

TEST_CASE("strongly coupled contacts: the forces are those of the block method") {
  for (const double dt : {6e-3, 2e-2})
    for (const bool tilted : {false, true}) {
      const std::vector<Body> bodies = lattice(12, 10, 1e-4, tilted, 5);
      std::vector<Contact> contacts;
      find_pairs(bodies, 2e-2, contacts);
      const RelaxedAndExact both(two_materials(dt, 1.0, 0.0, 300.0), bodies, contacts);
      const StepReport &a = both.report[0], &b = both.report[1];
      CHECK(b.active > 60);
      CHECK(a.active == b.active);
      CHECK(a.certificate < 1e-14);
      for (std::size_t i = 0; i < bodies.size(); ++i) CHECK(norm(both.force[0][i] - both.force[1][i]) < 1e-10 * b.peak_force);
    }
}

TEST_CASE("equal logs packed tightly and a long step, where pivots take turns without end") {
  const std::vector<Body> bodies = lattice(20, 20, 1e-6, false, 7);
  std::vector<Contact> contacts;
  find_pairs(bodies, 2e-2, contacts);
  for (const double dt : {0.05, 0.2, 1.0}) {
    System system(two_materials(dt, 1.0, 0.0));
    std::vector<Vec3<double>> force(bodies.size()), torque(bodies.size());
    const StepReport& report = step(system, bodies, contacts, 0.0, 1.0, force, torque);
    CHECK(report.active > 300);
    CHECK(report.certificate < 1e-14);
    CHECK(report.block_steps < 13);  // block pivots alone exchange the set a thousand times
    for (const ContactResult& c : system.contacts())
      CHECK((c.normal_force >= 0.0 && c.deformed_gap >= 0.0 && c.normal_force * c.deformed_gap == 0.0));
  }
}
