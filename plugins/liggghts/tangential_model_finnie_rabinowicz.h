// LIGGGHTS adapter of the Finnie-Rabinowicz tangential law: fetches the contact, calls dembark/finnie_rabinowicz.hpp, adds the force.
//
//   pair_style gran model hertz tangential finnie_rabinowicz [presliding linear|exponential]
//
// Works compiled out of tree into liggghts-dembark and, unchanged, copied into a LIGGGHTS src/ folder.
#ifdef TANGENTIAL_MODEL
TANGENTIAL_MODEL(TANGENTIAL_FINNIE_RABINOWICZ,finnie_rabinowicz,20)
#else

#ifndef TANGENTIAL_MODEL_FINNIE_RABINOWICZ_H_
#define TANGENTIAL_MODEL_FINNIE_RABINOWICZ_H_

#include <string>
#include <vector>

#include "contact_models.h"
#include "tangential_model_base.h"
#include "atom.h"
#include "fix_wall_gran.h"
#include "global_properties.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "dembark/contact_energy.hpp"
#include "dembark/finnie_rabinowicz.hpp"
#include "dembark/normal_force.hpp"
#include "energy_books.h"
#include "model_properties.h"
#include "settings_choice.h"

namespace LIGGGHTS {
namespace ContactModels {

template <>
class TangentialModel<TANGENTIAL_FINNIE_RABINOWICZ> : public TangentialModelBase {
  int offset_;
  int presliding_ = 0;
  int types_ = 0;
  std::vector<dembark::FinnieRabinowicz> laws_;  // one a pair of types, row by row
  IContactHistorySetup* host_;
  dembark_liggghts::EnergyBooks* books_ = nullptr;
  double exponent_ = 1.0;  // of the normal spring

  static dembark::FrictionState<double> load(const double* h) { return {{h[0], h[1], h[2]}, h[3], h[4]}; }
  static void store(double* h, const dembark::FrictionState<double>& s) {
    h[0] = s.displacement.x;
    h[1] = s.displacement.y;
    h[2] = s.displacement.z;
    h[3] = s.slip;
    h[4] = s.dissipated_energy;
  }

 public:
  TangentialModel(LAMMPS* lmp, IContactHistorySetup* hsetup, class ContactModelBase*)
      : TangentialModelBase(lmp, hsetup, nullptr), host_(hsetup) {
    // "1": the sign turns when the engine swaps the two grains of a pair.
    offset_ = hsetup->add_history_value("tangential_displacement_x", "1");
    hsetup->add_history_value("tangential_displacement_y", "1");
    hsetup->add_history_value("tangential_displacement_z", "1");
    hsetup->add_history_value("slip", "0");
    hsetup->add_history_value("friction_dissipated_energy", "0");
  }

  void registerSettings(Settings& settings) {
    dembark_liggghts::register_choice(settings, "presliding", presliding_, {"linear", "exponential"});
  }

  inline void postSettings(IContactHistorySetup*, ContactModelBase*) {}

  void connectToProperties(PropertyRegistry& registry) {
    dembark_liggghts::PropertyReader read(registry, modify, error, "tangential finnie_rabinowicz");
    types_ = read.types() + 1;
    laws_.assign(types_ * types_, {});
    for (int i = 1; i < types_; ++i)
      for (int j = 1; j < types_; ++j) {
        dembark::FinnieRabinowicz& law = laws_[i * types_ + j];
        law.static_friction = read.per_pair("staticFriction", i, j);
        law.kinetic_friction = read.per_pair("kineticFriction", i, j);
        law.critical_slip_distance = read.per_pair("criticalSlipDistance", i, j);
        law.interface_shear_strength = read.per_pair("interfaceShearStrength", i, j, dembark::unlimited_strength);
        law.healing_time = read.scalar("healingTime", 0.0);
        law.presliding = presliding_ ? dembark::Presliding::exponential : dembark::Presliding::linear;
        if (law.error()) read.fail(std::string(law.error()) + " (types " + std::to_string(i) + "-" + std::to_string(j) + ")");
      }
    books_ = dembark_liggghts::find_energy_books(modify);
    LAMMPS_NS::FixWallGran* const wall = dynamic_cast<LAMMPS_NS::FixWallGran*>(host_);
    const bool hertz =
        wall ? wall->contact_match("normal", "hertz") : dynamic_cast<LAMMPS_NS::PairGran&>(*host_).contact_match("normal", "hertz");
    exponent_ = hertz ? 1.5 : 1.0;
    // The engine tells a model of the end of a contact only within this factor of the radii; without it a grain that bounces
    // between two builds of the neighbour list would keep the displacement of its last contact (as it does in `history`).
    neighbor->register_contact_dist_factor(1.01);
  }

  const dembark::FinnieRabinowicz& law(int itype, int jtype) const { return laws_[itype * types_ + jtype]; }

  /// Where the state begins in a contact's history: displacement (3), slip, dissipated energy.
  int offset() const { return offset_; }

  /// Whether fix energy/account is there.
  bool books() const { return books_; }

  /// Tangential force on the first body of a touching pair. `spin`: sum of both bodies' angular velocities; `radius_overlap`: R* delta;
  /// `dt` is 0 at the set-up of a run, where forces are those of the stored state: a step of zero length, which is not stored.
  /// `displacement`: of the spring, after the step.
  DEMBARK_HOT dembark::Vec3<double> step(double* contact_history, int itype, int jtype, const dembark::Vec3<double>& normal,
                                         const dembark::Vec3<double>& spin, const dembark::Vec3<double>& velocity, double normal_force,
                                         double k_t, double gamma_t, double radius_overlap, double dt, bool update_history,
                                         dembark::Vec3<double>* displacement = nullptr) const {
    double* const history = contact_history + offset_;
    dembark::FrictionState<double> state = load(history);
    state.displacement = dembark::rotate_to_plane(state.displacement, normal, 0.5 * dt * dot(spin, normal));
    const dembark::Vec3<double> force = dembark::friction_step(laws_[itype * types_ + jtype], normal_force, k_t, gamma_t,
                                                               dembark::pi * radius_overlap, velocity, dt, state);
    if (update_history) store(history, state);
    if (displacement) *displacement = state.displacement;
    return force;
  }

  /// The run ends when two centres lie on each other: there is no normal, and the engine's own models would give no number.
  DEMBARK_COLD void refuse_coincidence(int i, int j) const {
    char line[160];
    const int* const tag = atom->tag;
    if (j < 0)
      snprintf(line, sizeof line, "the centre of atom %d lies on a wall: it has no normal; take a smaller time step or another start",
               tag[i]);
    else snprintf(line, sizeof line, "atoms %d and %d have the same centre: their contact has no normal; place them apart", tag[i], tag[j]);
    error->one(FLERR, line);
  }

  inline void surfacesIntersect(const SurfacesIntersectData& sidata, ForceData& i_forces, ForceData& j_forces) {
    if (!(sidata.r != 0.0)) refuse_coincidence(sidata.i, sidata.is_wall ? -1 : sidata.j);
    if (sidata.contact_flags) *sidata.contact_flags |= CONTACT_TANGENTIAL_MODEL;
    const bool update_history = sidata.computeflag && sidata.shearupdate;
    const dembark::Vec3<double> normal{sidata.en[0], sidata.en[1], sidata.en[2]};
    dembark::Vec3<double> spin{sidata.omega_i[0], sidata.omega_i[1], sidata.omega_i[2]};
    if (!sidata.is_wall) spin += {sidata.omega_j[0], sidata.omega_j[1], sidata.omega_j[2]};
    const double reduced_radius = sidata.is_wall ? sidata.radi : sidata.radi * sidata.radj / sidata.radsum;
    dembark::Vec3<double> displacement;
    const dembark::Vec3<double> force =
        step(sidata.contact_history, sidata.itype, sidata.jtype, normal, spin, {sidata.vtr1, sidata.vtr2, sidata.vtr3}, sidata.Fn,
             sidata.kt, sidata.gammat, reduced_radius * sidata.deltan, update_history ? update->dt : 0.0, update_history, &displacement);

    const dembark::Vec3<double> moment = cross(normal, force);
    const double scale = sidata.is_wall ? sidata.area_ratio : 1.0;
    add(i_forces, force, moment, scale, -scale * sidata.cri);
    if (!sidata.is_wall) add(j_forces, force, moment, -1.0, -sidata.crj);
    if (books_) account(sidata, normal, force, displacement);
  }

  inline void surfacesClose(SurfacesCloseData& scdata, ForceData&, ForceData&) {
    if (scdata.contact_flags) *scdata.contact_flags &= ~CONTACT_TANGENTIAL_MODEL;
    if (scdata.contact_history) store(scdata.contact_history + offset_, {});
  }

  inline void beginPass(SurfacesIntersectData&, ForceData&, ForceData&) {}
  inline void endPass(SurfacesIntersectData&, ForceData&, ForceData&) {}

 private:
  DEMBARK_COLD void account(const SurfacesIntersectData& d, const dembark::Vec3<double>& normal, const dembark::Vec3<double>& force,
                            const dembark::Vec3<double>& displacement) const {
    dembark::ContactParts parts;
    split_touching(parts, normal, d.deltan, d.kn * d.deltan, exponent_, d.Fn, d.kt, force, displacement);
    books_->add(d, normal, parts, d.cri, d.is_wall ? 0.0 : d.crj);
  }

  static void add(ForceData& to, const dembark::Vec3<double>& force, const dembark::Vec3<double>& moment, double sign, double arm) {
    to.delta_F[0] += sign * force.x;
    to.delta_F[1] += sign * force.y;
    to.delta_F[2] += sign * force.z;
    to.delta_torque[0] += arm * moment.x;
    to.delta_torque[1] += arm * moment.y;
    to.delta_torque[2] += arm * moment.z;
  }
};

}  // namespace ContactModels
}  // namespace LIGGGHTS

#endif  // TANGENTIAL_MODEL_FINNIE_RABINOWICZ_H_
#endif
