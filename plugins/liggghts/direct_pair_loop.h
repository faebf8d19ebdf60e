// The pair loop of liggghts-dembark's most used combinations: Hertz, Finnie-Rabinowicz, with or without capillary bridges.
//
// The engine's loop hands every number from model to model through memory and decides pair by pair whether there is a contact. Here
// the contacts of many grains are picked first and computed in packs (dembark/pairs): the same laws and the same numbers to round-off, in
// less time than the stock friction law takes. Whatever else the engine may ask of a pair style (stored forces, rigid bodies, ...) is
// left to its own loop, step by step. The virial is not: a run must not depend on when it is asked for.
#ifndef DEMBARK_DIRECT_PAIR_LOOP_H
#define DEMBARK_DIRECT_PAIR_LOOP_H

#include <cstdint>
#include <string>

#include "atom.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "property_registry.h"
#include "pair_gran_base.h"
#include "update.h"

#include "dembark/contact.hpp"
#include "bridge_reach.h"
#include "contact_data.h"
#include "fix_capillary_liquid.h"
#include "fix_energy_account.h"
#include "model_properties.h"
#include "packed_contacts.h"
#include "pair_parameters.h"
#include "shared_fix.h"

namespace dembark_liggghts {

/// The engine's `Granular<...>` for the combination `Style`, with a loop of its own for the plain step.
template <class Style>
class DirectPairLoop : public LIGGGHTS::PairStyles::Granular<LIGGGHTS::ContactModels::ContactModel<Style>>,
                       dembark_family::PackedContacts,
                       PairParameters {
  typedef LIGGGHTS::PairStyles::Granular<LIGGGHTS::ContactModels::ContactModel<Style>> Stock;
  static constexpr bool wet = Style::COHESION == LIGGGHTS::ContactModels::COHESION_CAPILLARY;
  static constexpr bool cohesive = wet || Style::COHESION == LIGGGHTS::ContactModels::COHESION_ADHESION;

  LAMMPS_NS::LAMMPS* lmp_;
  LAMMPS_NS::PairGran* pair_;
  PairTable<dembark::ContactParameters> laws_;
  LAMMPS_NS::FixCapillaryLiquid* liquid_ = nullptr;  // of carried liquid
  bool plain_settings_ = true;
  dembark::ContactOptions options_;
  const bool in_packs_ = asked();

  bool plain_step(LAMMPS_NS::PairGran* pair, int addflag) const {
    const LAMMPS_NS::Atom* atom = lmp_->atom;
    return plain_settings_ && in_packs_ && !(pair->cpl() && addflag) && pair->computeflag() && pair->listgranhistory &&
           !pair->storeContactForces() && !pair->storeContactForcesStress() && !pair->storeSumDelta() && !pair->store_sum_normal_force() &&
           !pair->fr_pair() && atom->rmass && lmp_->force->nktv2p == 1.0 && atom->sphere_flag && !atom->shapetype_flag &&
           lmp_->modify->n_fixes_style("insert/stream/predefined") == 0;
  }

  /// Calls visit(i, j, law, bodies, force, state) for each pair that acts, computed by itself and with a state that is not kept.
  template <class Visit>
  void each_contact(LAMMPS_NS::PairGran& pair, Visit visit) const {
    const LAMMPS_NS::Atom& atom = *lmp_->atom;
    const LAMMPS_NS::NeighList &list = *pair.list, &histories = *list.listgranhistory;
    const auto frozen = [&](int i) { return (atom.mask[i] & pair.freeze_group_bit()) != 0; };
    for (int n = 0; n < list.inum; ++n) {
      const int i = list.ilist[n];
      for (int k = 0; k < list.numneigh[i]; ++k) {
        const int j = list.firstneigh[i][k] & NEIGHMASK;
        const Vec3 apart = vector(atom.x[i]) - vector(atom.x[j]);
        const double* const history = histories.firstdouble[i] + pair.dnum() * k;
        dembark::ContactState state;
        const dembark_family::HistoryPlaces& at = tally_.at;
        if (at.cohesion >= 0) state.cohesion = dembark::load_cohesion(history + at.cohesion);
        const double reach = atom.radius[i] + atom.radius[j];
        if (dot(apart, apart) >= reach * reach && !state.cohesion.held()) continue;
        state.friction = load_friction(history + at.friction);
        if (at.rings >= 0) state.rings = load_rings(history + at.rings);
        if (at.rolling >= 0) state.rolling_angle = vector(history + at.rolling);
        const double mass_i = frozen(i) ? INFINITY : atom.rmass[i], mass_j = frozen(j) ? INFINITY : atom.rmass[j];
        const dembark::ContactParameters& law = laws_(atom.type[i], atom.type[j]);
        const dembark::ContactBodies b = dembark_family::grain_pair(atom, i, j, apart, mass_i, mass_j);
        const dembark::ContactForce out = contact_step(law, b, dt_, state);
        if (out.interacting) visit(i, j, law, b, out, state);
      }
    }
  }

  /// Adds up the virial of the forces that the packs are about to compute. Contacts have no potential energy in this engine.
  void tally_virial(LAMMPS_NS::PairGran& pair) const {
    each_contact(pair, [&](int i, int j, const auto&, const dembark::ContactBodies& b, const dembark::ContactForce& out, const auto&) {
      const Vec3 &f = out.force, &apart = b.separation;
      pair.ev_tally_xyz(i, j, lmp_->atom->nlocal, lmp_->force->newton_pair, 0.0, 0.0, f.x, f.y, f.z, apart.x, apart.y, apart.z);
    });
  }

  /// The energies of the set-up of a run, whose step leaves no state that packs could tally.
  void tally_setup(LAMMPS_NS::PairGran& pair) const {
    const int* const mask = lmp_->atom->mask;
    each_contact(pair, [&](int i, int j, const auto& law, const auto& b, const dembark::ContactForce& out, const auto& state) {
      if (mask[i] & mask[j] & tally_.frozen) return;
      const dembark::ContactLevers levers(out.normal, relative_motion(b, out.normal, out.overlap));
      tally_.sums->add_pair(contact_parts(law, b, out, state), levers, i, j);
    });
  }

  const dembark::ContactParameters& law(int i, int j) const override { return laws_(i, j); }
  void refuse_coincidence(int i, int j) const override { dembark_liggghts::refuse_coincidence(lmp_->error, lmp_->atom->tag, i, j); }
  void check_reach(int i, int j, double rupture_distance) const override {
    const double* const radius = lmp_->atom->radius;
    dembark_liggghts::check_reach(lmp_->neighbor, lmp_->error, rupture_distance, radius[i] + radius[j], false);
  }

 public:
  DirectPairLoop(LAMMPS_NS::LAMMPS* lmp, LAMMPS_NS::PairGran* parent, std::int64_t hash)
      : Stock(lmp, parent, hash), PairParameters(lmp), lmp_(lmp), pair_(parent) {}

  void settings(int count, char** words, LIGGGHTS::IContactHistorySetup* history) override {
    Stock::settings(count, words, history);
    int adhesion = 0;
    for (int k = 0; k + 1 < count; k += 2) {
      const std::string word = words[k], value = words[k + 1];
      bool chosen = false;
      each_choice(options_, [&](const char* name, const char*, auto& option, const auto& values, const char*) {
        if (word == name) chosen = dembark::option_from_name(values, value, option);
      });
      if (chosen) continue;
      if (word == "limitForce") options_.limit_force = value == "on";
      else if (word == "tangential_damping") options_.tangential_damping = value == "on";
      else if (word == "carried_liquid") options_.carried_liquid = value == "on";
      else if (word == "capillary_model") dembark::capillary::model_from_name(words[k + 1], options_.capillary_model);
      else if (word == "adhesion_law") {
        int law = 0;
        if (dembark::option_from_name(LIGGGHTS::ContactModels::adhesion_names(), value, law)) adhesion = law;
      } else if (value != "off") plain_settings_ = false;
    }
    if (cohesive) options_.cohesion = wet ? dembark::CohesionLaw::bridge : LIGGGHTS::ContactModels::adhesion_law(adhesion);
  }

  void init_granular() override {
    namespace models = LIGGGHTS::ContactModels;
    Stock::init_granular();
    typedef models::TangentialModel<models::TANGENTIAL_FINNIE_RABINOWICZ> Friction;
    typedef models::CohesionOnCore<wet> Attraction;
    dembark_family::HistoryPlaces at;
    at.friction = Stock::get_history_offset(Friction::history_name);
    if (options_.presliding == dembark::Presliding::partial_slip) at.rings = Stock::get_history_offset(Friction::rings_name);
    if (options_.rolling_resistance == dembark::RollingModel::elastic_plastic) at.rolling = Stock::get_history_offset(Friction::angle_name);
    if (cohesive && plain_settings_) at.cohesion = Stock::get_history_offset(Attraction::history_name);
    if (at.cohesion >= 0 && options_.carried_liquid) at.imbalance = Stock::get_history_offset(Attraction::imbalance_name);
    liquid_ =
        at.imbalance >= 0 ? static_cast<LAMMPS_NS::FixCapillaryLiquid*>(lmp_->modify->find_fix_style("capillary/liquid", 0)) : nullptr;
    begin(*lmp_->atom, at, pair_->freeze_group_bit(), liquid_, find_energy_tally(lmp_->modify));
    read_laws();
    make_known(plain_settings_);
  }

  void read_laws() {
    PropertyRegistry& registry = lmp_->force->registry;
    double **youngs_modulus = nullptr, **shear_modulus = nullptr, **damping_factor = nullptr;  // effective ones, by types
    registry.connect("Yeff", youngs_modulus, "model hertz");
    registry.connect("Geff", shear_modulus, "model hertz");
    registry.connect("betaeff", damping_factor, "model hertz");
    const PropertyReader read(registry, lmp_->modify, lmp_->error, "pair_style gran");
    const auto friction = read_friction(read, options_);
    PairTable<dembark::RollingResistance> rolling;
    PairTable<dembark::Cohesion> cohesion;
    if (options_.rolling_resistance != dembark::RollingModel::off) rolling = read_rolling(read, options_);
    if (cohesive && plain_settings_) cohesion = read_cohesion(read, options_);
    laws_ = PairTable<dembark::ContactParameters>(read.types());
    const dembark::ContactParameters chosen = dembark::chosen_laws(options_);
    for (int i = 1; i <= read.types(); ++i)
      for (int j = 1; j <= read.types(); ++j) {
        dembark::ContactParameters& p = laws_(i, j) = chosen;
        p.elasticity.effective_youngs_modulus = youngs_modulus[i][j];
        p.elasticity.effective_shear_modulus = shear_modulus[i][j];
        p.elasticity.damping = damping_factor[i][j];
        p.friction = friction(i, j);
        if (options_.rolling_resistance != dembark::RollingModel::off) p.rolling = rolling(i, j);
        if (cohesive && plain_settings_) p.cohesion = cohesion(i, j);
      }
  }

  dembark::ContactParameters parameters(int i, int j) const override { return laws_(i, j); }

  void compute_force(LAMMPS_NS::PairGran* pair, int eflag, int vflag, int addflag) override {
    if (!plain_step(pair, addflag)) {
      Stock::compute_force(pair, eflag, vflag, addflag);
      return;
    }
    if (eflag || vflag) pair->ev_setup(eflag, vflag);
    else pair->evflag = pair->vflag_fdotr = 0;
    if (pair->list->inum == 0) return;
    LAMMPS_NS::Atom& atom = *lmp_->atom;
    refuse_double_contacts(*pair, atom, *lmp_->neighbor, *lmp_->domain, lmp_->error);
    const bool keeps = pair->shearupdate();
    // The factor of relaxed contacts (PairGran::relax) is 1 in this version of the engine.
    namespace models = LIGGGHTS::ContactModels;
    const int owned = lmp_->force->newton_pair ? atom.nlocal + atom.nghost : atom.nlocal;
    dembark::PairStep step = describe(*pair->list, laws_.types(), atom.rmass, owned, keeps ? lmp_->update->dt : 0.0, keeps,
                                      keeps && !(liquid_ && !liquid_->collecting()));
    step.stride = pair->dnum();
    step.flags = pair->list->listgranhistory->firstneigh;
    step.histories = pair->list->listgranhistory->firstdouble;
    step.contact_flags = models::CONTACT_NORMAL_MODEL | models::CONTACT_TANGENTIAL_MODEL;
    step.bridge_flag = models::CONTACT_COHESION_MODEL;
    if (vflag) tally_virial(*pair);
    if (tally_.sums && !keeps) tally_setup(*pair);
    compute_packs(step);
  }
};

}  // namespace dembark_liggghts

#endif
