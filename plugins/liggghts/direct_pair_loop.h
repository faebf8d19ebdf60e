// The pair loop of liggghts-dembark's most used combinations: Hertz, Finnie-Rabinowicz, with or without capillary bridges.
//
// The engine's loop hands every number from model to model through memory and decides pair by pair whether there is a contact. Here
// the contacts of many grains are picked first and computed in packs (pair_packs.h): the same laws and the same numbers to round-off, in
// less time than the stock friction law takes. Whatever else the engine may ask of a pair style (energies, virial, stored forces, rigid
// bodies, accounts of energy, ...) is left to its own loop, step by step.
#ifndef DEMBARK_DIRECT_PAIR_LOOP_H
#define DEMBARK_DIRECT_PAIR_LOOP_H

#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "atom.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "property_registry.h"
#include "pair_gran_base.h"
#include "update.h"

#include "dembark/normal_force.hpp"
#include "dembark/vec3.hpp"
#include "pair_packs.h"

namespace dembark_liggghts {

template <int Cohesion>
using DirectStyle =
    LIGGGHTS::ContactModels::GranStyle<LIGGGHTS::ContactModels::HERTZ, LIGGGHTS::ContactModels::TANGENTIAL_FINNIE_RABINOWICZ, Cohesion,
                                       LIGGGHTS::ContactModels::ROLLING_OFF, LIGGGHTS::ContactModels::SURFACE_DEFAULT>;
template <int Cohesion>
using DirectModel = LIGGGHTS::ContactModels::ContactModel<DirectStyle<Cohesion>>;
template <int Cohesion>
using StockLoop = LIGGGHTS::PairStyles::Granular<DirectModel<Cohesion>>;

// The models are private to the loop and to each other; an explicit instantiation may name a private member.
template <int Cohesion>
struct ModelsOfLoop {
  typedef DirectModel<Cohesion> StockLoop<Cohesion>::* type;
};
template <int Cohesion>
struct TangentialOfModels {
  typedef LIGGGHTS::ContactModels::TangentialModel<LIGGGHTS::ContactModels::TANGENTIAL_FINNIE_RABINOWICZ> DirectModel<Cohesion>::* type;
};
template <int Cohesion>
struct CohesionOfModels {
  typedef LIGGGHTS::ContactModels::CohesionModel<Cohesion> DirectModel<Cohesion>::* type;
};
template <class Tag, typename Tag::type Member>
struct OpenMember {
  friend typename Tag::type open(Tag) { return Member; }
};
constexpr int dry = LIGGGHTS::ContactModels::COHESION_OFF, capillary = LIGGGHTS::ContactModels::COHESION_CAPILLARY;
ModelsOfLoop<dry>::type open(ModelsOfLoop<dry>);
ModelsOfLoop<capillary>::type open(ModelsOfLoop<capillary>);
TangentialOfModels<dry>::type open(TangentialOfModels<dry>);
TangentialOfModels<capillary>::type open(TangentialOfModels<capillary>);
CohesionOfModels<dry>::type open(CohesionOfModels<dry>);
CohesionOfModels<capillary>::type open(CohesionOfModels<capillary>);
template struct OpenMember<ModelsOfLoop<dry>, &StockLoop<dry>::cmodel>;
template struct OpenMember<ModelsOfLoop<capillary>, &StockLoop<capillary>::cmodel>;
template struct OpenMember<TangentialOfModels<dry>, &DirectModel<dry>::tangentialModel>;
template struct OpenMember<TangentialOfModels<capillary>, &DirectModel<capillary>::tangentialModel>;
template struct OpenMember<CohesionOfModels<dry>, &DirectModel<dry>::cohesionModel>;
template struct OpenMember<CohesionOfModels<capillary>, &DirectModel<capillary>::cohesionModel>;

/// The engine's `Granular<...>` for this combination, with a loop of its own for the plain step. `Cohesion`: COHESION_OFF or
/// COHESION_CAPILLARY.
template <int Cohesion>
class DirectPairLoop : public StockLoop<Cohesion> {
  typedef StockLoop<Cohesion> Stock;
  typedef dembark::Vec3<double> Vec3;
  static constexpr bool wet = Cohesion == capillary;
  static constexpr int own_flags = LIGGGHTS::ContactModels::CONTACT_NORMAL_MODEL | LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL |
                                   LIGGGHTS::ContactModels::CONTACT_TANGENTIAL_MODEL;

  LAMMPS_NS::LAMMPS* lmp_;
  double **youngs_modulus_ = nullptr, **shear_modulus_ = nullptr, **damping_factor_ = nullptr;  // effective ones, by types
  int types_ = 1;    // that grains or walls have, and one: the engine's tables end there, whatever the box was made for
  double dt_ = 0.0;  // of this step
  bool update_history_ = false;
  bool plain_settings_ = true, limit_force_ = false, tangential_damping_ = true;
  PairPacks* const packs_ = choose_pair_packs();
  const std::unique_ptr<PairBlock> block_ = std::make_unique<PairBlock>();
  std::vector<PairLaw> laws_;  // of this step

  bool plain_step(LAMMPS_NS::PairGran* pair, int eflag, int vflag, int addflag) const {
    const LAMMPS_NS::Atom* atom = lmp_->atom;
    return plain_settings_ && !eflag && !vflag && !(pair->cpl() && addflag) && pair->computeflag() && pair->listgranhistory &&
           !pair->storeContactForces() && !pair->storeContactForcesStress() && !pair->storeSumDelta() && !pair->store_sum_normal_force() &&
           !pair->fr_pair() && atom->rmass && lmp_->force->nktv2p == 1.0 && atom->sphere_flag && !atom->shapetype_flag &&
           lmp_->modify->n_fixes_style("insert/stream/predefined") == 0;
  }

  static Vec3 vector(const double* v) { return {v[0], v[1], v[2]}; }

  DirectModel<Cohesion>& models() { return this->*open(ModelsOfLoop<Cohesion>()); }
  auto& friction() { return models().*open(TangentialOfModels<Cohesion>()); }
  auto& cohesion() { return models().*open(CohesionOfModels<Cohesion>()); }

  // False when a law has to be left to its scalar form.
  bool collect_laws(double dt) {
    bool linear = true;
    laws_.assign(types_ * types_, {});
    for (int i = 1; i < types_; ++i)
      for (int j = 1; j < types_; ++j) {
        const dembark::FinnieRabinowicz& law = friction().law(i, j);
        laws_[i * types_ + j] = {youngs_modulus_[i][j], shear_modulus_[i][j],         damping_factor_[i][j],       law.static_friction,
                                 law.kinetic_friction,  law.interface_shear_strength, dembark::kept_slip(law, dt), 0.0};
        linear = linear && law.presliding == dembark::Presliding::linear;
      }
    return linear;
  }

  static void scalar_friction(void* caller, const PairBlock& block, int k, const FrictionInput& in, double* force) {
    DirectPairLoop& loop = *static_cast<DirectPairLoop*>(caller);
    const int* const type = loop.lmp_->atom->type;
    // What is no number never sticks in a pack: pairs without a normal end up here.
    if (!(in.normal[0] == in.normal[0])) loop.friction().refuse_coincidence(block.grain[k], block.partner[k]);
    const Vec3 t = loop.friction().step(block.history[k], type[block.grain[k]], type[block.partner[k]], vector(in.normal), vector(in.spin),
                                        vector(in.velocity), in.normal_force, in.stiffness, in.damping, in.radius_overlap, loop.dt_,
                                        loop.update_history_);
    force[0] = t.x;
    force[1] = t.y;
    force[2] = t.z;
  }

  static void bridges(void* caller, const PairBlock& block, int first, int count, const double* gap, double* pull) {
    DirectPairLoop& loop = *static_cast<DirectPairLoop*>(caller);
    const LAMMPS_NS::Atom* const atom = loop.lmp_->atom;
    const auto& cohesion = loop.cohesion();
    for (int n = 0; n < count; ++n) {
      const int k = first + n, i = block.grain[k], j = block.partner[k], type_i = atom->type[i], type_j = atom->type[j];
      const double radius_i = atom->radius[i], radius_j = atom->radius[j];
      if (block.pick[k] & 1)
        pull[n] = cohesion.touching_force(block.history[k], type_i, type_j, radius_i, radius_j, radius_i + radius_j, loop.update_history_);
      else if (cohesion.gap_force(block.history[k], type_i, type_j, radius_i, radius_j, gap[n], pull[n]))
        *block.flags[k] |= LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL;
      else pull[n] = 0.0;
    }
  }

 public:
  DirectPairLoop(LAMMPS_NS::LAMMPS* lmp, LAMMPS_NS::PairGran* parent, std::int64_t hash) : Stock(lmp, parent, hash), lmp_(lmp) {}

  void settings(int count, char** words, LIGGGHTS::IContactHistorySetup* history) override {
    Stock::settings(count, words, history);
    for (int k = 0; k + 1 < count; k += 2) {
      const bool on = std::strcmp(words[k + 1], "on") == 0, off = std::strcmp(words[k + 1], "off") == 0;
      if (std::strcmp(words[k], "limitForce") == 0) limit_force_ = on;
      else if (std::strcmp(words[k], "tangential_damping") == 0) tangential_damping_ = on;
      else if (std::strcmp(words[k], "presliding") != 0 && std::strcmp(words[k], "capillary_model") != 0 && !off) plain_settings_ = false;
    }
  }

  void init_granular() override {
    Stock::init_granular();
    PropertyRegistry& registry = lmp_->force->registry;
    registry.connect("Yeff", youngs_modulus_, "model hertz");
    registry.connect("Geff", shear_modulus_, "model hertz");
    registry.connect("betaeff", damping_factor_, "model hertz");
    types_ = registry.max_type() + 1;
  }

  void compute_force(LAMMPS_NS::PairGran* pair, int eflag, int vflag, int addflag) override {
    if (friction().books() || !plain_step(pair, eflag, vflag, addflag)) {
      Stock::compute_force(pair, eflag, vflag, addflag);
      return;
    }
    pair->evflag = pair->vflag_fdotr = 0;
    const LAMMPS_NS::NeighList* const list = pair->list;
    if (list->inum == 0) return;
    const LAMMPS_NS::Atom* const atom = lmp_->atom;
    update_history_ = pair->shearupdate();
    dt_ = update_history_ ? lmp_->update->dt : 0.0;

    PairStep step;
    step.x = atom->x[0];
    step.v = atom->v[0];
    step.omega = atom->omega[0];
    step.radius = atom->radius;
    step.mass = atom->rmass;
    step.type = atom->type;
    step.mask = atom->mask;
    step.f = atom->f[0];
    step.torque = atom->torque[0];
    step.owned = lmp_->force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
    step.count = list->inum;
    step.stride = pair->dnum();
    step.offset = friction().offset();
    step.grains = list->ilist;
    step.numneigh = list->numneigh;
    step.neighbors = list->firstneigh;
    step.flags = pair->listgranhistory->firstneigh;
    step.histories = pair->listgranhistory->firstdouble;
    step.own_flags = own_flags;
    step.touching_flags = wet ? own_flags : own_flags & ~LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL;
    // The scalar law knows what a step of no length is.
    step.pack_friction = collect_laws(dt_) && dt_ > 0.0;
    step.laws = laws_.data();
    step.types = types_;
    step.dt = dt_;
    step.reach_squared = lmp_->neighbor->contactDistanceFactor * lmp_->neighbor->contactDistanceFactor;
    step.limit_force = limit_force_;
    step.tangential_damping = tangential_damping_;
    step.frozen = pair->freeze_group_bit();
    step.caller = this;
    step.friction = &scalar_friction;
    step.bridges = nullptr;
    if constexpr (wet) step.bridges = &bridges;
    // The factor of relaxed contacts (PairGran::relax) is 1 in this version of the engine.
    packs_(step, *block_);
  }
};

}  // namespace dembark_liggghts

#endif
