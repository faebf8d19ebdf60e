// What fix resume/exact compares between the run that wrote a state and the run that goes on, and which of its fixes go on exactly.
#include <algorithm>
#include <cctype>
#include <cstring>

#include "group.h"
#include "neighbor.h"

#include "exact_fixes.h"
#include "resume_fix.h"

using namespace LAMMPS_NS;
namespace states = dembark::restart;

namespace dembark_family {
namespace {

/// Whether a pair style writes its settings into restart files, and nothing else. LAMMPS's granular also counts how often it was set.
bool writes_settings(const std::string& pair_style) { return pair_style == "gran" || pair_style == "sph/coupled"; }

/// Fixes of both engines that go on exactly from a state, and why. docs/how-to/restarts.md lists them with those of exact_fixes.h; a test
/// compares.
constexpr const char* shared_exact_fixes[][2] = {
    {"addforce", "keeps nothing"},
    {"capillary/liquid", "its liquid is in the restart file"},
    {"drag", "keeps nothing"},
    {"energy/account", "its sums are in the restart file"},
    {"enforce2d", "keeps nothing"},
    {"freeze", "keeps nothing"},
    {"gravity", "keeps nothing; its acceleration is compared"},
    {"integration/monitor", "its counts and past accelerations are in the restart file"},
    {"lcp/impact", "its contacts are in the restart file"},
    {"lineforce", "keeps nothing"},
    {"momentum", "keeps nothing"},
    {"move", "the positions and the step that it starts from are in the restart file"},
    {"nve", "keeps nothing"},
    {"nve/sphere", "keeps nothing"},
    {"planeforce", "keeps nothing"},
    {"print", "keeps nothing"},
    {"resume/exact", "this fix"},
    {"setforce", "keeps nothing"},
    {"viscous", "keeps nothing"},
};

template <std::size_t count>
bool lists(const char* const (&fixes)[count][2], const std::string& style) {
  return std::any_of(fixes, fixes + count, [&](const auto& exact) { return style == exact[0]; });
}

/// Functions and words of formulas whose value depends on what was drawn before, on where the run began, or on the machine.
const char* const functions_with_memory[] = {"random",  "normal",   "ramp", "vdisplace", "swiggle", "cwiggle",
                                             "elapsed", "elaplong", "cpu",  "tpcpu",     "spcpu",   "cpuremain"};

std::string function_with_memory(const std::string& formula) {
  const auto in_word = [&](std::size_t k) {
    return k < formula.size() && (std::isalnum(static_cast<unsigned char>(formula[k])) || formula[k] == '_');
  };
  for (const char* const word : functions_with_memory)
    for (std::size_t at = formula.find(word); at != std::string::npos; at = formula.find(word, at + 1))
      if (!(at > 0 && in_word(at - 1)) && !in_word(at + std::strlen(word))) return word;
  return "";
}

}  // namespace

/// Collective; complete on the first rank.
states::RunRecord ResumeFix::record() const {
  states::RunRecord run;
  const auto add = [&run](const std::string& name, const std::string& value) {
    run.facts.emplace_back(name, value.empty() ? "none" : value);
  };
  const auto word = [](const char* text) { return std::string(text ? text : ""); };
  bigint atoms = 0;
  const bigint own = atom->nlocal;
  MPI_Allreduce(&own, &atoms, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  add("number of atoms", std::to_string(atoms));
  for (int k = 1; k < group->ngroup; ++k)
    if (group->names[k]) add("number of atoms of group " + word(group->names[k]), std::to_string(bigint(group->count(k))));
  // A box that fits itself to the atoms is set anew by their positions.
  for (int k = 0; k < 3; ++k)
    if (domain->boundary[k][0] < 2 && domain->boundary[k][1] < 2)
      add(std::string("box along ") + "xyz"[k], states::digits(domain->boxlo[k], domain->boxhi[k]));
  if (domain->triclinic) add("tilt of the box", states::digits(domain->xy, domain->xz, domain->yz));
  std::string boundary;
  for (int k = 0; k < 6; ++k) boundary += "pfsm"[domain->boundary[k / 2][k % 2]];
  add("boundary", boundary);
  add("timestep", states::digits(update->dt));
  add("units", word(update->unit_style));
  add("atom_style", word(atom->atom_style));
  add("newton", force->newton_pair ? "on" : "off");
  add("neighbor", states::digits(neighbor->skin, neighbor->style));
  add("neigh_modify every, delay, check", states::digits(neighbor->every, neighbor->delay, neighbor->dist_check));
  add("atom_modify sort", states::digits(sort_frequency_));
  add("pair_style", word(force->pair_style));
  std::string acting;
  for (Fix* const fix : fixes()) {
    if (fix == this) continue;
    const auto* const own = dynamic_cast<const SharedFix*>(fix);
    add("fix " + word(fix->id), fix->style + (own && !own->words.empty() ? " " + own->words : ""));
    if (is(*fix, "gravity")) {
      const dembark::Vec3<double> g = acceleration_of(fix)();
      add("acceleration of fix " + word(fix->id), states::digits(g.x, g.y, g.z));
    }
  }
  for (int k = 0; k < modify->nfix; ++k)
    if (modify->fix[k] && modify->fmask[k] & acting_stages) acting += (acting.empty() ? "" : " ") + word(modify->fix[k]->id);
  add("order of fixes", acting);
  add_facts(run);
  if (comm->me != 0) return run;
  if (force->pair && writes_settings(word(force->pair_style)))
    add("settings of the pair style", states::hashed(written([this](FILE* file) { force->pair->write_restart(file); })));
  run.files = states::output_files(outputs_);
  return run;
}

/// Why `fix` does not go on exactly from a state of `step`; nothing if it does.
std::string ResumeFix::inexact_fix(Fix& fix, bigint step) const {
  if (!lists(shared_exact_fixes, fix.style) && !lists(dembark_engine::exact_fixes, fix.style)) return "begins anew or differently";
  const std::string why = inexact_arguments(fix);
  if (!why.empty() || !is(fix, "ave/time") || step % fix.global_freq == 0) return why;
  return "is within an interval at step " + std::to_string(step);
}

/// Fixes and variables that do not go on from a state of `step`, each with its reason.
std::vector<std::string> ResumeFix::inexact(bigint step) const {
  std::vector<std::string> all;
  for (Fix* const fix : fixes())
    if (const std::string why = inexact_fix(*fix, step); !why.empty())
      all.push_back(std::string("fix ") + fix->id + " (" + fix->style + ") " + why);
  for (const auto& [name, formula] : formulas())
    if (const std::string word = function_with_memory(formula); !word.empty()) all.push_back("variable " + name + " uses " + word);
  return all;
}

/// On the first rank.
std::string ResumeFix::why_approximate(const states::RunRecord& run) const {
  std::string why;
  const auto add = [&why](const std::vector<std::string>& reasons) {
    for (const std::string& reason : reasons) why += (why.empty() ? "" : "; ") + reason;
  };
  if (!saved_.facts.empty()) add(states::differences(saved_, run));
  add(inexact(update->ntimestep));
  return why;
}

}  // namespace dembark_family
