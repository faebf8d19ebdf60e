// The pair loop of liggghts-dembark's most used combinations: Hertz, Finnie-Rabinowicz, with or without capillary bridges.
//
// The engine's loop hands every number from model to model through memory and decides pair by pair whether there is a contact. Here
// the contacts of many grains are picked first and computed in packs (dembark/pairs): the same laws and the same numbers to round-off, in
// less time than the stock friction law takes. Whatever else the engine may ask of a pair style (stored forces, rigid bodies, ...) is
// left to its own loop, step by step. The virial is not: a run must not depend on when it is asked for.
#ifndef DEMBARK_DIRECT_PAIR_LOOP_H
#define DEMBARK_DIRECT_PAIR_LOOP_H

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "atom.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "property_registry.h"
#include "pair_gran_base.h"
#include "update.h"

#include "dembark/contact.hpp"
#include "dembark/pairs/pair_step.hpp"
#include "bridge_reach.h"
#include "contact_data.h"
#include "fix_capillary_liquid.h"
#include "fix_energy_account.h"
#include "model_properties.h"
#include "packed_tally.h"
#include "pair_grains.h"
#include "pair_parameters.h"
#include "shared_fix.h"

namespace dembark_liggghts {

/// The engine's `Granular<...>` for the combination `Style`, with a loop of its own for the plain step.
template <class Style>
class DirectPairLoop : public LIGGGHTS::PairStyles::Granular<LIGGGHTS::ContactModels::ContactModel<Style>>,
                       dembark::ScalarLaws,
                       dembark::ScalarMemory,
                       PairParameters {
  typedef dembark::PairBlock PairBlock;
  typedef LIGGGHTS::PairStyles::Granular<LIGGGHTS::ContactModels::ContactModel<Style>> Stock;
  static constexpr bool wet = Style::COHESION == LIGGGHTS::ContactModels::COHESION_CAPILLARY;

  LAMMPS_NS::LAMMPS* lmp_;
  LAMMPS_NS::PairGran* pair_;
  double **youngs_modulus_ = nullptr, **shear_modulus_ = nullptr, **damping_factor_ = nullptr;  // effective ones, by types
  PairTable<dembark::FinnieRabinowicz> friction_;
  PairTable<dembark::RollingResistance> rolling_;
  PairTable<dembark::Liquid> liquids_;
  int friction_offset_ = 0, rings_offset_ = -1, angle_offset_ = -1, bridge_offset_ = 0,
      imbalance_offset_ = -1;  // in the history of a contact
  double dt_ = 0.0;            // of this step
  bool update_history_ = false;
  LAMMPS_NS::FixCapillaryLiquid* liquid_ = nullptr;  // of carried liquid
  bool plain_settings_ = true, carried_ = false, limit_force_ = false, tangential_damping_ = true;
  dembark::Presliding presliding_ = dembark::Presliding::linear;
  dembark::FrictionLimit friction_limit_ = dembark::FrictionLimit::total;
  dembark::RollingModel rolling_model_ = dembark::RollingModel::off;
  dembark::capillary::Model model_ = dembark::capillary::Model::exact;
  const bool in_packs_ = dembark::PairLoops::asked_lanes() != 1;
  const dembark::PairLoops packs_ = dembark::PairLoops::choose();
  const std::unique_ptr<PairBlock> block_ = std::make_unique<PairBlock>();
  std::vector<dembark::PairLaw<double>> laws_;  // of this step
  dembark_family::PackedTally tally_;

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
        if (wet) {
          state.bridge_volume = history[bridge_offset_];
          state.rupture_distance = history[bridge_offset_ + 1];
        }
        const double reach = atom.radius[i] + atom.radius[j];
        if (dot(apart, apart) >= reach * reach && !(state.bridge_volume > 0.0)) continue;
        state.friction = load_friction(history + friction_offset_);
        if (rings_offset_ >= 0) state.rings = load_rings(history + rings_offset_);
        if (angle_offset_ >= 0) state.rolling_angle = vector(history + angle_offset_);
        const double mass_i = frozen(i) ? INFINITY : atom.rmass[i], mass_j = frozen(j) ? INFINITY : atom.rmass[j];
        const dembark::ContactParameters law = parameters(atom.type[i], atom.type[j]);
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

  void collect_laws() {
    const int types = friction_.types();
    laws_.assign(std::size_t(types + 1) * (types + 1), {});
    for (int i = 1; i <= types; ++i)
      for (int j = 1; j <= types; ++j) {
        const dembark::FinnieRabinowicz& law = friction_(i, j);
        laws_[i * (types + 1) + j] = {youngs_modulus_[i][j],        shear_modulus_[i][j],      damping_factor_[i][j],
                                      law.static_friction,          law.kinetic_friction,      law.interface_shear_strength,
                                      dembark::kept_slip(law, dt_), law.critical_slip_distance};
      }
  }

  Vec3 friction(const PairBlock& block, int k, const Vec3& normal, double twist, const dembark::NormalResponse<double>& response,
                const Vec3& velocity) override {
    const LAMMPS_NS::Atom* const atom = lmp_->atom;
    const int i = block.grain[k], j = block.partner[k];
    // What is no number neither sticks nor slips in a pack: pairs without a normal end up here.
    if (dembark::has_no_direction(normal)) refuse_coincidence(lmp_->error, atom->tag, i, j);
    double* const history = block.history[k] + friction_offset_;
    dembark::FrictionState<double> state = load_friction(history);
    dembark::SlipRings rings;
    if (rings_offset_ >= 0) rings = load_rings(block.history[k] + rings_offset_);
    const Vec3 force = contact_friction(law(block, k), normal, twist, response, velocity, dt_, state, &rings);
    if (update_history_) store_friction(history, state);
    if (update_history_ && rings_offset_ >= 0) store_rings(block.history[k] + rings_offset_, rings);
    return force;
  }

  Vec3 rolling(const PairBlock& block, int k, const Vec3& normal, double twist, double normal_force, double tangential_stiffness,
               const Vec3& spin) override {
    const LAMMPS_NS::Atom* const atom = lmp_->atom;
    const int i = block.grain[k], j = block.partner[k];
    double* const history = angle_offset_ >= 0 ? block.history[k] + angle_offset_ : nullptr;
    Vec3 angle = history ? vector(history) : Vec3{};
    const dembark::RollingContact contact{normal,
                                          twist,
                                          dembark::reduced(atom->radius[i], atom->radius[j]),
                                          pair_inertia(*atom, *pair_, i, atom->rmass[i], j, atom->rmass[j]),
                                          normal_force,
                                          tangential_stiffness,
                                          spin};
    const Vec3 couple = rolling_step(rolling_(atom->type[i], atom->type[j]), contact, dt_, angle);
    if (update_history_ && history) store(history, angle);
    tally_.note_rolling(k, rolling_(atom->type[i], atom->type[j]).on(), couple);
    return couple;
  }

  const dembark::FinnieRabinowicz& law(const PairBlock& block, int k) const {
    const int* const type = lmp_->atom->type;
    return friction_(type[block.grain[k]], type[block.partner[k]]);
  }
  double limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) override {
    return shear_limit(law(block, k), friction_coefficient(law(block, k), slip), normal_force, contact_area);
  }
  double sliding_limit(const PairBlock& block, int k, const dembark::RingMotion<double>& motion, const double* rings, double normal_force,
                       double contact_area, double& slip) override {
    return dembark::sliding_limit(law(block, k), motion, rings, rings + dembark::SlipRings::count, normal_force, contact_area, slip);
  }

  void bridges(const PairBlock& block, int first, int count, const double* gap, double* pull) override {
    const LAMMPS_NS::Atom* const atom = lmp_->atom;
    for (int n = 0; n < count; ++n) {
      const int k = first + n, i = block.grain[k], j = block.partner[k];
      const bool touching = block.pick[k] & 1;
      double* const history = block.history[k] + bridge_offset_;
      double volume = history[0], rupture_distance = history[1];
      const bool was_there = volume > 0.0;
      const dembark::Liquid& liquid = liquids_(atom->type[i], atom->type[j]);
      pull[n] = bridge_step(liquid, atom->radius[i], atom->radius[j], gap[n], touching, volume, rupture_distance);
      tally_.note_pull(k, pull[n]);
      const bool is_there = volume > 0.0;
      const bool update = update_history_ && !(carried_ && !liquid_->collecting());
      // One that cannot break in this pass, the set-up of a run, is looked at again in the next.
      if (!touching && (is_there || (was_there && !update))) *block.flags[k] |= LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL;
      if (is_there && !was_there) check_reach(lmp_->neighbor, lmp_->error, rupture_distance, atom->radius[i] + atom->radius[j], false);
      if (!update) continue;
      const double before = std::exchange(history[0], volume);
      history[1] = rupture_distance;
      if (carried_)
        liquid_->report({i, j, false}, atom->radius[i], atom->radius[j], liquid, touching, before, history,
                        block.history[k] + imbalance_offset_);
    }
  }

 public:
  DirectPairLoop(LAMMPS_NS::LAMMPS* lmp, LAMMPS_NS::PairGran* parent, std::int64_t hash)
      : Stock(lmp, parent, hash), PairParameters(lmp), lmp_(lmp), pair_(parent) {}

  void settings(int count, char** words, LIGGGHTS::IContactHistorySetup* history) override {
    Stock::settings(count, words, history);
    for (int k = 0; k + 1 < count; k += 2) {
      const std::string word = words[k], value = words[k + 1];
      if (word == "limitForce") limit_force_ = value == "on";
      else if (word == "tangential_damping") tangential_damping_ = value == "on";
      else if (word == "presliding") dembark::option_from_name(dembark::presliding_names(), value, presliding_);
      else if (word == "friction_limit") dembark::option_from_name(dembark::friction_limit_names(), value, friction_limit_);
      else if (word == "rolling_resistance") dembark::option_from_name(dembark::rolling_names(), value, rolling_model_);
      else if (word == "carried_liquid") carried_ = value == "on";
      else if (word == "capillary_model") dembark::capillary::model_from_name(words[k + 1], model_);
      else if (value != "off") plain_settings_ = false;
    }
  }

  void init_granular() override {
    namespace models = LIGGGHTS::ContactModels;
    Stock::init_granular();
    PropertyRegistry& registry = lmp_->force->registry;
    registry.connect("Yeff", youngs_modulus_, "model hertz");
    registry.connect("Geff", shear_modulus_, "model hertz");
    registry.connect("betaeff", damping_factor_, "model hertz");
    const PropertyReader read(registry, lmp_->modify, lmp_->error, "pair_style gran");
    friction_ = read_friction(read, presliding_, friction_limit_);
    typedef models::TangentialModel<models::TANGENTIAL_FINNIE_RABINOWICZ> Friction;
    friction_offset_ = Stock::get_history_offset(Friction::history_name);
    if (presliding_ == dembark::Presliding::partial_slip) rings_offset_ = Stock::get_history_offset(Friction::rings_name);
    if (rolling_model_ != dembark::RollingModel::off) rolling_ = read_rolling(read, rolling_model_);
    if (rolling_model_ == dembark::RollingModel::elastic_plastic) angle_offset_ = Stock::get_history_offset(Friction::angle_name);
    if (wet && plain_settings_) {
      typedef models::CohesionModel<models::COHESION_CAPILLARY> Bridges;
      liquids_ = read_liquids(read, model_, false, carried_);
      bridge_offset_ = Stock::get_history_offset(Bridges::history_name);
      if (carried_) imbalance_offset_ = Stock::get_history_offset(Bridges::imbalance_name);
      liquid_ = carried_ ? static_cast<LAMMPS_NS::FixCapillaryLiquid*>(lmp_->modify->find_fix_style("capillary/liquid", 0)) : nullptr;
    }
    tally_.sums = find_energy_tally(lmp_->modify);
    tally_.frozen = pair_->freeze_group_bit();
    tally_.atom = lmp_->atom;
    tally_.friction_at = friction_offset_;
    tally_.rings_at = rings_offset_;
    tally_.angle_at = angle_offset_;
    make_known(plain_settings_);
  }

  dembark::ContactParameters parameters(int i, int j) const override {
    dembark::ContactParameters p;
    p.elasticity.effective_youngs_modulus = youngs_modulus_[i][j];
    p.elasticity.effective_shear_modulus = shear_modulus_[i][j];
    p.elasticity.damping = damping_factor_[i][j];
    p.tangential_damping = tangential_damping_;
    p.limit_force = limit_force_;
    p.friction = friction_(i, j);
    if (rolling_model_ != dembark::RollingModel::off) p.rolling = rolling_(i, j);
    if (wet) p.liquid = liquids_(i, j);
    return p;
  }

  void compute_force(LAMMPS_NS::PairGran* pair, int eflag, int vflag, int addflag) override {
    if (!plain_step(pair, addflag)) {
      Stock::compute_force(pair, eflag, vflag, addflag);
      return;
    }
    if (eflag || vflag) pair->ev_setup(eflag, vflag);
    else pair->evflag = pair->vflag_fdotr = 0;
    if (pair->list->inum == 0) return;
    LAMMPS_NS::Atom& atom = *lmp_->atom;
    update_history_ = pair->shearupdate();
    dt_ = update_history_ ? lmp_->update->dt : 0.0;
    if (vflag) tally_virial(*pair);
    if (tally_.sums && !update_history_) tally_setup(*pair);
    collect_laws();
    const int owned = lmp_->force->newton_pair ? atom.nlocal + atom.nghost : atom.nlocal;
    // The scalar law knows the exponential curve, and what a step of no length is.
    const bool pack_friction = presliding_ != dembark::Presliding::exponential && dt_ > 0.0;
    // The factor of relaxed contacts (PairGran::relax) is 1 in this version of the engine.
    // The rolling spring stands behind the rings.
    const int more = rings_offset_ >= 0 ? rings_offset_ : angle_offset_;
    const int numbers = (rings_offset_ >= 0 ? ring_numbers : 0) + (angle_offset_ >= 0 ? 3 : 0);
    namespace models = LIGGGHTS::ContactModels;
    const LAMMPS_NS::NeighList &list = *pair->list, &histories = *list.listgranhistory;
    dembark::PairStep step{*this};
    dembark_family::describe_pairs(step, atom, list);
    step.memory = this;
    step.results = tally_.sums && update_history_ ? &tally_ : nullptr;
    step.laws = laws_.data();
    step.types = friction_.types() + 1;
    step.one_law = friction_.types() == 1;
    step.owned = owned;
    step.offset = friction_offset_;
    step.rings = rings_offset_;
    step.more = more;
    step.more_numbers = numbers;
    step.dt = dt_;
    step.wet = wet;
    step.limit_force = limit_force_;
    step.tangential_damping = tangential_damping_;
    step.elastic_limit = friction_limit_ == dembark::FrictionLimit::elastic;
    step.pack_friction = pack_friction;
    step.rolls = rolling_model_ != dembark::RollingModel::off;
    step.frozen = pair->freeze_group_bit();
    step.stride = pair->dnum();
    step.flags = histories.firstneigh;
    step.histories = histories.firstdouble;
    step.contact_flags = models::CONTACT_NORMAL_MODEL | models::CONTACT_TANGENTIAL_MODEL;
    step.bridge_flag = models::CONTACT_COHESION_MODEL;
    packs_.lists(step, *block_);
  }
};

}  // namespace dembark_liggghts

#endif
