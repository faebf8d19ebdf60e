#include "fix_integration_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "fix_mesh_surface.h"
#include "fix_neighlist_mesh.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "neigh_list.h"
#include "pair_gran.h"
#include "pair_hybrid.h"
#include "primitive_wall.h"
#include "tri_mesh.h"

#include "pair_parameters.h"

using namespace LAMMPS_NS;
using dembark_liggghts::PairParameters;

/// Whether a pair style has no contacts of grains: one of a fluid, or a hybrid of such.
static bool fluid_only(const Force &force) {
  const auto fluid = [](const char *style) { return std::strncmp(style, "sph", 3) == 0; };
  const auto *const hybrid = dynamic_cast<const PairHybrid *>(force.pair);
  return hybrid ? std::all_of(hybrid->keywords, hybrid->keywords + hybrid->nstyles, fluid) : fluid(force.pair_style);
}

void FixIntegrationMonitor::post_create() {
  const std::string name = "accelerations_" + std::string(id);
  property_ = new char[name.size() + 1];
  std::strcpy(property_, name.c_str());
  std::vector<std::string> words{name, "all", "property/atom", name, "vector", "yes", "no", "no"};
  words.resize(words.size() + history_numbers, "0.");
  std::vector<char *> pointers;
  for (std::string &word : words) pointers.push_back(&word[0]);
  histories_ = modify->add_fix_property_atom(int(pointers.size()), pointers.data(), style);
}

void FixIntegrationMonitor::pre_delete(bool unfixed) {
  if (unfixed && histories_) modify->delete_fix(property_);
  delete[] property_;
  property_ = nullptr;
}

/// Stiffness is known of the normal models hertz and hooke. Without a pair style, or with a fluid alone, there are no contacts to judge.
void FixIntegrationMonitor::find_contacts() {
  walls_.clear();
  pair_ = dynamic_cast<PairGran *>(force->pair_match("gran", 0));
  if (!pair_ && force->pair && !fluid_only(*force))
    fail(std::string("it judges the contacts of one pair_style gran, alone or in a hybrid; there is pair_style ") + force->pair_style);
  if (!pair_) return;
  for (Fix *const fix : fixes())
    if (FixWallGran *const wall = dynamic_cast<FixWallGran *>(fix)) walls_.push_back(wall);
  hertz_ = pair_->contact_match("normal", "hertz");
  if (!hertz_ && !pair_->contact_match("normal", "hooke"))
    fail("it knows the stiffness of model hertz or hooke only; the pair style has another model");
  for (FixWallGran *const wall : walls_)
    if (!wall->contact_match("normal", hertz_ ? "hertz" : "hooke"))
      fail(std::string("it knows the stiffness of walls with the normal model of the pair style only; fix ") + wall->id + " has another");
  const dembark_liggghts::PropertyReader read(force->registry, modify, error, "fix integration/monitor");
  using dembark::ContactNumber;
  if (!hertz_) characteristic_velocity_ = dembark_liggghts::PropertySource(read, 1, 1).number(ContactNumber::characteristic_velocity);
  moduli_ = for_all_pairs(read, [](const dembark_liggghts::PropertySource &of) {
    return dembark::effective_youngs_modulus(of.number(ContactNumber::youngs_modulus, 1), of.number(ContactNumber::poissons_ratio, 1),
                                             of.number(ContactNumber::youngs_modulus, 2), of.number(ContactNumber::poissons_ratio, 2));
  });
}

bool FixIntegrationMonitor::has_contacts() const { return pair_; }

const NeighList *FixIntegrationMonitor::pairs() const { return pair_->list; }

double FixIntegrationMonitor::stiffness(int type_i, int type_j, double radius, double mass, double overlap) const {
  const dembark::HertzParameters elastic(moduli_(type_i, type_j), 1.0, 1.0);
  const auto response = hertz_ ? dembark::hertz(elastic, radius, mass, overlap, 0.0)
                               : dembark::hooke(elastic, characteristic_velocity_, radius, mass, overlap, 0.0);
  return response.normal_stiffness;
}

dembark::ContactParameters FixIntegrationMonitor::parameters(int type_i, int type_j) const {
  return PairParameters::of(lmp)->parameters(type_i, type_j);
}

void FixIntegrationMonitor::setup_pre_force(int) {
  if (!PairParameters::of(lmp))
    fail("impacts are integrated anew for pair_style gran model hertz tangential finnie_rabinowicz only, without viscous liquid");
  if (atom->map_style == 0) fail("impacts needs 'atom_modify map array'");
}

double *FixIntegrationMonitor::history(int i) { return histories_->array_atom[i]; }

void FixIntegrationMonitor::clear_histories() { histories_->set_all(0.0, false); }

/// Grains and walls as in FixWallGran, by the lists of candidates that it has.
void FixIntegrationMonitor::take_walls() {
  double away[3];
  int side = 0;
  const auto take = [this](int i, double distance, int type) {
    if (distance < 0.0) take_contact(i, -1, INFINITY, type, -distance);
  };
  for (FixWallGran *const wall : walls_) {
    const auto takes = [&](int i) { return i < atom->nlocal && (atom->mask[i] & wall->groupbit) && (atom->mask[i] & groupbit); };
    if (!wall->is_mesh_wall()) {
      int *list = nullptr;
      const int count = wall->primitiveWall()->getNeighbors(list);
      for (int k = 0; k < count; ++k)
        if (takes(list[k]))
          take(list[k], wall->primitiveWall()->resolveContact(atom->x[list[k]], atom->radius[list[k]], away), wall->atom_type_wall());
      continue;
    }
    for (int m = 0; m < wall->n_meshes(); ++m) {
      FixMeshSurface *const surface = wall->mesh_list()[m];
      TriMesh *const mesh = surface->triMesh();
      const int triangles = mesh->sizeLocal() + mesh->sizeGhost();
      for (int t = 0; surface->meshNeighlist() && t < triangles; ++t)
        for (const int i : surface->meshNeighlist()->get_contact_list(t))
          if (takes(i)) take(i, mesh->resolveTriSphereContact(i, t, atom->radius[i], atom->x[i], away, side), surface->atomTypeWall());
    }
  }
}
