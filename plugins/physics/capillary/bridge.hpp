// Capillary force of a pendular liquid bridge between two spheres, or a sphere and a wall.
//
//   exact         the stable axisymmetric bridge (equation of Young and Laplace, no gravity) between the spheres as they are, from tables
//                 built once: about 70 ms of one core for equal spheres, and 0.25 s more for unequal ones and walls.
//                 docs/theory/capillary.md has the errors. The tables span V/R^3 = 1e-9...1 and angles up to 90 degrees;
//                 smaller volumes go on by similarity, larger ones act as V/R^3 = 1
//   willett       closed form and
//   willett_full  regression of Willett, Adams, Johnson & Seville, Langmuir 16 (2000) 9396
//   rabinovich    Rabinovich, Esayanur & Moudgil, Langmuir 21 (2005) 10992
//   bagheri       Bagheri, Roy & Poeschel (2024), arXiv:2310.11485
//   constant      2 pi R gamma cos(theta) up to rupture
//
// R = 2 R* = 2 Ri Rj / (Ri + Rj); 2 Ri against a wall, an infinite Rj. The closed forms know this R alone. SI units. Positive = attractive.
// `exact` can push for contact angles near 90 degrees: a bridge that does not wet has its least area at a gap > 0. Rupture of `exact` is
// the gap where the bridge ceases to be stable (young_laplace.hpp), of `willett`, `willett_full` and `bagheri` Willett's, of `rabinovich`
// and `constant` Lian's distance.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../constants.hpp"
#include "bridge_table.hpp"
#include "closed_forms.hpp"
#include "liquid.hpp"

namespace dembark::capillary {

enum class Model { exact, willett, willett_full, rabinovich, bagheri, constant };

/// The names that users write, in the order of `Model`.
inline std::vector<std::string> model_names() { return {"exact", "willett", "willett_full", "rabinovich", "bagheri", "constant"}; }

/// False, and `model` as it was, for a name that is none of model_names().
inline bool model_from_name(const char* name, Model& model) { return name && option_from_name(model_names(), name, model); }

/// Evaluates the force law of one model and one contact angle: a plain value that may be copied to a device. BridgeLaw (bridge_law.hpp)
/// makes it and owns what `tables` points to.
class BridgeForce {
 public:
  ExactTables tables{};  ///< of the exact model

  DEMBARK_FUNCTION Model model() const { return model_; }
  DEMBARK_FUNCTION double contact_angle() const { return theta_; }

  /// Gap (m) beyond which there is no bridge of `volume` (m^3) between spheres of `radius_1` and `radius_2` (m; infinite = a wall).
  DEMBARK_FUNCTION double rupture_distance(double radius_1, double radius_2, double volume) const {
    const PairSize pair(radius_1, radius_2);
    const double v = pair.reduced(volume);
    return usable(v) ? pair.radius * reduced_rupture(v, pair.asymmetry) : 0.0;
  }

  /// Force (N) at `gap` (m; <= 0 counts as touching) for `volume` (m^3) and `surface_tension` (N/m); 0 beyond rupture and without liquid.
  DEMBARK_FUNCTION double force(double radius_1, double radius_2, double gap, double volume, double surface_tension) const {
    const PairSize pair(radius_1, radius_2);
    const double v = pair.reduced(volume);
    if (!usable(v)) return 0.0;
    const double scale = surface_tension * pair.radius, s = gap > 0.0 ? gap * pair.inverse : 0.0;
    if (model_ != Model::exact) return scale * reduced_closed_form(s, v);
    return scale * (gap > 0.0 ? tables.force(s, v, pair.asymmetry) : tables.touching_force(v, pair.asymmetry));
  }

 protected:
  /// Of an angle of 0...pi/2 (rad), without tables.
  BridgeForce(Model model, double contact_angle)
      : model_(model), theta_(contact_angle), sine_(std::sin(contact_angle)), cosine_(std::max(std::cos(contact_angle), 0.0)) {
    if (model == Model::willett_full) regression_ = WillettRegression(contact_angle);
    if (model == Model::bagheri) fit_ = BagheriFit(contact_angle);
  }

 private:
  struct PairSize {
    double inverse, radius, asymmetry;  // 1/R, R = 2 R*, |R2 - R1| / (R1 + R2)
    DEMBARK_FUNCTION PairSize(double radius_1, double radius_2) {
      const double curvature_1 = 1.0 / radius_1, curvature_2 = 1.0 / radius_2;
      inverse = 0.5 * (curvature_1 + curvature_2);
      radius = 1.0 / inverse;
      asymmetry = 0.5 * std::fabs(curvature_1 - curvature_2) * radius;
    }
    DEMBARK_FUNCTION double reduced(double volume) const { return volume * (inverse * inverse * inverse); }
  };
  // No liquid, or numbers that overflow or are none.
  DEMBARK_FUNCTION static bool usable(double v) { return v > 0.0 && v < 1e30; }

  Model model_;
  double theta_, sine_, cosine_;
  WillettRegression regression_;
  BagheriFit fit_;

  DEMBARK_FUNCTION double reduced_rupture(double v, double asymmetry = 0.0) const {
    switch (model_) {
      case Model::exact: return tables.rupture(v, asymmetry);
      case Model::rabinovich:
      case Model::constant: return lian_rupture(v, theta_);
      default: return willett_rupture(v, theta_);
    }
  }

  DEMBARK_FUNCTION double reduced_closed_form(double gap, double v) const {
    if (gap > 0.0 && gap > reduced_rupture(v)) return 0.0;
    switch (model_) {
      case Model::willett: return willett_force(gap, v, cosine_);
      case Model::willett_full: return regression_.force(gap, v);
      case Model::rabinovich: return rabinovich_force(gap, v, sine_, cosine_);
      case Model::bagheri: return fit_.force(gap, v);
      default: return two_pi * cosine_;
    }
  }
};

}  // namespace dembark::capillary
