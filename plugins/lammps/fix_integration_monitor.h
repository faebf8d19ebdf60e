// LAMMPS's side of fix ID group integration/monitor (monitor_fix.h).
#ifndef DEMBARK_FIX_INTEGRATION_MONITOR_H
#define DEMBARK_FIX_INTEGRATION_MONITOR_H

#include <vector>

#include "monitor_fix.h"
#include "rows_fix.h"

namespace LAMMPS_NS {

class FixIntegrationMonitor : public dembark_lammps::RowsFix<dembark_family::MonitorFix> {
 public:
  FixIntegrationMonitor(LAMMPS* lmp, int narg, char** arg) : RowsFix(lmp, narg, arg) { make_rows(history_numbers); }

 private:
  void find_contacts() override;
  bool has_contacts() const override { return pair_; }
  const NeighList* pairs() const override;
  void take_walls() override;
  double stiffness(int type_i, int type_j, double radius, double mass, double overlap) const override;
  dembark::ContactParameters parameters(int type_i, int type_j) const override;
  double* history(int i) override { return row(i).data(); }
  void clear_histories() override;

  class PairDembarkGranular* pair_ = nullptr;
  std::vector<class FixWallDembark*> walls_;
};

}  // namespace LAMMPS_NS

#endif
