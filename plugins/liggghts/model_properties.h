// Material properties of the contact models, read from `fix property/global` with range checks and defaults.
#ifndef DEMBARK_MODEL_PROPERTIES_H
#define DEMBARK_MODEL_PROPERTIES_H

#include <string>

#include "atom.h"
#include "error.h"
#include "fix_property_global.h"
#include "modify.h"
#include "property_registry.h"

namespace dembark_liggghts {

/// One property of the engine. A missing one without default, a wrong shape or an asymmetric pair table ends the run with one line.
class PropertyReader {
  LAMMPS_NS::LAMMPS* lmp_;
  LAMMPS_NS::Modify* modify_;
  LAMMPS_NS::Error* error_;
  int types_;
  std::string model_;

  LAMMPS_NS::Fix* look_up(const char* name, const char* shape, int n, int m) const {
    return modify_->find_fix_property(name, "property/global", shape, n, m, model_.c_str(), false);
  }

  LAMMPS_NS::FixPropertyGlobal* find(const char* name, const char* shape, bool required) {
    // The engine's look-up accepts a scalar only with length 0 and otherwise checks the length.
    const int n = std::string(shape) == "scalar" ? 0 : types_;
    const int m = std::string(shape) == "peratomtypepair" ? types_ : 0;
    LAMMPS_NS::Fix* fix = look_up(name, shape, n, m);
    if (fix) return static_cast<LAMMPS_NS::FixPropertyGlobal*>(fix);
    // One that is there in another form is a mistake, also where none is needed.
    std::string other;
    for (const char* form : {"scalar", "peratomtype", "peratomtypepair"})
      if (std::string(form) != shape && look_up(name, form, 0, 0)) other = form;
    if (!required && other.empty()) return nullptr;
    const std::string values = n == 0   ? "VALUE"
                               : m == 0 ? "VALUE (one a type)"
                                        : std::to_string(lmp_->atom->ntypes) + " VALUE (one a pair of types)";
    const std::string line = model_ + " needs the material property '" + name + "': fix ID all property/global " + name + " " + shape +
                             " " + values + (other.empty() ? "" : ", not " + other);
    error_->all(FLERR, line.c_str());
    return nullptr;
  }

 public:
  PropertyReader(PropertyRegistry& registry, LAMMPS_NS::Modify* modify, LAMMPS_NS::Error* error, const std::string& model)
      : lmp_(registry.getLAMMPS()), modify_(modify), error_(error), types_(registry.max_type()), model_(model) {}

  int types() const { return types_; }

  void fail(const std::string& what) { error_->all(FLERR, (model_ + ": " + what).c_str()); }

  /// Whether a table of pairs of types is there.
  bool given(const char* name) { return find(name, "peratomtypepair", false) != nullptr; }

  double scalar(const char* name) { return find(name, "scalar", true)->compute_scalar(); }
  double scalar(const char* name, double otherwise) {
    LAMMPS_NS::FixPropertyGlobal* fix = find(name, "scalar", false);
    return fix ? fix->compute_scalar() : otherwise;
  }
  double per_type(const char* name, int type) { return find(name, "peratomtype", true)->compute_vector(type - 1); }
  double per_pair(const char* name, int i, int j) { return symmetric(find(name, "peratomtypepair", true), name, i, j); }
  double per_pair(const char* name, int i, int j, double otherwise) {
    LAMMPS_NS::FixPropertyGlobal* fix = find(name, "peratomtypepair", false);
    return fix ? symmetric(fix, name, i, j) : otherwise;
  }

 private:
  double symmetric(LAMMPS_NS::FixPropertyGlobal* fix, const char* name, int i, int j) {
    const double value = fix->compute_array(i - 1, j - 1);
    if (value != fix->compute_array(j - 1, i - 1))
      fail(std::string(name) + " differs between types " + std::to_string(i) + "-" + std::to_string(j) + " and " + std::to_string(j) + "-" +
           std::to_string(i) + "; the table of a pair property has to be symmetric");
    return value;
  }
};

}  // namespace dembark_liggghts

#endif
