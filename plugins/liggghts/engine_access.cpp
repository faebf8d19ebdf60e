#include "engine_access.h"

#include <type_traits>

using namespace LAMMPS_NS;
using namespace LIGGGHTS;

namespace dembark_liggghts {
namespace {

struct Keywords {
  typedef std::map<std::string, Setting*> Settings::* type;
  friend type member(Keywords);
};
struct FixStyles {
  typedef std::map<std::string, FixCreator>* Modify::* type;
  friend type member(FixStyles);
};
struct Commands {
  typedef std::map<std::string, CommandCreator>* Input::* type;
  friend type member(Commands);
};
template <class Host>
struct Loops {
  typedef GranularCreators<Host> Utils::AbstractFactory<Host>::* type;
};
struct PairLoops : Loops<PairStyles::IGranularPairStyle> {
  friend type member(PairLoops);
};
struct WallLoops : Loops<Walls::IGranularWall> {
  friend type member(WallLoops);
};
struct PartnerCounts {
  typedef int* FixContactHistory::* type;
  friend type member(PartnerCounts);
};
struct Partners {
  typedef int** FixContactHistory::* type;
  friend type member(Partners);
};

template <class Tag, auto Member>
struct Reach {
  static_assert(std::is_same_v<decltype(Member), typename Tag::type>,
                "a private member of this LIGGGHTS has another type than in LIGGGHTS-PUBLIC 3.8.0: use that version");
  friend typename Tag::type member(Tag) { return Member; }
};
template struct Reach<Keywords, &Settings::settings>;
template struct Reach<FixStyles, &Modify::fix_map>;
template struct Reach<Commands, &Input::command_map>;
template struct Reach<PairLoops, &Utils::AbstractFactory<PairStyles::IGranularPairStyle>::styleTable>;
template struct Reach<WallLoops, &Utils::AbstractFactory<Walls::IGranularWall>::styleTable>;
template struct Reach<PartnerCounts, &FixContactHistory::npartner_>;
template struct Reach<Partners, &FixContactHistory::partner_>;

}  // namespace

std::map<std::string, Setting*>& keywords(Settings& settings) { return settings.*member(Keywords()); }
std::map<std::string, FixCreator>& fix_styles(Modify& modify) { return *(modify.*member(FixStyles())); }
std::map<std::string, CommandCreator>& commands(Input& input) { return *(input.*member(Commands())); }
GranularCreators<PairStyles::IGranularPairStyle>& pair_loops() { return PairStyles::Factory::instance().*member(PairLoops()); }
GranularCreators<Walls::IGranularWall>& wall_loops() { return Walls::Factory::instance().*member(WallLoops()); }
int* partner_counts(FixContactHistory& history) { return history.*member(PartnerCounts()); }
int** partners(FixContactHistory& history) { return history.*member(Partners()); }

}  // namespace dembark_liggghts
