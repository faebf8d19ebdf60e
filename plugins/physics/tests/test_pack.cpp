// The laws in packs of contacts give the bits of the scalar laws, lane by lane.
#include "catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "dembark/exponential.hpp"
#include "dembark/finnie_rabinowicz.hpp"
#include "dembark/kinematics.hpp"
#include "dembark/normal_force.hpp"
#include "dembark/pack.hpp"
#include "dembark/partial_slip.hpp"

using namespace dembark;

namespace {

template <int N>
struct LawPack {
  Pack<N> effective_youngs_modulus, effective_shear_modulus, damping, static_friction, kinetic_friction, interface_shear_strength,
      kept_slip, critical_slip_distance;
};

// Rows of numbers, one a lane.
template <int N>
class Lanes {
  std::mt19937 chance_{7};

 public:
  std::vector<std::array<double, N>> all;
  Pack<N> uniform(double low, double high) {
    std::array<double, N> row;
    for (double& value : row) value = std::uniform_real_distribution<double>(low, high)(chance_);
    all.push_back(row);
    return Pack<N>::load(row.data());
  }
  // One of a few values, so that every branch is met.
  Pack<N> among(const std::vector<double>& values) {
    std::array<double, N> row;
    for (double& value : row) value = values[chance_() % values.size()];
    all.push_back(row);
    return Pack<N>::load(row.data());
  }
  Vec3<Pack<N>> vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
};

template <int N>
Vec3<double> lane(const Vec3<Pack<N>>& v, int k) {
  return {v.x[k], v.y[k], v.z[k]};
}

bool same(const Vec3<double>& a, const Vec3<double>& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

template <int N>
void compare() {
  Lanes<N> draw;
  int stuck = 0, slipped = 0;
  for (int round = 0; round < 500; ++round) {
    const LawPack<N> p{draw.uniform(1e6, 1e7),      draw.uniform(1e5, 1e6),
                       draw.uniform(-0.5, 0.0),     draw.among({0.4, 0.5, 0.6}),
                       draw.among({0.0, 0.2, 0.4}), draw.among({1e4, 1e30, INFINITY}),
                       draw.among({0.0, 0.9}),      draw.among({0.0, 1e-7, 1e-5, INFINITY})};
    const Pack<N> radius = draw.uniform(1e-3, 2e-3), mass = draw.uniform(1e-5, 1e-4), overlap = draw.uniform(1e-6, 1e-4), dt = 1e-5;
    Vec3<Pack<N>> normal = draw.vector(1.0);
    normal *= 1.0 / sqrt(dot(normal, normal));
    const Vec3<Pack<N>> relative = draw.vector(0.1), spin_1 = draw.vector(100.0), spin_2 = draw.vector(100.0);
    const Pack<N> arm_1 = draw.uniform(1e-3, 2e-3), arm_2 = draw.uniform(1e-3, 2e-3);
    const Pack<N> twist = draw.among({0.0, 1e-9, 1e-5, 0.1, -1.0});
    Vec3<Pack<N>> displacement = draw.vector(round % 2 ? 1e-6 : 3e-5);
    displacement -= draw.among({0.0, 0.9, 0.9999, 1.0, 1.0}) * dot(displacement, normal) * normal;
    FrictionState<Pack<N>> state{displacement, draw.among({0.0, 0.0, 1e-6, 3e-5, 1e-3}), draw.uniform(0.0, 1.0)};
    const FrictionState<Pack<N>> before = state;

    const SurfaceMotion<Pack<N>> motion = surface_motion(normal, relative, arm_1, spin_1, arm_2, spin_2);
    const Pack<N> turn = contact_twist(normal, spin_1, spin_2, dt);
    const NormalResponse<Pack<N>> response =
        adjusted(hertz(p, radius, mass, overlap, motion.normal_velocity), round % 2 == 0, round % 3 != 0);
    state.displacement = rotate_to_plane(state.displacement, normal, twist) + motion.tangential_velocity * dt;
    const Mask<N> sticks = plainly_sticks(p, response.force, response.tangential_stiffness, response.contact_area, state);
    const FrictionState<Pack<N>> moved = state;
    FrictionState<Pack<N>> slid;
    const Mask<N> slips = coulomb_slip(p, response.force, response.tangential_stiffness, motion.tangential_velocity * dt,
                                       !sticks & !(p.interface_shear_strength < unlimited_strength), moved, slid);
    const Vec3<Pack<N>> force =
        sticking_force(response.tangential_stiffness, response.tangential_damping, motion.tangential_velocity, dt, p.kept_slip, state);

    for (int k = 0; k < N; ++k) {
      const Vec3<double> one_normal = lane(normal, k), one_spin = lane(spin_1, k), other_spin = lane(spin_2, k);
      const SurfaceMotion<double> one_motion = surface_motion(one_normal, lane(relative, k), arm_1[k], one_spin, arm_2[k], other_spin);
      CHECK(one_motion.normal_velocity == motion.normal_velocity[k]);
      CHECK(same(one_motion.tangential_velocity, lane(motion.tangential_velocity, k)));
      CHECK(contact_twist(one_normal, one_spin, other_spin, dt[k]) == turn[k]);
      HertzParameters elasticity;
      elasticity.effective_youngs_modulus = p.effective_youngs_modulus[k];
      elasticity.effective_shear_modulus = p.effective_shear_modulus[k];
      elasticity.damping = p.damping[k];
      const NormalResponse<double> one =
          adjusted(hertz(elasticity, radius[k], mass[k], overlap[k], one_motion.normal_velocity), round % 2 == 0, round % 3 != 0);
      CHECK(one.force == response.force[k]);
      CHECK(one.tangential_stiffness == response.tangential_stiffness[k]);
      CHECK(one.tangential_damping == response.tangential_damping[k]);
      CHECK(one.contact_area == response.contact_area[k]);
      FrictionState<double> single{rotate_to_plane(lane(before.displacement, k), lane(normal, k), twist[k]), before.slip[k],
                                   before.dissipated_energy[k]};
      CHECK(same(single.displacement + one_motion.tangential_velocity * dt[k], lane(moved.displacement, k)));
      if (!sticks[k] && p.interface_shear_strength[k] < unlimited_strength) continue;
      // The whole scalar step gives the lane's force and state, whether it sticks or slips.
      (slips[k] ? slipped : stuck) += 1;
      FinnieRabinowicz law;
      law.static_friction = p.static_friction[k];
      law.kinetic_friction = p.kinetic_friction[k];
      law.interface_shear_strength = p.interface_shear_strength[k];
      law.critical_slip_distance = p.critical_slip_distance[k];
      law.healing_time = p.kept_slip[k] > 0.0 ? -dt[k] / std::log(p.kept_slip[k]) : 0.0;
      const Vec3<double> whole = friction_step(law, one.force, one.tangential_stiffness, one.tangential_damping, one.contact_area,
                                               one_motion.tangential_velocity, dt[k], single);
      const FrictionState<Pack<N>>& then = slips[k] ? slid : state;
      CHECK(same(whole, slips[k] ? -one.tangential_stiffness * lane(slid.displacement, k) : lane(force, k)));
      CHECK(same(single.displacement, lane(then.displacement, k)));
      CHECK(single.dissipated_energy == then.dissipated_energy[k]);
      // The share of its slip that a contact keeps has gone through a logarithm here.
      CHECK(single.slip == Approx(then.slip[k]).epsilon(slips[k] ? 0.0 : 1e-14).margin(0.0));
    }
  }
  CHECK(stuck > 100);
  CHECK(slipped > 100);
}

/// Rings of a contact that is rubbed at random, moved by packs of N, in a row of contacts.
template <int N>
std::vector<double> rubbed() {
  std::mt19937 chance(3);
  const auto uniform = [&chance](double low, double high) { return std::uniform_real_distribution<double>(low, high)(chance); };
  std::vector<double> trace;
  int rim = 0, sliding = 0;
  for (int contact = 0; contact < 50; ++contact) {
    SlipRings rings;
    double slip = 0.0;
    for (int step = 0; step < 60; ++step) {
      const RingMotion<double> motion{uniform(1.0, 1.2), uniform(-4e-8, 4e-8), uniform(-2e-8, 2e-8),
                                      uniform(0.9, 1.0), uniform(0.0, 1.0),    5e3};
      RingSums sums;
      double limit = 4e-4;
      FinnieRabinowicz law;
      law.static_friction = law.kinetic_friction = 0.4;
      bool slides = false;
      while (move_rings<Pack<N>>(motion, limit, slides, rings.along.data(), rings.across.data(), sums)) {
        slides = true;
        ++sliding;
        limit = sliding_limit(law, motion, rings.along.data(), rings.across.data(), limit / 0.4, 1e-8, slip);
      }
      rim += sums.lost > 0.0 && !slides;
      trace.insert(trace.end(), {sums.along, sums.across, sums.lost, slip});
    }
    trace.insert(trace.end(), rings.along.begin(), rings.along.end());
    trace.insert(trace.end(), rings.across.begin(), rings.across.end());
  }
  CHECK(rim > 100);
  CHECK(sliding > 100);
  return trace;
}

}  // namespace

TEST_CASE("rings of partial slip have the same bits in packs of every size") {
  const std::vector<double> narrow = rubbed<2>();
  CHECK(narrow == rubbed<4>());
  CHECK(narrow == rubbed<8>());
}

TEST_CASE("sums of packs do not depend on their size") {
  double numbers[8] = {1.0, 1e-16, -3.0, 0.1, 7e5, 1e-3, 0.3, -1e9};
  const Pack<2> twos[4] = {Pack<2>::load(numbers), Pack<2>::load(numbers + 2), Pack<2>::load(numbers + 4), Pack<2>::load(numbers + 6)};
  const Pack<4> fours[2] = {Pack<4>::load(numbers), Pack<4>::load(numbers + 4)};
  const Pack<8> eights[1] = {Pack<8>::load(numbers)};
  const double expected = ((numbers[0] + numbers[4]) + (numbers[2] + numbers[6])) + ((numbers[1] + numbers[5]) + (numbers[3] + numbers[7]));
  CHECK(sum(twos) == expected);
  CHECK(sum(fours) == expected);
  CHECK(sum(eights) == expected);
}

TEST_CASE("laws in packs give the bits of the scalar laws") {
  compare<2>();
  compare<4>();
  compare<8>();
}

TEST_CASE("the exponential function is right to a unit in the last place, and in packs to the bit") {
  std::mt19937 chance(5);
  double worst = 0.0;
  for (int k = 0; k < 100000; ++k) {
    const double x = std::uniform_real_distribution<double>(k % 2 ? -1.0 : -690.0, k % 2 ? 1.0 : 690.0)(chance), mine = exponential(x);
    worst = std::max(worst, double(std::abs((static_cast<long double>(mine) - expl(x)) / expl(x))));
    const Pack<4> four = exponential(Pack<4>(x));
    if (four[0] != mine || four[3] != mine) FAIL("other bits in a pack for " << x);
  }
  CHECK(worst < 2.2e-16);
  CHECK(exponential(0.0) == 1.0);
  CHECK(exponential(-0.0) == 1.0);
  CHECK(exponential(-701.0) == 0.0);
  CHECK(exponential(-double(INFINITY)) == 0.0);
}

TEST_CASE("masks and choices of packs") {
  const double numbers[4] = {-1.0, NAN, 0.5, INFINITY};
  const Pack<4> p = Pack<4>::load(numbers);
  CHECK(bits(p > 0.0) == 0b1100);
  CHECK(bits(!(p > 0.0)) == 0b0011);
  CHECK(bits((p < 1.0) & (p > 0.0)) == 0b0100);
  CHECK(bits((p < 0.0) | (p > 1.0)) == 0b1001);
  CHECK_FALSE(any(p < -1.0));
  const Pack<4> chosen = select(p > 0.0, p, Pack<4>(2.0));
  CHECK((chosen[0] == 2.0 && chosen[1] == 2.0 && chosen[2] == 0.5 && chosen[3] == INFINITY));
  CHECK(std::signbit(Pack<2>(-0.0)[1]));
}
