// fix ID group lcp/impact: contact forces between logs, and of logs with walls, from one linear complementarity problem a step.
//
// The model is engine-neutral and lies in dembark/impact/; this class carries bodies, forces, walls, restarts and output between
// LIGGGHTS and the model. It holds no physics.
#ifdef FIX_CLASS

FixStyle(lcp/impact,FixLcpImpact)

#else

#ifndef LMP_FIX_LCP_IMPACT_H
#define LMP_FIX_LCP_IMPACT_H

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
  FixLcpImpact(class LAMMPS *, int, char **);
  ~FixLcpImpact();

  int setmask();
  void init();
  void setup(int);
  void post_force(int);
  void post_run();
  void reset_dt();

  void write_restart(FILE *);
  void restart(char *);

  double compute_vector(int);
  double memory_usage();

 private:
  static constexpr int local_columns = 13;

  void check_order();
  void find_meshes();
  void gather_atoms();
  void gather_meshes(double dt);
  void take_meshes(double dt);
  void do_step(double dt, const std::function<void()> &work);
  dembark::impact::PeriodicBox box() const;
  double torque_scale() const;
  void apply();
  bool local_is_read() const;
  void fill_local();
  void keep_end_of_step();
  void checked(const std::function<void()> &work);
  void on_root(const std::function<void()> &work);
  void refuse(const std::string &line);

  std::unique_ptr<dembark::impact::Coupling> impacts_;
  dembark::impact::FirstRank ranks_;
  std::vector<class FixMeshSurface *> mesh_fix_;      // of each mesh
  std::vector<std::vector<dembark::Triangle>> mesh_;  // on the first rank: of each mesh as it is now, empty where it stands
  std::vector<int> own_atom_;                         // of each own body, in the order in which they are gathered
  std::vector<dembark::impact::Body> own_body_, all_body_;
  std::vector<dembark::impact::Push> own_push_, all_push_;
  int local_capacity_ = 1;
};

}  // namespace LAMMPS_NS

#endif
#endif
