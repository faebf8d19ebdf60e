// fix ID group lcp/impact: contact forces between logs, and of logs with walls, from one linear complementarity problem a step.
//
// The model is engine-neutral and lies in dembark/impact/; this class carries bodies, forces, restarts and output between LAMMPS and the
// model. It holds no physics.
#ifndef DEMBARK_FIX_LCP_IMPACT_H
#define DEMBARK_FIX_LCP_IMPACT_H

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fix.h"

#include "dembark/impact/coupling.hpp"
#include "dembark/impact/first_rank.hpp"

namespace LAMMPS_NS {

class FixLcpImpact : public Fix {
 public:
  FixLcpImpact(LAMMPS* lmp, int narg, char** arg);
  ~FixLcpImpact() override;
  int setmask() override;
  void init() override;
  void setup(int vflag) override;
  void post_force(int vflag) override;
  void post_run() override;
  void reset_dt() override;
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  double compute_vector(int k) override;
  double memory_usage() override;

 private:
  static constexpr int local_columns = 13;

  [[noreturn]] void fail(const std::string& what) const;
  void checked(const std::function<void()>& work);
  void on_first(const std::function<void()>& work);
  void check_order() const;
  double find_torque_scale() const;
  dembark::impact::PeriodicBox box() const;
  void gather_atoms();
  void do_step(const std::function<void()>& work);
  bool local_is_read() const;
  void fill_local();
  void keep_end_of_step();

  std::unique_ptr<dembark::impact::Coupling> impacts_;
  dembark::impact::FirstRank ranks_;
  std::vector<int> own_atom_;  // of each own body, in the order in which they are gathered
  std::vector<dembark::impact::Body> own_body_, all_body_;
  std::vector<dembark::impact::Push> own_push_, all_push_;
  double torque_scale_ = 1.0;  // LAMMPS turns atoms with an inertia of its own
  int local_capacity_ = 1;
};

}  // namespace LAMMPS_NS

#endif
