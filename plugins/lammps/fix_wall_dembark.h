// LAMMPS adapter of whole contacts between grains and a wall: the law of pair_style dembark/granular, whose coefficients for an atom type
// the wall has. The wall is the surface of a region or the triangles of an STL file, and can move as
// dembark/motion/prescribed_motion.hpp says.
//
//   fix ID group wall/dembark region REGION|stl FILE type T [precision P] [motion TERM ...]
#ifndef DEMBARK_FIX_WALL_DEMBARK_H
#define DEMBARK_FIX_WALL_DEMBARK_H

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "dembark/contact_history.hpp"
#include "dembark/motion/wall_frame.hpp"
#include "energy_tally.h"
#include "moving_wall.h"
#include "rows_fix.h"
#include "wall_surface.h"

namespace LAMMPS_NS {

class FixWallDembark : public dembark_lammps::RowsFix<dembark_family::SharedFix> {
 public:
  FixWallDembark(LAMMPS* lmp, int narg, char** arg);
  ~FixWallDembark() override;
  int setmask() override;
  void init() override;
  void setup(int vflag) override;
  void post_force(int vflag) override;
  void end_of_step() override;
  double compute_vector(int k) override;

  void grow_arrays(int count) override;
  void copy_arrays(int from, int to, int) override;
  void set_arrays(int i) override;
  int pack_restart(int i, double* buffer) override;
  void unpack_restart(int i, int nth) override;
  int size_restart(int i) override { return 1 + RowsFix::size_restart(i); }
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;

  int type() const { return wall_type_; }
  /// m, of grain i and the parts of the wall that it touched when the last forces were computed.
  const std::vector<double>& overlaps(int i);

  /// Calls visit(volume, imbalance) for each bridge of grain i, which may change them.
  template <class Visit>
  void each_bridge(int i, Visit visit) {
    double* const end = row(i).data() + row(i).size();
    for (double* slot = row(i).data(); slot < end; slot += slot_size())
      if (slot[1 + layout_.cohesion_at()] > 0.0) visit(slot[1 + layout_.cohesion_at()], slot[1 + layout_.imbalance_at()]);
  }

 protected:
  int wall_type_ = 0;
  std::unique_ptr<dembark_lammps::WallSurface> surface_;
  std::unique_ptr<dembark_family::MovingWall> moving_;  // nullptr: it stands, or its region moves by itself
  dembark::WallFrame frame_;
  class PairDembarkGranular* pair_ = nullptr;
  dembark::HistoryLayout layout_;
  // A row has of each contact the number of the part of the surface plus one, and the history.
  double** force_ = nullptr;                       // of each grain: of the wall on it, N
  std::array<double, 8> totals_{}, all_totals_{};  // on this process, and on all at the step `summed_`
  bigint summed_ = -1;
  dembark_lammps::EnergyTally* tally_ = nullptr;

  int slot_size() const { return 1 + layout_.size(); }
  std::string not_for(int type) const;
  [[noreturn]] void refuse_coincidence(int i) const;
  void move();
  dembark::Vec3<double> origin() const;

 private:
  class FixCapillaryLiquid* liquid_ = nullptr;
  std::vector<double> before_;  // the row of the grain in work before this step
  std::vector<double> overlaps_;

  std::string region_state() const;
  /// In restart files before a row: negative, as no part of a surface is.
  double layout_key() const { return -1.0 - layout_.code(); }
  void find_pair();
  void check_types();
  void act_on(int i, bool advance);
  const double* history_of(const dembark_lammps::WallContact& contact, const dembark::Vec3<double>& centre, double radius) const;
  const std::array<double, 8>& totals();
  dembark::WallLoad load();
};

}  // namespace LAMMPS_NS

#endif
