// Bases of fixes that both LIGGGHTS (a fork of LAMMPS) and LAMMPS have. The files of this folder are compiled with the headers of
// either engine; what differs is in the engine's engine_fix.h, or left to the classes in the engine's own folder.
#ifndef DEMBARK_SHARED_FIX_H
#define DEMBARK_SHARED_FIX_H

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "dembark/contact.hpp"
#include "engine_fix.h"

namespace dembark_family {

inline dembark::Vec3<double> vector(const double* v) { return {v[0], v[1], v[2]}; }

DEMBARK_HOT void add(double* to, const dembark::Vec3<double>& v, double scale = 1.0) {
  to[0] += scale * v.x;
  to[1] += scale * v.y;
  to[2] += scale * v.z;
}

/// Two grains as they are. `separation` (m): that of j's centre to i's; `mass_i`, `mass_j` (kg): infinite of what forces do not move.
inline dembark::ContactBodies grain_pair(const LAMMPS_NS::Atom& atom, int i, int j, const dembark::Vec3<double>& separation, double mass_i,
                                         double mass_j) {
  dembark::ContactBodies b;
  b.separation = separation;
  b.velocity_1 = vector(atom.v[i]);
  b.velocity_2 = vector(atom.v[j]);
  b.angular_velocity_1 = vector(atom.omega[i]);
  b.angular_velocity_2 = vector(atom.omega[j]);
  b.radius_1 = atom.radius[i];
  b.radius_2 = atom.radius[j];
  b.mass_1 = mass_i;
  b.mass_2 = mass_j;
  return b;
}

/// What is wrong with units in which the laws do not hold as they are written, or nothing.
std::string units_error(const LAMMPS_NS::Force& force, const LAMMPS_NS::Update& update);
/// What is wrong with run styles whose steps have more than one length, or nothing.
std::string run_style_error(const LAMMPS_NS::Update& update);

/// What is wrong with `delete_atoms` and these words of it, or nothing. Unless they say 'compress no', the atoms that stay get other
/// numbers, and a run or a restart file has left histories whose partners are known by theirs.
std::string new_numbers_error(const LAMMPS_NS::Atom& atom, const LAMMPS_NS::Update& update, int narg, char** arg);

/// A fix's part of a restart file, piece by piece, as SharedFix::write_part() wrote it. The engine hands back its bytes without their
/// number: they begin with a word for their format and with their size. Another format or size is thrown as std::runtime_error.
class SavedPart {
 public:
  /// To be changed when a fix changes what it writes.
  static constexpr char format[9] = "dembark1";
  static constexpr std::size_t head = sizeof(std::uint64_t) + sizeof format - 1;

  explicit SavedPart(const char* buffer);
  template <class T>
  void read(T* values, std::size_t count = 1) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(values, count * sizeof(T));
  }
  /// All that is left.
  template <class T>
  std::vector<T> rest() {
    std::vector<T> values(left_ / sizeof(T));
    read(values.data(), values.size());
    end();
    return values;
  }
  /// Up to a zero.
  std::string text();
  void end() const {
    if (left_ != 0) refuse();
  }

 private:
  [[noreturn]] static void refuse();
  void take(void* to, std::size_t bytes);

  const char* at_;
  std::size_t left_ = 0;
};

/// Where bytes are, and how many.
typedef std::vector<std::pair<const void*, std::size_t>> Pieces;

class SharedFix : public dembark_engine::EngineFix {
 public:
  SharedFix(LAMMPS_NS::LAMMPS* lmp, int narg, char** arg);

  const std::string words;  ///< of the command, behind the style

 protected:
  static bool begins_with(const std::string& text, const char* with) { return text.rfind(with, 0) == 0; }
  static bool is(const Fix& fix, const char* style) { return std::string(fix.style) == style; }

  std::vector<Fix*> fixes() const;
  /// The first of a style, or nullptr.
  Fix* fix_of_style(const char* style) const;
  /// Whether `fix` has grains of this one's group. Collective.
  bool meets(const Fix& fix) const;
  void only_one() const;
  void only_verlet() const;
  void only_coherent_units() const;
  /// Ends the run where a fix changes the box: what it does to contacts across a border is not known here. `does`: what this fix does in
  /// the box, for messages.
  void only_constant_box(const std::string& does) const;
  /// `does`: what this fix does with them, for messages.
  void only_spheres(const std::string& does) const;
  /// Ends the run where a fix moves bodies made of several grains. `does`: what this fix does with single grains, for messages.
  void only_single_grains(const std::string& does) const;

  /// What `work` returns; what it throws ends the run with its line.
  template <class Work>
  auto checked(const Work& work) const -> decltype(work()) {
    std::string wrong;
    try {
      return work();
    } catch (const std::exception& e) {
      wrong = e.what();
    }
    fail(wrong);
  }

  /// This fix's part of a restart file, which the first rank writes and SavedPart reads.
  void write_part(FILE* file, const Pieces& pieces) const;
  /// What `write` writes to a file.
  static std::string written(const std::function<void(FILE*)>& write);
  /// Of an atom, behind what other fixes have there; the first number is how many there are.
  const double* restart_row(int i, int nth) const;
};

/// A fix that asks which grains follow their forces, and what gravity does to them.
class GrainFix : public SharedFix {
 public:
  using SharedFix::SharedFix;

 protected:
  struct Gravity {
    int group;  // its bit
    std::function<dembark::Vec3<double>()> acceleration;
  };

  /// `does`: what this fix does with single grains, for messages.
  void find_movers(const std::string& does);
  void want_movers() const;
  bool follows_forces(int i) const { return (atom->mask[i] & moving_) && !(atom->mask[i] & frozen_); }
  /// Moment of inertia over m r^2 of a grain that follows its forces; 0 if it does not turn.
  double inertia(int i) const {
    for (const auto& [group, inertia_factor] : movers_)
      if (atom->mask[i] & group) return inertia_factor;
    return 0.0;
  }

  std::vector<Gravity> gravities_;

 private:
  int moving_ = 0, frozen_ = 0;                 // bits of groups
  std::vector<std::pair<int, double>> movers_;  // bits of groups, and their moments of inertia over m r^2
};

}  // namespace dembark_family

#endif
