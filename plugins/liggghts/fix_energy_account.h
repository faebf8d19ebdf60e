// fix ID all energy/account: kinetic energy, and the works of gravity and of all parts of the contact forces, summed so that they balance
// to round-off at any time step.
//
// Velocity Verlet is two kicks a step with the same force, v <- v + (dt/2) F/m. A kick changes the kinetic energy by exactly
// (dt/2) F . u, u the mean of the velocities before and after it, so each part of F has its share of that. At the end of step n the mean
// of the kick before is v(n) - (dt/4) F/m, of the one behind v(n) + (dt/4) F/m: with P the power of a part at v(n) and Q that of the part
// on F/m, the works are dt/2 P -+ dt^2/8 Q. The second kick is booked in the next step, or with the forces of a set-up in between.
#ifdef FIX_CLASS

FixStyle(energy/account,FixEnergyAccount)

#else

#ifndef LMP_FIX_ENERGY_ACCOUNT_H
#define LMP_FIX_ENERGY_ACCOUNT_H

#include <array>
#include <string>
#include <vector>

#include "fix.h"

#include "energy_books.h"

namespace LAMMPS_NS {

class FixEnergyAccount : public Fix {
 public:
  FixEnergyAccount(class LAMMPS *, int, char **);

  int setmask();
  void init();
  void setup_pre_force(int);
  void pre_initial_integrate();
  void post_integrate();
  void pre_force(int);
  void final_integrate();
  void end_of_step();
  double compute_vector(int);
  void *extract(const char *, int &);
  void write_restart(FILE *);
  void restart(char *);
  double memory_usage();

 private:
  // What has a work: the parts of the contacts, walls and driven grains, gravity, and all forces on the grains that follow them.
  static constexpr std::size_t walls = dembark::contact_part_count, gravity = walls + 1, all_forces = walls + 2, works = walls + 3;
  typedef std::array<double, works> Works;

  /// Of this rank; their sums over the ranks are the energies (J), powers P (W) and Q (W/s).
  struct State {
    double kinetic = 0.0, normal_stored = 0.0, tangential_stored = 0.0;
    double first_kinetic = 0.0, first_stored = 0.0;  // at the beginning; what others make of the springs is added to the latter
    double imposed = 0.0;
    Works work{}, power{}, rate{};  // work so far, P, Q
  };
  static constexpr std::size_t state_size = sizeof(State) / sizeof(double);

  [[noreturn]] void refuse(const std::string &what);
  void check_models();
  void check_motion();
  bool follows_forces(int i) const;
  double shape() const;
  double kinetic() const;
  void measure_all_forces(double &power, double &rate) const;
  void note_changes();
  void measure_powers();
  void kick(double sign);
  void take_setup(State &state, bool &begun) const;
  void impose(double change, double of, double &sum) const;
  const std::array<double, state_size> &totals();

  dembark_liggghts::EnergyBooks books_;
  State now_, shown_;     // shown_: at the end of the last step, or of the set-up
  bool begun_ = false;    // the first_ values are there
  bool fresh_ = false;    // forces are those of a set-up
  bool resumed_ = false;  // powers come from a restart file, for its forces
  bool totalled_ = false;
  double kinetic_before_ = 0.0;  // J, with the atoms before they are exchanged
  int moving_ = 0, frozen_ = 0;  // bits of groups
  std::vector<class FixGravity *> gravities_;
  std::array<double, state_size> totals_{};
};

}  // namespace LAMMPS_NS

#endif
#endif
