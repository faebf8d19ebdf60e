// LIGGGHTS adapter of capillary bridges: fetches the contact, calls dembark/capillary/bridge.hpp, adds the force. The volume of a bridge is
// fixed by the types, or taken from the grains (carried_liquid on, with fix capillary/liquid, which settles what forms and breaks).
//
//   pair_style gran model hertz tangential ... cohesion capillary [capillary_model exact|willett|willett_full|rabinovich|bagheri|constant]
//              [viscous_liquid on|off] [carried_liquid on|off]
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

#include "atom.h"
#include "contact_models.h"
#include "cohesion_model_base.h"
#include "fix_wall_gran.h"
#include "global_properties.h"
#include "neighbor.h"
#include "update.h"

#include "dembark/capillary/bridge.hpp"
#include "dembark/capillary/viscous.hpp"
#include "dembark/kinematics.hpp"
#include "dembark/vec3.hpp"
#include "bridge_reach.h"
#include "energy_books.h"
#include "fix_capillary_liquid.h"
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
  static constexpr double largest_ratio = 100.0;  // of volume and cube of the radius; beyond it is a mistake in the unit
  int offset_;
  int model_ = 0;
  int types_ = 0;
  double surface_tension_ = 0.0;
  bool viscous_ = false, carried_ = false;
  int imbalance_ = -1;  // where a bridge of carried liquid keeps how it will be split
  IContactHistorySetup* host_;
  LAMMPS_NS::FixCapillaryLiquid* owner_ = nullptr;  // of carried liquid
  const LAMMPS_NS::FixWallGran* wall_ = nullptr;
  dembark_liggghts::EnergyBooks* books_ = nullptr;
  dembark::capillary::ViscousLiquid liquid_;
  std::vector<PairLiquid> pairs_;                                                   // one a pair of types, row by row
  std::map<double, std::shared_ptr<const dembark::capillary::BridgeForce>> built_;  // by mean contact angle

  static double bridge_radius(const SurfacesCloseData& d) { return d.is_wall ? 2.0 * d.radi : 2.0 * d.radi * d.radj / d.radsum; }
  static double other_radius(const SurfacesCloseData& d) { return d.is_wall ? INFINITY : d.radj; }

  void pull(const SurfacesCloseData& d, double force, const double* normal, ForceData& i_forces, ForceData& j_forces) const {
    const double scale = d.is_wall ? d.area_ratio : 1.0;
    for (int k = 0; k < 3; ++k) {
      i_forces.delta_F[k] -= scale * force * normal[k];
      if (!d.is_wall) j_forces.delta_F[k] += force * normal[k];
    }
    if (books_)
      account(dembark::ContactPart::capillary, d, normal, -force * dembark::Vec3<double>{normal[0], normal[1], normal[2]}, 0.0, 0.0);
  }

  // What the liquid resists with, of a bridge of `volume` at `gap`. The engine sets velocities of surfaces for touching pairs only.
  void resist(const SurfacesCloseData& d, const double* normal, double gap, double volume, ForceData& i_forces, ForceData& j_forces) const {
    typedef dembark::Vec3<double> Vec3;
    const auto vec = [](const double* a) { return Vec3{a[0], a[1], a[2]}; };
    const Vec3 n = vec(normal), relative = vec(d.v_i) - vec(d.v_j);
    const double arm_i = d.radi + 0.5 * gap, arm_j = d.is_wall ? 0.0 : d.radj + 0.5 * gap;
    Vec3 spin = arm_i * vec(d.is_wall ? d.omega_i : atom->omega[d.i]);
    if (!d.is_wall) spin += arm_j * vec(atom->omega[d.j]);
    const dembark::ContactMotion<double> motion = dembark::contact_motion(n, relative, spin);
    const auto resistance = dembark::capillary::viscous_resistance(liquid_, bridge_radius(d), gap, volume);
    const Vec3 tangential = -resistance.tangential * motion.tangential;
    const Vec3 force = tangential - resistance.normal * motion.normal * n, moment = cross(n, tangential);
    const double scale = d.is_wall ? d.area_ratio : 1.0;
    const double f[3] = {force.x, force.y, force.z}, m[3] = {moment.x, moment.y, moment.z};
    for (int k = 0; k < 3; ++k) {
      i_forces.delta_F[k] += scale * f[k];
      i_forces.delta_torque[k] -= scale * arm_i * m[k];
      if (d.is_wall) continue;
      j_forces.delta_F[k] -= f[k];
      j_forces.delta_torque[k] -= arm_j * m[k];
    }
    if (books_) account(dembark::ContactPart::liquid_viscous, d, normal, force, arm_i, arm_j);
  }

  DEMBARK_COLD void account(dembark::ContactPart part, const SurfacesCloseData& d, const double* normal, const dembark::Vec3<double>& force,
                            double arm_i, double arm_j) const {
    books_->add(part, d, {normal[0], normal[1], normal[2]}, force, arm_i, arm_j);
  }

  void check_time_step(double radius, double effective_mass) const {
    const double limit = dembark::capillary::viscous_time_step(liquid_, radius, effective_mass);
    if (update->dt <= limit) return;
    char line[256];
    snprintf(line, sizeof line,
             "cohesion capillary: with viscous_liquid on a bridge between these grains needs a time step <= %.3g s, not %g s, or a larger "
             "minimumGap",
             limit, update->dt);
    error->one(FLERR, line);
  }

  // With carried liquid: who owns it, and where the reach of its bridges is reckoned from; 0 if not known.
  double find_owner(dembark_liggghts::PropertyReader& read, double largest_radius) {
    owner_ = static_cast<LAMMPS_NS::FixCapillaryLiquid*>(modify->find_fix_style("capillary/liquid", 0));
    if (!carried_) {
      if (owner_)
        read.fail(
            "fix capillary/liquid is there, but liquid is not carried; write 'carried_liquid on' after the models, or leave the fix out");
      return 0.0;
    }
    if (!owner_) read.fail("carried_liquid on needs the liquid: fix ID all capillary/liquid content C");
    if (read.given("bridgeVolume"))
      read.fail("bridgeVolume is given, but with carried_liquid on a bridge takes its volume from the grains; leave one of them out");
    wall_ = dynamic_cast<LAMMPS_NS::FixWallGran*>(host_);
    owner_->place(wall_, offset_, imbalance_);
    return owner_->likely_bridge(largest_radius < 1e10 ? largest_radius : 0.0);
  }

  // A touching contact without a bridge asks for liquid, once in a step.
  void ask(const SurfacesIntersectData& d) const {
    if (!d.computeflag || !d.shearupdate || !owner_->collecting()) return;
    LAMMPS_NS::FixCapillaryLiquid::Request request;
    request.i = d.i;
    request.j = d.is_wall ? -1 : d.j;
    request.wall = d.is_wall ? owner_->wall_number(wall_) : -1;
    request.radius_i = d.radi;
    request.radius_j = d.is_wall ? dembark::capillary::flat<double> : d.radj;
    request.bridge = d.contact_history + offset_;
    request.imbalance = d.contact_history + imbalance_;
    request.force = pairs_[d.itype * types_ + d.jtype].force.get();
    request.primitive_wall = d.is_wall && !d.mesh;
    owner_->ask(request);
  }

  // A bridge of carried liquid at a gap beyond its rupture distance: it gives its liquid back and is no more.
  void give_back(const SurfacesCloseData& d) const {
    if (!d.computeflag || !d.shearupdate || !owner_->collecting()) return;
    double *const bridge = d.contact_history + offset_, &imbalance = d.contact_history[imbalance_];
    if (d.is_wall) owner_->broke_wall(d.i, owner_->wall_number(wall_), bridge[0], imbalance);
    else owner_->broke(d.i, d.j, bridge[0], imbalance);
    bridge[0] = bridge[1] = imbalance = 0.0;
  }

 public:
  CohesionModel(LAMMPS* lmp, IContactHistorySetup* hsetup, class ContactModelBase* c) : CohesionModelBase(lmp, hsetup, c), host_(hsetup) {
    offset_ = hsetup->add_history_value("bridge_volume", "0");
    hsetup->add_history_value("bridge_rupture_distance", "0");
  }

  void registerSettings(Settings& settings) {
    dembark_liggghts::register_choice(settings, "capillary_model", model_, dembark::capillary::model_names());
    settings.registerOnOff("viscous_liquid", viscous_, false);
    settings.registerOnOff("carried_liquid", carried_, false);
  }

  inline void postSettings(IContactHistorySetup* hsetup, ContactModelBase*) {
    if (carried_) imbalance_ = hsetup->add_history_value("bridge_imbalance", "1");
  }

  void connectToProperties(PropertyRegistry& registry) {
    dembark_liggghts::PropertyReader read(registry, modify, error, "cohesion capillary");
    books_ = dembark_liggghts::find_energy_books(modify);
    dembark::capillary::Model model{};
    dembark::capillary::model_from_name(dembark::capillary::model_names()[model_].c_str(), model);
    types_ = read.types() + 1;
    pairs_.assign(types_ * types_, {});
    surface_tension_ = read.scalar("surfaceTension");
    if (!(surface_tension_ >= 0.0 && surface_tension_ < INFINITY)) read.fail("surfaceTension (N/m) must be >= 0 and finite");
    liquid_.viscosity = viscous_ ? read.scalar("liquidViscosity") : read.scalar("liquidViscosity", 0.0);
    if (!viscous_ && liquid_.viscosity != 0.0)
      read.fail("liquidViscosity is given, but viscous forces are off; write 'viscous_liquid on' after the models, or leave it out");
    if (viscous_) liquid_.minimum_gap = read.scalar("minimumGap");
    if (const char* wrong = liquid_.error()) read.fail(std::string("liquidViscosity, minimumGap: ") + wrong);
    const double r_min = registry.min_radius(), r_max = registry.max_radius();
    const double carried_volume = find_owner(read, r_max);
    double largest = 0.0;
    for (int i = 1; i < types_; ++i)
      for (int j = 1; j < types_; ++j) {
        PairLiquid& pair = pairs_[i * types_ + j];
        pair.volume = carried_ ? 0.0 : read.per_pair("bridgeVolume", i, j);
        if (!(pair.volume >= 0.0 && pair.volume < INFINITY))
          read.fail("bridgeVolume (m^3) must be >= 0 and finite (types " + std::to_string(i) + "-" + std::to_string(j) + ")");
        const double angle = 0.5 * (read.per_type("contactAngle", i) + read.per_type("contactAngle", j));
        if (!(angle >= 0.0 && angle <= 0.5 * dembark::pi))
          read.fail("contactAngle is in radians (stock models take degrees) and must lie in 0...pi/2; the mean of types " +
                    std::to_string(i) + " and " + std::to_string(j) + " is " + std::to_string(angle));
        std::shared_ptr<const dembark::capillary::BridgeForce>& force = built_[angle];
        if (!force) force = std::make_shared<const dembark::capillary::BridgeForce>(model, angle);
        pair.force = force;
        if (r_min > 0.0 && r_max < 1e10 && pair.volume > largest_ratio * r_max * r_max * r_max)
          read.fail("bridgeVolume (m^3) of types " + std::to_string(i) + "-" + std::to_string(j) + " is " +
                    std::to_string(pair.volume / (r_max * r_max * r_max)) +
                    " cubes of the largest radius; a bridge between grains has at most a few, give its volume in m^3");
        if (r_min > 0.0 && r_max < 1e10)
          for (const double r : {r_min, r_max})
            for (const double other : {r_min, r_max, static_cast<double>(INFINITY)})
              largest = std::max(largest, force->rupture_distance(r, other, carried_ ? carried_volume : pair.volume) / r_min);
      }
    // Pairs are kept to (f - 1)(r_i + r_j), walls to (f - 1) r_i; the wall needs the larger factor.
    if (largest > 0.0) neighbor->register_contact_dist_factor(1.0 + 1.001 * largest);
  }

  /// Attraction (N) of a touching pair; its bridge forms now if it has none, unless it must not be stored (`update_history`).
  double touching_force(double* contact_history, int itype, int jtype, double radius_i, double radius_j, double size, bool update_history,
                        bool primitive_wall = false) const {
    const PairLiquid& pair = pairs_[itype * types_ + jtype];
    double* const history = contact_history + offset_;
    double volume = history[0];
    if (!(volume > 0.0)) {
      if (!(pair.volume > 0.0)) return 0.0;
      volume = pair.volume;
      const double rupture = pair.force->rupture_distance(radius_i, radius_j, volume);
      dembark_liggghts::check_reach(neighbor, error, rupture, size, primitive_wall);
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
    const double& volume = sidata.contact_history[offset_];
    const bool dry = !(volume > 0.0);
    if (dry && carried_) {
      if (liquid_.on()) check_time_step(bridge_radius(sidata), sidata.meff);
      ask(sidata);
      return;
    }
    const double attraction = touching_force(sidata.contact_history, sidata.itype, sidata.jtype, sidata.radi, other_radius(sidata),
                                             sidata.is_wall ? sidata.radi : sidata.radsum, sidata.computeflag && sidata.shearupdate,
                                             sidata.is_wall && !sidata.mesh);
    pull(sidata, attraction, sidata.en, i_forces, j_forces);
    if (!liquid_.on() || !(volume > 0.0)) return;
    if (dry) check_time_step(bridge_radius(sidata), sidata.meff);
    resist(sidata, sidata.en, -sidata.deltan, volume, i_forces, j_forces);
  }

  inline void surfacesClose(SurfacesCloseData& scdata, ForceData& i_forces, ForceData& j_forces) {
    if (!scdata.contact_history) return;
    const double distance = sqrt(scdata.rsq), gap = distance - (scdata.is_wall ? scdata.radi : scdata.radsum);
    if (carried_ && scdata.contact_history[offset_] > 0.0 && gap > scdata.contact_history[offset_ + 1]) {
      give_back(scdata);
      if (scdata.contact_flags) *scdata.contact_flags &= ~CONTACT_COHESION_MODEL;
      return;
    }
    double attraction;
    if (!gap_force(scdata.contact_history, scdata.itype, scdata.jtype, scdata.radi, other_radius(scdata), gap, attraction)) {
      if (scdata.contact_flags) *scdata.contact_flags &= ~CONTACT_COHESION_MODEL;
      return;
    }
    if (scdata.contact_flags) *scdata.contact_flags |= CONTACT_COHESION_MODEL;
    scdata.has_force_update = true;
    const double normal[3] = {scdata.delta[0] / distance, scdata.delta[1] / distance, scdata.delta[2] / distance};
    pull(scdata, attraction, normal, i_forces, j_forces);
    if (liquid_.on()) resist(scdata, normal, gap, scdata.contact_history[offset_], i_forces, j_forces);
  }

  inline void endSurfacesIntersect(SurfacesIntersectData&, ForceData&, ForceData&) {}
  void beginPass(SurfacesIntersectData&, ForceData&, ForceData&) {}
  void endPass(SurfacesIntersectData&, ForceData&, ForceData&) {}
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif  // COHESION_MODEL_CAPILLARY_H_
#endif
