// fix ID all capillary/liquid [content C | volume V] [share cap|fraction C] [return equal|radius|taken] [max_bridge V]
//     [wall WALL-ID POOL SHARE PART] ...: liquid that grains and walls own, for cohesion capillary with carried_liquid on.
//
// The contact models report, during a step, which touching contacts have no bridge and which bridges broke; at the end of the step the
// fix settles all of them with dembark/capillary/liquid.hpp. Each grain keeps books of its own: its liquid (the property capillaryLiquid),
// its part of the bridges to other grains, and the bridges to each wall. A pair across a border is reckoned on both ranks from the
// same numbers; each rank books for the grains it owns.
#ifdef FIX_CLASS

FixStyle(capillary/liquid,FixCapillaryLiquid)

#else

#ifndef LMP_FIX_CAPILLARY_LIQUID_H
#define LMP_FIX_CAPILLARY_LIQUID_H

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fix.h"

#include "dembark/capillary/bridge.hpp"
#include "dembark/capillary/liquid.hpp"

namespace LAMMPS_NS {

class FixCapillaryLiquid : public Fix {
 public:
  /// A touching contact without a bridge. `j`: -1 for a wall. `bridge`: where volume and rupture distance go, `imbalance`: as in NewBridge.
  struct Request {
    int i, j, wall;
    double radius_i, radius_j;
    double *bridge, *imbalance;
    const dembark::capillary::BridgeForce *force;
    bool primitive_wall;
  };

  FixCapillaryLiquid(class LAMMPS *, int, char **);
  ~FixCapillaryLiquid();

  int setmask();
  void post_create();
  void pre_delete(bool);
  void init();
  void setup_pre_force(int);
  void setup(int);
  void pre_force(int);
  void end_of_step();
  double compute_vector(int);

  void grow_arrays(int);
  void copy_arrays(int, int, int);
  void set_arrays(int);
  int pack_exchange(int, double *);
  int unpack_exchange(int, double *);
  int pack_restart(int, double *);
  void unpack_restart(int, int);
  int size_restart(int);
  int maxsize_restart();
  void write_restart(FILE *);
  void restart(char *);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);
  double memory_usage();

  /// False while a set-up computes forces: then nothing may form or break.
  bool collecting() const;
  /// Where the models of a wall, or of the pairs (nullptr), keep volume and imbalance among the numbers of a contact.
  void place(const class Fix *wall, int volume, int imbalance) { places_[wall] = {volume, imbalance}; }
  /// The number of a wall in `Request` and broke_wall().
  int wall_number(const class Fix *wall) const;
  void ask(const Request &request) { requests_.push_back(request); }
  void broke(int i, int j, double volume, double imbalance);
  void broke_wall(int i, int wall, double volume, double imbalance);
  /// Volume (m^3) of a bridge that grains of up to `largest_radius` may well form; 0: not known. Collective.
  double likely_bridge(double largest_radius) const;

 private:
  struct Wall {
    std::string id;
    double pool = 0.0, share = 0.0, part = 0.0;
    bool named = false;                        // in the arguments
    class FixWallGran *fix = nullptr;          // nullptr: not there (yet, or any more)
    class FixPropertyAtom *history = nullptr;  // of the contacts with a primitive wall
  };
  struct Totals {
    double grains, bridges, walls, count;
  };

  dembark::capillary::ShareRule share_;
  dembark::capillary::Return return_ = dembark::capillary::Return::equal;
  double content_ = 0.0, volume_ = -1.0, largest_ = dembark::capillary::flat<double>;
  std::vector<Wall> walls_;
  std::map<const class Fix *, std::pair<int, int>> places_;

  class FixPropertyAtom *property_ = nullptr;
  std::vector<double> books_;  // per atom: part of bridges to grains, then bridges to each wall
  std::vector<Request> requests_;
  dembark::capillary::Demands demands_;
  std::vector<double> grants_, wall_returned_, wall_taken_, wall_grants_;
  double reference_ = 0.0, lost_ = 0.0, added_ = 0.0;  // reference_: what there should be
  bigint atoms_ = -1;                                  // that had liquid when it was last counted; -1: never
  bigint totals_step_ = -1;
  Totals totals_{};

  std::size_t width() const { return 1 + walls_.size(); }
  double *book(int i) { return &books_[std::size_t(i) * width()]; }
  const double *book(int i) const { return &books_[std::size_t(i) * width()]; }
  double *liquid() const;
  template <class Call>
  void each_pair_bridge(Call call) const;
  template <class Call>
  void each_wall_bridge(const Wall &wall, int i, Call call) const;
  double initial(int i) const;

  void parse(int narg, char **arg);
  [[noreturn]] void refuse(const std::string &what);
  void find_walls();
  void rearrange(const std::vector<Wall> &walls);

  void after_new_list(bool in_run);
  void take_in();
  void check_pairs(bool in_run);
  void check_walls();
  void count_all();
  double holdings() const;

  void settle_walls();
  void grant_all();
  void form(const Request &request);
  const Totals &totals();
};

}  // namespace LAMMPS_NS

#endif
#endif
