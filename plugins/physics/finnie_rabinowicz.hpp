// Tangential contact force after Finnie and Rabinowicz.
//
// This is a reconstruction from what the two authors published; no source was found that writes the law under both names.
//
// Rabinowicz: friction falls from its static to its kinetic value over a critical slip distance s_c,
//     mu(s) = mu_k + (mu_s - mu_k) exp(-s / s_c),                                            (1)
// s the slip accumulated since the contact last stuck; a contact that sticks again heals, s -> 0, at once or with a
// healing time. E. Rabinowicz, J. Appl. Phys. 22 (1951) 1373; Proc. Phys. Soc. 71 (1958) 668.
//
// Finnie & Shaw: the real area of contact saturates towards the apparent one, A_r / A = 1 - exp(-mu N / (tau_s A)), and the
// interface carries no more than its shear strength tau_s,
//     T_max = tau_s A [1 - exp(-mu(s) N / (tau_s A))].                                       (2)
// I. Finnie & M. C. Shaw, Trans. ASME 78 (1956) 1649. Low pressure: Coulomb, mu N; high pressure: tau_s A.
//
// Below the limit a Mindlin spring of stiffness k_t with the elastic displacement xi kept in the contact plane; at the limit
// return mapping, the excess displacement goes to s and to dissipated energy. The pre-sliding curve is
//     linear        T = k_t xi, or
//     exponential   dT = k_t (du - T |du| / T_max), under monotone loading T = T_max (1 - exp(-k_t u / T_max))
//                   (P. R. Dahl, AIAA J. 14 (1976) 1675), or
//     partial slip  of a Hertzian contact, with its loading history: partial_slip.hpp.
//
// Ingredients switch off: mu_k = mu_s gives Coulomb friction, tau_s >= unlimited_strength no saturation, and both together with
// `linear` the law of LIGGGHTS's `tangential history`.
//
// Units SI. N is the repulsive force of the normal law (>= 0), with its dash-pot or, with `friction_limit elastic`, of its spring alone.
// With both, adhesion acts through the larger overlap that it causes.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "exponential.hpp"
#include "vec3.hpp"

namespace dembark {

/// Shear strengths from here on (Pa) mean that the interface has no limit of its own; also +inf.
constexpr double unlimited_strength = 1e30;

enum class Presliding { linear, exponential, partial_slip };
/// Their names, in their order.
inline std::vector<std::string> presliding_names() { return {"linear", "exponential", "partial_slip"}; }

/// What N is: the normal force with its dash-pot, or that of the spring alone.
enum class FrictionLimit { total, elastic };
/// Their names, in their order.
inline std::vector<std::string> friction_limit_names() { return {"total", "elastic"}; }

struct FinnieRabinowicz {
  double static_friction = 0.5;                          ///< mu_s, >= mu_k
  double kinetic_friction = 0.5;                         ///< mu_k, >= 0
  double critical_slip_distance = 1e-5;                  ///< s_c, m, >= 0; 0 drops to mu_k with the first slip
  double interface_shear_strength = unlimited_strength;  ///< tau_s, Pa, > 0
  double healing_time = 0.0;                             ///< s, >= 0; time constant of s -> 0 while the contact sticks; 0 = at once
  Presliding presliding = Presliding::linear;
  FrictionLimit friction_limit = FrictionLimit::total;

  /// What is wrong with these numbers, or nullptr, for those who do not read them by the table of parameters.
  const char* error() const {
    if (!(static_friction >= 0.0) || std::isinf(static_friction)) return "static friction must be a number >= 0";
    if (!(kinetic_friction >= 0.0)) return "kinetic friction must be a number >= 0";
    if (kinetic_friction > static_friction) return "kinetic friction must not exceed static friction";
    if (!(critical_slip_distance >= 0.0)) return "critical slip distance (m) must be >= 0";
    if (!(interface_shear_strength > 0.0)) return "interface shear strength (Pa) must be > 0; 1e30 or more means unlimited";
    if (!(healing_time >= 0.0)) return "healing time (s) must be >= 0";
    return nullptr;
  }
};

/// What an engine stores per contact.
template <class Real>
struct FrictionState {
  Vec3<Real> displacement{};  ///< xi = -T / k_t on body 1, m, in the contact plane
  Real slip{};                ///< s, m
  Real dissipated_energy{};   ///< J, by slip and by tangential damping, since the contact began
};

/// mu(s), equation (1). `Law` here and below: FinnieRabinowicz, or those of its members that are used as packs.
template <class Law, class Real>
DEMBARK_HOT Real friction_coefficient(const Law& law, Real slip) {
  const Real kinetic = law.kinetic_friction, at_rest = law.static_friction;
  Real mu = select(slip > 0.0, kinetic, at_rest);
  // Far beyond s_c what is left, exp(-40) = 4e-18, is below the rounding of the drop.
  const auto falling = (slip > 0.0) & (slip < 40.0 * law.critical_slip_distance);
  if (any(falling)) mu = select(falling, kinetic + (at_rest - kinetic) * exponential(-slip / law.critical_slip_distance), mu);
  return mu;
}

/// T_max (N), equation (2), for a friction coefficient mu.
template <class Real>
DEMBARK_FUNCTION inline Real shear_limit(const FinnieRabinowicz& law, Real mu, Real normal_force, Real contact_area) {
  using std::expm1;
  if (!(normal_force > 0.0)) return Real(0.0);
  const Real coulomb = mu * normal_force;
  if (law.interface_shear_strength >= unlimited_strength) return coulomb;
  const Real strength = law.interface_shear_strength * contact_area;
  if (!(strength > 0.0)) return Real(0.0);
  return -strength * expm1(-coulomb / strength);
}

namespace detail {

/// The return to the limit curve: the slip ds >= 0 for which k_t (xi - ds) = T_max(s + ds), where the interface has no limit of its own;
/// `coefficient` is mu(s). The residual is concave, so Newton's method descends to its last root from any place beyond it. Where the spring
/// is softer than the drop of friction it thus takes the whole drop at once, as a quasi-static contact does.
template <class Law, class Real, class Truth>
DEMBARK_HOT Real slip_to_coulomb(const Law& law, Real k_t, Real trial, Real slip, Real coefficient, Real normal_force, Truth wanted) {
  const Real kinetic = law.kinetic_friction, drop = law.static_friction - kinetic;
  const Real load = select(normal_force > 0.0, normal_force, Real(0.0));
  // The largest possible slip, to the kinetic limit.
  Real ds = trial - kinetic * load / k_t;
  auto open = wanted & (drop > 0.0) & (slip < 40.0 * law.critical_slip_distance);
  if (!any(open)) return select(ds > 0.0, ds, Real(0.0));
  const Real per_distance = Real(1.0) / law.critical_slip_distance;
  // The tangent at the present slip meets zero beyond the root, too: mostly close to it, for the slip of a step is short beside s_c.
  Real slope = load * (coefficient - kinetic) * per_distance - k_t;
  const Real on_tangent = (coefficient * load - k_t * trial) / slope;
  ds = select(open & (slope < 0.0) & (on_tangent < ds), on_tangent, ds);
  for (int i = 0; i < 32 && any(open); ++i) {
    const Real weakening = drop * exponential(-(slip + ds) * per_distance), gradient = load * weakening * per_distance;
    slope = gradient - k_t;
    const Real step = (k_t * (trial - ds) - (kinetic + weakening) * load) / slope;
    open = open & (slope < 0.0);
    ds = select(open, ds - step, ds);
    // The method doubles the digits: what it leaves is the square of the step times half the curvature over the slope.
    open = open & (step * step > 1e-30 * trial * trial) & (0.5 * step * step * gradient * per_distance > -1e-17 * trial * slope);
  }
  return select(ds > 0.0, ds, Real(0.0));
}

/// The same with any interface. Beside a shear strength the residual need not be concave everywhere, and the search begins at the largest
/// possible slip.
DEMBARK_FUNCTION inline double slip_to_limit(const FinnieRabinowicz& law, double k_t, double trial, double slip, double normal_force,
                                             double contact_area) {
  if (law.interface_shear_strength >= unlimited_strength)
    return slip_to_coulomb(law, k_t, trial, slip, friction_coefficient(law, slip), normal_force, true);
  const double kinetic_limit = shear_limit(law, law.kinetic_friction, normal_force, contact_area);
  double ds = trial - kinetic_limit / k_t;
  const double drop = law.static_friction - law.kinetic_friction;
  if (drop == 0.0 || law.critical_slip_distance == 0.0) return ds;
  for (int i = 0; i < 32; ++i) {
    const double weakening = drop * exponential(-(slip + ds) / law.critical_slip_distance);
    const double mu = law.kinetic_friction + weakening;
    const double limit = shear_limit(law, mu, normal_force, contact_area);
    const double gradient = -normal_force * weakening / law.critical_slip_distance *
                            std::exp(-mu * normal_force / (law.interface_shear_strength * contact_area));
    const double slope = -k_t - gradient;
    if (!(slope < 0.0)) break;
    const double step = (k_t * (trial - ds) - limit) / slope;
    ds = std::max(ds - step, 0.0);
    if (std::abs(step) <= 1e-15 * trial) break;
  }
  return std::max(ds, 0.0);
}

}  // namespace detail

/// The share of its slip that a contact keeps when it sticks for `dt` (s).
template <class Real>
DEMBARK_FUNCTION inline Real kept_slip(const FinnieRabinowicz& law, Real dt) {
  using std::exp;
  return law.healing_time > 0.0 ? exp(-dt / law.healing_time) : Real(0.0);
}

/// Turn the elastic displacement with the contact plane: into the plane of the new normal, then about the normal by the mean spin
/// of the two bodies (`twist` = omega_n dt, rad). Its length stays as it is, so a pair that rotates as a rigid body keeps its
/// force; its direction is exact for a displacement along or across the motion of the normal and right to second order in the
/// angle of one step otherwise, without a stored normal. Unit normal.
template <class Real>
DEMBARK_HOT Vec3<Real> rotate_to_plane(Vec3<Real> v, const Vec3<Real>& normal, Real twist) {
  using std::sqrt;
  const Real size = dot(v, v);
  const Real out_of_plane = dot(v, normal);
  const Real lost = out_of_plane * out_of_plane;
  const Real t = 0.5 * twist, t2 = t * t;
  Real factor = 2.0 * (1.0 - t2 * (1.0 - t2));
  const auto twisted = !(t2 < 1e-6);
  if (any(twisted)) factor = select(twisted, 2.0 / (1.0 + t2), factor);
  const Vec3<Real> turned = (factor * t) * cross(normal, v);
  v -= out_of_plane * normal;
  Real length = 1.0;
  // What follows stands in the innermost loop of an engine: the small angles of one step need no square root, and below 1e-7 rad
  // no correction. A normal that jumps by more than 60 degrees is no rotation of one contact: the projection is all there is.
  const auto tilted = lost > 1e-14 * size;
  if (any(tilted)) {
    const Real q = lost / size;
    length = select(tilted & (q < 1e-5), 1.0 + q * (0.5 + q * (0.375 + q * 0.3125)), length);
    const auto far = tilted & !(q < 1e-5) & (q < 0.75);
    if (any(far)) length = select(far, 1.0 / sqrt(1.0 - q), length);
  }
  return (length * (1.0 - factor * t2)) * v + length * turned;
}

namespace detail {

/// A step of the exponential pre-sliding curve. Exact for the straight path of one step: T relaxes towards T_max along it.
template <class Real>
DEMBARK_COLD Vec3<Real> exponential_step(const FinnieRabinowicz& law, Real normal_force, Real stiffness, Real contact_area,
                                         const Vec3<Real>& increment, Real dt, FrictionState<Real>& state) {
  using std::exp;
  const Real path = norm(increment);
  const Vec3<Real> before = stiffness * state.displacement;
  if (path > 0.0 && dot(before, increment) < 0.0) state.slip *= kept_slip(law, dt);
  const Real limit = shear_limit(law, friction_coefficient(law, state.slip), normal_force, contact_area);
  if (!(limit > 0.0)) {
    state.displacement = {};
    state.slip += path;
    return {};
  }
  Vec3<Real> force = before;
  if (path > 0.0) {
    const Vec3<Real> direction = increment * (1.0 / path);
    force = limit * direction + exp(-stiffness * path / limit) * (before - limit * direction);
    // |T| / T_max of the path is plastic; the work of T on it is the energy lost.
    const Vec3<Real> mean = 0.5 * (before + force);
    const Real share = norm(mean) / limit;
    state.dissipated_energy += share * share * limit * path;
    if (dot(mean, direction) > 0.0) state.slip += share * path;
  }
  const Real size = norm(force);
  if (size > limit) {  // load or friction have fallen since the force was built up: the spring lets go
    state.dissipated_energy += 0.5 * (size * size - limit * limit) / stiffness;
    force *= limit / size;
  }
  state.displacement = force * (1.0 / stiffness);
  return -force;
}

/// Whether a contact slid in its last step. Without a healing time every sticking step forgets the slip; with one, sliding shows in a
/// spring at its limit, give or take what damping makes of the normal force.
template <class Real>
DEMBARK_COLD bool was_sliding(const FinnieRabinowicz& law, Real normal_force, Real stiffness, Real contact_area,
                              const FrictionState<Real>& state) {
  if (law.healing_time == 0.0) return true;
  return stiffness * norm(state.displacement) > 0.99 * shear_limit(law, friction_coefficient(law, state.slip), normal_force, contact_area);
}

/// What a contact that slips by `slip` of its spring's `trial` length (m) does to its state. Lost is the work of the step less what the
/// spring gained: the mean of its force before and after, along the slip. Where friction drops faster than the spring follows, that
/// includes what the spring lets go.
template <class Real>
DEMBARK_HOT FrictionState<Real> slipped(const FrictionState<Real>& state, Real slip, Real trial, Real stiffness,
                                        const Vec3<Real>& increment) {
  const Vec3<Real> slid = state.displacement * (slip / trial), before = state.displacement - increment, after = state.displacement - slid;
  const Real lost = 0.5 * stiffness * dot(before + after, slid);
  return {after, state.slip + slip, state.dissipated_energy + select(lost > 0.0, lost, Real(0.0))};
}

}  // namespace detail

/// Which of the `wanted` linear springs slip, of interfaces without a limit of their own; `moved` is what the states of these become. The
/// others stick.
template <class Law, class Real, class Truth>
DEMBARK_HOT Truth coulomb_slip(const Law& law, Real normal_force, Real stiffness, const Vec3<Real>& increment, Truth wanted,
                               const FrictionState<Real>& state, FrictionState<Real>& moved) {
  using std::sqrt;
  const Real coefficient = friction_coefficient(law, state.slip);
  const Real limit = coefficient * select(normal_force > 0.0, normal_force, Real(0.0));
  const Real trial = sqrt(dot(state.displacement, state.displacement));
  const Truth slips = wanted & (stiffness * trial > limit);
  if (!any(slips)) return slips;
  const Real slip = detail::slip_to_coulomb(law, stiffness, trial, state.slip, coefficient, normal_force, slips);
  moved = detail::slipped(state, slip, trial, stiffness, increment);
  return slips;
}

namespace detail {

/// The same with any interface, one contact at a time.
DEMBARK_COLD inline bool linear_slip(const FinnieRabinowicz& law, double normal_force, double stiffness, double contact_area,
                                     const Vec3<double>& increment, FrictionState<double>& state) {
  if (law.interface_shear_strength >= unlimited_strength) {
    FrictionState<double> moved;
    const bool slips = coulomb_slip(law, normal_force, stiffness, increment, true, state, moved);
    if (slips) state = moved;
    return slips;
  }
  const double limit = shear_limit(law, friction_coefficient(law, state.slip), normal_force, contact_area);
  const double trial = norm(state.displacement);
  if (!(stiffness * trial > limit)) return false;
  state = slipped(state, slip_to_limit(law, stiffness, trial, state.slip, normal_force, contact_area), trial, stiffness, increment);
  return true;
}

}  // namespace detail

/// T_max (N) of a contact that has not slipped, where the interface has no limit of its own.
template <class Law, class Real>
DEMBARK_HOT Real first_limit(const Law& law, Real normal_force) {
  return law.static_friction * select(normal_force > 0.0, normal_force, Real(0.0));
}

/// Whether a linear spring, displaced already, sticks without a doubt. Most contacts of a dense bed do, far from their limit: they are
/// told by a bound that needs neither root nor exponential, T_max >= mu_k N (1 - mu_k N / (2 tau_s A)).
template <class Law, class Real>
DEMBARK_HOT auto plainly_sticks(const Law& law, Real normal_force, Real stiffness, Real contact_area, const FrictionState<Real>& state) {
  const Real coulomb = select(state.slip > 0.0, Real(law.kinetic_friction), Real(law.static_friction)) * normal_force;
  Real bound = coulomb;
  const auto limited = law.interface_shear_strength < unlimited_strength;
  if (any(limited)) {
    const Real strength = law.interface_shear_strength * contact_area;
    bound = select(limited, select(coulomb < strength, coulomb - 0.5 * coulomb * coulomb / strength, Real(0.0)), bound);
  }
  return (bound > 0.0) & (stiffness * stiffness * dot(state.displacement, state.displacement) < bound * bound * (1.0 - 1e-8));
}

/// The force (N) on body 1 of a linear spring, displaced already, while it sticks: it keeps the share `kept` of its slip, and what its
/// dash-pot takes is booked.
template <class Real>
DEMBARK_HOT Vec3<Real> sticking_force(Real stiffness, Real damping, const Vec3<Real>& velocity, Real dt, Real kept,
                                      FrictionState<Real>& state) {
  state.slip *= kept;
  state.dissipated_energy += damping * dot(velocity, velocity) * dt;
  return -(stiffness * state.displacement + damping * velocity);
}

/// One step of the law.
///
/// normal_force  N, N (negative values count as 0)     stiffness  k_t, N/m, > 0      damping  gamma_t, N s/m (0 = none)
/// contact_area  A, m^2                                 velocity   tangential velocity of body 1 relative to 2 at the contact, m/s
/// dt            s: the displacement of this step is velocity * dt
///
/// `state.displacement` must already lie in the contact plane (rotate_to_plane). Returns the force on body 1 (N) and updates the
/// state. The viscous part acts while the contact sticks.
template <class Real>
DEMBARK_HOT Vec3<Real> friction_step(const FinnieRabinowicz& law, Real normal_force, Real stiffness, Real damping, Real contact_area,
                                     const Vec3<Real>& velocity, Real dt, FrictionState<Real>& state) {
  const Vec3<Real> increment = velocity * dt;
  if (law.presliding == Presliding::exponential)
    return detail::exponential_step(law, normal_force, stiffness, contact_area, increment, dt, state);

  // An engine asks again, in a step of zero length, for the forces of a moment (set-up of a run, output of contacts). The dash-pot of
  // a contact that slides stays out then as it did in the step.
  if (dt == 0.0 && state.slip > 0.0) {
    const FrictionState<Real> copy = state;
    if (detail::was_sliding(law, normal_force, stiffness, contact_area, copy)) return -stiffness * state.displacement;
  }

  state.displacement += increment;
  if (!plainly_sticks(law, normal_force, stiffness, contact_area, state) &&
      detail::linear_slip(law, normal_force, stiffness, contact_area, increment, state))
    return -stiffness * state.displacement;
  return sticking_force(stiffness, damping, velocity, dt, state.slip > 0.0 ? kept_slip(law, dt) : Real(0.0), state);
}

}  // namespace dembark
