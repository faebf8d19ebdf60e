// Equation of state of a weakly compressible liquid, after Tait, and the energy that compression stores.
//
//   p = B [(rho/rho_0)^gamma - 1],  B = rho_0 c_0^2 / gamma                                              (1)
//   e = integral_(rho_0)^rho p/rho^2 drho = B/rho_0 [(x^(gamma - 1) - 1)/(gamma - 1) + 1/x - 1],  x = rho/rho_0
//   p <= rho_0 c_0^2/10                                                                                                   (2)
//
// J. J. Monaghan, J. Comput. Phys. 110 (1994) 399, eqs. (4.1), (4.2). c_0 is ten times the largest speed or more, so that the density
// varies by 1 % or less; it is not the speed of sound in water. Without `tension` the pressure is 0 below rho_0 (and e, too): particles
// that leave a free surface do not pull on each other. With it closed vessels can be filled.
//
// (2) is the water hammer of c_0/10, the largest speed that c_0 is meant for; beyond it the pressure stays. Only particles that solids
// squeeze get there: one that is caught between a heavy body and a floor, where water would run out, else carries the body alone, is
// compressed until (1) is too stiff for any step, and is shot out with the body's energy.
//
// Limits: gamma = 1 is p = c_0^2 (rho - rho_0); small compression the same for any gamma. Units SI.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "../message_text.hpp"

namespace dembark::sph {

struct Tait {
  double density = 1000.0;    ///< rho_0, kg/m^3, > 0
  double sound_speed = 10.0;  ///< c_0, m/s, > 0
  double gamma = 7.0;         ///< >= 1
  bool tension = false;       ///< keep negative pressures

  /// The one clear line about what is wrong with these parameters, or nullptr.
  const char* error() const {
    if (!(density > 0.0) || std::isinf(density)) return "density must be a number > 0 (kg/m^3)";
    if (!(sound_speed > 0.0) || std::isinf(sound_speed)) return "sound_speed must be a number > 0 (m/s)";
    if (!(gamma >= 1.0) || std::isinf(gamma)) return "gamma must be a number >= 1";
    return nullptr;
  }

  double stiffness() const { return density * sound_speed * sound_speed / gamma; }
  /// The largest pressure, Pa.
  double hammer() const { return 0.1 * density * sound_speed * sound_speed; }

  /// p (Pa) at the density rho (kg/m^3).
  double pressure(double rho) const {
    if (!tension && rho <= density) return 0.0;
    return std::min(unlimited(rho), hammer());
  }
  /// rho at the pressure p > -B, the inverse of (1).
  double density_at(double p) const { return density * std::pow(1.0 + p / stiffness(), 1.0 / gamma); }

  /// e (J/kg).
  double energy(double rho) const {
    if (!tension && rho <= density) return 0.0;
    const double most = unlimited(rho) > hammer() ? density_at(hammer()) : rho, x = most / density;
    const double stored = gamma == 1.0 ? std::log(x) : (std::pow(x, gamma - 1.0) - 1.0) / (gamma - 1.0);
    return stiffness() / density * (stored + 1.0 / x - 1.0) + (most < rho ? hammer() * (1.0 / most - 1.0 / rho) : 0.0);
  }

 private:
  /// (1).
  double unlimited(double rho) const {
    const double x = rho / density;
    // The usual exponents without std::pow.
    if (gamma == 7.0) {
      const double cube = x * x * x;
      return stiffness() * (cube * cube * x - 1.0);
    }
    return stiffness() * ((gamma == 1.0 ? x : std::pow(x, gamma)) - 1.0);
  }
};

/// rho at a pressure p (Pa) that a user gives. Throws std::invalid_argument with one line for one that no density has.
inline double initial_density(const Tait& state, double p) {
  if (p > -state.stiffness()) return state.density_at(p);
  throw std::invalid_argument("a pressure must be > -" + number_text(state.stiffness()) + " Pa (density sound_speed^2/gamma), not " +
                              number_text(p) + " Pa");
}

}  // namespace dembark::sph
