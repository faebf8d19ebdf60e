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
#include "dembark/impact/periodic.hpp"
#include "dembark/impact/system.hpp"
#include "dembark/impact/triangles.hpp"
#include "fix_lcp_impact_mesh.h"
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
  typedef dembark::Vec3<double> Vec;
  static constexpr int local_columns = 13;

  void check_order();
  void find_meshes();
  void take_time_step();
  dembark::impact::PeriodicBox box() const;
  void gather_atoms();
  void take_bodies();
  void gather_meshes(double dt);
  void find_contacts(double reach, std::vector<dembark::impact::Contact> &contacts);
  void solve(double kick);
  void apply();
  bool local_is_read() const;
  void fill_local();
  const std::vector<dembark::impact::ContactResult> &results() const;
  void keep_end_of_step();
  void archive(dembark::impact::Archive &);
  void on_root(const std::function<void()> &work);
  void refuse(const std::string &line);

  dembark_liggghts::ImpactOptions options_;
  int me_;
  dembark::impact::StepReport report_;            // the same on all ranks
  std::vector<class FixMeshSurface *> mesh_fix_;  // per wall, null for planes and cylinders
  std::vector<dembark_liggghts::ImpactMesh> mesh_;

  // Own atoms, in the order in which their rows are gathered, and how many numbers each rank sends.
  std::vector<int> own_atom_, counts_, offsets_;
  std::vector<double> own_row_, all_row_;

  // On the first rank: all bodies of the group by number, the row of each, and the forces of the contacts.
  std::unique_ptr<dembark::impact::System> system_;
  dembark::impact::PeriodicPairs pairs_;
  dembark::impact::TriangleFinder triangles_;
  std::vector<dembark::impact::Body> bodies_;
  std::vector<std::size_t> order_;
  std::vector<Vec> force_, torque_;
  dembark::impact::ImpactFile file_;
  long long file_kept_;  // bytes, from a restart file; -1: none

  std::vector<dembark::impact::ContactResult> results_;  // of the step of a restart file

  dembark::impact::LastForces last_;
  bool kept_;  // last_ is that of the last step
  bigint last_step_;
  double last_dt_;
  // Time of a step: the engine's own clock does not survive a restart with another time step.
  double clock_time_;
  bigint clock_step_;
  int local_capacity_;
};

}  // namespace LAMMPS_NS

#endif
#endif
