// What a run of the solver is made with.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "contact_potential.hpp"
#include "kernels.hpp"
#include "moment.hpp"
#include "shifting.hpp"
#include "state.hpp"
#include "vector.hpp"
#include "wall.hpp"
#include "xsph.hpp"

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
  Xsph xsph{};
  int shepard = 0;  ///< steps from one filter of density to the next, 0: none
  Moment moment = Moment::lattice;

  double h() const { return smoothing * spacing; }
  /// Whether particles are displaced beyond what their velocities do.
  bool displaces() const { return shifting.coefficient > 0.0 || xsph.on(); }
  /// Whether the moments of the particles are computed.
  bool corrects() const { return moment == Moment::particles; }
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
    const std::pair<const char*, bool> all[] = {{"dimension", dimension != other.dimension},
                                                {"spacing", spacing != other.spacing},
                                                {"smoothing", smoothing != other.smoothing},
                                                {"density", state.density != other.state.density},
                                                {"sound_speed", state.sound_speed != other.state.sound_speed},
                                                {"gamma", state.gamma != other.state.gamma},
                                                {"tension", state.tension != other.state.tension},
                                                {"alpha", alpha != other.alpha},
                                                {"delta", delta != other.delta},
                                                {"kernel", kernel != other.kernel},
                                                {"boundary", boundary != other.boundary},
                                                {"no_slip", no_slip != other.no_slip},
                                                {"shifting", shifting.coefficient != other.shifting.coefficient},
                                                {"contact_stiffness", contact.stiffness != other.contact.stiffness},
                                                {"contact_exponent", contact.exponent != other.contact.exponent},
                                                {"skin", skin != other.skin},
                                                {"threads", threads != other.threads},
                                                {"slit_pressure", slit_pressure != other.slit_pressure},
                                                {"xsph", xsph.epsilon != other.xsph.epsilon},
                                                {"shepard", shepard != other.shepard},
                                                {"moment", moment != other.moment}};
    const auto found = std::find_if(std::begin(all), std::end(all), [](const auto& one) { return one.second; });
    return found == std::end(all) ? nullptr : found->first;
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
    if (const char* const wrong = xsph.error()) return wrong;
    if (shepard < 0) return "shepard (steps from one filter to the next) must be 0 or more";
    if (threads < 1) return "threads must be 1 or more";
    return nullptr;
  }
};

}  // namespace dembark::sph
