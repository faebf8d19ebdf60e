// fix ID group lcp/impact: contact forces between logs, and of logs with walls, from one linear complementarity problem a step.
//
// The model is engine-neutral and lies in dembark/impact/; this class carries bodies, forces, walls, restarts and output between
// LIGGGHTS and the model. It holds no physics. One rank, the first, has all bodies and solves; the others send atoms and get forces.
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

#include "dembark/impact/impact_file.hpp"
#include "dembark/impact/last_forces.hpp"
#include "dembark/impact/system.hpp"
#include "fix_lcp_impact_options.h"

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
  void take_bodies();
  void take_meshes(double dt);
  void solve(double kick);
  void do_step(double dt, const std::function<void()> &work);
  dembark::impact::PeriodicBox box() const;
  void apply();
  bool local_is_read() const;
  void fill_local();
  const std::vector<dembark::impact::ContactResult> &results() const;
  void keep_end_of_step();
  void archive(dembark::impact::Archive &);
  void checked(const std::function<void()> &work);
  void on_root(const std::function<void()> &work);
  void refuse(const std::string &line);
  template <class T>
  void gather(std::vector<T> &own, std::vector<T> &all);

  dembark_liggghts::ImpactOptions options_;
  dembark::impact::StepReport report_;                // the same on all ranks
  std::vector<class FixMeshSurface *> mesh_fix_;      // of each mesh
  std::vector<std::vector<dembark::Triangle>> mesh_;  // on the first rank: of each mesh as it is now, empty where it stands
  std::vector<int> own_atom_;                         // of each own body, in the order in which they are gathered
  std::vector<dembark::impact::Body> own_body_;
  std::vector<dembark::impact::Push> own_push_;

  // On the first rank: all bodies of the group by number, as they came and what each of them gets, and the model.
  std::vector<int> counts_, offsets_;  // bytes, of the last gather
  std::vector<dembark::impact::Body> all_body_, bodies_;
  std::vector<dembark::impact::Push> all_push_, pushes_;
  std::vector<std::size_t> order_;
  std::unique_ptr<dembark::impact::System> system_;
  dembark::impact::ImpactFile file_;
  std::vector<dembark::impact::ContactResult> results_;  // of the step of a restart file

  dembark::impact::LastForces last_;
  bool kept_ = false;  // last_ is that of the last step
  bigint last_step_ = -1;
  double last_dt_ = 0.0;
  // Time of a step: the engine's own clock does not survive a restart with another time step.
  double clock_time_ = 0.0;
  bigint clock_step_ = 0;
  int local_capacity_ = 1;
};

}  // namespace LAMMPS_NS

#endif
#endif
