// Particles as the loops read them, and what becomes of the loops' sums: the same for every adapter and for the solver.
#pragma once

#include <algorithm>
#include <string>

#include "../keyword_reader.hpp"
#include "ledger.hpp"
#include "loops.hpp"
#include "settings.hpp"

namespace dembark::sph {

/// Of a fluid particle for the rates of density: diffusion acts on what the weight of still water does not explain (pair_terms.hpp).
inline Record density_record(const Settings& s, const Vector& x, const Vector& v, double rho, double p) {
  const Vector stratified = (s.state.density / (s.state.sound_speed * s.state.sound_speed)) * s.gravity;
  return {x.x, x.y, x.z, rho - s.state.density - dot(stratified, x), v.x, v.y, v.z, p / (rho * rho)};
}

/// Of a solid particle for the rates of density.
inline Record solid_record(const Vector& x, const Vector& v) { return {x.x, x.y, x.z, 0.0, v.x, v.y, v.z, 0.0}; }

/// For forces and for the sums at walls; v: of a solid particle the velocity that viscosity meets.
inline Record force_record(const Vector& x, const Vector& v, double rho, double p) {
  return {x.x, x.y, x.z, p / (rho * rho), v.x, v.y, v.z, rho};
}

/// Fills up rows: beyond the reach of all.
inline Record far_record(const Vector& far) { return {far.x, far.y, far.z, 0.0, 0.0, 0.0, 0.0, 1.0}; }

/// Density of the solid at the pressure p (Pa). Deep under tension no density has this pressure: the wall's is that of the fluid at rest.
inline double wall_density(const Tait& state, double p) {
  return p != 0.0 && p > -0.5 * state.stiffness() ? state.density_at(p) : state.density;
}

/// Density of a dynamic boundary particle after dt (s) at the rate (kg/m^3/s). Walls do not pull.
inline double boundary_density(const Settings& s, double rho, double rate, double dt) {
  return std::max(rho + dt * rate, s.state.tension ? 0.0 : s.state.density);
}

/// Numbers of the kernel and the particles that all loops use.
struct LoopNumbers {
  PairCoefficients pair{};
  double at_spacing = 1.0;  ///< W(dx)
  double spray = 0.0;       ///< kg/m^3, the lowest density without tension
  double moment = 1.0;      ///< of the lattice
};

/// Density of a fluid particle after dt (s) at the rate (kg/m^3/s). Without tension nothing holds what flies apart, and errors of steps and
/// diffusion would carry the density of spray below zero, where viscosity, which divides by it, is without bounds and of any sign; a
/// particle that comes to a wall so thin gets no pressure there and falls through it. Hence the lowest density is (rho_0 + m W(0))/2: a
/// particle gains (rho_0 - m W(0))/2 on its way to the first place of a lattice on a flat wall or surface, and has rho_0 there, as those
/// that the surface began with. Without pressure this costs no energy.
inline double fluid_density(const Settings& s, const LoopNumbers& numbers, double rho, double rate, double dt) {
  const double next = rho + dt * rate;
  return s.state.tension ? next : std::max(next, numbers.spray);
}

/// First half of a step of dt (s) of a fluid particle, up to where the forces are computed: kick by `kick` (m/s), drift, and its shift (m).
inline void first_half(Vector& x, Vector& v, const Vector& kick, const Vector& shift, double dt) {
  v += kick;
  x += dt * v + shift;
}

/// Fluid that is not has blown up; nor is a speed that is no number.
inline bool slower_than_sound(const Settings& s, const Vector& v) { return dot(v, v) <= s.state.sound_speed * s.state.sound_speed; }
/// What a message says of a particle that moves so.
inline std::string too_fast(const Settings& s, const Vector& v) {
  return "moves at " + keywords::text(norm(v)) + " m/s, faster than sound (" + keywords::text(s.state.sound_speed) +
         " m/s); take a larger sound_speed, a shorter step or thicker walls";
}

/// Adds the energies of a fluid particle.
inline void add_energies(const Settings& s, const Vector& x, const Vector& v, double rho, Energies& e) {
  e.kinetic += 0.5 * s.mass() * dot(v, v);
  e.potential -= s.mass() * dot(s.gravity, x);
  e.compression += s.mass() * s.state.energy(rho);
}

/// Calls work(kernel) with the kernel of the settings.
template <class Work>
auto with_kernel(const Settings& s, const Work& work) {
  if (s.kernel == KernelName::wendland_c2) return work(WendlandC2(s.dimension, s.h()));
  return work(CubicSpline(s.dimension, s.h()));
}

inline LoopNumbers loop_numbers(const Settings& s) {
  return with_kernel(s, [&](const auto& kernel) {
    const double moment = lattice_moment(kernel, s.dimension, s.h(), s.spacing);
    PairCoefficients pair = PairCoefficients::of(s.mass(), moment, s.h(), s.state.sound_speed, s.state.density, s.alpha, s.delta);
    if (s.boundary == Boundary::extrapolated) pair.guard = 0.25 * s.state.sound_speed * s.state.sound_speed / s.state.density;
    pair.reach = 0.9 * s.spacing;
    return LoopNumbers{pair, kernel.value(s.spacing), 0.5 * (s.state.density + s.mass() * kernel.value(0.0)), moment};
  });
}

}  // namespace dembark::sph
