// One step of the contacts of one grain with the later grains of its list, as Kokkos calls it.
#ifndef DEMBARK_CONTACT_KERNEL_H
#define DEMBARK_CONTACT_KERNEL_H

#include "grain_views.h"

namespace dembark_lammps {

/// `neighflag`: of the package KOKKOS; HALFTHREAD adds forces atomically. Each grain has all its owned and ghost partners (newton off).
///
/// Histories are rows of layout.size() + 1 numbers. LAMMPS hands a row to the other grain of a pair with all its signs turned over. The
/// last number says so: 1 as stored, -1 turned over, 0 without a history.
template <class DeviceType, int neighflag>
struct ContactKernel : GrainViews<DeviceType> {
  typedef GrainViews<DeviceType> Views;
  typedef typename Views::AT AT;
  typedef typename Views::Vec3 Vec3;
  typedef EV_FLOAT value_type;
  typedef Kokkos::View<F_FLOAT* [3], typename DAT::t_f_array::array_layout, typename KKDevice<DeviceType>::value,
                       Kokkos::MemoryTraits<AtomicF<neighflag>::value>>
      Sums;
  typedef Kokkos::View<F_FLOAT* [6], typename DAT::t_virial_array::array_layout, typename KKDevice<DeviceType>::value,
                       Kokkos::MemoryTraits<AtomicF<neighflag>::value>>
      Virials;
  using Views::add;
  using Views::advance;
  using Views::dt;
  using Views::inertial_mass;
  using Views::laws;
  using Views::layout;
  using Views::omega;
  using Views::radius;
  using Views::report;
  using Views::type;
  using Views::v;
  using Views::vector;
  using Views::x;

  Sums force, torque;
  Virials atom_virials;
  typename AT::t_neighbors_2d neighbors;
  typename AT::t_int_1d_randomread grains, neighbor_counts;
  typename AT::t_int_2d flags;
  typename AT::t_float_2d rows;
  double skin = 0.0;
  double special[4] = {};
  int own = 0;
  bool global_virial = false, each_virial = false;

  KOKKOS_INLINE_FUNCTION bool load(int i, int jj, dembark::ContactState& state) const {
    const int size = layout.size(), first = jj * (size + 1);
    const double sign = rows(i, first + size);
    if (sign == 0.0) return false;
    double row[most_numbers];
    for (int k = 0; k < size; ++k) row[k] = sign * rows(i, first + k);
    if (sign > 0.0) layout.load(row, state);
    else {
      double swapped[most_numbers];
      layout.swap_bodies(row, swapped);
      layout.load(swapped, state);
    }
    return true;
  }

  KOKKOS_INLINE_FUNCTION void store(int i, int jj, bool keep, const dembark::ContactState& state) const {
    const int size = layout.size(), first = jj * (size + 1);
    flags(i, jj) = keep;
    rows(i, first + size) = keep;
    if (!keep) return;
    double row[most_numbers];
    layout.store(row, state);
    for (int k = 0; k < size; ++k) rows(i, first + k) = row[k];
  }

  KOKKOS_INLINE_FUNCTION void operator()(const int ii) const {
    EV_FLOAT sums;
    (*this)(ii, sums);
  }

  KOKKOS_INLINE_FUNCTION void operator()(const int ii, EV_FLOAT& sums) const {
    const int i = grains[ii];
    const Vec3 place = vector(x, i);
    dembark::ContactBodies b = this->body(i);
    Vec3 own_force{}, own_torque{};
    const int count = neighbor_counts[i];
    for (int jj = 0; jj < count; ++jj) {
      const int listed = neighbors(i, jj), j = listed & NEIGHMASK;
      b.separation = place - vector(x, j);
      b.radius_2 = radius[j];
      const double sum = b.radius_1 + b.radius_2;
      const bool had = rows(i, (jj + 1) * (layout.size() + 1) - 1) != 0.0;
      if ((dot(b.separation, b.separation) >= sum * sum && !had) || special[listed >> SBBITS & 3] == 0.0) {
        flags(i, jj) = had;
        continue;
      }
      b.velocity_2 = vector(v, j);
      b.angular_velocity_2 = vector(omega, j);
      b.mass_2 = inertial_mass(j);
      const dembark::ContactParameters& p = laws(type[i], type[j]);
      dembark::ContactState state;
      if (had) load(i, jj, state);
      const bool was_held = state.cohesion.held();
      const dembark::ContactForce out = contact_step(p, b, dt, state, advance);
      if (dembark::has_no_direction(out.normal)) report(Fault::coincidence, i, j, 0.0);
      if (advance) {
        if (state.cohesion.held() && !was_held) {
          const double limit = p.cohesion.liquid.stable_time_step(b.effective_radius(), b.effective_mass());
          if (dt > limit) report(Fault::time_step, i, j, limit);
          if (state.cohesion.rupture_distance > skin) report(Fault::reach, i, j, state.cohesion.rupture_distance);
        }
        store(i, jj, out.interacting, state);
      } else flags(i, jj) = had;
      if (!out.interacting) continue;
      own_force += out.force;
      own_torque += out.torque_1;
      if (j < own) {
        add(force, j, -out.force);
        add(torque, j, out.torque_2);
      }
      if (global_virial || each_virial) tally(i, j, b.separation, out.force, sums);
    }
    add(force, i, own_force);
    add(torque, i, own_torque);
  }

  KOKKOS_INLINE_FUNCTION void tally(int i, int j, const Vec3& d, const Vec3& f, EV_FLOAT& sums) const {
    const double virial[6] = {d.x * f.x, d.y * f.y, d.z * f.z, d.x * f.y, d.x * f.z, d.y * f.z};
    const double share = j < own ? 1.0 : 0.5;
    for (int k = 0; k < 6; ++k) {
      if (global_virial) sums.v[k] += share * virial[k];
      if (!each_virial) continue;
      atom_virials(i, k) += 0.5 * virial[k];
      if (j < own) atom_virials(j, k) += 0.5 * virial[k];
    }
  }
};

}  // namespace dembark_lammps

#endif
