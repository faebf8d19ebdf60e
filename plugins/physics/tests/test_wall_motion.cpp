#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "catch.hpp"

#include "dembark/motion/prescribed_motion.hpp"
#include "dembark/motion/wall_frame.hpp"
#include "dembark/motion/wall_work.hpp"

using namespace dembark;
using Catch::WithinAbs;

namespace {

const char* const terms[] = {
    "harmonic amplitude 1e-3 0 2e-3 frequency 20 phase 0.3",
    "harmonic amplitude 0 1e-3 0 frequency 20 phase 0.3 ramp 0 start 0.02",
    "harmonic amplitude 0 0 1e-3 frequency 20 ramp 2 start 0.1 until 0.7",
    "circular first 1e-3 0 0 second 0 0 2e-3 frequency 7 ramp 3",
    "rocking point 0.1 0 0 axis 0 2 0 angle 0.2 frequency 5",
    "rotation point 0 0 1 axis 0 1 0 rate 3 acceleration -2",
    "uniform velocity 0.1 0 -0.2 acceleration 1 2 3",
    "jolts shape half_sine acceleration 5 0 0 duration 0.08 interval 0.1 count 4 signs +--+",
    "jolts shape rising acceleration 0 5 0 duration 0.08 interval 0.1 count 3",
    "harmonic amplitude 0 0 1e-3 frequency 20 harmonic amplitude 0 0 2e-4 frequency 35 phase 1 ramp 17.5",
};

double difference(const WallState& a, const WallState& b, const WallState& slope, double h) {
  return norm((1.0 / h) * (b.displacement - a.displacement) - slope.velocity) + std::abs((b.angle - a.angle) / h - slope.rate);
}

std::string message(const std::string& words) {
  try {
    PrescribedMotion{words};
  } catch (const std::invalid_argument& wrong) {
    return wrong.what();
  }
  return "";
}

}  // namespace

TEST_CASE("wall motion: velocity and acceleration are the derivatives of the displacement", "[motion]") {
  for (const char* words : terms) {
    INFO(words);
    const PrescribedMotion motion{std::string(words)};
    const double h = 1e-6;
    // Away from the times at which a pulse, or a motion without a ramp, begins.
    for (double t = 0.0113; t < 1.2; t += 0.0271) {
      const WallState before = motion.at(t - h), now = motion.at(t), after = motion.at(t + h);
      CHECK_THAT(difference(before, after, now, 2.0 * h), WithinAbs(0.0, 1e-8));
      CHECK_THAT(norm((0.5 / h) * (after.velocity - before.velocity) - now.acceleration), WithinAbs(0.0, 1e-5));
      CHECK_THAT((0.5 / h) * (after.rate - before.rate) - now.angular_acceleration, WithinAbs(0.0, 1e-6));
    }
  }
}

TEST_CASE("wall motion: a ramped oscillation begins and ends at rest without a jump of acceleration", "[motion]") {
  const PrescribedMotion motion{std::string("harmonic amplitude 0 0 1e-3 frequency 20 phase 1.1 ramp 10 start 0.2 until 2.2")};
  for (const double t : {0.2, 2.2}) {
    for (const double side : {-1e-9, 0.0, 1e-9}) {
      const WallState s = motion.at(t + side);
      CHECK_THAT(norm(s.displacement), WithinAbs(0.0, 1e-18));
      CHECK_THAT(norm(s.velocity), WithinAbs(0.0, 1e-12));
      CHECK_THAT(norm(s.acceleration), WithinAbs(0.0, 1e-4));
    }
  }
  // Full amplitude between.
  const double w = two_pi * 20.0;
  for (double t = 0.71; t < 1.69; t += 0.0137)
    CHECK_THAT(motion.at(t).displacement.z, WithinAbs(1e-3 * std::sin(w * (t - 0.2) + 1.1), 1e-15));
}

TEST_CASE("wall motion: circular motion goes round with constant speed", "[motion]") {
  const PrescribedMotion motion{std::string("circular first 0 0 -2e-3 second 2e-3 0 0 frequency 10 ramp 1")};
  for (double t = 0.1; t < 0.5; t += 0.013) {
    const WallState s = motion.at(t);
    CHECK_THAT(norm(s.displacement), WithinAbs(2e-3, 1e-16));
    CHECK_THAT(norm(s.velocity), WithinAbs(2e-3 * two_pi * 10.0, 1e-14));
    CHECK_THAT(cross(s.displacement, s.velocity).y, WithinAbs(4e-6 * two_pi * 10.0, 1e-16));
  }
}

TEST_CASE("wall motion: pulses of acceleration add up, and + - - + comes back", "[motion]") {
  for (const char* shape : {"half_sine", "constant", "rising"}) {
    const PrescribedMotion one{std::string("jolts acceleration 3 0 0 duration 0.1 shape ") + shape};
    const double part = std::string(shape) == "half_sine" ? 2.0 / (0.5 * two_pi) : std::string(shape) == "constant" ? 1.0 : 0.5;
    CHECK_THAT(one.at(5.0).velocity.x, WithinAbs(3.0 * 0.1 * part, 1e-14));
    const PrescribedMotion four{std::string("jolts acceleration 3 0 0 duration 0.1 interval 0.25 count 4 signs +--+ shape ") + shape};
    CHECK_THAT(four.at(5.0).velocity.x, WithinAbs(0.0, 1e-14));
    CHECK_THAT(four.at(5.0).displacement.x, WithinAbs(0.0, 1e-14));
    CHECK(std::abs(four.at(0.5).displacement.x) > 1e-2);
  }
}

TEST_CASE("wall motion: a table is met in its rows, smooth between them, at rest outside", "[motion]") {
  const std::string name = "test_wall_motion_table.csv";
  const auto write = [&name](const std::string& text) { std::ofstream(name) << text; };
  write("# t x y z\n0,1,0,0\n0.1 1.01 0 -0.02\n\n0.3, 1.02, 0, 0\n0.35 1.0 0 0.01\n");
  const PrescribedMotion motion{"table file " + name + " start 0.5"};
  CHECK_THAT(norm(motion.at(0.6).displacement - Vec3<double>{0.01, 0.0, -0.02}), WithinAbs(0.0, 1e-16));
  CHECK_THAT(norm(motion.at(0.8).displacement - Vec3<double>{0.02, 0.0, 0.0}), WithinAbs(0.0, 1e-16));
  CHECK(norm(motion.at(0.4).displacement) == 0.0);
  CHECK_THAT(norm(motion.at(9.0).displacement - Vec3<double>{0.0, 0.0, 0.01}), WithinAbs(0.0, 1e-16));
  CHECK(norm(motion.at(9.0).velocity) == 0.0);
  const double h = 1e-7;
  for (const double knot : {0.6, 0.8}) {
    CHECK_THAT(norm(motion.at(knot + h).velocity - motion.at(knot - h).velocity), WithinAbs(0.0, 1e-4));
    CHECK_THAT(norm(motion.at(knot + h).acceleration - motion.at(knot - h).acceleration), WithinAbs(0.0, 1e-2));
  }
  for (double t = 0.503; t < 0.85; t += 0.01)
    CHECK_THAT(difference(motion.at(t - h), motion.at(t + h), motion.at(t), 2.0 * h), WithinAbs(0.0, 1e-7));
  // Rows that no sample meets, and rows within one step.
  write("0 0 0 0\n4.99999 0 0 0\n5.00001 0 0 0.7\n5.00003 0 0 0\n10 0 0 0\n");
  PrescribedMotion jump{"table file " + name + " start 0"};
  jump.begin(0.0);
  CHECK(jump.reach(0.0, 9.0).high.z >= 0.7);
  CHECK(jump.step_error(1.9e-5).empty());
  CHECK(jump.step_error(1e-4).find("its table has rows 2e-05 s apart, closer than the time step of 0.0001 s") == 0);
  write("0 0 0 0\n0.2 0 0 1\n0.2 0 0 2\n");
  CHECK(message("table file " + name) == "motion table: file '" + name + "', line 3: the times do not ascend");
  write("0 0 0\n");
  CHECK(message("table file " + name).find("line 1: it must have four numbers") != std::string::npos);
  std::remove(name.c_str());
}

TEST_CASE("wall motion: the steps of an engine add up to the displacement", "[motion]") {
  for (const char* words : terms) {
    const PrescribedMotion motion{std::string(words)};
    Vec3<double> sum = motion.at(0.0).displacement;
    for (int k = 0; k < 1000; ++k) sum += 1e-3 * motion.step(1e-3 * k, 1e-3).velocity;
    CHECK_THAT(norm(sum - motion.at(1.0).displacement), WithinAbs(0.0, 1e-14));
  }
}

TEST_CASE("wall motion: it begins from where the wall stands, at any time", "[motion]") {
  const std::string name = "test_wall_motion_begin.csv";
  std::ofstream(name) << "0 0 0 0\n0.1 1e-2 0 -0.02\n0.3 2e-2 0 0\n";
  std::vector<std::string> all(std::begin(terms), std::end(terms));
  for (const std::string& more :
       {"table file " + name, std::string(terms[0]) + " table file " + name,
        std::string("harmonic amplitude 0 0 1e-3 frequency 20 ramp 0 uniform velocity 0.01 0 0 rotation point 1 2 3 "
                    "axis 0 0 1 rate 5 acceleration 2")})
    all.push_back(more);
  for (const std::string& words : all)
    for (const double now : {0.1125, 0.25}) {
      INFO(words);
      const PrescribedMotion early{words};
      PrescribedMotion late{words};
      late.begin(now);
      CHECK(norm(late.at(now).displacement) == 0.0);
      CHECK(late.at(now).angle == 0.0);
      const dembark::WallReach all = late.reach(now, now + 1.0);
      const bool given = words.find("start") != std::string::npos;
      const WallState from = early.at(now);
      for (double s = 0.0; s < 1.0; s += 0.0171) {
        // Without a start of their own terms start then, others go on as they would have.
        const WallState here = late.at(now + s), same = early.at(given ? now + s : s);
        CHECK(norm(here.displacement - (same.displacement - (given ? 1.0 : 0.0) * from.displacement)) < 1e-14);
        CHECK(std::abs(here.angle - (same.angle - (given ? from.angle : 0.0))) < 1e-13);
        CHECK(norm(here.velocity - same.velocity) < 1e-12);
        CHECK(std::abs(here.rate - same.rate) < 1e-12);
        CHECK((here.displacement.x > all.low.x - 1e-3 && here.displacement.z < all.high.z + 1e-3));
      }
      // The speed of the half step before: what has no start has always been going on, oscillations begin.
      CHECK(norm(late.step(now - 1e-6, 1e-6).velocity - early.step(given ? now - 1e-6 : -1e-6, 1e-6).velocity) < 1e-9);
      // Once more from the beginning, as after a restart.
      late.begin(now);
      CHECK(norm(late.at(now).displacement) == 0.0);
    }
  std::remove(name.c_str());
  PrescribedMotion ends{std::string("uniform velocity 0 0 1 until 0.1")};
  CHECK_THROWS_WITH(ends.begin(0.2), "motion uniform: until 0.1 s must be later than start 0.2 s");
}

TEST_CASE("wall motion: the bounds of a point that turns hold, and are reached", "[motion]") {
  const Vec3<double> point{0.3, -0.2, 0.1};
  for (const char* words : {"rotation point 0.1 0.2 0.3 axis 1 2 3 rate 2", "rotation point 0 0 0 axis 0 0 1 rate 90",
                            "rocking point 0 0.1 0 axis 0 1 0 angle 0.4 frequency 3 ramp 0 phase 1",
                            "rotation point 0 0 0 axis 0 1 0 rate -1 acceleration 3 uniform velocity 0.1 0 -0.2",
                            "rocking point 0 0.1 0 axis 0 1 0 angle 0.4 frequency 30 ramp 2"}) {
    INFO(words);
    PrescribedMotion motion{std::string(words)};
    motion.begin(0.25);
    // As a mesh has it, at its place now.
    const double now = 0.35;
    const WallState then = motion.at(now);
    const dembark::WallFrame frame(motion, then);
    Vec3<double> low, high, least{1e9, 1e9, 1e9}, most = -1.0 * least;
    motion.bounds(point, then, motion.reach(now, now + 1.0), low, high);
    const Vec3<double> own = frame.inside(point);
    for (int k = 0; k <= 4000; ++k) {
      const WallState state = motion.at(now + k / 4000.0);
      const Vec3<double> place = motion.centre(state) + dembark::WallFrame(motion, state).outside(own - motion.centre({}));
      least = {std::min(least.x, place.x), std::min(least.y, place.y), std::min(least.z, place.z)};
      most = {std::max(most.x, place.x), std::max(most.y, place.y), std::max(most.z, place.z)};
    }
    const Vec3<double> below = least - low, above = high - most;
    const double room = std::string(words).find("uniform") == std::string::npos ? 1e-3 : 0.3;
    for (const double gap : {below.x, below.y, below.z, above.x, above.y, above.z}) {
      CHECK(gap > -1e-5);
      CHECK(gap < room);
    }
  }
}

TEST_CASE("wall motion: what is wrong is told in one line", "[motion]") {
  CHECK(message("").find("there is no motion ''; it is harmonic") == 0);
  CHECK(message("harmonic frequency 2") == "motion harmonic: amplitude is missing; it has amplitude, frequency, phase, ramp, start, until");
  CHECK(message("harmonic amplitude 0 0 1 frequency 0") == "motion harmonic: frequency 0 must be > 0");
  CHECK(message("harmonic amplitude 0 0 one frequency 1") == "motion harmonic: amplitude 'one' is not a number");
  CHECK(message("harmonic amplitude 0 0 nan frequency 1") == "motion harmonic: amplitude 'nan' is not a number");
  CHECK(message("harmonic amplitude 0 0 0 frequency 1") == "motion harmonic: its amplitude is zero");
  CHECK(message("harmonic amplitude 0 0 1 frequency 1 frequency 2") == "motion harmonic: frequency is given twice");
  CHECK(message("harmonic amplitude 0 0") == "motion harmonic: amplitude must have 3 numbers");
  CHECK(message("harmonic amplitude 0 0 1 frequency 2 until 3").find("later than start 0 s by both ramps, 10 s") != std::string::npos);
  CHECK(message("uniform velocity 0 0 1 start 2 until 1").find("later than start") != std::string::npos);
  CHECK(message("rotation point 0 0 0 axis 0 0 0 rate 1").find("axis must be a vector") != std::string::npos);
  CHECK(message("rotation point 0 0 0 axis 0 0 1 rate 1 rocking point 0 0 0 axis 1 0 0 angle 1 frequency 1").find("same point and axis") !=
        std::string::npos);
  CHECK(message("jolts shape square acceleration 1 0 0 duration 1").find("half_sine, constant or rising") != std::string::npos);
  CHECK(message("jolts shape constant acceleration 1 0 0 duration 1 interval 0.5").find("at least the duration") != std::string::npos);
  CHECK(message("jolts shape constant acceleration 1 0 0 duration 1 count 1.5").find("whole number") != std::string::npos);
  CHECK(message("jolts shape constant acceleration 1 0 0 duration 1 signs +x").find("of + and -") != std::string::npos);
  CHECK(message("table file no/such.csv") == "motion table: file 'no/such.csv' cannot be read");
  const PrescribedMotion fast{std::string("harmonic amplitude 0 0 1 frequency 2000")};
  CHECK(fast.step_error(4e-5).empty());
  CHECK(fast.step_error(6e-5) == "its shortest period, 0.0005 s, is below ten time steps of 6e-05 s: take a shorter step");
}

TEST_CASE("wall motion: a clock is exact to the step, and goes on when the step changes", "[motion]") {
  MotionClock clock;
  clock.begin(0.0, 0, 1000000, 1e-5);
  CHECK(clock.begun == 1000000 * 1e-5);
  CHECK(clock.time(1000000, 1e-5) == 1000000 * 1e-5);
  CHECK(clock.time(1000001, 1e-5) == 1000001 * 1e-5);
  CHECK_THAT(clock.time(1000001, 2e-5), WithinAbs(10.00001, 1e-14));
  CHECK_THAT(clock.time(1000003, 2e-5), WithinAbs(10.00005, 1e-14));
  // What has begun does not begin again; an engine whose step was another one before has a time of its own.
  clock.begin(0.0, 0, 1000003, 2e-5);
  CHECK(clock.begun == 1000000 * 1e-5);
  MotionClock late;
  late.begin(0.1, 10000, 12000, 5e-6);
  CHECK_THAT(late.begun, WithinAbs(0.11, 1e-15));
  CHECK_THAT(late.time(14000, 5e-6), WithinAbs(0.12, 1e-15));
}

TEST_CASE("wall motion: power is that of forces and torques, and the surface's acceleration turns the mean velocities of steps",
          "[motion]") {
  const PrescribedMotion motion{
      std::string("rotation point 1 0 0 axis 0 0 1 rate 2 acceleration 3 uniform velocity 1 0 0 acceleration 0 4 0")};
  const double t = 0.3, h = 1e-4;
  const WallState state = motion.at(t);
  const Vec3<double> centre = motion.centre(state), place{1.5, 0.7, 0.2}, force{1.0, -2.0, 0.5};
  WallLoad load;
  load.add(place - centre, force, {});
  const Vec3<double> surface = state.velocity + cross(state.rate * motion.axis(), place - centre);
  CHECK_THAT(wall_power(load, state, motion.axis()), WithinAbs(dot(force, surface), 1e-14));
  // Of quadratic motion differences are exact.
  const WallAcceleration change = wall_acceleration(motion, t, h);
  CHECK_THAT(norm(change.linear - Vec3<double>{0.0, 4.0, 0.0}), WithinAbs(0.0, 1e-7));
  CHECK_THAT(norm(change.angular - Vec3<double>{0.0, 0.0, 3.0}), WithinAbs(0.0, 1e-7));
  WallSums sums;
  sums.begin(1.0, {1.0, 0.0, 0.0});
  sums.step(0.5, 3.0, {3.0, 0.0, 2.0});
  CHECK(sums.work == 1.0);
  CHECK(sums.impulse.x == 1.0);
  CHECK(sums.impulse.z == 0.5);
}
