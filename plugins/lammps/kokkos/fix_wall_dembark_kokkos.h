// fix wall/dembark/kk: the contacts of fix_wall_dembark.h with planes and cylinders in a Kokkos kernel.
#ifndef DEMBARK_FIX_WALL_DEMBARK_KOKKOS_H
#define DEMBARK_FIX_WALL_DEMBARK_KOKKOS_H

#include <vector>

#include "fix_wall_dembark.h"
#include "grain_views.h"
#include "wall_faces.h"

namespace dembark_lammps {

/// Force and moment on all grains, contacts and bridges.
struct WallTotals {
  double value[8] = {};
  KOKKOS_INLINE_FUNCTION void operator+=(const WallTotals& other) {
    for (int k = 0; k < 8; ++k) value[k] += other.value[k];
  }
};

/// The contacts of a grain with all faces. A row has of each face whether there is a history, and the history.
template <class DeviceType>
struct WallKernel : GrainViews<DeviceType> {
  typedef GrainViews<DeviceType> Views;
  typedef typename Views::AT AT;
  typedef typename Views::Vec3 Vec3;
  typedef WallTotals value_type;
  using Views::add;
  using Views::advance;
  using Views::dt;
  using Views::laws;
  using Views::layout;
  using Views::mask;
  using Views::radius;
  using Views::report;
  using Views::type;
  using Views::vector;
  using Views::x;

  typename AT::t_f_array force, torque;
  typename AT::t_float_2d wall_force, rows;
  dembark::WallFrame frame;
  WallFace faces[most_faces];
  Vec3 velocity{}, spin{}, centre{};  ///< of the wall, m/s at `centre`, rad/s and m
  int face_count = 0, wall_type = 0, group = 0;

  KOKKOS_INLINE_FUNCTION void operator()(const int i, WallTotals& sums) const {
    for (int k = 0; k < 3; ++k) wall_force(i, k) = 0.0;
    if (!(mask[i] & group)) return;
    const Vec3 place = vector(x, i), inside = frame.inside(place);
    Vec3 arms[most_faces];
    double distances[most_faces];
    bool near = true;
    for (int k = 0; k < face_count; ++k) {
      arms[k] = faces[k].arm(inside, distances[k]);
      near = near && distances[k] >= 0.0;
    }
    Vec3 total{}, moment{};
    for (int k = 0; k < face_count; ++k) {
      const int first = k * (layout.size() + 1);
      const bool had = rows(i, first) != 0.0;
      // At the axis of a cylinder no direction leads to it.
      const bool on_axis = faces[k].radius > 0.0 && distances[k] == faces[k].radius;
      if (!near || on_axis || !(distances[k] < radius[i] || had)) {
        if (advance) rows(i, first) = 0.0;
        continue;
      }
      dembark::ContactBodies b = this->body(i);
      b.separation = frame.outside(arms[k]);
      b.wall_spin = spin;
      b.velocity_2 = velocity + cross(spin, place - b.separation - centre);
      double row[most_numbers];
      dembark::ContactState state;
      if (had) {
        for (int n = 0; n < layout.size(); ++n) row[n] = rows(i, first + 1 + n);
        layout.load(row, state);
      }
      const bool was_held = state.cohesion.held();
      const dembark::ContactParameters& p = laws(type[i], wall_type);
      const dembark::ContactForce out = contact_step(p, b, dt, state, advance);
      if (dembark::has_no_direction(out.normal)) report(Fault::coincidence, i, i, 0.0);
      if (advance) {
        if (state.cohesion.held() && !was_held) {
          const double limit = p.cohesion.liquid.stable_time_step(b.effective_radius(), b.effective_mass());
          if (dt > limit) report(Fault::time_step, i, i, limit);
        }
        rows(i, first) = out.interacting;
        layout.store(row, state);
        for (int n = 0; n < layout.size(); ++n) rows(i, first + 1 + n) = row[n];
      }
      if (!out.interacting) continue;
      total += out.force;
      moment += out.torque_1;
      sums.value[6] += out.overlap > 0.0;
      sums.value[7] += state.cohesion.held();
    }
    add(force, i, total);
    add(torque, i, moment);
    add(wall_force, i, total);
    const Vec3 about = cross(place - centre, total) + moment;
    const double all[6] = {total.x, total.y, total.z, about.x, about.y, about.z};
    for (int k = 0; k < 6; ++k) sums.value[k] += all[k];
  }
};

}  // namespace dembark_lammps

namespace LAMMPS_NS {

/// Rows are the host's when grains change their places in memory or are saved, and the device's from the next step on.
template <class DeviceType>
class FixWallDembarkKokkos : public FixWallDembark {
 public:
  typedef DeviceType device_type;

  FixWallDembarkKokkos(LAMMPS* lmp, int narg, char** arg);
  ~FixWallDembarkKokkos() override;
  void init() override;
  void post_force(int vflag) override;

  void grow_arrays(int count) override;
  void copy_arrays(int from, int to, int mode) override;
  void set_arrays(int i) override;
  int pack_exchange(int i, double* buffer) override;
  int unpack_exchange(int i, double* buffer) override;
  int pack_restart(int i, double* buffer) override;
  void unpack_restart(int i, int nth) override;
  int maxsize_restart() override;

  /// Whether the device knows the surface that the command names.
  static bool knows(const LAMMPS& lmp, int narg, char** arg);

 private:
  std::vector<dembark_lammps::WallFace> faces_;
  dembark_lammps::DeviceLaws<DeviceType> laws_;
  dembark_lammps::FaultView<DeviceType> fault_;
  DAT::tdual_float_2d k_rows_, k_force_;
  bool on_device_ = false;
  int count_ = 0;  // of grains whose rows the device has

  int width() const { return int(faces_.size()) * (layout_.size() + 1); }
  void to_host();
  void to_device();
  void stop_at(const dembark_lammps::Fault& fault);
};

}  // namespace LAMMPS_NS

#endif
