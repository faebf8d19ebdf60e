#include "granular_combinations.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// The library's headers depend on this order.
#include "fix_insert_stream.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "lammps.h"
#include "update.h"
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

/// "(ROLLING_OFF, ROLLING_CDT)" of the list as a user writes it: "off|cdt".
std::string words(std::string models, const std::string& kind) {
  for (std::size_t at; (at = models.find(kind)) != std::string::npos;) models.erase(at, kind.size());
  std::string line;
  for (const char c : models)
    if (c == ',') line += '|';
    else if (!std::strchr("() ", c)) line += static_cast<char>(std::tolower(c));
  return line;
}

std::string available() {
  std::string line;
#define GRAN_MODELS(normal, tangential, cohesion, rolling, surface)                                                                  \
  line += (line.empty() ? "" : "; ") + ("model " + words(#normal, "NORMAL_")) + " tangential " + words(#tangential, "TANGENTIAL_") + \
          " cohesion " + words(#cohesion, "COHESION_") + " surface " + words(#surface, "SURFACE_") + " rolling_friction " +          \
          words(#rolling, "ROLLING_");
#include "granular_combinations_list.h"
#undef GRAN_MODELS
  return line;
}

/// Models of a combination in the order in which a user writes them, and in which their numbers stand in its hash.
constexpr const char* kinds[] = {"model", "tangential", "cohesion", "rolling_friction", "surface"};
typedef std::array<int, 5> Combination;

/// The name of a model, as a user writes it.
std::string name(int kind, int number) {
  std::string found = "off";
#define NORMAL_MODEL(id, text, constant) \
  if (kind == 0 && number == constant) found = #text;
#define TANGENTIAL_MODEL(id, text, constant) \
  if (kind == 1 && number == constant) found = #text;
#define COHESION_MODEL(id, text, constant) \
  if (kind == 2 && number == constant) found = #text;
#define ROLLING_MODEL(id, text, constant) \
  if (kind == 3 && number == constant) found = #text;
#define SURFACE_MODEL(id, text, constant) \
  if (kind == 4 && number == constant) found = #text;
#include "style_normal_model.h"
#include "style_tangential_model.h"
#include "style_cohesion_model.h"
#include "style_rolling_model.h"
#include "style_surface_model.h"
#undef NORMAL_MODEL
#undef TANGENTIAL_MODEL
#undef COHESION_MODEL
#undef ROLLING_MODEL
#undef SURFACE_MODEL
  return found;
}

std::vector<Combination> compiled_combinations() {
  std::vector<Combination> all;
#define MODELS(...) {__VA_ARGS__}
#define GRAN_MODELS(normal, tangential, cohesion, rolling, surface) \
  for (const int n : std::initializer_list<int> MODELS normal)      \
    for (const int r : std::initializer_list<int> MODELS rolling) all.push_back({n, tangential, cohesion, r, surface});
#include "granular_combinations_list.h"
#undef GRAN_MODELS
#undef MODELS
  return all;
}

/// Which model of `asked` there is no combination with, and what could stand there: those of the combinations that differ least.
std::string what_does_not_fit(const Combination& asked) {
  const std::vector<Combination> all = compiled_combinations();
  const auto others = [&](const Combination& c) {
    int count = 0;
    for (std::size_t k = 0; k < asked.size(); ++k) count += c[k] != asked[k];
    return count;
  };
  int fewest = int(asked.size());
  for (const Combination& c : all) fewest = std::min(fewest, others(c));
  std::string line;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    std::vector<std::string> choices;
    for (const Combination& c : all) {
      if (others(c) != fewest || c[k] == asked[k]) continue;
      const std::string choice = name(int(k), c[k]);
      if (std::find(choices.begin(), choices.end(), choice) == choices.end()) choices.push_back(choice);
    }
    if (choices.empty()) continue;
    line += std::string(line.empty() ? "" : fewest > 1 ? ", and " : ", or ") + kinds[k] + " " + name(int(k), asked[k]) + " can be ";
    for (std::size_t c = 0; c < choices.size(); ++c) line += (c ? ", " : "") + choices[c];
  }
  return line;
}

template <class Host>
using Creator = typename GranularCreators<Host>::mapped_type;

template <class Host>
Creator<Host> stock_fallback = nullptr;

Combination combination(std::int64_t hash) {
  Combination models;
  for (std::size_t k = 0; k < models.size(); ++k) models[k] = (hash >> (6 * k)) & 63;
  return models;
}
bool is_ours(const Combination& models) {
  return models[1] == TANGENTIAL_FINNIE_RABINOWICZ || models[2] == COHESION_CAPILLARY || models[2] == COHESION_ADHESION;
}

template <class Host>
Host* fallback_or_refuse(LAMMPS* lammps, typename Host::ParentType* parent, std::int64_t hash) {
  const Combination asked = combination(hash);
  if (is_ours(asked)) {
    const std::string line =
        "this combination of contact models is not compiled: " + what_does_not_fit(asked) + "; there is, in this order, " + available();
    lammps->error->all(FLERR, line.c_str());
  }
  return stock_fallback<Host>(lammps, parent, hash);
}

typedef PairStyles::IGranularPairStyle PairHost;
std::map<int, Creator<PairHost>> pair_makers;
std::map<const LAMMPS*, std::int64_t> pair_hashes;  // of what was made last

/// The engine compares the histories of a restart file with those of the pair style by their length alone: those of other models with as
/// many numbers would be read as displacements or volumes.
void check_restarted_histories(LAMMPS* lammps, std::int64_t hash) {
  const auto before = pair_hashes.find(lammps);
  if (before == pair_hashes.end() || before->second == hash) return;
  const Combination then = combination(before->second), now = combination(hash);
  const std::vector<std::string> styles = restarted_fixes(*lammps->modify);
  if (!(is_ours(then) || is_ours(now)) || std::find(styles.begin(), styles.end(), "contacthistory") == styles.end()) return;
  std::string line = "pair_style gran: the restart file has contact histories of";
  for (std::size_t k = 0; k < then.size(); ++k)
    if (then[k] != now[k]) line += std::string(" ") + kinds[k] + " " + name(int(k), then[k]) + ",";
  line += " which other models cannot read; give the models of the file, or start from positions and velocities";
  lammps->error->all(FLERR, line.c_str());
}

/// The engine begins the histories of pairs anew with each command pair_style, also when it has the same models.
void warn_of_lost_histories(const LAMMPS& lammps, std::int64_t hash) {
  const auto before = pair_hashes.find(&lammps);
  if (!lammps.update->first_update || before == pair_hashes.end() || lammps.comm->me != 0) return;
  if (is_ours(combination(before->second)) || is_ours(combination(hash)))
    lammps.error->warning(FLERR,
                          "pair_style gran: given again after a run, it takes friction springs, slip and bridges from all pairs of grains, "
                          "which begin as if they had just met; give it once, before the first run");
}

/// Makes the loop of any combination, ours or not; read_restart makes that of its file, and pair_style the one to go on with.
PairHost* make_pair_loop(LAMMPS* lammps, LAMMPS_NS::PairGran* parent, std::int64_t hash) {
  check_restarted_histories(lammps, hash);
  warn_of_lost_histories(*lammps, hash);
  pair_hashes[lammps] = hash;
  const auto maker = pair_makers.find(int(hash));
  return (maker == pair_makers.end() ? &fallback_or_refuse<PairHost> : maker->second)(lammps, parent, hash);
}

template <class Host, class Type>
Host* create(LAMMPS* lammps, typename Host::ParentType* parent, std::int64_t hash) {
  return new Type(lammps, parent, hash);
}

/// The engine's loop, with one line for who could have the faster one.
template <class Style>
class RollingPairLoop : public PairStyles::Granular<ContactModel<Style>> {
  LAMMPS* lammps_;

 public:
  RollingPairLoop(LAMMPS* lammps, LAMMPS_NS::PairGran* parent, std::int64_t hash)
      : PairStyles::Granular<ContactModel<Style>>(lammps, parent, hash), lammps_(lammps) {}

  void init_granular() override {
    PairStyles::Granular<ContactModel<Style>>::init_granular();
    if (lammps_->comm->me != 0 || std::exchange(warned_, true)) return;
    constexpr bool constant = Style::ROLLING == ROLLING_CDT;
    const std::string line = std::string("pair_style gran: with rolling_friction ") + (constant ? "cdt" : "epsd2") +
                             " pairs are computed one by one, which takes longer than with stock models; 'rolling_resistance " +
                             (constant ? "constant_torque" : "elastic_plastic") + "' behind the models is computed in packs";
    lammps_->error->warning(FLERR, line.c_str());
  }

 private:
  bool warned_ = false;
};

// The class that runs the pair loop of a style: the engine's, unless there is a faster one.
template <class Style>
struct PairLoop {
  typedef PairStyles::Granular<ContactModel<Style>> type;
};
template <int Cohesion>
struct PairLoop<GranStyle<HERTZ, TANGENTIAL_FINNIE_RABINOWICZ, Cohesion, ROLLING_OFF, SURFACE_DEFAULT>> {
  typedef DirectPairLoop<GranStyle<HERTZ, TANGENTIAL_FINNIE_RABINOWICZ, Cohesion, ROLLING_OFF, SURFACE_DEFAULT>> type;
};

template <int Cohesion, int Rolling>
struct PairLoop<GranStyle<HERTZ, TANGENTIAL_FINNIE_RABINOWICZ, Cohesion, Rolling, SURFACE_DEFAULT>> {
  typedef RollingPairLoop<GranStyle<HERTZ, TANGENTIAL_FINNIE_RABINOWICZ, Cohesion, Rolling, SURFACE_DEFAULT>> type;
};

template <int Normal, int Tangential, int Cohesion, int Rolling, int Surface>
void add_combination() {
  typedef GranStyle<Normal, Tangential, Cohesion, Rolling, Surface> Style;
  PairStyles::Factory::instance().addStyle("gran", Style::HASHCODE, &create<PairHost, typename PairLoop<Style>::type>);
  Walls::Factory::instance().addStyle("gran", Style::HASHCODE, &create<Walls::IGranularWall, MeshWall<ContactModel<Style>>>);
}

template <int... Ids>
struct Models {};

template <int Tangential, int Cohesion, int Surface, int... Normal, int... Rolling>
void add_combinations(Models<Normal...>, Models<Rolling...>) {
  const auto with = [](auto normal) { (add_combination<decltype(normal)::value, Tangential, Cohesion, Rolling, Surface>(), ...); };
  (with(std::integral_constant<int, Normal>()), ...);
}

template <class Host>
void guard_fallback(GranularCreators<Host>& creators) {
  Creator<Host>& creator = creators[{"gran", static_cast<int>(GranStyle<>::HASHCODE)}];
  if (creator == &fallback_or_refuse<Host>) return;  // Of an instance before the command clear.
  stock_fallback<Host> = creator;
  creator = &fallback_or_refuse<Host>;
}

void enter_combinations() {
  ContactModels::Factory& models = ContactModels::Factory::instance();
  models.addTangentialModel("finnie_rabinowicz", TANGENTIAL_FINNIE_RABINOWICZ);
  models.addCohesionModel("capillary", COHESION_CAPILLARY);
  models.addCohesionModel("adhesion", COHESION_ADHESION);

#define MODELS(...) Models<__VA_ARGS__>()
#define GRAN_MODELS(normal, tangential, cohesion, rolling, surface) \
  add_combinations<tangential, cohesion, surface>(MODELS normal, MODELS rolling);
#include "granular_combinations_list.h"
#undef GRAN_MODELS
#undef MODELS
}

}  // namespace

bool has_our_models(LAMMPS_NS::Force& force) {
  LAMMPS_NS::PairGran* const pair = dynamic_cast<LAMMPS_NS::PairGran*>(force.pair_match("gran", 0));
  return pair && is_ours(combination(pair->hashcode()));
}

void register_contact_models() {
  guard_fallback(wall_loops());
  // The tables outlive the command clear, but the engine enters its own combinations anew.
  static bool known = false;
  if (!std::exchange(known, true)) enter_combinations();
  for (auto& [key, creator] : pair_loops()) {
    if (creator == &make_pair_loop) continue;
    const bool fallback = key.second == int(GranStyle<>::HASHCODE);
    (fallback ? stock_fallback<PairHost> : pair_makers[key.second]) = creator;
    creator = &make_pair_loop;
  }
}

}  // namespace dembark_liggghts
