// fix ID group lcp/impact: contact forces between logs, and of logs with walls, from one linear complementarity problem a step.
//
// The model is engine-neutral and lies in dembark/impact/; this class carries bodies, forces, walls, restarts and output between
// LIGGGHTS and the model. It holds no physics.
#ifdef FIX_CLASS

FixStyle(lcp/impact,FixLcpImpact)

#else

#ifndef LMP_FIX_LCP_IMPACT_H
#define LMP_FIX_LCP_IMPACT_H

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fix.h"

#include "dembark/impact/system.hpp"
#include "fix_lcp_impact_mesh.h"
#include "fix_lcp_impact_options.h"
#include "fix_lcp_impact_record.h"

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

  dembark::impact::Settings settings() const;
  void build_system();
  void check_order();
  void find_meshes();
  void open_record();
  void read_atom(int i, double *row) const;
  void gather_bodies();
  void gather_meshes(double dt);
  void find_contacts(double reach, std::vector<dembark::impact::Contact> &contacts);
  void add_periodic_images(double reach, std::vector<dembark::impact::Body> &bodies, std::vector<int> &origin);
  double inertia_factor() const;
  void solve(double kick);
  void apply();
  void find_local_readers();
  bool local_is_read() const;
  void fill_local();
  const std::vector<dembark::impact::ContactResult> &results() const;
  void take_snapshot();
  bool same_bodies() const;
  std::vector<double> pack() const;
  void refuse(const std::string &line);

  dembark_liggghts::ImpactOptions options_;
  std::unique_ptr<dembark::impact::System> system_;
  dembark::impact::StepReport report_;
  std::vector<double> restored_;  // state of the model from a restart file, until there is a system

  // All bodies of the group, sorted by tag, the same on every rank; of each own atom its index there.
  std::vector<dembark::impact::Body> bodies_;
  std::vector<int> own_atom_, own_body_;
  std::vector<double> own_row_, all_row_;
  std::vector<std::size_t> order_;
  std::vector<Vec> force_, torque_;                      // of the contacts, on bodies_
  std::vector<dembark::impact::ContactResult> results_;  // of the step of a restart file
  dembark::impact::PairFinder pairs_;

  std::vector<class FixMeshSurface *> mesh_fix_;  // per wall, null for planes and cylinders
  std::vector<dembark_liggghts::ImpactMesh> mesh_;

  // What the forces of the last step were computed for: a set-up that finds it again takes those forces.
  bigint last_step_;
  std::vector<double> last_bodies_;  // tag, position, velocity, spin at the end of the step
  std::vector<Vec> last_force_, last_torque_;
  double last_dt_;
  // Time of a step: the engine's own clock does not survive a restart with another time step.
  double clock_time_;
  bigint clock_step_;

  dembark_liggghts::ImpactRecord record_;
  std::string record_name_;
  long long record_kept_;  // bytes, from a restart file; -1: none
  int me_, local_capacity_;
  bool local_always_;  // something besides dumps may read the local array
};

}  // namespace LAMMPS_NS

#endif
#endif
