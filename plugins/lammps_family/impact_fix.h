// fix ID group lcp/impact: contact forces between logs, and of logs with walls, from one linear complementarity problem a step.
//
// The model is engine-neutral and lies in dembark/impact/; this class carries bodies, forces, restarts and output between the engine and
// the model. It holds no physics.
#ifndef DEMBARK_IMPACT_FIX_H
#define DEMBARK_IMPACT_FIX_H

#include <memory>

#include "shared_fix.h"

#include "dembark/impact/coupling.hpp"
#include "first_rank.h"

namespace dembark_family {

class ImpactFix : public SharedFix {
 public:
  /// `mesh`: what the word behind a wall's name is if the wall is a mesh, for messages; nullptr where there are none.
  ImpactFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg, const char* mesh);
  ~ImpactFix() override;

  int setmask() override { return LAMMPS_NS::FixConst::POST_FORCE | LAMMPS_NS::FixConst::POST_RUN; }
  void init() override;
  void setup(int) override;
  void post_force(int) override;
  void post_run() override;
  void reset_dt() override;
  void write_restart(FILE* file) override;
  void restart(char* buffer) override;
  double compute_vector(int k) override;
  double memory_usage() override;

 protected:
  std::unique_ptr<dembark::impact::Coupling> impacts_;
  FirstRank ranks_;

 private:
  static constexpr int local_columns = 13, atom_columns = 8;

  /// What the engine's own walls are to have before a run; then, in each step, what of them all ranks send to the first (collective), and
  /// what the first takes over. `dt` (s): time since the last call, or 0 if there is none.
  virtual void find_walls() {}
  virtual void gather_walls(double) {}
  virtual void take_walls(double) {}

  void on_first(const std::function<void()>& work);
  void check_order() const;
  void find_movers();
  double find_torque_scale() const;
  dembark::impact::PeriodicBox box() const;
  void gather_atoms();
  void do_step(double dt, const std::function<void()>& work);
  void update_atoms();
  bool local_is_read() const;
  void fill_local();
  void keep_end_of_step();

  std::vector<int> own_atom_;  // of each own body, in the order in which they are gathered
  std::vector<dembark::impact::Body> own_body_, all_body_;
  std::vector<dembark::impact::BodyUpdate> own_update_, all_update_;
  int moved_ = 0, frozen_ = 0;  // bits of the groups of fixes nve/sphere, and freeze
  double torque_scale_ = 1.0;   // the engine turns atoms with an inertia of its own
  int local_capacity_ = 1, atom_capacity_ = 0;
};

}  // namespace dembark_family

#endif
