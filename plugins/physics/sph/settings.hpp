// What a run of the solver is made with.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string>
#include <tuple>

#include "contact_potential.hpp"
#include "kernels.hpp"
#include "shifting.hpp"
#include "state.hpp"
#include "vector.hpp"
#include "wall.hpp"

namespace dembark::sph {

struct Settings {
  int dimension = 3;       ///< 2 (the plane z = 0, per metre of depth) or 3
  double spacing = 0.0;    ///< dx, m, > 0: of the lattice that the fluid began as
  double smoothing = 1.3;  ///< h/dx, 0.8 ... 3
  Tait state{};
  double alpha = 0.02;  ///< of the artificial viscosity, >= 0
  double delta = 0.1;   ///< of the diffusion of density, 0 ... 0.5
  Vector gravity{};     ///< m/s^2
  KernelName kernel = KernelName::wendland_c2;
  Boundary boundary = Boundary::extrapolated;
  bool no_slip = false;  ///< viscosity acts between fluid and solid particles, too
  Shifting shifting{0.0};
  ContactPotential contact{};  ///< if on: bodies that are no walls act on the fluid by it alone
  double skin = 0.2;           ///< over h: neighbours are searched anew when particles have moved half of it
  int threads = 1;
  double slit_pressure = 1.0;  ///< xi of the films in slits, 0 ... 1

  double h() const { return smoothing * spacing; }
  /// Of a particle, kg (in the plane kg/m).
  double mass() const { return state.density * std::pow(spacing, dimension); }
  /// Largest stable time step (s) of sound: the highest frequency of the lattice is below 2.2 c_0/h, and 2 over it is the limit of the
  /// scheme, kick - drift - kick; viscosity and diffusion take some of it.
  double longest_step() const { return 0.6 * h() / state.sound_speed; }

  /// The one clear line about a step of dt (s) that is not stable; "": it is.
  std::string step_error(double dt) const {
    const double most = longest_step();
    if (dt > 0.0 && dt <= most * (1.0 + 1e-9)) return "";
    return "the time step must be > 0 and at most 0.6 h/sound_speed = " + std::to_string(1e3 * most) + " ms, not " +
           std::to_string(1e3 * dt) + " ms";
  }

  /// Name of a setting that has another value in `other`, or nullptr. Without gravity, which engines keep.
  const char* difference(const Settings& other) const {
    static constexpr const char* names[] = {
        "dimension", "spacing", "smoothing", "density",           "sound_speed",      "gamma", "tension", "alpha",        "delta", "kernel",
        "boundary",  "no_slip", "shifting",  "contact_stiffness", "contact_exponent", "skin",  "threads", "slit_pressure"};
    const auto values = [](const Settings& s) {
      return std::tie(s.dimension, s.spacing, s.smoothing, s.state.density, s.state.sound_speed, s.state.gamma, s.state.tension, s.alpha,
                      s.delta, s.kernel, s.boundary, s.no_slip, s.shifting.coefficient, s.contact.stiffness, s.contact.exponent, s.skin,
                      s.threads, s.slit_pressure);
    };
    static_assert(std::tuple_size_v<decltype(values(other))> == std::size(names));
    return std::apply(
        [&](const auto&... mine) {
          return std::apply(
              [&](const auto&... others) {
                const char* found = nullptr;
                std::size_t k = 0;
                ((found = !found && mine != others ? names[k] : found, ++k), ...);
                return found;
              },
              values(other));
        },
        values(*this));
  }
  /// The one clear line about what is wrong with these settings, or nullptr.
  const char* error() const {
    if (dimension != 2 && dimension != 3) return "dimension must be 2 or 3";
    if (!(spacing > 0.0) || std::isinf(spacing)) return "spacing must be a number > 0 (m)";
    if (!(smoothing >= 0.8 && smoothing <= 3.0)) return "smoothing (h over the spacing) must be between 0.8 and 3";
    if (const char* const wrong = state.error()) return wrong;
    if (!(alpha >= 0.0 && alpha <= 1.0)) return "alpha must be between 0 and 1";
    if (!(delta >= 0.0 && delta <= 0.5)) return "delta must be between 0 and 0.5";
    if (!std::isfinite(gravity.x + gravity.y + gravity.z)) return "gravity must be finite (m/s^2)";
    if (dimension == 2 && gravity.z != 0.0) return "gravity must have no z in the plane";
    if (const char* const wrong = shifting.error()) return wrong;
    if (const char* const wrong = contact.error()) return wrong;
    if (!(skin > 0.0 && skin <= 2.0)) return "skin (over h) must be > 0 and at most 2";
    if (!(slit_pressure >= 0.0 && slit_pressure <= 1.0)) return "slit_pressure must be between 0 and 1";
    if (threads < 1) return "threads must be 1 or more";
    return nullptr;
  }
};

}  // namespace dembark::sph
