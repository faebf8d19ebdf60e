// The ledger of energies: kicks seen from their beginning, mean and end, held bodies, velocities that were set.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include "catch.hpp"

#include "dembark/energy_ledger.hpp"

using namespace dembark;
using Catch::WithinAbs;
using Catch::WithinRel;

namespace {

double entry(const Energies& energies, const std::string& name) {
  const auto found = std::find(energy_names.begin(), energy_names.end(), name);
  REQUIRE(found != energy_names.end());
  return energies[std::size_t(found - energy_names.begin())];
}

EnergyBody some_body(std::mt19937_64& random, unsigned blocked = 0) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  EnergyBody body;
  SixVector force{}, damping{};
  body.mass = {2.0, 2.0, 2.0, 0.3, 0.3, 0.3};
  for (std::size_t k = 0; k < 6; ++k)
    if (blocked >> k & 1u) body.mass[k] = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    body.velocity[k] = u(random);
    damping[k] = -0.1 * body.velocity[k];
    force[k] = damping[k] + 30.0 * u(random);
  }
  body.set_forces(force, {0.0, 0.0, -2.0 * 9.81, 0.0, 0.0, 0.0}, damping);
  return body;
}

Energies after_kick(EnergyBody body, const std::array<SixVector, contact_part_count>& loads, double h, int side) {
  EnergyLedger ledger;
  ledger.kinetic = ledger.first_kinetic = body.kinetic(body.velocity);
  const SixVector after = body.kicked(h), before = body.velocity;
  for (std::size_t k = 0; k < 6; ++k) body.velocity[k] = side > 0 ? before[k] : side < 0 ? after[k] : 0.5 * (before[k] + after[k]);
  ledger.now.add_body(body);
  std::array<bool, contact_part_count> present;
  present.fill(true);
  ledger.now.add_loads(body, loads, present);
  ledger.kick(h, side);
  ledger.kinetic = body.kinetic(after);
  return ledger.energies();
}

}  // namespace

TEST_CASE("the works of a kick are the same from its beginning, mean and end, and balance", "[energy]") {
  std::mt19937_64 random(5);
  for (const unsigned blocked : {0u, 9u, 63u}) {
    const EnergyBody body = some_body(random, blocked);
    std::array<SixVector, contact_part_count> loads{};
    for (SixVector& load : loads) load = some_body(random).force;
    const Energies begin = after_kick(body, loads, 0.01, 1), mean = after_kick(body, loads, 0.01, 0),
                   end = after_kick(body, loads, 0.01, -1);
    const double scale = entry(mean, "scale");
    CHECK((scale > 0.0));
    for (std::size_t k = 0; k < begin.size(); ++k) {
      INFO(energy_names[k] << " with blocked " << blocked);
      CHECK_THAT(begin[k], WithinAbs(mean[k], 1e-14 * scale));
      CHECK_THAT(end[k], WithinAbs(mean[k], 1e-14 * scale));
    }
    CHECK_THAT(entry(mean, "balance"), WithinAbs(0.0, 1e-14 * scale));
    // What acts on the free degrees of freedom is work of the parts and of the walls together.
    double contacts = entry(mean, "walls");
    for (std::size_t part = 0; part < force_part_count; ++part) contacts += mean[3 + part];
    contacts += entry(mean, "rolling_elastic") + entry(mean, "rolling_viscous");
    double expected = 0.0;
    const SixVector after = body.kicked(0.01);
    for (std::size_t k = 0; k < 6; ++k)
      if (body.is_free(k))
        for (const SixVector& load : loads) expected += 0.01 * load[k] * 0.5 * (body.velocity[k] + after[k]);
    CHECK_THAT(contacts, WithinAbs(expected, 1e-14 * scale));
    if (blocked == 63u) CHECK(entry(mean, "gravity") == 0.0);
    else CHECK(entry(mean, "numerical_damping") < 0.0);
  }
}

TEST_CASE("two half kicks of velocity Verlet are one of leapfrog", "[energy]") {
  std::mt19937_64 random(6);
  const EnergyBody body = some_body(random);
  const double dt = 0.02;
  EnergyLedger leapfrog, verlet;
  EnergyBody mean = body, middle = body;
  leapfrog.arrive(mean, dt, body.kicked(dt));
  leapfrog.now.add_body(mean);
  leapfrog.kick(dt, 0);
  middle.velocity = body.kicked(0.5 * dt);
  verlet.now.add_body(middle);
  verlet.kick(0.5 * dt, -1);
  verlet.kick(0.5 * dt, 1);
  for (std::size_t k = 0; k < Powers::count; ++k) CHECK_THAT(verlet.work[k], WithinAbs(leapfrog.work[k], 1e-13));
  CHECK(leapfrog.imposed == 0.0);
}

TEST_CASE("a velocity that the forces did not make is imposed", "[energy]") {
  std::mt19937_64 random(7);
  EnergyBody body = some_body(random, 32);
  EnergyLedger ledger;
  const double first = body.kinetic(body.velocity);
  ledger.first_kinetic = first;
  const SixVector by_forces = body.kicked(0.01);
  SixVector after = by_forces;
  after[1] += 0.5;
  after[5] += 3.0;  // held: no kinetic energy
  ledger.kinetic = 0.0;
  const double arrived = ledger.arrive(body, 0.01, after);  // before the comparison, whose sides come in any order
  CHECK(arrived == ledger.kinetic);
  CHECK_THAT(ledger.imposed, WithinRel(0.5 * 2.0 * (after[1] * after[1] - by_forces[1] * by_forces[1]), 1e-12));
  ledger.now.add_body(body);
  ledger.kick(0.01, 0);
  const Energies energies = ledger.energies();
  CHECK_THAT(entry(energies, "balance"), WithinAbs(0.0, 1e-14 * entry(energies, "scale")));
}

TEST_CASE("a held body gives the others what it takes", "[energy]") {
  EnergyBody wall;
  wall.velocity = {0.0, 0.0, 0.5, 0.0, 0.0, 0.0};
  Powers powers;
  powers.add_held(wall, {0.0, 0.0, -4.0, 0.0, 0.0, 0.0});
  CHECK(powers.power[Powers::walls] == 2.0);
}

TEST_CASE("the error of the step counts the springs at the positions where they are known", "[energy]") {
  EnergyLedger ledger;
  ledger.now.power[0] = -2.0;
  ledger.set_stored(0.01, 0.0, 0.0, 0.5 * 0.01 * -2.0);
  CHECK(entry(ledger.energies(), "step_error") == 0.0);
  ledger.kick(0.01, 0);
  CHECK(entry(ledger.energies(), "normal_elastic") == -0.02);
  CHECK(entry(ledger.energies(), "step_error") == 0.0);
}
