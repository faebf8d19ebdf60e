// What the contact models book for fix energy/account: the parts of all contact forces, added up by the grain on which they act.
//
// A work needs the mean velocity of the step (dembark/contact_energy.hpp), which is known only when all forces of a grain are. So forces
// and torques are kept, part by part, from their computation to the end of the step. Each rank books for the grains that it owns.
#ifndef DEMBARK_ENERGY_BOOKS_H
#define DEMBARK_ENERGY_BOOKS_H

#include <array>
#include <vector>

#include "contact_interface.h"
#include "fix.h"
#include "modify.h"

#include "dembark/contact_energy.hpp"

namespace dembark_liggghts {

class EnergyBooks {
 public:
  typedef dembark::Vec3<double> Vec3;
  typedef LIGGGHTS::ContactModels::SurfacesCloseData Contact;
  struct Load {
    Vec3 force, torque;
  };
  typedef std::array<Load, dembark::contact_part_count> Loads;

  std::array<double, dembark::contact_part_count> wall_power{};  ///< W, of each part on the grains, were they moved as the wall is
  double normal_stored = 0.0, tangential_stored = 0.0;           ///< J

  /// Begins anew for the forces of a moment, with this many owned grains.
  void clear(int grains) {
    loads_.assign(std::size_t(grains), {});
    wall_power.fill(0.0);
    normal_stored = tangential_stored = 0.0;
  }

  std::size_t size() const { return loads_.size(); }
  const Loads& of(int i) const { return loads_[std::size_t(i)]; }

  /// One part of a contact's force on grain i (N), with the lever arms of both bodies (m). Forces that move no grain are not booked.
  void add(dembark::ContactPart part, const Contact& d, const Vec3& normal, const Vec3& force, double arm_i, double arm_j) {
    if (!d.computeflag) return;
    const std::size_t p = static_cast<std::size_t>(part);
    const Vec3 moment = cross(normal, force);
    const double scale = d.is_wall ? d.area_ratio : 1.0;
    Load& on_i = loads_[std::size_t(d.i)][p];
    on_i.force += scale * force;
    on_i.torque -= (scale * arm_i) * moment;
    if (d.is_wall) {
      wall_power[p] += scale * dot(force, {d.v_j[0], d.v_j[1], d.v_j[2]});
    } else if (std::size_t(d.j) < loads_.size()) {
      Load& on_j = loads_[std::size_t(d.j)][p];
      on_j.force -= force;
      on_j.torque -= arm_j * moment;
    }
  }

  /// A touching contact: springs and dash-pots, and what the springs hold; of a pair that two ranks compute each books half of it.
  void add(const Contact& d, const Vec3& normal, const dembark::ContactParts& parts, double arm_i, double arm_j) {
    using dembark::ContactPart;
    if (!d.computeflag) return;
    for (const ContactPart part :
         {ContactPart::normal_elastic, ContactPart::normal_viscous, ContactPart::tangential_elastic, ContactPart::tangential_viscous})
      add(part, d, normal, parts[part], arm_i, arm_j);
    const double share = d.is_wall ? d.area_ratio : std::size_t(d.j) < loads_.size() ? 1.0 : 0.5;
    normal_stored += share * parts.normal_stored;
    tangential_stored += share * parts.tangential_stored;
  }

 private:
  std::vector<Loads> loads_;
};

constexpr const char* energy_books_name = "energy books";

/// The books of the fix, or nullptr.
inline EnergyBooks* find_energy_books(LAMMPS_NS::Modify* modify) {
  int none = 0;
  LAMMPS_NS::Fix* const fix = modify->find_fix_style("energy/account", 0);
  return fix ? static_cast<EnergyBooks*>(fix->extract(energy_books_name, none)) : nullptr;
}

}  // namespace dembark_liggghts

#endif
