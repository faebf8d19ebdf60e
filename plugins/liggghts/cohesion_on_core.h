// Cohesion of dembark in LIGGGHTS, for the models of cohesion_model_*.h: fetches the contact, calls dembark/cohesion, adds the force.
#ifndef DEMBARK_COHESION_ON_CORE_H
#define DEMBARK_COHESION_ON_CORE_H

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "atom.h"
#include "contact_models.h"
#include "cohesion_model_base.h"
#include "fix_wall_gran.h"
#include "global_properties.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "dembark/contact.hpp"
#include "dembark/contact_energy.hpp"
#include "bridge_reach.h"
#include "contact_data.h"
#include "fix_energy_account.h"
#include "fix_capillary_liquid.h"
#include "model_properties.h"

namespace LIGGGHTS {
namespace ContactModels {

/// The choices of `adhesion_law`.
inline std::vector<std::string> adhesion_names() { return {"jkr", "dmt", "constant"}; }
inline dembark::CohesionLaw adhesion_law(int choice) {
  constexpr dembark::CohesionLaw laws[] = {dembark::CohesionLaw::jkr, dembark::CohesionLaw::dmt, dembark::CohesionLaw::constant};
  return laws[choice];
}

/// `Wet`: liquid bridges, else adhesion of dry surfaces.
template <bool Wet>
class CohesionOnCore : public CohesionModelBase {
  static constexpr const char* model = Wet ? "cohesion capillary" : "cohesion adhesion";
  int offset_;
  int model_ = 0, adhesion_ = 0;
  bool viscous_ = false, carried_ = false;
  dembark_liggghts::StockSums sums_;
  int imbalance_ = -1;               // where a bridge of carried liquid keeps how it will be split
  LAMMPS_NS::PairGran* const pair_;  // nullptr: these are contacts with a wall
  LAMMPS_NS::FixWallGran* const wall_;
  LAMMPS_NS::FixCapillaryLiquid* owner_ = nullptr;  // of carried liquid
  dembark_liggghts::EnergyTally* tally_ = nullptr;
  dembark_liggghts::PairTable<dembark::Cohesion> laws_;
  double** youngs_modulus_ = nullptr;  // E*, by types

  // With carried liquid: who owns it.
  void find_owner(const dembark_liggghts::PropertyReader& read) {
    owner_ = static_cast<LAMMPS_NS::FixCapillaryLiquid*>(modify->find_fix_style("capillary/liquid", 0));
    if (!carried_) {
      if (owner_)
        read.fail(
            "fix capillary/liquid is there, but liquid is not carried; write 'carried_liquid on' after the models, or leave the fix out");
      return;
    }
    if (!owner_) read.fail("carried_liquid on needs the liquid: fix ID all capillary/liquid content C");
    owner_->place(wall_, offset_, imbalance_);
  }

  void check_time_step(const dembark::Liquid& liquid, double radius, double mass) const {
    const double limit = liquid.stable_time_step(radius, mass);
    if (update->dt <= limit) return;
    char line[256];
    snprintf(line, sizeof line,
             "cohesion capillary: with viscous_liquid on a bridge between these grains needs a time step <= %.3g s, not %g s, or a larger "
             "minimumGap",
             limit, update->dt);
    error->one(FLERR, line);
  }

  // A contact with a grain or a wall, as fix capillary/liquid numbers them.
  dembark::capillary::BridgeSides sides(int i, int j) const { return {i, wall_ ? owner_->wall_number(wall_) : j, wall_ != nullptr}; }

  // A bridge of carried liquid ruptures: its liquid goes back to the two.
  void return_liquid(int i, int j, double* history) const {
    owner_->bridge_broke({sides(i, j), history[offset_], history[imbalance_]});
    history[imbalance_] = 0.0;
  }

  /// One step of the bridge of a contact, `overlap` (m) being that of its surfaces; whether it is there.
  bool step(const SurfacesCloseData& d, const dembark::Vec3<double>& normal, double overlap, bool touching, double effective_mass,
            ForceData& i_forces, ForceData& j_forces) const {
    const dembark::Cohesion& law = laws_(d.itype, d.jtype);
    const dembark::Liquid& liquid = law.liquid;
    const dembark::ContactBodies bodies = dembark_liggghts::bodies(d, atom->omega);
    const bool update_history = d.computeflag && d.shearupdate && !(carried_ && !owner_->collecting());
    double* const history = d.contact_history + offset_;
    dembark::CohesionState state = dembark::load_cohesion(history);
    const bool was_there = state.held();
    dembark::ContactForce out;
    out.normal = normal;
    out.overlap = overlap;
    const double modulus = youngs_modulus_ ? youngs_modulus_[d.itype][d.jtype] : 0.0;
    out.cohesive_force = cohesion_step(law, {bodies.radius_1, bodies.radius_2, -overlap, touching, modulus}, state);
    const bool is_there = state.held();
    // Also in the set-up, which leaves histories as they are: the skin may be a new one.
    if (is_there && !(was_there && d.shearupdate))
      dembark_liggghts::check_reach(neighbor, error, state.rupture_distance, d.is_wall ? d.radi : d.radsum, d.is_wall && !d.mesh);
    // In every step: a run may go on with a longer one.
    if (touching && (is_there || carried_)) check_time_step(liquid, bodies.effective_radius(), effective_mass);
    if (update_history) {
      const double before = history[0];
      dembark::store_cohesion(history, state);
      if (carried_)
        owner_->report(sides(d.i, d.j), bodies.radius_1, bodies.radius_2, liquid, touching, before, history, d.contact_history + imbalance_,
                       d.is_wall && !d.mesh);
    }
    if (!is_there && out.cohesive_force == 0.0) return false;
    dembark::RelativeMotion motion;
    if (liquid.viscous.on()) {
      motion = relative_motion(bodies, normal, overlap);
      bridge_resistance(liquid, bodies, state.bridge_volume, motion, out);
    }
    assemble(motion, out);
    dembark_liggghts::add_force(out, d, i_forces, j_forces);
    if (tally_) {
      dembark::ContactParts parts;
      split_cohesion(parts, out);
      tally_->add(d, normal, parts, motion);
    }
    return true;
  }

 public:
  static constexpr const char *history_name = "capillary", *imbalance_name = "capillary_imbalance";

  CohesionOnCore(LAMMPS* lmp, IContactHistorySetup* host, class ContactModelBase* models)
      : CohesionModelBase(lmp, host, models),
        pair_(dynamic_cast<LAMMPS_NS::PairGran*>(host)),
        wall_(dynamic_cast<LAMMPS_NS::FixWallGran*>(host)) {
    offset_ = host->add_history_value("bridge_volume", "0");
    host->add_history_value("bridge_rupture_distance", "0");
    models->add_history_offset(history_name, offset_);
  }

  void registerSettings(Settings& settings) {
    if (Wet) {
      dembark_liggghts::register_choice(settings, "capillary_model", model_, dembark::capillary::model_names());
      settings.registerOnOff("viscous_liquid", viscous_, false);
      settings.registerOnOff("carried_liquid", carried_, false);
    } else dembark_liggghts::register_choice(settings, "adhesion_law", adhesion_, adhesion_names());
    sums_.register_in(settings, false);
  }

  inline void postSettings(IContactHistorySetup* host, ContactModelBase* models) {
    sums_.refuse(error, viscous_ ? "cohesion capillary with viscous_liquid" : model, viscous_);
    if (!carried_) return;
    imbalance_ = host->add_history_value("bridge_imbalance", "1");
    models->add_history_offset(imbalance_name, imbalance_);
  }

  void connectToProperties(PropertyRegistry& registry) {
    const dembark_liggghts::PropertyReader read(registry, modify, error, model);
    tally_ = dembark_liggghts::find_energy_tally(modify);
    if (Wet) find_owner(read);
    dembark::ContactOptions options;
    options.cohesion = Wet ? dembark::CohesionLaw::bridge : adhesion_law(adhesion_);
    options.capillary_model = static_cast<dembark::capillary::Model>(model_);
    options.viscous = viscous_;
    options.carried_liquid = carried_;
    if (options.cohesion == dembark::CohesionLaw::jkr) {
      const bool hertz = wall_ ? wall_->contact_match("normal", "hertz") : pair_->contact_match("normal", "hertz");
      if (!hertz) options.normal_law = dembark::NormalLaw::hooke;
      registry.registerProperty("Yeff", &MODEL_PARAMS::createYeff, model);
      registry.connect("Yeff", youngs_modulus_, model);
    }
    laws_ = dembark_liggghts::read_cohesion(read, options);
    const double largest = registry.max_radius() < 1e10 ? registry.max_radius() : 0.0;
    for (int i = 1; i <= read.types(); ++i)
      for (int j = 1; j <= read.types(); ++j) {
        const std::string line = dembark::wrong_bridge_volume("bridgeVolume", laws_(i, j).liquid.bridge_volume, largest);
        if (!line.empty()) read.fail(line + " (types " + std::to_string(i) + "-" + std::to_string(j) + ")");
      }
    if (carried_ && largest > 0.0) owner_->look_for_liquid(registry.min_radius(), largest);
    const auto reach = [this](int i, int j, double radius, double other) {
      return cohesion_reach(laws_(i, j), radius, other, youngs_modulus_ ? youngs_modulus_[i][j] : 0.0,
                            carried_ ? owner_->likely_bridge(radius, other) : laws_(i, j).liquid.bridge_volume);
    };
    // The pair style comes first when a run begins, and how far copies of grains reach follows from what is registered by then: were it
    // without the walls, the second run of a script would have more copies than the first.
    std::vector<const LAMMPS_NS::FixWallGran*> bodies = {wall_};
    for (int k = 0; pair_ && k < modify->nfix; ++k)
      if (const auto* const wall = dynamic_cast<LAMMPS_NS::FixWallGran*>(modify->fix[k])) bodies.push_back(wall);
    const std::vector<dembark_liggghts::RadiusRange> ranges = dembark_liggghts::radius_ranges(*atom, *modify, world, read.types());
    for (const LAMMPS_NS::FixWallGran* const body : bodies)
      neighbor->register_contact_dist_factor(dembark_liggghts::cohesion_distance_factor(read.types(), ranges, body, reach));
  }

  inline void surfacesIntersect(SurfacesIntersectData& d, ForceData& i_forces, ForceData& j_forces) {
    if (d.contact_flags) *d.contact_flags |= CONTACT_COHESION_MODEL;
    step(d, dembark_liggghts::vector(d.en), d.deltan, true, d.meff, i_forces, j_forces);
  }

  inline void surfacesClose(SurfacesCloseData& d, ForceData& i_forces, ForceData& j_forces) {
    if (!d.contact_history) return;
    const double distance = sqrt(d.rsq);
    d.has_force_update = dembark::load_cohesion(d.contact_history + offset_).held() &&
                         step(d, dembark_liggghts::vector(d.delta) * (1.0 / distance), (d.is_wall ? d.radi : d.radsum) - distance, false,
                              0.0, i_forces, j_forces);
    if (!d.contact_flags) return;
    if (d.has_force_update) *d.contact_flags |= CONTACT_COHESION_MODEL;
    else *d.contact_flags &= ~CONTACT_COHESION_MODEL;
  }

  inline void endSurfacesIntersect(SurfacesIntersectData&, ForceData&, ForceData&) {}
  void beginPass(SurfacesIntersectData& d, ForceData&, ForceData&) {
    if (!pair_ || !d.computeflag || !d.shearupdate || (carried_ && !owner_->collecting())) return;
    dembark_liggghts::refuse_double_contacts(*pair_, *atom, *neighbor, *domain, error);
    dembark_liggghts::end_parted_pairs(*pair_, *atom, neighbor->contactDistanceFactor, CONTACT_COHESION_MODEL,
                                       [this](int i, int j, double* history) {
                                         if (carried_ && history[offset_] > 0.0) return_liquid(i, j, history);
                                         history[offset_] = history[offset_ + 1] = 0.0;
                                       });
  }
  void endPass(SurfacesIntersectData&, ForceData&, ForceData&) {}
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif
