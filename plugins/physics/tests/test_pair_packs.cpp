// Contacts in packs compared with contact_step, on random pairs and on degenerate ones.
#include <cmath>
#include <random>
#include <vector>
#include "catch.hpp"

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/contact.hpp"
#include "dembark/contact_history.hpp"
#include "dembark/pairs/pair_step.hpp"
// Behind the step, which it needs.
#include "dembark/pack.hpp"

using namespace dembark;

namespace {

const capillary::BridgeLaw bridge{capillary::Model::willett, 0.3};

/// Grains, and a list with each pair once; the laws of rare contacts as adapters have them.
struct Scene : ContactCallbacks, HistoryCallbacks {
  int count = 0;
  std::vector<double> x, v, omega, radius, mass, f, torque;
  std::vector<int> type, mask;
  ContactParameters law;
  HistoryLayout layout;
  double dt = 1e-6;
  std::vector<std::vector<int>> neighbors, flags;
  std::vector<std::vector<double>> histories;
  int refused = 0;  ///< pairs without a normal

  ContactState state(int i, int k) const {
    ContactState now;
    if (flags[std::size_t(i)][std::size_t(k)]) layout.load(&histories[std::size_t(i)][std::size_t(k * layout.size())], now);
    return now;
  }
  ContactBodies bodies(int i, int j) const {
    const auto vector = [](const std::vector<double>& of, int n) { return Vec3<double>{of[3 * n], of[3 * n + 1], of[3 * n + 2]}; };
    ContactBodies b;
    b.separation = vector(x, i) - vector(x, j);
    b.velocity_1 = vector(v, i), b.velocity_2 = vector(v, j);
    b.angular_velocity_1 = vector(omega, i), b.angular_velocity_2 = vector(omega, j);
    b.radius_1 = radius[i], b.radius_2 = radius[j];
    b.mass_1 = mask[i] ? INFINITY : mass[i], b.mass_2 = mask[j] ? INFINITY : mass[j];
    return b;
  }

  Vec3<double> friction(const PairBlock& block, int k, const Vec3<double>& normal, double twist, const NormalResponse<double>& response,
                        const Vec3<double>& velocity) override {
    refused += has_no_direction(normal);
    double* const row = block.history[k];
    FrictionState<double> now = load_friction(row);
    SlipRings rings;
    if (layout.rings) rings = load_rings(row + layout.rings_at());
    const Vec3<double> out = contact_friction(law.friction, normal, twist, response, velocity, dt, now, &rings);
    store_friction(row, now);
    if (layout.rings) store_rings(row + layout.rings_at(), rings);
    return out;
  }
  void bridges(const PairBlock& block, int first, int number, const double* gap, double* pull) override {
    for (int n = 0; n < number; ++n) {
      const int k = first + n;
      double* const row = block.history[k] + layout.cohesion_at();
      pull[n] = cohesion_step(
          law.cohesion,
          {radius[block.grain[k]], radius[block.partner[k]], gap[n], (block.pick[k] & 1) != 0, law.elasticity.effective_youngs_modulus},
          row);
      if (row[0] > 0.0) *block.flags[k] = 1;
    }
  }
  Vec3<double> rolling(const PairBlock& block, int k, const Vec3<double>& normal, double twist, double normal_force,
                       double tangential_stiffness, const Vec3<double>& spin) override {
    const ContactBodies b = bodies(block.grain[k], block.partner[k]);
    double* const row = block.history[k] + layout.rolling_at();
    Vec3<double> angle{row[0], row[1], row[2]};
    const RollingContact contact{normal,
                                 twist,
                                 b.effective_radius(),
                                 relative_inertia(b.mass_1, b.radius_1, b.mass_2, b.radius_2),
                                 normal_force,
                                 tangential_stiffness,
                                 spin};
    const Vec3<double> couple = rolling_step(law.rolling, contact, dt, angle);
    row[0] = angle.x, row[1] = angle.y, row[2] = angle.z;
    return couple;
  }
  double limit(const PairBlock&, int, double normal_force, double contact_area, double slip) override {
    return shear_limit(law.friction, friction_coefficient(law.friction, slip), normal_force, contact_area);
  }
  double sliding_limit(const PairBlock&, int, const RingMotion<double>& motion, const double* rings, double normal_force,
                       double contact_area, double& slip) override {
    return dembark::sliding_limit(law.friction, motion, rings, rings + SlipRings::count, normal_force, contact_area, slip);
  }

  void step(const PairLoops& loops) {
    f.assign(x.size(), 0.0);
    torque.assign(x.size(), 0.0);
    const PackedCoefficients<double> numbers = packed_coefficients(law, dt);
    std::vector<int> grains, numneigh;
    std::vector<int*> lists, touches;
    std::vector<double*> rows;
    for (int i = 0; i < count; ++i) {
      grains.push_back(i);
      numneigh.push_back(int(neighbors[std::size_t(i)].size()));
      lists.push_back(neighbors[std::size_t(i)].data());
      touches.push_back(flags[std::size_t(i)].data());
      rows.push_back(histories[std::size_t(i)].data());
    }
    PairStep s{*this};
    s.memory = this;
    s.laws = &numbers;
    s.types = 0;
    s.one_law = true;
    s.owned = count;
    s.rings = layout.rings ? layout.rings_at() : -1;
    s.more = layout.rings || layout.rolling ? layout.rings_at() : -1;
    s.more_numbers = layout.imbalance_at() - layout.rings_at();
    s.dt = dt;
    s.wet = layout.cohesion;
    s.limit_force = law.limit_force;
    s.tangential_damping = law.tangential_damping;
    s.elastic_limit = law.friction.friction_limit == FrictionLimit::elastic;
    s.pack_friction = packs_know(law.friction);
    s.rolls = law.rolling.on();
    s.x = x.data(), s.v = v.data(), s.omega = omega.data(), s.radius = radius.data(), s.mass = mass.data();
    s.type = type.data(), s.mask = mask.data();
    s.f = f.data(), s.torque = torque.data();
    s.frozen = 1;
    s.count = count;
    s.stride = layout.size();
    s.grains = grains.data(), s.numneigh = numneigh.data();
    s.neighbors = lists.data(), s.flags = touches.data(), s.histories = rows.data();
    s.number_bits = 0x3fffffff;
    s.contact_flags = s.bridge_flag = 1;
    PairBlock block;
    loops.lists(s, block);
  }
};

/// Compares packs with contact_step over some steps of grains that drift; returns how many pairs acted.
int compare(Scene& s, const PairLoops& loops) {
  int acted = 0;
  for (int step = 0; step < 12; ++step) {
    std::vector<Vec3<double>> force(std::size_t(s.count), Vec3<double>{}), torque = force;
    std::vector<std::vector<ContactState>> states(std::size_t(s.count));
    double largest = 0.0, turning = 0.0;
    int without_normal = 0;
    for (int i = 0; i < s.count; ++i)
      for (int k = 0; k < int(s.neighbors[std::size_t(i)].size()); ++k) {
        const int j = s.neighbors[std::size_t(i)][std::size_t(k)];
        ContactState state = s.state(i, k);
        const ContactForce out = contact_step(s.law, s.bodies(i, j), s.dt, state);
        states[std::size_t(i)].push_back(state);
        if (!out.interacting) continue;
        ++acted;
        if (!std::isfinite(out.force.x)) {
          ++without_normal;
          CHECK(norm(s.bodies(i, j).separation) == 0.0);
          continue;
        }
        force[std::size_t(i)] += out.force, force[std::size_t(j)] -= out.force;
        torque[std::size_t(i)] += out.torque_1, torque[std::size_t(j)] += out.torque_2;
        largest = std::max(largest, norm(out.force));
        turning = std::max({turning, norm(out.torque_1), norm(out.torque_2)});
      }
    s.refused = 0;
    s.step(loops);
    CHECK(s.refused == without_normal);
    // An engine ends there.
    if (without_normal > 0) return acted;
    for (int i = 0; i < s.count; ++i) {
      const double* const f = &s.f[std::size_t(3 * i)];
      const double* const t = &s.torque[std::size_t(3 * i)];
      CHECK(norm(Vec3<double>{f[0], f[1], f[2]} - force[std::size_t(i)]) <= 1e-11 * largest);
      CHECK(norm(Vec3<double>{t[0], t[1], t[2]} - torque[std::size_t(i)]) <= 1e-11 * turning);
      for (int k = 0; k < int(states[std::size_t(i)].size()); ++k) {
        const ContactState now = s.state(i, k), &expected = states[std::size_t(i)][std::size_t(k)];
        CHECK(norm(now.friction.displacement - expected.friction.displacement) <= 1e-16 + 1e-9 * norm(expected.friction.displacement));
        CHECK(std::abs(now.friction.slip - expected.friction.slip) <= 1e-16 + 1e-9 * expected.friction.slip);
        CHECK(std::abs(now.cohesion.bridge_volume - expected.cohesion.bridge_volume) <= 1e-12 * expected.cohesion.bridge_volume);
        CHECK(norm(now.rolling_angle - expected.rolling_angle) <= 1e-14 + 1e-9 * norm(expected.rolling_angle));
      }
    }
    for (std::size_t n = 0; n < s.x.size(); ++n) s.x[n] += s.dt * s.v[n];
  }
  return acted;
}

Scene random_scene(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  Scene s;
  s.count = count;
  for (int i = 0; i < count; ++i) {
    const bool held = random() % 3 == 0, rests = random() % 4 == 0;
    for (int k = 0; k < 3; ++k) {
      s.x.push_back(3e-3 * any(random));
      s.v.push_back(rests ? 0.0 : 5.0 * any(random));
      s.omega.push_back(rests ? 0.0 : 500.0 * any(random));
    }
    s.radius.push_back(1e-3 * (1.0 + 0.4 * any(random)));
    s.mass.push_back(2500.0 * 4.0 / 3.0 * pi * std::pow(s.radius.back(), 3));
    s.type.push_back(0);
    s.mask.push_back(held);
  }
  // Places that touch to the last bit, that coincide, and zero sizes are put in by the tests.
  s.law.elasticity = {effective_youngs_modulus(5e6, 0.3, 5e6, 0.3), effective_shear_modulus(5e6, 0.3, 5e6, 0.3),
                      random() % 4 == 0 ? 1.0 : 0.4};
  s.law.friction.static_friction = random() % 5 == 0 ? 0.0 : 0.6;
  s.law.friction.kinetic_friction = s.law.friction.static_friction * (random() % 2 ? 1.0 : 0.7);
  s.law.friction.critical_slip_distance = random() % 2 ? 0.0 : 1e-6;
  s.law.friction.healing_time = random() % 2 ? 0.0 : 1e-4;
  if (random() % 4 == 0) s.law.friction.interface_shear_strength = 1e3;
  s.law.friction.presliding = Presliding(random() % 3);
  s.law.friction.friction_limit = FrictionLimit(random() % 2);
  s.law.limit_force = random() % 2;
  s.law.tangential_damping = random() % 2;
  if (random() % 2) s.law.rolling = {random() % 2 ? RollingModel::constant_torque : RollingModel::elastic_plastic, 0.1, 0.3};
  if (random() % 2) s.law.cohesion = {CohesionLaw::bridge, {&bridge, 0.072, 1e-11, {}}};
  s.layout.cohesion = s.law.cohesion.holds();
  s.layout.rings = s.law.friction.presliding == Presliding::partial_slip;
  s.layout.rolling = s.law.rolling.on();
  for (int i = 0; i < count; ++i) {
    s.neighbors.emplace_back();
    for (int j = i + 1; j < count; ++j) s.neighbors.back().push_back(j);
    s.flags.emplace_back(s.neighbors.back().size(), 0);
    s.histories.emplace_back(s.neighbors.back().size() * std::size_t(s.layout.size()), 0.0);
  }
  return s;
}

std::vector<PairLoops> all_loops() {
  std::vector<PairLoops> all{PairLoops::of<Pack<2, Portable>>()};
#ifdef DEMBARK_PAIR_PACKS_X86
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2")) all.push_back(PairLoops::of<Pack<4, Avx2>>());
#endif
  all.push_back(PairLoops::choose());
  return all;
}

}  // namespace

TEST_CASE("packs of contacts are contact_step, whatever is held, wet, slips or rolls") {
  std::mt19937 random(20261);
  int acted = 0;
  for (const PairLoops& loops : all_loops())
    for (int trial = 0; trial < 60; ++trial) {
      Scene s = random_scene(random, 12);
      acted += compare(s, loops);
    }
  CHECK(acted > 10000);
}

TEST_CASE("degenerate pairs: the same in packs and one by one") {
  std::mt19937 random(20262);
  for (const PairLoops& loops : all_loops())
    for (int trial = 0; trial < 60; ++trial) {
      Scene s = random_scene(random, 4);
      const auto put = [&s](int i, double at) {
        s.x[std::size_t(3 * i)] = at, s.x[std::size_t(3 * i + 1)] = s.x[std::size_t(3 * i + 2)] = 0.0;
      };
      // Touching to the last bit, one bit within, coincident; all held in every other trial.
      const double reach = s.radius[0] + s.radius[1];
      put(0, 0.0);
      put(1, trial % 3 == 0 ? reach : trial % 3 == 1 ? std::nextafter(reach, 0.0) : 0.0);
      if (trial % 2) s.mask.assign(4, 1);
      if (trial % 4 < 2) s.v.assign(12, 0.0), s.omega.assign(12, 0.0);
      compare(s, loops);
    }
}
