// Numbers of mathematics, rounded to double.
#pragma once

namespace dembark {

constexpr double pi = 3.14159265358979323846;
constexpr double two_pi = 6.28318530717958647693;
constexpr double three_pi = 9.42477796076937971539;

}  // namespace dembark
