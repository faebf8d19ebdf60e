// Liquid that is carried by grains and walls, lent to bridges and given back: who gives how much, who gets how much back.
//
// Every holder (a grain, a wall) owns a volume L of liquid. A contact without a bridge asks both sides for a share of what they own:
//
//   cap       c/2 (1 - sqrt(1 - Rj^2 / (Ri + Rj)^2)) of Li: the film on the cap of i that faces j, the cone from the centre of i around j
//             (Shi & McCarthy, Powder Technology 184 (2008) 64, in the form that the model easo/capillary/viscous of LIGGGHTS takes);
//             c/2 against a wall. With c = 1 the caps of touching spheres do not overlap: their shares add up to 1 at most
//   fraction  c of Li, whatever the radii. c = 1 and a largest volume: the rule of the liquid migration models of MercuryDPM
//
// All shares that one step asks of a holder are summed, D. Each is granted L / max(1, D) times its share: no more is taken than is there,
// and the order of the contacts does not matter. A bridge may be limited to a largest volume; the rest stays where it was.
// A bridge is split again when it breaks: into halves, by the radii, or into what each side gave. The part that would go to i is fixed
// when the bridge forms, so each side can tally its own (liquid_ledger.hpp). SI units; nothing here knows an engine.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "../message_text.hpp"

namespace dembark::capillary {

/// Radius of a wall in the functions below.
template <class Real>
inline constexpr Real flat = std::numeric_limits<Real>::infinity();

/// Part (0...1/2) of the surface of a sphere that faces a touching sphere of radius `other`; 1/2 if that is flat.
template <class Real>
inline Real cap_share(Real radius, Real other) {
  using std::sqrt;
  if (!(other < flat<Real>)) return Real(0.5);
  const Real larger = std::max(radius, other), own = radius / larger, its = other / larger;  // no overflow
  const Real sine = its / (own + its), cosine = sqrt(own * (own + Real(2) * its)) / (own + its);
  return Real(0.5) * sine * sine / (Real(1) + cosine);  // 1 - cosine without cancellation
}

/// The names that users write, in the order of ShareRule::Kind.
inline std::vector<std::string> share_names() { return {"cap", "fraction"}; }

/// What a new bridge asks of one side.
struct ShareRule {
  enum class Kind { cap, fraction };
  Kind kind = Kind::cap;
  double factor = 1.0;  // c above: 0...2 of the cap, 0...1 as a fraction

  /// Whether there is a kind of that name, which then holds.
  bool set_kind(const std::string& name) { return option_from_name(share_names(), name, kind); }
  /// Nullptr, or what is wrong.
  const char* error() const {
    if (kind == Kind::cap) return factor > 0.0 && factor <= 2.0 ? nullptr : "the factor of the facing cap must lie in (0, 2]";
    return factor > 0.0 && factor <= 1.0 ? nullptr : "the fraction of the liquid must lie in (0, 1]";
  }
  /// Share of its liquid that a grain of `radius` is asked for by a bridge to `other` (flat: a wall).
  template <class Real>
  Real operator()(Real radius, Real other) const {
    return Real(factor) * (kind == Kind::cap ? cap_share(radius, other) : Real(1));
  }
};

/// How the liquid of a broken bridge is split.
enum class Return { equal, radius, taken };

/// The names that users write, in the order of `Return`.
inline std::vector<std::string> return_names() { return {"equal", "radius", "taken"}; }

/// Volume (m^3) that a holder of `liquid` gives per unit share when the shares asked of it in one step add up to `demand`.
template <class Real>
inline Real grant(Real liquid, Real demand) {
  return demand > Real(1) ? liquid / demand : liquid;
}

/// What is left of `liquid` after `amount`; the last bit of a sum of grants does not make it negative.
template <class Real>
inline Real remaining(Real liquid, Real amount) {
  return std::max(liquid - amount, Real(0));
}

/// A bridge as it forms. `imbalance`: what i gets back when it breaks less what j gets; it changes sign when i and j change places.
template <class Real>
struct NewBridge {
  Real volume, from_i, from_j, imbalance;
};

/// Part of a broken bridge that goes to i; with the imbalance negated, to j.
template <class Real>
inline Real returned(Real volume, Real imbalance) {
  return Real(0.5) * (volume + imbalance);
}

/// Bridge of two sides that give `given_i` and `given_j` (share times grant) and hold `largest` at most. For Return::radius the part of i
/// is Ri / (Ri + Rj). Both sides swapped give the same volume bit for bit.
template <class Real>
inline NewBridge<Real> form_bridge(Real given_i, Real given_j, Real radius_i, Real radius_j, Return rule, Real largest = flat<Real>) {
  NewBridge<Real> bridge{given_i + given_j, given_i, given_j, Real(0)};
  if (bridge.volume > largest) {
    const Real scale = largest / bridge.volume;
    bridge.from_i *= scale;
    bridge.from_j *= scale;
    bridge.volume = bridge.from_i + bridge.from_j;
  }
  if (rule == Return::taken) bridge.imbalance = bridge.from_i - bridge.from_j;
  if (rule == Return::radius) bridge.imbalance = bridge.volume * ((radius_i - radius_j) / (radius_i + radius_j));
  return bridge;
}

/// Bridge of a grain and a wall that keeps the part `wall_part` (0...1) of it when it breaks; with Return::taken what it gave.
template <class Real>
inline NewBridge<Real> form_wall_bridge(Real given_i, Real given_wall, Real wall_part, Return rule, Real largest = flat<Real>) {
  NewBridge<Real> bridge = form_bridge(given_i, given_wall, Real(1), Real(1), rule, largest);
  if (rule != Return::taken) bridge.imbalance = bridge.volume * (Real(1) - Real(2) * wall_part);
  return bridge;
}

/// The two sides of a contact: a grain, and another grain or a wall by its number.
struct BridgeSides {
  int grain = 0, other = 0;
  bool wall = false;

  bool operator<(const BridgeSides& b) const { return std::tie(wall, grain, other) < std::tie(b.wall, b.grain, b.other); }
};

/// A touching contact without a bridge. Engines derive from it what they need to find the contact again.
struct BridgeRequest {
  BridgeSides sides;
  double radius = 0.0, other_radius = 0.0;  // m; of a wall `flat`

  bool operator<(const BridgeRequest& r) const { return sides < r.sides; }
};

/// A bridge that broke. `imbalance`: as in NewBridge.
struct BrokenBridge {
  BridgeSides sides;
  double volume = 0.0, imbalance = 0.0;

  bool operator<(const BrokenBridge& b) const { return std::tie(sides, volume, imbalance) < std::tie(b.sides, b.volume, b.imbalance); }
};

/// Liquid (m^3) that a grain of `radius` gathers from others, of radius `other`, that keep `liquid` each: with it bridges between them give
/// back to each side what they took from it. Return::taken moves no liquid.
inline double gathered(const ShareRule& share, Return split, double radius, double other, double liquid) {
  if (split == Return::taken) return 0.0;
  const double back = split == Return::radius ? radius / other : 1.0;
  return liquid * back * share(other, radius) / share(radius, other);
}

/// How wet grains are at most, from which the size of their bridges can be foreseen.
struct WettestGrains {
  double largest_radius = 0.0;  ///< m
  double volume = 0.0;          ///< m^3, the most on one grain
  double over_square = 0.0;     ///< m, the most over the square of the radius

  void add(double radius, double liquid) {
    volume = std::max(volume, liquid);
    if (radius > 0.0) over_square = std::max(over_square, liquid / (radius * radius));
  }

  /// Volume (m^3) of a bridge between grains of these radii (m; `other` flat: a wall). Liquid gathers on some grains: twice as much as now
  /// is foreseen, of which a bridge to a grain may take as much as one to a wall.
  double likely_bridge(const ShareRule& share, Return split, double radius, double other) const {
    const double partner = other < flat<double> ? other : radius;
    const auto liquid = [&](double r) {
      return std::min(volume, std::max(over_square * r * r, gathered(share, split, r, largest_radius, volume)));
    };
    const double own = liquid(radius), its = liquid(partner);
    const double pair = share(radius, partner) * own + share(partner, radius) * its;
    return 2.0 * std::min(std::max(pair, share(radius, flat<double>) * std::min(own, its)), std::max(own, its));
  }
};

}  // namespace dembark::capillary
