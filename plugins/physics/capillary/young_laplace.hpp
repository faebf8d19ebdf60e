// Axisymmetric liquid bridge between two equal spheres: the family of solutions of Young and Laplace, and the stable one of given
// volume and gap.
//
// Lengths in sphere radii R, force in gamma R, pressure in gamma/R. With the meridian r(t) from the neck (t = 0) to the contact line,
// t arc length, p the pressure inside minus outside, r0 the neck radius, the first integral
//   r sin(phi) = C + p r^2/2,   C = r0 - p r0^2/2,   phi the slope against the radius,   F = 2 pi C
// (Orr, Scriven & Rivas, J. Fluid Mech. 67 (1975) 723) makes r^2 harmonic in t:
//   r^2 = r0^2 + 4 (1 - p r0) sin^2(p t/2) / p^2.
// A whole bridge is therefore fixed by two pure numbers, the phase k = p t_c at the contact line and the slenderness a = r0/t_c: they
// give the slope there, slope = half-filling angle beta + contact angle, and sin(beta) = r_c the size. No case (nodoid, catenoid,
// unduloid, cylinder, sphere, neck or bulge) is singular in (k, a), and all integrands are smooth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace dembark::capillary {

/// A bridge that satisfies Young and Laplace, in units of R and gamma.
struct BridgeShape {
  bool valid = false;  ///< the contact line lies on the spheres
  double gap = 0.0;    ///< surface to surface; negative where the spheres would overlap
  double volume = 0.0;
  double force = 0.0;  ///< positive = attractive
  double neck_radius = 0.0;
  double half_filling_angle = 0.0;  ///< rad
  double pressure = 0.0;            ///< inside minus outside
  double energy = 0.0;              ///< liquid-gas area - cos(theta) * wetted area; force = d energy / d gap at constant volume
};

/// Coordinates of the family: phase k, and ln(a) so that sizes of any magnitude are alike.
struct ShapeCoordinates {
  double phase = 0.0, log_slenderness = 0.0;
};
/// From `a` a part of the way to `b`, or on beyond it.
inline ShapeCoordinates between(const ShapeCoordinates& a, const ShapeCoordinates& b, double part) {
  return {a.phase + part * (b.phase - a.phase), a.log_slenderness + part * (b.log_slenderness - a.log_slenderness)};
}

namespace detail {

/// One step of a damped Newton method: the first of x' = moved_by(1), moved_by(1/2), ... whose residual is smaller. False: there is none.
template <class Coordinates, class Residual, class Move, class Evaluate>
bool damped_step(Coordinates& x, Residual& f, Move moved_by, Evaluate residual) {
  for (double part = 1.0; part > 1e-3; part *= 0.5) {
    const Coordinates y = moved_by(part);
    const Residual next = residual(y);
    if (!(next.valid && next.norm() < f.norm())) continue;
    x = y;
    f = next;
    return true;
  }
  return false;
}

constexpr double pi = 3.14159265358979323846;

/// Positive half of the Gauss-Legendre rule with 2 n points; the integrands are even in the arc length.
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

/// Height 1 - cos(beta) of the cap wetted up to half-filling angle beta, without cancellation.
inline double cap_height(double beta) {
  const double s = std::sin(0.5 * beta);
  return 2.0 * s * s;
}

}  // namespace detail

/// The bridge at coordinates `c` for contact angle `theta` (rad).
inline BridgeShape bridge_shape(const ShapeCoordinates& c, double theta) {
  static const detail::EvenGauss<20> rule;
  const double k = c.phase, a = std::exp(c.log_slenderness);
  const double spread = 1.0 - k * a;
  // r sin(phi) = C + k r^2/2, with the large terms of a thin ring of liquid (|k| a >> 1) cancelled by hand.
  const auto moment = [&](double arc2) { return a + 0.5 * k * spread * arc2; };
  double height = 0.0, revolved = 0.0, area = 0.0;
  for (std::size_t i = 0; i < rule.node.size(); ++i) {
    const double t = rule.node[i], arc = t * detail::sinc(0.5 * k * t), arc2 = arc * arc;
    const double r2 = a * a + spread * arc2;
    if (!(r2 > 0.0)) return {};
    const double r = std::sqrt(r2), rise = moment(arc2) / r;
    height += rule.weight[i] * rise;
    revolved += rule.weight[i] * rise * r2;
    area += rule.weight[i] * r;
  }
  const double end = detail::sinc(0.5 * k), r2 = a * a + spread * end * end;
  if (!(r2 > 0.0)) return {};
  const double beta = std::atan2(moment(end * end), spread * detail::sinc(k)) - theta;
  if (!(beta > 0.0 && beta < detail::pi)) return {};
  const double scale = std::sin(beta) / std::sqrt(r2);  // t_c in sphere radii
  const double cap = detail::cap_height(beta);
  BridgeShape b;
  b.gap = 2.0 * (scale * height - cap);
  b.volume = 2.0 * detail::pi * (scale * scale * scale * revolved - cap * cap * (3.0 - cap) / 3.0);
  b.force = 2.0 * detail::pi * scale * (a - 0.5 * k * a * a);
  b.neck_radius = scale * a;
  b.half_filling_angle = beta;
  b.pressure = k / scale;
  b.energy = 4.0 * detail::pi * (scale * scale * area - std::cos(theta) * cap);
  b.valid = height > 0.0 && b.volume > 0.0;
  return b;
}

/// Solutions of one contact angle (rad). Every solver takes a nearby start and leaves the solution in it.
class YoungLaplace {
 public:
  explicit YoungLaplace(double theta) : theta_(theta) {}

  BridgeShape shape(const ShapeCoordinates& c) const { return bridge_shape(c, theta_); }

  /// Start of the touching bridge of a small volume: the ring between osculating paraboloids.
  ShapeCoordinates small_touching(double volume) const {
    const double beta = std::pow(2.0 * volume / detail::pi, 0.25);
    const double span = 0.5 * detail::pi - theta_ - beta;
    const double arc = 0.5 * beta * beta / detail::sinc(span);
    const double neck = beta - 0.5 * span * arc;
    return {arc / neck - span, std::log(neck / arc)};
  }

  /// Bridge of given volume and gap; false when Newton's method does not get there.
  bool solve(double volume, double gap, ShapeCoordinates& x) const {
    constexpr double h = 1e-6, wanted = 1e-11, round_off = 1e-8;
    Residual f = residual(x, volume, gap);
    for (int iteration = 0; f.valid && iteration < 60; ++iteration) {
      if (f.norm() < wanted) return true;
      const Residual kp = residual({x.phase + h, x.log_slenderness}, volume, gap),
                     km = residual({x.phase - h, x.log_slenderness}, volume, gap);
      const Residual lp = residual({x.phase, x.log_slenderness + h}, volume, gap),
                     lm = residual({x.phase, x.log_slenderness - h}, volume, gap);
      if (!(kp.valid && km.valid && lp.valid && lm.valid)) return false;
      const double a = (kp.volume - km.volume) / (2 * h), b = (lp.volume - lm.volume) / (2 * h);
      const double c = (kp.height - km.height) / (2 * h), d = (lp.height - lm.height) / (2 * h);
      const double determinant = a * d - b * c;
      const double dk = -(d * f.volume - b * f.height) / determinant, dl = -(a * f.height - c * f.volume) / determinant;
      if (!std::isfinite(dk) || !std::isfinite(dl)) return false;
      const auto moved_by = [&](double part) { return ShapeCoordinates{x.phase + part * dk, x.log_slenderness + part * dl}; };
      if (!detail::damped_step(x, f, moved_by, [&](const ShapeCoordinates& y) { return residual(y, volume, gap); })) break;
    }
    return f.valid && f.norm() < round_off;
  }

  /// From the touching bridge along the branch of constant volume to where it ceases to be stable: to its largest gap, where it meets the
  /// unstable branch, or to the gap where liquid begins to drain to one of the spheres, whichever comes first. `path`, when given,
  /// receives the steps from there (without the start).
  bool rupture(double volume, ShapeCoordinates& x, std::vector<ShapeCoordinates>* path = nullptr) const {
    constexpr double longest = 0.08;
    Direction d = direction(x);
    if (d.stretch < 0.0) d.reverse();
    double step = longest;
    for (int count = 0; d.valid && count < 5000; ++count) {
      ShapeCoordinates y = moved(x, d, step);
      Direction next;
      if (onto_volume(volume, y)) next = direction(y);
      if (next.along(d) < 0.0) next.reverse();
      // A small bridge runs close to the edge beta = 0 of the family, which a long straight step may cross.
      if (!next.valid || next.along(d) < 0.98) {
        step *= 0.5;
        if (step < 1e-6) return false;
        continue;
      }
      if (next.margin() <= 0.0) {
        if (!refine(volume, x, d, step, next.margin())) return false;
        if (path) path->push_back(x);
        return true;
      }
      x = y;
      d = next;
      step = std::min(longest, 1.5 * step);
      if (path) path->push_back(x);
    }
    return false;
  }

 private:
  // Logarithms make the residuals, and with them the tolerances, relative for bridges of any size.
  struct Residual {
    bool valid = false;
    double volume = 0.0, height = 0.0;
    double norm() const { return std::hypot(volume, height); }
  };

  // Unit direction of constant volume, the growth of the gap along it, and how far the bridge is from swaying. The meridian shifted along
  // itself keeps volume and gap to first order; with slope phi and sin(b) = r at its end it also keeps the contact angles where
  // d(phi - b)/dt = 0. There a branch of asymmetric bridges leaves the symmetric one, which is not stable beyond. Between planes (b = 0)
  // this is an inflection at the contact line (Vogel, Discrete Contin. Dyn. Syst. Suppl. 2005, 862). `steadiness` is -d(phi - b)/dt without
  // the factor 1 - p r0 of all derivatives along the meridian, which is 0 for a cylinder.
  struct Direction {
    bool valid = false;
    double phase = 0.0, log_slenderness = 0.0, stretch = 0.0, steadiness = 0.0;
    double margin() const { return std::min(stretch, steadiness); }
    void reverse() { phase = -phase, log_slenderness = -log_slenderness, stretch = -stretch; }
    double along(const Direction& o) const { return phase * o.phase + log_slenderness * o.log_slenderness; }
  };

  struct Gradients {
    bool valid = false;
    double volume[2] = {}, gap[2] = {};  // of ln(volume) and of the gap
  };

  double theta_;

  Residual residual(const ShapeCoordinates& x, double volume, double gap) const {
    const BridgeShape b = shape(x);
    if (!b.valid) return {};
    const double cap = detail::cap_height(b.half_filling_angle);
    return {true, std::log(b.volume / volume), std::log((cap + 0.5 * b.gap) / (cap + 0.5 * gap))};
  }

  static ShapeCoordinates moved(const ShapeCoordinates& x, const Direction& d, double step) {
    return {x.phase + step * d.phase, x.log_slenderness + step * d.log_slenderness};
  }

  Gradients gradients(const ShapeCoordinates& x) const {
    constexpr double h = 1e-6;
    const BridgeShape kp = shape({x.phase + h, x.log_slenderness}), km = shape({x.phase - h, x.log_slenderness});
    const BridgeShape lp = shape({x.phase, x.log_slenderness + h}), lm = shape({x.phase, x.log_slenderness - h});
    if (!(kp.valid && km.valid && lp.valid && lm.valid)) return {};
    return {true,
            {std::log(kp.volume / km.volume) / (2 * h), std::log(lp.volume / lm.volume) / (2 * h)},
            {(kp.gap - km.gap) / (2 * h), (lp.gap - lm.gap) / (2 * h)}};
  }

  Direction direction(const ShapeCoordinates& x) const {
    const Gradients g = gradients(x);
    const double length = std::hypot(g.volume[0], g.volume[1]);
    if (!(g.valid && length > 0.0)) return {};
    Direction d{true, -g.volume[1] / length, g.volume[0] / length, 0.0, 0.0};
    d.stretch = g.gap[0] * d.phase + g.gap[1] * d.log_slenderness;
    const double beta = shape(x).half_filling_angle, k = x.phase, end = detail::sinc(0.5 * k);
    d.steadiness = std::cos(beta) * (std::exp(x.log_slenderness) - 0.5 * k * end * end) + std::sin(beta) * detail::sinc(k);
    return d;
  }

  bool onto_volume(double volume, ShapeCoordinates& x) const {
    for (int iteration = 0; iteration < 30; ++iteration) {
      const BridgeShape b = shape(x);
      if (!b.valid) return false;
      const double f = std::log(b.volume / volume);
      if (std::fabs(f) < 1e-11) return true;
      const Gradients g = gradients(x);
      if (!g.valid) return false;
      const double factor = f / (g.volume[0] * g.volume[0] + g.volume[1] * g.volume[1]);
      x.phase -= factor * g.volume[0];
      x.log_slenderness -= factor * g.volume[1];
    }
    return false;
  }

  // The bridge is stable at x and not (`at_high` < 0) a step ahead of it; the last stable one goes to x.
  bool refine(double volume, ShapeCoordinates& x, const Direction& d, double step, double at_high) const {
    const ShapeCoordinates from = x;
    double low = 0.0, high = step, at_low = d.margin();
    for (int iteration = 0; iteration < 60 && high - low > 1e-9; ++iteration) {
      double middle = 0.5 * (low + high);
      // Regula falsi alone may keep one end for ever; every third step halves.
      if (iteration % 3 != 2) middle = low + (high - low) * at_low / (at_low - at_high);
      x = moved(from, d, middle);
      if (!onto_volume(volume, x)) return false;
      Direction here = direction(x);
      if (!here.valid) return false;
      if (here.along(d) < 0.0) here.reverse();
      const double margin = here.margin();
      if (margin > 0.0) low = middle, at_low = margin;
      else high = middle, at_high = margin;
      if (margin == 0.0) break;
    }
    return true;
  }
};

}  // namespace dembark::capillary
