#include "engine_access.h"

#include <type_traits>

using namespace LAMMPS_NS;
using namespace LIGGGHTS;

namespace dembark_liggghts {
namespace {

enum Member { keyword_map, fix_map, command_map, pair_loop_map, wall_loop_map, partner_count, partner };
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
auto pointer(Tag<partner_count>);
auto pointer(Tag<partner>);
template struct Reach<keyword_map, &Settings::settings>;
template struct Reach<fix_map, &Modify::fix_map>;
template struct Reach<command_map, &Input::command_map>;
template struct Reach<pair_loop_map, &Utils::AbstractFactory<PairStyles::IGranularPairStyle>::styleTable>;
template struct Reach<wall_loop_map, &Utils::AbstractFactory<Walls::IGranularWall>::styleTable>;
template struct Reach<partner_count, &FixContactHistory::npartner_>;
template struct Reach<partner, &FixContactHistory::partner_>;

template <Member name, class Type, class Owner>
Type& reach(Owner& owner) {
  static_assert(std::is_same_v<decltype(owner.*pointer(Tag<name>())), Type&>,
                "a private member of this LIGGGHTS has another type than in LIGGGHTS-PUBLIC 3.8.0: use that version");
  return owner.*pointer(Tag<name>());
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
int* partner_counts(FixContactHistory& history) { return reach<partner_count, int*>(history); }
int** partners(FixContactHistory& history) { return reach<partner, int**>(history); }

}  // namespace dembark_liggghts
