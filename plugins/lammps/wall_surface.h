// The surfaces that fix wall/dembark knows: that of a region of LAMMPS, and the triangles of an STL file.
#ifndef DEMBARK_WALL_SURFACE_H
#define DEMBARK_WALL_SURFACE_H

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "pointers.h"

#include "dembark/motion/prescribed_motion.hpp"
#include "dembark/surface/surface_contacts.hpp"
#include "dembark/vec3.hpp"

namespace LAMMPS_NS {
class Region;
}

namespace dembark_lammps {

/// Where a sphere is near a surface.
struct WallContact {
  int surface;                       ///< number of a part of it; histories are kept by that
  dembark::Vec3<double> separation;  ///< m, from the surface to the sphere's centre
  dembark::Vec3<double> velocity{};  ///< m/s, of the surface there
  int triangle = 0;                  ///< or the copy of one
};

/// What is wrong is thrown as std::invalid_argument.
class WallSurface : protected LAMMPS_NS::Pointers {
 public:
  explicit WallSurface(LAMMPS_NS::LAMMPS* lmp) : Pointers(lmp) {}

  /// Before a run; `reach`: m, from a sphere's centre to whatever can act on it, as it is now: it may grow during the run; `motion`: of the
  /// complete surface, or nullptr.
  virtual void prepare(double reach, const dembark::PrescribedMotion* motion) = 0;
  virtual void begin_step() {}
  /// Of the centre of a sphere, in the surface's own frame, with all of the surface within `reach` (m). Until the next call.
  virtual const std::vector<WallContact>& contacts(const dembark::Vec3<double>& centre, double radius, double reach) = 0;
  /// Whether a contact that was on part `before` is `now`.
  virtual bool goes_on(int before, const WallContact& now, const dembark::Vec3<double>& /*centre*/, double /*radius*/) const {
    return before == now.surface;
  }
  virtual dembark::Vec3<double> spin() const { return {}; }    ///< rad/s, of its own motion
  virtual dembark::Vec3<double> origin() const { return {}; }  ///< m, of moments
  virtual LAMMPS_NS::Region* region() const { return nullptr; }
  /// m, of its triangles, if it has any, in the surface's own frame.
  virtual std::vector<dembark::Vec3<double>> middles() const { return {}; }

 protected:
  std::vector<WallContact> found_;
};

class RegionSurface : public WallSurface {
 public:
  RegionSurface(LAMMPS_NS::LAMMPS* lmp, const std::string& id);
  void prepare(double reach, const dembark::PrescribedMotion* motion) override;
  void begin_step() override;
  const std::vector<WallContact>& contacts(const dembark::Vec3<double>& centre, double radius, double reach) override;
  dembark::Vec3<double> spin() const override;
  dembark::Vec3<double> origin() const override;
  LAMMPS_NS::Region* region() const override { return region_; }

 private:
  const std::string id_;
  LAMMPS_NS::Region* region_ = nullptr;
  bool moves_ = false;
  double axis_length_ = 1.0;  // of its rotation, as the script gives it

  void find();
};

/// The triangles and, where the box is periodic, their copies.
class TriangleSurface : public WallSurface {
 public:
  /// Collective: the first rank reads the file. precision: m.
  TriangleSurface(LAMMPS_NS::LAMMPS* lmp, const std::string& file, double precision);
  void prepare(double reach, const dembark::PrescribedMotion* motion) override;
  const std::vector<WallContact>& contacts(const dembark::Vec3<double>& centre, double radius, double reach) override;
  bool goes_on(int before, const WallContact& now, const dembark::Vec3<double>& centre, double radius) const override;
  std::vector<dembark::Vec3<double>> middles() const override;

 private:
  std::size_t own_ = 0;  // triangles of the file, which come first
  dembark::SurfaceContacts surface_;
  double reach_ = 0.0;  // m, for which there are copies
  std::vector<dembark::SurfacePoint> points_;
  std::vector<std::pair<int, int>> copies_;  // of own triangles: a copy's number in `surface_`; sorted

  void copy_across_periods(double reach);
  dembark::Vec3<double> wrapped(dembark::Vec3<double> place) const;
};

}  // namespace dembark_lammps

#endif
