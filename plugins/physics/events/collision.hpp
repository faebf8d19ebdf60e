// A collision of hard grains, or of a grain with a wall: an impulse, without duration.
//
// Normal: the speed v at which the surfaces approach is turned into e(v) v. e is constant, or
//     e(v) = 1 - (1 - e0) min(1, v / v0)^p;
// p = 3/4 and v0 = sqrt(g d): vibrated layers of C. Bizon, M. D. Shattuck, J. B. Swift, W. D. McCormick, H. L. Swinney, Phys. Rev. Lett. 80
// (1998) 57; p = 1/5: leading term of viscoelastic spheres, R. Ramirez, T. Poeschel, N. V. Brilliantov, T. Schwager, Phys. Rev. E 60 (1999)
// 4465.
//
// Tangential, O. R. Walton & R. L. Braun, J. Rheol. 30 (1986) 949; S. F. Foerster, M. Y. Louge, H. Chang, K. Allia, Phys. Fluids 6 (1994)
// 1108: a contact that sticks turns the slip u into -beta u; one that would need more than mu times the normal impulse for that slides,
// with this impulse against the slip. beta = -1: smooth, 0: no slip afterwards, 1: slip reversed without loss.
//
// Energy: the loss is m_n (v^2 - v'^2) / 2 + m_t (u^2 - u'^2) / 2 with the reduced mass m_n of the pair and m_t = m_n / (1 + 1/q), where
// q = I / (m r^2) is the same for both grains: 2/5 for spheres, 1/2 for discs.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "../message_text.hpp"
#include "../vec3.hpp"

namespace dembark::events {

typedef Vec3<double> Vector;

struct CollisionLaw {
  double restitution = 1.0;             ///< e, 0 ... 1; e0 where it depends on the speed
  double restitution_speed = 0.0;       ///< m/s, v0; 0: e is constant
  double restitution_exponent = 0.75;   ///< p, above 0
  double friction = 0.0;                ///< mu, 0 or more; infinite: never slides
  double tangential_restitution = 0.0;  ///< beta, -1 ... 1

  /// One line about a number out of its range, or nothing.
  std::string error() const {
    if (!(restitution >= 0.0 && restitution <= 1.0)) return "restitution must be between 0 and 1, not " + number_text(restitution);
    if (!(restitution_speed >= 0.0 && std::isfinite(restitution_speed)))
      return "restitution_speed must be >= 0 m/s and finite, not " + number_text(restitution_speed);
    if (!(restitution_exponent > 0.0 && std::isfinite(restitution_exponent)))
      return "restitution_exponent must be > 0 and finite, not " + number_text(restitution_exponent);
    if (!(friction >= 0.0)) return "friction must be >= 0, not " + number_text(friction);
    if (!(tangential_restitution >= -1.0 && tangential_restitution <= 1.0))
      return "tangential_restitution must be between -1 and 1, not " + number_text(tangential_restitution);
    return "";
  }

  /// e at the speed of approach (m/s).
  double at(double speed) const {
    if (restitution_speed == 0.0 || restitution == 1.0) return restitution;
    return 1.0 - (1.0 - restitution) * std::pow(std::min(1.0, speed / restitution_speed), restitution_exponent);
  }
};

struct Collision {
  Vector impulse;                                 ///< N s, on the first; the second gets the opposite
  double normal = 0.0;                            ///< N s, its normal part
  double normal_loss = 0.0, friction_loss = 0.0;  ///< J
};

/// normal: unit vector from the second to the first; velocity (m/s): of the first's surface, seen from the second's; mass (kg): m_n;
/// shape: q; elastic: e = 1; least (m/s): the surfaces part at this speed at least, which keeps rounded numbers from approaching still.
inline Collision collide(const CollisionLaw& law, const Vector& normal, const Vector& velocity, double mass, double shape, bool elastic,
                         double least) {
  const double opening = dot(velocity, normal), approach = std::max(0.0, -opening);
  const double parting = std::max({elastic ? approach : law.at(approach) * approach, least, opening});
  Collision c;
  c.normal = mass * (parting - opening);
  c.normal_loss = 0.5 * mass * (opening * opening - parting * parting);
  c.impulse = c.normal * normal;
  if (law.friction == 0.0) return c;
  const Vector slip = velocity - opening * normal;
  const double speed = norm(slip), inert = mass * shape / (1.0 + shape);
  const double sticking = inert * (1.0 + law.tangential_restitution) * speed, tangential = std::min(sticking, law.friction * c.normal);
  if (!(tangential > 0.0)) return c;
  c.impulse -= (tangential / speed) * slip;
  const double left = speed - tangential / inert;
  c.friction_loss = 0.5 * inert * (speed * speed - left * left);
  return c;
}

}  // namespace dembark::events
