#include "engine_access.h"

#include <type_traits>

using namespace LAMMPS_NS;
using namespace LIGGGHTS;

namespace dembark_liggghts {
namespace {

enum Member {
  keyword_map,
  fix_map,
  command_map,
  pair_loop_map,
  wall_loop_map,
  restarted_styles,
  partner_count,
  partner,
  mean_mode,
  mean_file,
  mesh_precision,
  gravity_source,
  variable_count,
  variable_names,
  variable_texts,
  excluded_type_count,
  excluded_type_1,
  excluded_type_2,
  excluded_group_count,
  excluded_bit_1,
  excluded_bit_2
};
template <Member>
struct Tag {};
template <Member name, auto Pointer>
struct Reach {
  friend auto pointer(Tag<name>) { return Pointer; }
};
auto pointer(Tag<keyword_map>);
auto pointer(Tag<fix_map>);
auto pointer(Tag<command_map>);
auto pointer(Tag<pair_loop_map>);
auto pointer(Tag<wall_loop_map>);
auto pointer(Tag<restarted_styles>);
auto pointer(Tag<partner_count>);
auto pointer(Tag<partner>);
auto pointer(Tag<mean_mode>);
auto pointer(Tag<mean_file>);
auto pointer(Tag<variable_count>);
auto pointer(Tag<variable_names>);
auto pointer(Tag<variable_texts>);
auto pointer(Tag<mesh_precision>);
auto pointer(Tag<gravity_source>);
auto pointer(Tag<excluded_type_count>);
auto pointer(Tag<excluded_type_1>);
auto pointer(Tag<excluded_type_2>);
auto pointer(Tag<excluded_group_count>);
auto pointer(Tag<excluded_bit_1>);
auto pointer(Tag<excluded_bit_2>);
template struct Reach<keyword_map, &Settings::settings>;
template struct Reach<fix_map, &Modify::fix_map>;
template struct Reach<command_map, &Input::command_map>;
template struct Reach<pair_loop_map, &Utils::AbstractFactory<PairStyles::IGranularPairStyle>::styleTable>;
template struct Reach<wall_loop_map, &Utils::AbstractFactory<Walls::IGranularWall>::styleTable>;
template struct Reach<restarted_styles, &Modify::style_restart_peratom>;
template struct Reach<partner_count, &FixContactHistory::npartner_>;
template struct Reach<partner, &FixContactHistory::partner_>;
template struct Reach<mean_mode, &FixAveTime::ave>;
template struct Reach<mean_file, &FixAveTime::fp>;
template struct Reach<variable_count, &Variable::nvar>;
template struct Reach<variable_names, &Variable::names>;
template struct Reach<variable_texts, &Variable::data>;
template struct Reach<mesh_precision, &MultiNodeMesh<3>::precision_>;
template struct Reach<gravity_source, &FixGravity::varflag>;
template struct Reach<excluded_type_count, &Neighbor::nex_type>;
template struct Reach<excluded_type_1, &Neighbor::ex1_type>;
template struct Reach<excluded_type_2, &Neighbor::ex2_type>;
template struct Reach<excluded_group_count, &Neighbor::nex_group>;
template struct Reach<excluded_bit_1, &Neighbor::ex1_bit>;
template struct Reach<excluded_bit_2, &Neighbor::ex2_bit>;

template <Member name, class Type, class Owner>
Type& reach(Owner& owner) {
  static_assert(std::is_same_v<decltype(owner.*pointer(Tag<name>())), Type&>,
                "a private member of this LIGGGHTS has another type than in LIGGGHTS-PUBLIC 3.8.0: use that version");
  return owner.*pointer(Tag<name>());
}

template <Member count, Member first, Member second>
std::vector<std::pair<int, int>> excluded(Neighbor& neighbor) {
  std::vector<std::pair<int, int>> all;
  for (int k = 0; k < reach<count, int>(neighbor); ++k) all.emplace_back(reach<first, int*>(neighbor)[k], reach<second, int*>(neighbor)[k]);
  return all;
}

}  // namespace

std::map<std::string, Setting*>& keywords(Settings& settings) { return reach<keyword_map, std::map<std::string, Setting*>>(settings); }
std::map<std::string, FixCreator>& fix_styles(Modify& modify) { return *reach<fix_map, std::map<std::string, FixCreator>*>(modify); }
std::map<std::string, CommandCreator>& commands(Input& input) { return *reach<command_map, std::map<std::string, CommandCreator>*>(input); }
GranularCreators<PairStyles::IGranularPairStyle>& pair_loops() {
  return reach<pair_loop_map, GranularCreators<PairStyles::IGranularPairStyle>>(PairStyles::Factory::instance());
}
GranularCreators<Walls::IGranularWall>& wall_loops() {
  return reach<wall_loop_map, GranularCreators<Walls::IGranularWall>>(Walls::Factory::instance());
}
std::vector<std::string> restarted_fixes(Modify& modify) {
  char** const styles = reach<restarted_styles, char**>(modify);
  return {styles, styles + (styles ? modify.nfix_restart_peratom : 0)};
}
int* partner_counts(FixContactHistory& history) { return reach<partner_count, int*>(history); }
int** partners(FixContactHistory& history) { return reach<partner, int**>(history); }
bool is_of_one_interval(FixAveTime& mean) { return reach<mean_mode, int>(mean) == 0; }
bool has_file(FixAveTime& mean) { return reach<mean_file, FILE*>(mean); }

std::vector<std::pair<std::string, std::string>> formulas(Variable& variables) {
  std::vector<std::pair<std::string, std::string>> all;
  for (int k = 0; k < reach<variable_count, int>(variables); ++k)
    if (variables.equalstyle(k) || variables.atomstyle(k))
      all.emplace_back(reach<variable_names, char**>(variables)[k], reach<variable_texts, char***>(variables)[k][0]);
  return all;
}
bool from_variables(FixGravity& gravity) { return reach<gravity_source, int>(gravity) != 0; }
std::vector<std::pair<int, int>> excluded_types(Neighbor& neighbor) {
  return excluded<excluded_type_count, excluded_type_1, excluded_type_2>(neighbor);
}
std::vector<std::pair<int, int>> excluded_groups(Neighbor& neighbor) {
  return excluded<excluded_group_count, excluded_bit_1, excluded_bit_2>(neighbor);
}
double precision(TriMesh& mesh) { return reach<mesh_precision, double>(static_cast<MultiNodeMesh<3>&>(mesh)); }

}  // namespace dembark_liggghts
