// The pair loop of liggghts-dembark's most used combinations: Hertz, Finnie-Rabinowicz, with or without capillary bridges.
//
// The engine's loop hands every number from model to model through memory and decides pair by pair whether there is a contact. Here
// the contacts of a grain are picked first and computed one after the other in registers: the same laws and the same numbers to
// round-off, in less time than the stock friction law takes. Whatever else the engine may ask of a pair style (energies, virial,
// stored forces, rigid bodies, ...) is left to its own loop, step by step.
#ifndef DEMBARK_DIRECT_PAIR_LOOP_H
#define DEMBARK_DIRECT_PAIR_LOOP_H

#include <cmath>
#include <cstdint>
#include <cstring>
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

namespace dembark_liggghts {

template <int Cohesion>
using DirectStyle = LIGGGHTS::ContactModels::GranStyle<LIGGGHTS::ContactModels::HERTZ, LIGGGHTS::ContactModels::TANGENTIAL_FINNIE_RABINOWICZ, Cohesion,
                                                       LIGGGHTS::ContactModels::ROLLING_OFF, LIGGGHTS::ContactModels::SURFACE_DEFAULT>;
template <int Cohesion>
using DirectModel = LIGGGHTS::ContactModels::ContactModel<DirectStyle<Cohesion>>;
template <int Cohesion>
using StockLoop = LIGGGHTS::PairStyles::Granular<DirectModel<Cohesion>>;

// The models are private to the loop and to each other; an explicit instantiation may name a private member.
template <int Cohesion>
struct ModelsOfLoop {
  typedef DirectModel<Cohesion> StockLoop<Cohesion>::*type;
};
template <int Cohesion>
struct TangentialOfModels {
  typedef LIGGGHTS::ContactModels::TangentialModel<LIGGGHTS::ContactModels::TANGENTIAL_FINNIE_RABINOWICZ> DirectModel<Cohesion>::*type;
};
template <int Cohesion>
struct CohesionOfModels {
  typedef LIGGGHTS::ContactModels::CohesionModel<Cohesion> DirectModel<Cohesion>::*type;
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

/// The engine's `Granular<...>` for this combination, with a loop of its own for the plain step. `Cohesion`: COHESION_OFF or COHESION_CAPILLARY.
template <int Cohesion>
class DirectPairLoop : public StockLoop<Cohesion> {
  typedef StockLoop<Cohesion> Stock;
  typedef dembark::Vec3<double> Vec3;
  static constexpr bool wet = Cohesion == capillary;
  static constexpr int own_flags = LIGGGHTS::ContactModels::CONTACT_NORMAL_MODEL | LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL |
                                   LIGGGHTS::ContactModels::CONTACT_TANGENTIAL_MODEL;

  struct Near {
    Vec3 delta;
    double distance_squared;
    int slot, j;
  };

  LAMMPS_NS::LAMMPS* lmp_;
  double **youngs_modulus_ = nullptr, **shear_modulus_ = nullptr, **damping_factor_ = nullptr;  // effective ones, by types
  bool plain_settings_ = true, limit_force_ = false, tangential_damping_ = true;
  std::vector<Near> near_;

  bool plain_step(LAMMPS_NS::PairGran* pair, int eflag, int vflag, int addflag) const {
    const LAMMPS_NS::Atom* atom = lmp_->atom;
    return plain_settings_ && !eflag && !vflag && !(pair->cpl() && addflag) && pair->computeflag() && pair->listgranhistory && !pair->storeContactForces() &&
           !pair->storeContactForcesStress() && !pair->storeSumDelta() && !pair->store_sum_normal_force() && !pair->fr_pair() && atom->rmass &&
           lmp_->force->nktv2p == 1.0 && atom->sphere_flag && !atom->shapetype_flag && lmp_->modify->n_fixes_style("insert/stream/predefined") == 0;
  }

  static Vec3 row(double* const* array, int i) { return {array[i][0], array[i][1], array[i][2]}; }
  static void add(double* to, double scale, const Vec3& what) {
    to[0] += scale * what.x;
    to[1] += scale * what.y;
    to[2] += scale * what.z;
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
  }

  void compute_force(LAMMPS_NS::PairGran* pair, int eflag, int vflag, int addflag) override {
    if (!plain_step(pair, eflag, vflag, addflag)) {
      Stock::compute_force(pair, eflag, vflag, addflag);
      return;
    }
    pair->evflag = pair->vflag_fdotr = 0;
    DirectModel<Cohesion>& models = this->*open(ModelsOfLoop<Cohesion>());
    auto& friction = models.*open(TangentialOfModels<Cohesion>());
    auto& cohesion = models.*open(CohesionOfModels<Cohesion>());

    const LAMMPS_NS::Atom* const atom = lmp_->atom;
    double** const x = atom->x;
    double** const v = atom->v;
    double** const omega = atom->omega;
    double** const f = atom->f;
    double** const torque = atom->torque;
    const double* const radius = atom->radius;
    const double* const mass = atom->rmass;
    const int* const type = atom->type;
    const int* const mask = atom->mask;
    const int frozen = pair->freeze_group_bit();
    const int owned = lmp_->force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
    const bool update_history = pair->shearupdate();
    const double dt = update_history ? lmp_->update->dt : 0.0;
    const double reach_squared = lmp_->neighbor->contactDistanceFactor * lmp_->neighbor->contactDistanceFactor;
    const int stride = pair->dnum();

    for (int ii = 0; ii < pair->list->inum; ++ii) {
      const int i = pair->list->ilist[ii], count = pair->list->numneigh[i];
      const int* const neighbors = pair->list->firstneigh[i];
      int* const flags = pair->listgranhistory->firstneigh[i];
      double* const histories = pair->listgranhistory->firstdouble[i];
      const Vec3 position = row(x, i);
      const double radius_i = radius[i];

      // Which pairs touch cannot be foreseen: no branch on it. Pairs near enough to have to forget a contact, or to keep a bridge,
      // come along when they have anything stored.
      if (near_.size() <= static_cast<std::size_t>(count)) near_.resize(count + 64);
      Near* const near = near_.data();
      int found = 0;
      for (int slot = 0; slot < count; ++slot) {
        const int j = neighbors[slot] & NEIGHMASK;
        const Vec3 delta = position - row(x, j);
        const double squared = dot(delta, delta), touching = (radius_i + radius[j]) * (radius_i + radius[j]);
        near[found] = {delta, squared, slot, j};
        found += (squared < touching) | ((flags[slot] != 0) & (squared < reach_squared * touching));
      }
      if (found == 0) continue;

      const Vec3 velocity_i = row(v, i), omega_i = row(omega, i);
      const double mass_i = mass[i];
      const int type_i = type[i];
      Vec3 force_i{}, torque_i{};
      for (const Near* pick = near; pick != near + found; ++pick) {
        const int j = pick->j, type_j = type[j];
        const double radius_j = radius[j], radius_sum = radius_i + radius_j;
        double* const history = histories + static_cast<std::ptrdiff_t>(stride) * pick->slot;
        int& flag = flags[pick->slot];
        if (!(pick->distance_squared > 0.0)) friction.refuse_coincidence(i, j);
        const double distance = std::sqrt(pick->distance_squared), reduced_radius = radius_i * radius_j / radius_sum;
        const Vec3 normal = pick->delta * (1.0 / distance);

        if (!(pick->distance_squared < radius_sum * radius_sum)) {
          flag &= ~own_flags;
          friction.forget(history);
          if constexpr (wet) {
            double pull;
            if (!cohesion.gap_force(history, type_i, type_j, radius_i, radius_j, distance - radius_sum, pull)) continue;
            flag |= LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL;
            force_i -= pull * normal;
            if (j < owned) add(f[j], pull * pair->relax(j), normal);
          }
          continue;
        }
        flag |= wet ? own_flags : own_flags & ~LIGGGHTS::ContactModels::CONTACT_COHESION_MODEL;

        const double mass_j = mass[j];
        double reduced_mass = mass_i * mass_j / (mass_i + mass_j);
        if (mask[i] & frozen) reduced_mass = mass_j;
        if (mask[j] & frozen) reduced_mass = mass_i;

        const double overlap = radius_sum - distance, arm_i = radius_i - 0.5 * overlap, arm_j = radius_j - 0.5 * overlap;
        const Vec3 omega_j = row(omega, j), relative = velocity_i - row(v, j);
        const double normal_velocity = dot(relative, normal);
        const Vec3 tangential_velocity = relative - normal_velocity * normal - cross(arm_i * omega_i + arm_j * omega_j, normal);

        dembark::HertzParameters elasticity;
        elasticity.effective_youngs_modulus = youngs_modulus_[type_i][type_j];
        elasticity.effective_shear_modulus = shear_modulus_[type_i][type_j];
        elasticity.damping = damping_factor_[type_i][type_j];
        dembark::NormalResponse<double> response = dembark::hertz(elasticity, reduced_radius, reduced_mass, overlap, normal_velocity);
        if (limit_force_ && response.force < 0.0) response.force = 0.0;

        const Vec3 tangential = friction.step(history, type_i, type_j, normal, omega_i + omega_j, tangential_velocity, response.force,
                                              response.tangential_stiffness, tangential_damping_ ? response.tangential_damping : 0.0,
                                              reduced_radius * overlap, dt, update_history);
        double pull = 0.0;
        if constexpr (wet) pull = cohesion.touching_force(history, type_i, type_j, radius_i, radius_j, radius_sum, update_history);

        const Vec3 force = (response.force - pull) * normal + tangential, moment = cross(normal, tangential);
        force_i += force;
        torque_i -= arm_i * moment;
        if (j < owned) {
          const double share = pair->relax(j);
          add(f[j], -share, force);
          add(torque[j], -share * arm_j, moment);
        }
      }
      const double share = pair->relax(i);
      add(f[i], share, force_i);
      add(torque[i], share, torque_i);
    }
  }
};

}  // namespace dembark_liggghts

#endif
