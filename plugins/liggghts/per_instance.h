// What belongs to one engine of several in a process, for those who have no place in it to keep it.
#ifndef DEMBARK_PER_INSTANCE_H
#define DEMBARK_PER_INSTANCE_H

#include <map>

namespace LAMMPS_NS {
class LAMMPS;
}

namespace dembark_liggghts {

template <class Value>
class PerInstance {
 public:
  /// A fresh value at first.
  Value& operator[](const LAMMPS_NS::LAMMPS* engine) { return values_[engine]; }
  void forget(const LAMMPS_NS::LAMMPS* engine) { values_.erase(engine); }

 private:
  std::map<const LAMMPS_NS::LAMMPS*, Value> values_;
};

}  // namespace dembark_liggghts

#endif
