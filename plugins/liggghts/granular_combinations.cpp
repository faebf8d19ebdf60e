#include "granular_combinations.h"

#include <cctype>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

// The library's headers depend on this order.
#include "fix_insert_stream.h"
#include "error.h"
#include "lammps.h"
#include "contact_models.h"
#include "style_surface_model.h"
#include "style_normal_model.h"
#include "style_tangential_model.h"
#include "style_cohesion_model.h"
#include "style_rolling_model.h"
#include "granular_pair_style.h"
#include "granular_wall.h"
#include "pair_gran_base.h"
#include "fix_wall_gran_base.h"

#include "direct_pair_loop.h"
#include "engine_access.h"
#include "mesh_wall.h"

namespace dembark_liggghts {
namespace {

using LAMMPS_NS::LAMMPS;
using namespace LIGGGHTS;
using namespace LIGGGHTS::ContactModels;

/// What of granular_combinations_list.h a user can write, in the words of a script: combinations that differ in one model stand together.
std::string available() {
  // By tangential, cohesion and surface model: the rolling models of each normal model.
  std::map<std::string, std::map<std::string, std::string>> groups;
  const auto word = [](const std::string& id, const std::string& kind) {
    std::string name = id.substr(id.rfind(kind, 0) == 0 ? kind.size() : 0);
    for (char& c : name) c = static_cast<char>(std::tolower(c));
    return name;
  };
  const auto add = [&](const char* normal, const char* tangential, const char* cohesion, const char* rolling, const char* surface) {
    std::string& of_normal = groups["tangential " + word(tangential, "TANGENTIAL_") + " cohesion " + word(cohesion, "COHESION_") +
                                    " surface " + word(surface, "SURFACE_")][word(normal, "NORMAL_")];
    of_normal += (of_normal.empty() ? "" : "|") + word(rolling, "ROLLING_");
  };
#define GRAN_MODEL(normal, tangential, cohesion, rolling, surface) add(#normal, #tangential, #cohesion, #rolling, #surface);
#include "granular_combinations_list.h"
#undef GRAN_MODEL
  std::string line;
  for (const auto& [rest, normals] : groups) {
    std::map<std::string, std::string> same;  // normal models by their rolling models
    for (const auto& [normal, rollings] : normals) same[rollings] += (same[rollings].empty() ? "" : "|") + normal;
    for (const auto& [rollings, names] : same)
      line += (line.empty() ? "" : "; ") + ("model " + names + " " + rest) + " rolling_friction " + rollings;
  }
  return line;
}

template <class Host>
using Creator = typename GranularCreators<Host>::mapped_type;

template <class Host>
Creator<Host> stock_fallback = nullptr;

template <class Host>
Host* fallback_or_refuse(LAMMPS* lammps, typename Host::ParentType* parent, std::int64_t hash) {
  const int tangential = (hash >> 6) & 63, cohesion = (hash >> 12) & 63;
  if (tangential == TANGENTIAL_FINNIE_RABINOWICZ || cohesion == COHESION_CAPILLARY) {
    const std::string line = std::string("this combination of contact models is not compiled; there is ") + available();
    lammps->error->all(FLERR, line.c_str());
  }
  return stock_fallback<Host>(lammps, parent, hash);
}

template <class Host, class Type>
Host* create(LAMMPS* lammps, typename Host::ParentType* parent, std::int64_t hash) {
  return new Type(lammps, parent, hash);
}

// The class that runs the pair loop of a style: the engine's, unless there is a faster one.
template <class Style>
struct PairLoop {
  typedef PairStyles::Granular<ContactModel<Style>> type;
};
template <int Cohesion>
struct PairLoop<GranStyle<HERTZ, TANGENTIAL_FINNIE_RABINOWICZ, Cohesion, ROLLING_OFF, SURFACE_DEFAULT>> {
  typedef DirectPairLoop<GranStyle<HERTZ, TANGENTIAL_FINNIE_RABINOWICZ, Cohesion, ROLLING_OFF, SURFACE_DEFAULT>> type;
};

template <int Normal, int Tangential, int Cohesion, int Rolling, int Surface>
void add_combination() {
  typedef GranStyle<Normal, Tangential, Cohesion, Rolling, Surface> Style;
  PairStyles::Factory::instance().addStyle("gran", Style::HASHCODE,
                                           &create<PairStyles::IGranularPairStyle, typename PairLoop<Style>::type>);
  Walls::Factory::instance().addStyle("gran", Style::HASHCODE, &create<Walls::IGranularWall, MeshWall<ContactModel<Style>>>);
}

template <class Host>
void guard_fallback(GranularCreators<Host>& creators) {
  Creator<Host>& creator = creators[{"gran", static_cast<int>(GranStyle<>::HASHCODE)}];
  stock_fallback<Host> = creator;
  creator = &fallback_or_refuse<Host>;
}

}  // namespace

void register_contact_models() {
  ContactModels::Factory& models = ContactModels::Factory::instance();
  models.addTangentialModel("finnie_rabinowicz", TANGENTIAL_FINNIE_RABINOWICZ);
  models.addCohesionModel("capillary", COHESION_CAPILLARY);

#define GRAN_MODEL(normal, tangential, cohesion, rolling, surface) add_combination<normal, tangential, cohesion, rolling, surface>();
#include "granular_combinations_list.h"
#undef GRAN_MODEL

  guard_fallback(pair_loops());
  guard_fallback(wall_loops());
}

}  // namespace dembark_liggghts
