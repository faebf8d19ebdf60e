// Axisymmetric liquid bridges without gravity between two spheres, or a sphere and a plane: the solutions of Young and Laplace.
//
// Lengths in R = 2 R* = 2 R1 R2 / (R1 + R2), the radius of equal spheres, force in gamma R, pressure in gamma/R. With arc length t, the
// meridian r(t), its slope phi against the radius and p the pressure inside minus outside, the first integral
//   r sin(phi) = C + p r^2/2,   F = 2 pi C
// (Orr, Scriven & Rivas, J. Fluid Mech. 67 (1975) 723) makes r^2 harmonic in t. In the coordinates below no case (nodoid, catenoid,
// unduloid, cylinder, sphere, neck or bulge) is singular, and all integrands are smooth.
#pragma once

#include <array>
#include <cmath>

#include "../constants.hpp"

namespace dembark::capillary {

/// What fixes a bridge; ratios and logarithms, so that sizes of any magnitude are alike.
using BridgeCoordinates = std::array<double, 3>;

/// From `a` a part of the way to `b`, or on beyond it.
inline BridgeCoordinates between(const BridgeCoordinates& a, const BridgeCoordinates& b, double part) {
  BridgeCoordinates c;
  for (int k = 0; k < 3; ++k) c[k] = a[k] + part * (b[k] - a[k]);
  return c;
}

/// A solution of Young and Laplace, in units of R and gamma.
struct BridgeShape {
  bool valid = false;  ///< the meridian stays off the axis, holds liquid and meets the spheres
  double miss = 0.0;   ///< 0 where it meets body 2 at the contact angle: then it is a bridge
  double gap = 0.0;    ///< surface to surface; negative where the spheres would overlap
  double caps = 0.0;   ///< height of both wetted caps; caps + gap is that of the bridge
  double volume = 0.0;
  double force = 0.0;               ///< positive = attractive
  double energy = 0.0;              ///< liquid-gas area - cos(theta) * wetted area; force = d energy / d gap at constant volume
  double half_filling_angle = 0.0;  ///< rad, of body 1
  double pressure = 0.0;            ///< inside minus outside
  double neck_radius = 0.0;         ///< between equal spheres
};

namespace detail {

/// Positive half of the Gauss-Legendre rule with 2 n points.
template <int n>
struct EvenGauss {
  std::array<double, n> node{}, weight{};
  EvenGauss() {
    const int count = 2 * n;
    for (int i = 0; i < n; ++i) {
      double x = std::cos(pi * (i + 0.75) / (count + 0.5)), slope = 1.0;
      for (int iteration = 0; iteration < 50; ++iteration) {
        double before = 1.0, here = x;
        for (int k = 2; k <= count; ++k) {
          const double next = ((2 * k - 1) * x * here - (k - 1) * before) / k;
          before = here;
          here = next;
        }
        slope = count * (x * here - before) / (x * x - 1.0);
        const double step = here / slope;
        x -= step;
        if (std::fabs(step) < 1e-15) break;
      }
      node[i] = x;
      weight[i] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
  }
};

inline double sinc(double x) { return std::fabs(x) < 1e-4 ? 1.0 - x * x / 6.0 : std::sin(x) / x; }

/// Cap of a sphere or a plane: height, volume, area from the radius of its rim and its half angle.
struct Cap {
  double height, volume, area;
  Cap(double rim, double half_angle)
      : height(rim * std::tan(0.5 * half_angle)),
        volume(pi * height * (3.0 * rim * rim + height * height) / 6.0),
        area(pi * (rim * rim + height * height)) {}
};

}  // namespace detail

/// Bridges between spheres of the curvatures 1 + e (body 1, the smaller) and 1 - e, with the asymmetry e = (R2 - R1) / (R1 + R2), 0 =
/// equal, 1 = a plane. With t from the contact line on body 1 (radius r1, slope phi1),
///   r^2 - r1^2 = 2 r1 cos(phi1) t sinc(p t) + (1 - p r1 sin(phi1)) t^2 sinc^2(p t/2) = D(t),     r sin(phi) = r1 sin(phi1) + p D/2.
/// A meridian is fixed by the half-filling angle b1 on body 1 (r1 = sin(b1) / (1 + e), phi1 = pi - b1 - theta), p L and its length L; it is
/// a bridge when it meets body 2 at the contact angle, sin(phi2 - theta) = (1 - e) r2. Coordinates: ln(b1 / (1 + e)), p L, ln(L).
class UnequalSpheres {
 public:
  static constexpr int first_free = 0;
  static constexpr double difference = 1e-7;
  static constexpr bool central = false;
  UnequalSpheres(double theta, double asymmetry) : theta_(theta), near_(1.0 + asymmetry), far_(1.0 - asymmetry) {}
  double contact_angle() const { return theta_; }

  BridgeShape shape(const BridgeCoordinates& x) const { return shape<16>(x); }

  /// From integrals of 2 `half` points.
  template <int half>
  BridgeShape shape(const BridgeCoordinates& x) const {
    static const detail::EvenGauss<half> rule;
    const double b1 = near_ * std::exp(x[0]), length = std::exp(x[2]), k = x[1], p = k / length;
    if (!(b1 < pi)) return {};
    const double r1 = std::sin(b1) / near_, rise1 = r1 * std::sin(b1 + theta_), run1 = -r1 * std::cos(b1 + theta_);
    const double spread = 1.0 - p * rise1;
    double height = 0.0, revolved = 0.0, area = 0.0;
    for (std::size_t i = 0; i < rule.node.size(); ++i)
      for (const double node : {-rule.node[i], rule.node[i]}) {
        const double part = 0.5 + 0.5 * node, t = length * part, s = detail::sinc(0.5 * k * part), c = std::cos(0.5 * k * part);
        const double d = t * s * (2.0 * run1 * c + spread * t * s), r2 = r1 * r1 + d;
        if (!(r2 > 0.0)) return {};
        const double r = std::sqrt(r2), rise = (rise1 + 0.5 * p * d) / r;
        height += rule.weight[i] * rise;
        revolved += rule.weight[i] * rise * r2;
        area += rule.weight[i] * r;
      }
    const double s = detail::sinc(0.5 * k), d = length * s * (2.0 * run1 * std::cos(0.5 * k) + spread * length * s), square = r1 * r1 + d;
    if (!(square > 0.0)) return {};
    const double rise2 = rise1 + 0.5 * p * d, run2 = run1 * std::cos(k) + spread * length * detail::sinc(k);
    const double r2 = std::sqrt(square), b2 = std::atan2(rise2, run2) - theta_;
    const detail::Cap cap1(r1, b1), cap2(r2, b2);
    BridgeShape b;
    b.miss = (std::sin(b2) - far_ * r2) / b1;
    b.caps = cap1.height + cap2.height;
    b.gap = 0.5 * length * height - b.caps;
    b.volume = 0.5 * pi * length * revolved - cap1.volume - cap2.volume;
    b.force = 2.0 * pi * (rise1 - 0.5 * p * r1 * r1);
    b.energy = pi * length * area - std::cos(theta_) * (cap1.area + cap2.area);
    b.half_filling_angle = b1;
    b.pressure = p;
    b.valid = b.volume > 0.0 && b.caps + b.gap > 0.0;
    return b;
  }

  /// No other branch crosses theirs: they are stable up to the largest gap.
  double steadiness(const BridgeCoordinates&) const { return HUGE_VAL; }

 private:
  double theta_, near_, far_;
};

/// Bridges between equal spheres, symmetric about their neck. With t from the neck and r0 its radius,
///   r^2 = r0^2 + 4 (1 - p r0) sin^2(p t/2) / p^2,   C = r0 - p r0^2/2,
/// so that two numbers fix a whole bridge: the phase k = p t_c at the contact line and the slenderness a = r0/t_c. They give the slope
/// there, half-filling angle beta + contact angle, and sin(beta) = r_c the size. Coordinates: 0, k, ln(a).
class EqualSpheres {
 public:
  static constexpr int first_free = 1;                            ///< of the coordinates
  static constexpr double difference = 1e-6;                      ///< of coordinates, for derivatives
  static constexpr bool central = true;                           ///< on both sides
  explicit EqualSpheres(double theta) : meridian_(theta, 0.0) {}  ///< contact angle in rad
  double contact_angle() const { return meridian_.contact_angle(); }

  /// The coordinates of the same bridge in UnequalSpheres; the first is no number where there is none.
  BridgeCoordinates among_unequal(const BridgeCoordinates& x) const {
    const double k = x[1], a = std::exp(x[2]), end = detail::sinc(0.5 * k);
    const double spread = 1.0 - k * a, r2 = a * a + spread * end * end;
    // r sin(phi) = C + k r^2/2, with the large terms of a thin ring of liquid (|k| a >> 1) cancelled by hand.
    const double beta = std::atan2(a + 0.5 * k * spread * end * end, spread * detail::sinc(k)) - contact_angle();
    return {std::log(beta), 2.0 * k, std::log(2.0 * std::sin(beta) / std::sqrt(r2))};
  }

  BridgeShape shape(const BridgeCoordinates& x) const {
    const BridgeCoordinates y = among_unequal(x);
    if (!std::isfinite(y[0] + y[2])) return {};
    BridgeShape b = meridian_.shape<20>(y);
    b.miss = 0.0;
    b.neck_radius = 0.5 * std::exp(y[2] + x[2]);
    return b;
  }

  /// How far the bridge is from swaying. The meridian shifted along itself keeps volume and gap to first order; with slope phi and
  /// sin(b) = r at its end it also keeps the contact angles where d(phi - b)/dt = 0. There a branch of asymmetric bridges leaves the
  /// symmetric one, which is not stable beyond. Between planes (b = 0) this is an inflection at the contact line (Vogel, Discrete Contin.
  /// Dyn. Syst. Suppl. 2005, 862). This is -d(phi - b)/dt without the factor 1 - p r0 of all derivatives along the meridian, which is 0 for
  /// a cylinder.
  double steadiness(const BridgeCoordinates& x) const {
    const double k = x[1], end = detail::sinc(0.5 * k), beta = std::exp(among_unequal(x)[0]);
    return std::cos(beta) * (std::exp(x[2]) - 0.5 * k * end * end) + std::sin(beta) * detail::sinc(k);
  }

  /// Start of the touching bridge of a small volume: the ring between osculating paraboloids.
  BridgeCoordinates small_touching(double volume) const {
    const double beta = std::pow(2.0 * volume / pi, 0.25);
    const double span = 0.5 * pi - contact_angle() - beta;
    const double arc = 0.5 * beta * beta / detail::sinc(span);
    const double neck = beta - 0.5 * span * arc;
    return {0.0, arc / neck - span, std::log(neck / arc)};
  }

 private:
  UnequalSpheres meridian_;
};

}  // namespace dembark::capillary
