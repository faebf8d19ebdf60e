// LIGGGHTS adapter of capillary bridges with a volume of their own: fetches the contact, calls dembark/capillary/bridge.hpp, adds the
// force.
//
//   pair_style gran model hertz tangential ... cohesion capillary [capillary_model exact|willett|willett_full|rabinovich|bagheri|constant]
//
// Works compiled out of tree into liggghts-dembark and, unchanged, copied into a LIGGGHTS src/ folder.
#ifdef COHESION_MODEL
COHESION_MODEL(COHESION_CAPILLARY,capillary,20)
#else

#ifndef COHESION_MODEL_CAPILLARY_H_
#define COHESION_MODEL_CAPILLARY_H_

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "contact_models.h"
#include "cohesion_model_base.h"
#include "global_properties.h"
#include "neighbor.h"

#include "dembark/capillary/bridge.hpp"
#include "model_properties.h"
#include "settings_choice.h"

namespace LIGGGHTS {
namespace ContactModels {

template <>
class CohesionModel<COHESION_CAPILLARY> : public CohesionModelBase {
  struct PairLiquid {
    std::shared_ptr<const dembark::capillary::BridgeForce> force;
    double volume = 0.0;
  };
  int offset_;
  int model_ = 0;
  int types_ = 0;
  double surface_tension_ = 0.0;
  std::vector<PairLiquid> pairs_;  // one a pair of types, row by row
  std::map<double, std::shared_ptr<const dembark::capillary::BridgeForce>> built_;  // by mean contact angle

  static double other_radius(const SurfacesCloseData& d) { return d.is_wall ? INFINITY : d.radj; }

  void pull(const SurfacesCloseData& d, double force, const double* normal, ForceData& i_forces, ForceData& j_forces) const {
    const double scale = d.is_wall ? d.area_ratio : 1.0;
    for (int k = 0; k < 3; ++k) {
      i_forces.delta_F[k] -= scale * force * normal[k];
      if (!d.is_wall) j_forces.delta_F[k] += force * normal[k];
    }
  }

  // A bridge longer than the neighbour list looks would vanish without a word. `size`: r_i + r_j, r_i against a wall.
  void check_reach(double rupture_distance, double size, bool primitive_wall) const {
    char line[256];
    if (primitive_wall && rupture_distance > neighbor->skin) {
      // The engine keeps the grains near a primitive wall within the skin only.
      snprintf(line, sizeof line, "cohesion capillary: a bridge to a primitive wall reaches %g m but the neighbour skin is %g m; use neighbor %.3g bin",
               rupture_distance, neighbor->skin, 1.01 * rupture_distance);
      error->one(FLERR, line);
    }
    const double reach = (neighbor->contactDistanceFactor - 1.0) * size;
    if (rupture_distance <= reach) return;
    const double needed = 1.0 + rupture_distance / size;
    snprintf(line, sizeof line, "cohesion capillary: a bridge reaches %g m but neighbours are kept to %g m only; use neigh_modify contact_distance_factor %.3g",
             rupture_distance, reach, needed * 1.01);
    error->one(FLERR, line);
  }

 public:
  CohesionModel(LAMMPS* lmp, IContactHistorySetup* hsetup, class ContactModelBase* c) : CohesionModelBase(lmp, hsetup, c) {
    offset_ = hsetup->add_history_value("bridge_volume", "0");
    hsetup->add_history_value("bridge_rupture_distance", "0");
  }

  void registerSettings(Settings& settings) { dembark_liggghts::register_choice(settings, "capillary_model", model_, dembark::capillary::model_names()); }

  inline void postSettings(IContactHistorySetup*, ContactModelBase*) {}

  void connectToProperties(PropertyRegistry& registry) {
    dembark_liggghts::PropertyReader read(registry, modify, error, "cohesion capillary");
    dembark::capillary::Model model{};
    dembark::capillary::model_from_name(dembark::capillary::model_names()[model_].c_str(), model);
    types_ = read.types() + 1;
    pairs_.assign(types_ * types_, {});
    surface_tension_ = read.scalar("surfaceTension");
    if (!(surface_tension_ >= 0.0)) read.fail("surfaceTension (N/m) must be >= 0");
    double largest = 0.0;
    for (int i = 1; i < types_; ++i)
      for (int j = 1; j < types_; ++j) {
        PairLiquid& pair = pairs_[i * types_ + j];
        pair.volume = read.per_pair("bridgeVolume", i, j);
        if (!(pair.volume >= 0.0)) read.fail("bridgeVolume (m^3) must be >= 0 (types " + std::to_string(i) + "-" + std::to_string(j) + ")");
        const double angle = 0.5 * (read.per_type("contactAngle", i) + read.per_type("contactAngle", j));
        if (!(angle >= 0.0 && angle <= 0.5 * dembark::pi)) read.fail("contactAngle is in radians (stock models take degrees) and must lie in 0...pi/2; the mean of types " + std::to_string(i) + " and " + std::to_string(j) + " is " + std::to_string(angle));
        std::shared_ptr<const dembark::capillary::BridgeForce>& force = built_[angle];
        if (!force) force = std::make_shared<const dembark::capillary::BridgeForce>(model, angle);
        pair.force = force;
        const double r_min = registry.min_radius(), r_max = registry.max_radius();
        if (r_min > 0.0 && r_max < 1e10)
          for (const double r : {r_min, r_max})
            for (const double other : {r_min, r_max, static_cast<double>(INFINITY)}) largest = std::max(largest, force->rupture_distance(r, other, pair.volume) / r_min);
      }
    // Pairs are kept to (f - 1)(r_i + r_j), walls to (f - 1) r_i; the wall needs the larger factor.
    if (largest > 0.0) neighbor->register_contact_dist_factor(1.0 + 1.001 * largest);
  }

  /// Attraction (N) of a touching pair; its bridge forms now if it has none, unless it must not be stored (`update_history`).
  double touching_force(double* contact_history, int itype, int jtype, double radius_i, double radius_j, double size, bool update_history, bool primitive_wall = false) const {
    const PairLiquid& pair = pairs_[itype * types_ + jtype];
    double* const history = contact_history + offset_;
    double volume = history[0];
    if (!(volume > 0.0)) {
      if (!(pair.volume > 0.0)) return 0.0;
      volume = pair.volume;
      const double rupture = pair.force->rupture_distance(radius_i, radius_j, volume);
      check_reach(rupture, size, primitive_wall);
      if (update_history) {
        history[0] = volume;
        history[1] = rupture;
      }
    }
    return pair.force->force(radius_i, radius_j, 0.0, volume, surface_tension_);
  }

  /// Whether a bridge holds the pair over the gap, and its attraction (N); it ruptures here.
  bool gap_force(double* contact_history, int itype, int jtype, double radius_i, double radius_j, double gap, double& attraction) const {
    double* const history = contact_history + offset_;
    if (!(history[0] > 0.0)) return false;
    if (gap > history[1]) {
      history[0] = history[1] = 0.0;
      return false;
    }
    attraction = pairs_[itype * types_ + jtype].force->force(radius_i, radius_j, gap, history[0], surface_tension_);
    return true;
  }

  inline void surfacesIntersect(SurfacesIntersectData& sidata, ForceData& i_forces, ForceData& j_forces) {
    if (sidata.contact_flags) *sidata.contact_flags |= CONTACT_COHESION_MODEL;
    const double attraction = touching_force(sidata.contact_history, sidata.itype, sidata.jtype, sidata.radi, other_radius(sidata), sidata.is_wall ? sidata.radi : sidata.radsum,
                                             sidata.computeflag && sidata.shearupdate, sidata.is_wall && !sidata.mesh);
    pull(sidata, attraction, sidata.en, i_forces, j_forces);
  }

  inline void surfacesClose(SurfacesCloseData& scdata, ForceData& i_forces, ForceData& j_forces) {
    if (!scdata.contact_history) return;
    const double distance = sqrt(scdata.rsq);
    double attraction;
    if (!gap_force(scdata.contact_history, scdata.itype, scdata.jtype, scdata.radi, other_radius(scdata), distance - (scdata.is_wall ? scdata.radi : scdata.radsum), attraction)) {
      if (scdata.contact_flags) *scdata.contact_flags &= ~CONTACT_COHESION_MODEL;
      return;
    }
    if (scdata.contact_flags) *scdata.contact_flags |= CONTACT_COHESION_MODEL;
    scdata.has_force_update = true;
    const double normal[3] = {scdata.delta[0] / distance, scdata.delta[1] / distance, scdata.delta[2] / distance};
    pull(scdata, attraction, normal, i_forces, j_forces);
  }

  inline void endSurfacesIntersect(SurfacesIntersectData&, ForceData&, ForceData&) {}
  void beginPass(SurfacesIntersectData&, ForceData&, ForceData&) {}
  void endPass(SurfacesIntersectData&, ForceData&, ForceData&) {}
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif  // COHESION_MODEL_CAPILLARY_H_
#endif
