// The grains as a Kokkos kernel sees them, and why it stops a run: what the contacts of pairs and those with walls share.
#ifndef DEMBARK_GRAIN_VIEWS_H
#define DEMBARK_GRAIN_VIEWS_H

#include "atom_kokkos.h"
#include "kokkos_type.h"

#include "dembark/contact_history.hpp"

#include "device_laws.h"

namespace dembark_lammps {

/// Why the run cannot go on; the first that a kernel finds.
struct Fault {
  enum Kind { none, coincidence, time_step, reach };
  int kind = none;
  int i = 0, j = 0;
  double limit = 0.0;  ///< s, or m
};

template <class DeviceType>
using FaultView = Kokkos::View<Fault, DeviceType>;

/// What kernels have found so far.
template <class DeviceType>
Fault found(const FaultView<DeviceType>& there) {
  Fault fault;
  Kokkos::deep_copy(Kokkos::View<Fault, Kokkos::HostSpace, Kokkos::MemoryTraits<Kokkos::Unmanaged>>(&fault), there);
  return fault;
}

/// Numbers of a contact that the layout knows of, at most, without those of carried liquid.
constexpr int most_numbers = 5 + 2 + dembark::ring_numbers + 3;

/// The base of a kernel of contacts.
template <class DeviceType>
struct GrainViews {
  typedef ArrayTypes<DeviceType> AT;
  typedef dembark::Vec3<double> Vec3;

  typename AT::t_x_array_randomread x;
  typename AT::t_v_array_randomread v, omega;
  typename AT::t_int_1d_randomread type, mask;
  typename AT::t_float_1d_randomread mass, radius;
  typename DeviceLaws<DeviceType>::Reader laws;
  FaultView<DeviceType> fault;
  dembark::HistoryLayout layout;
  double dt = 0.0;
  int frozen = 0;       ///< bit of the group whose masses are infinite
  bool advance = true;  ///< false: the forces of the present state, which stays

  void see(const LAMMPS_NS::AtomKokkos& atom) {
    x = atom.k_x.view<DeviceType>();
    v = atom.k_v.view<DeviceType>();
    omega = atom.k_omega.view<DeviceType>();
    type = atom.k_type.view<DeviceType>();
    mask = atom.k_mask.view<DeviceType>();
    mass = atom.k_rmass.view<DeviceType>();
    radius = atom.k_radius.view<DeviceType>();
  }

  template <class View>
  KOKKOS_INLINE_FUNCTION static Vec3 vector(const View& of, int i) {
    return {of(i, 0), of(i, 1), of(i, 2)};
  }
  template <class View>
  KOKKOS_INLINE_FUNCTION static void add(const View& to, int i, const Vec3& value) {
    to(i, 0) += value.x;
    to(i, 1) += value.y;
    to(i, 2) += value.z;
  }
  KOKKOS_INLINE_FUNCTION double inertial_mass(int i) const { return mask[i] & frozen ? INFINITY : mass[i]; }
  /// Grain i as body 1 of its contacts.
  KOKKOS_INLINE_FUNCTION dembark::ContactBodies body(int i) const {
    dembark::ContactBodies b;
    b.velocity_1 = vector(v, i);
    b.angular_velocity_1 = vector(omega, i);
    b.radius_1 = radius[i];
    b.mass_1 = inertial_mass(i);
    return b;
  }

  KOKKOS_INLINE_FUNCTION void report(Fault::Kind kind, int i, int j, double limit) const {
    Fault& there = fault();
    if (Kokkos::atomic_compare_exchange(&there.kind, int(Fault::none), int(kind)) != Fault::none) return;
    there.i = i;
    there.j = j;
    there.limit = limit;
  }
};

}  // namespace dembark_lammps

#endif
