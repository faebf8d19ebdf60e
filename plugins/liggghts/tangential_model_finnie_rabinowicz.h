// LIGGGHTS adapter of the Finnie-Rabinowicz tangential law and of rolling resistance: fetches the contact, calls dembark/contact.hpp, adds
// the force.
//
//   pair_style gran model hertz tangential finnie_rabinowicz [presliding linear|exponential|partial_slip]
//              [friction_limit total|elastic] [rolling_resistance off|constant_torque|elastic_plastic]
//
// Works compiled out of tree into liggghts-dembark and, unchanged, copied into a LIGGGHTS src/ folder.
#ifdef TANGENTIAL_MODEL
TANGENTIAL_MODEL(TANGENTIAL_FINNIE_RABINOWICZ,finnie_rabinowicz,20)
#else

#ifndef TANGENTIAL_MODEL_FINNIE_RABINOWICZ_H_
#define TANGENTIAL_MODEL_FINNIE_RABINOWICZ_H_

#include "contact_models.h"
#include "tangential_model_base.h"
#include "atom.h"
#include "fix_wall_gran.h"
#include "global_properties.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "dembark/contact.hpp"
#include "dembark/contact_energy.hpp"
#include "contact_data.h"
#include "fix_energy_account.h"
#include "model_properties.h"

namespace LIGGGHTS {
namespace ContactModels {

template <>
class TangentialModel<TANGENTIAL_FINNIE_RABINOWICZ> : public TangentialModelBase {
  int offset_;
  int rings_ = -1;  // offset, with partial slip
  int angle_ = -1;  // the same of an elastic-plastic rolling spring
  dembark::ContactOptions options_;
  dembark_liggghts::StockSums sums_;
  dembark_liggghts::PairTable<dembark::Friction> laws_;
  dembark_liggghts::PairTable<dembark::RollingResistance> rolling_;
  LAMMPS_NS::PairGran* const pair_;  // nullptr: these are contacts with a wall
  LAMMPS_NS::FixWallGran* const wall_;
  dembark_liggghts::EnergyTally* tally_ = nullptr;
  double exponent_ = 1.0;  // of the normal spring

 public:
  static constexpr const char* history_name = "finnie_rabinowicz";
  static constexpr const char* rings_name = "slip_rings";
  static constexpr const char* angle_name = "rolling_angle";

  TangentialModel(LAMMPS* lmp, IContactHistorySetup* host, class ContactModelBase* models)
      : TangentialModelBase(lmp, host, models),
        pair_(dynamic_cast<LAMMPS_NS::PairGran*>(host)),
        wall_(dynamic_cast<LAMMPS_NS::FixWallGran*>(host)) {
    // As in dembark::FrictionState. "1": the sign turns when the engine swaps the two grains of a pair.
    offset_ = host->add_history_value("tangential_displacement_x", "1");
    host->add_history_value("tangential_displacement_y", "1");
    host->add_history_value("tangential_displacement_z", "1");
    host->add_history_value("slip", "0");
    host->add_history_value("friction_dissipated_energy", "0");
    models->add_history_offset(history_name, offset_);
  }

  void registerSettings(Settings& settings) {
    each_choice(options_, [&](const char* name, const char*, auto& option, const auto& values, const char*) {
      dembark_liggghts::register_choice(settings, name, option, values);
    });
    sums_.register_in(settings, true);
  }

  inline void postSettings(IContactHistorySetup* host, ContactModelBase* models) {
    sums_.refuse(error, "tangential finnie_rabinowicz", true);
    if (options_.presliding == dembark::Presliding::partial_slip) {
      rings_ = dembark_liggghts::add_rings(*host);
      models->add_history_offset(rings_name, rings_);
    }
    if (options_.rolling_resistance != dembark::RollingModel::elastic_plastic) return;
    angle_ = host->add_history_value("rolling_angle_x", "1");
    host->add_history_value("rolling_angle_y", "1");
    host->add_history_value("rolling_angle_z", "1");
    models->add_history_offset(angle_name, angle_);
  }

  void connectToProperties(PropertyRegistry& registry) {
    const dembark_liggghts::PropertyReader read(registry, modify, error, "tangential finnie_rabinowicz");
    laws_ = dembark_liggghts::read_friction(read, options_);
    if (options_.rolling_resistance != dembark::RollingModel::off) {
      if (!matches("rolling_friction", "off"))
        read.fail("rolling_resistance and the model rolling_friction are both on; leave one of them out");
      rolling_ = dembark_liggghts::read_rolling(read, options_);
    }
    tally_ = dembark_liggghts::find_energy_tally(modify);
    exponent_ = matches("normal", "hertz") ? 1.5 : 1.0;
    // The engine tells a model of the end of a contact only within this factor of the radii; without it a grain that bounces
    // between two builds of the neighbour list would keep the displacement of its last contact (as it does in `history`).
    neighbor->register_contact_dist_factor(1.01);
  }

  inline void surfacesIntersect(const SurfacesIntersectData& d, ForceData& i_forces, ForceData& j_forces) {
    using dembark_liggghts::vector;
    if (!(d.r != 0.0)) dembark_liggghts::refuse_coincidence(error, atom->tag, d.i, d.is_wall ? -1 : d.j);
    if (d.contact_flags) *d.contact_flags |= CONTACT_TANGENTIAL_MODEL;
    const bool update_history = d.computeflag && d.shearupdate;
    const double dt = update_history ? update->dt : 0.0, radius = d.is_wall ? d.radi : d.radi * d.radj / d.radsum;
    const dembark::NormalResponse<double> response{d.Fn, d.kt, d.gammat, dembark::pi * radius * d.deltan, d.kn, d.kn * d.deltan};
    dembark::ContactState state;
    state.friction = dembark_liggghts::load_friction(d.contact_history + offset_);
    if (rings_ >= 0) state.rings = dembark_liggghts::load_rings(d.contact_history + rings_);
    if (angle_ >= 0) state.rolling_angle = vector(d.contact_history + angle_);
    const bool rolls = options_.rolling_resistance != dembark::RollingModel::off && rolling_(d.itype, d.jtype).on();
    const dembark::RollingResistance resistance = rolls ? rolling_(d.itype, d.jtype) : dembark::RollingResistance{};
    const double inertia = !rolls      ? 0.0
                           : d.is_wall ? dembark::relative_inertia(d.mi, d.radi, INFINITY, INFINITY)
                                       : dembark_liggghts::pair_inertia(*atom, *pair_, d.i, d.mi, d.j, d.mj);
    dembark::ContactForce out;
    out.normal = vector(d.en);
    const dembark::Vec3<double> spin_i = vector(d.omega_i), spin_j = d.is_wall ? dembark_liggghts::wall_spin(d) : vector(d.omega_j);
    dembark::RelativeMotion motion{d.vn, {d.vtr1, d.vtr2, d.vtr3}, d.cri, d.is_wall ? -0.5 * d.deltan : d.crj};
    // The engine takes the velocity of a wall at its surface.
    if (d.is_wall) motion.tangential_velocity -= cross(motion.arm_2 * spin_j, out.normal);
    dembark::SurfaceLaws laws{laws_(d.itype, d.jtype), resistance, radius, inertia, dt, state, out};
    out.tangential = surface_forces(out.normal, response, motion.tangential_velocity, spin_i, spin_j, dt, laws);
    assemble(motion, out);
    if (rolls) add_couple(out.rolling, out);
    if (update_history) store(d.contact_history, state);
    dembark_liggghts::add_force(out, d, i_forces, j_forces);
    if (!tally_) return;
    dembark::ContactParts parts;
    split_touching(parts, out.normal, d.deltan, d.kn * d.deltan, exponent_, d.Fn, d.kt, out.tangential, state.friction.displacement,
                   rings_ >= 0 ? &state.rings : nullptr);
    if (rolls) split_rolling(parts, out.rolling, state.rolling_angle, dembark::rolling_stiffness(d.kt, radius));
    tally_->add(d, out.normal, parts, motion);
  }

  inline void surfacesClose(SurfacesCloseData& d, ForceData&, ForceData&) {
    if (d.contact_flags) *d.contact_flags &= ~CONTACT_TANGENTIAL_MODEL;
    if (d.contact_history) store(d.contact_history, {});
  }

  inline void beginPass(SurfacesIntersectData& d, ForceData&, ForceData&) {
    if (!pair_ || !d.computeflag || !d.shearupdate) return;
    dembark_liggghts::refuse_double_contacts(*pair_, *atom, *neighbor, *domain, error);
    dembark_liggghts::end_parted_pairs(*pair_, *atom, neighbor->contactDistanceFactor, CONTACT_TANGENTIAL_MODEL,
                                       [this](int, int, double* history) { store(history, {}); });
  }
  inline void endPass(SurfacesIntersectData&, ForceData&, ForceData&) {}

 private:
  bool matches(const char* kind, const char* model) const {
    return wall_ ? wall_->contact_match(kind, model) : pair_->contact_match(kind, model);
  }

  void store(double* history, const dembark::ContactState& state) const {
    dembark_liggghts::store_friction(history + offset_, state.friction);
    if (rings_ >= 0) dembark_liggghts::store_rings(history + rings_, state.rings);
    if (angle_ >= 0) dembark_liggghts::store(history + angle_, state.rolling_angle);
  }
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif  // TANGENTIAL_MODEL_FINNIE_RABINOWICZ_H_
#endif
