// liggghts-dembark: stock LIGGGHTS, from its shared library, plus dembark's styles.
//
// The command line and everything else is LIGGGHTS's own. Before the input is read, and after the command clear, the contact models and
// their combinations are entered into the tables that the library looks them up in.
#include <dlfcn.h>
#include <mpi.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "fix_contact_history.h"
#include "force.h"
#include "input.h"
#include "lammps.h"
#include "modify.h"
#include "signal_handling.h"

#include "deleted_atoms.h"
#include "engine_access.h"
#include "fix_adapt_at_once.h"
#include "fix_capillary_liquid.h"
#include "fix_energy_account.h"
#include "fix_integration_monitor.h"
#include "fix_lcp_impact.h"
#include "fix_nve_sph_coupled.h"
#include "fix_resume_exact.h"
#include "fix_sph_body.h"
#include "fix_sph_contact.h"
#include "fix_wall_gran_forgetful.h"
#include "fix_wall_motion.h"
#include "granular_combinations.h"
#include "pair_sph_coupled.h"
#include "shared_fix.h"

namespace {

bool entered = false;  // the styles are in the library's tables
dembark_liggghts::CommandCreator stock_run = nullptr, stock_delete_atoms = nullptr;
std::map<const LAMMPS_NS::LAMMPS*, dembark_family::DeletedAtoms> deleted_atoms;

template <class Style>
LAMMPS_NS::Fix* create_fix(LAMMPS_NS::LAMMPS* lammps, int narg, char** arg) {
  return new Style(lammps, narg, arg);
}

/// A process that no launcher started has nobody to talk to. Open MPI would start a daemon for it and open the networks, a third of a
/// second in which nothing else happens. What the user has set stays as it is.
void start_alone() {
  for (const char* const launched : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"})
    if (std::getenv(launched)) return;
  setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
  setenv("OMPI_MCA_pml", "ob1", 0);
  setenv("OMPI_MCA_btl", "self", 0);
  // Its folder for such daemons is the same for all that are started alone: one that ends takes it away while another begins.
  setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
}

/// Contact histories stay in the neighbor list after a run, where ghost atoms are partners, until the next run or restart file takes them
/// out. Atoms that a script creates in between overwrite the ghosts, and contacts across borders would lose their histories. Runs of stock
/// models stay as they are in stock LIGGGHTS.
void run_and_keep_histories(LAMMPS_NS::LAMMPS* host, int narg, char** arg) {
  const std::string wrong = deleted_atoms[host].run_error(*host->atom, host->world);
  if (!wrong.empty()) host->error->all(FLERR, wrong.c_str());
  stock_run(host, narg, arg);
  deleted_atoms[host].clear();
  if (!dembark_liggghts::has_our_models(*host->force)) return;
  for (int i = 0; i < host->modify->nfix; ++i)
    if (!std::strcmp(host->modify->fix[i]->style, "contacthistory")) host->modify->fix[i]->setup_pre_exchange();
}

/// Histories of pairs, and logs, are found again by the numbers of the atoms.
void delete_and_keep_numbers(LAMMPS_NS::LAMMPS* host, int narg, char** arg) {
  const bool by_number = dembark_liggghts::has_our_models(*host->force) || host->modify->find_fix_style("lcp/impact", 0);
  const std::string wrong = by_number ? dembark_family::new_numbers_error(*host->atom, *host->update, narg, arg) : "";
  if (!wrong.empty()) host->error->all(FLERR, wrong.c_str());
  if (by_number && host->update->first_update)
    deleted_atoms[host].watch(*host->atom, host->world, [&] { stock_delete_atoms(host, narg, arg); });
  else stock_delete_atoms(host, narg, arg);
}

/// The library enters its own combinations when it is made; ours come after, where its fallback can be replaced.
void enter_styles(LAMMPS_NS::LAMMPS& host) {
  if (!host.modify || !host.force || !host.input) return;
  LAMMPS_NS::ResumeState::file.forget(&host);
  deleted_atoms[&host].clear();
  dembark_liggghts::register_contact_models();
  auto& fixes = dembark_liggghts::fix_styles(*host.modify);
  // In place of the stock styles, of the same names.
  fixes.at("adapt") = &create_fix<LAMMPS_NS::FixAdaptAtOnce>;
  fixes.at("wall/gran") = &create_fix<LAMMPS_NS::FixWallGranForgetful>;
  fixes["capillary/liquid"] = &create_fix<LAMMPS_NS::FixCapillaryLiquid>;
  fixes["energy/account"] = &create_fix<LAMMPS_NS::FixEnergyAccount>;
  fixes["integration/monitor"] = &create_fix<LAMMPS_NS::FixIntegrationMonitor>;
  fixes["lcp/impact"] = &create_fix<LAMMPS_NS::FixLcpImpact>;
  fixes["nve/sph/coupled"] = &create_fix<LAMMPS_NS::FixNveSphCoupled>;
  fixes["resume/exact"] = &create_fix<LAMMPS_NS::FixResumeExact>;
  fixes["sph/contact"] = &create_fix<LAMMPS_NS::FixSphContact>;
  fixes["sph/body"] = fixes["sph/wall"] = &create_fix<LAMMPS_NS::FixSphBody>;
  fixes["wall/motion"] = &create_fix<LAMMPS_NS::FixWallMotion>;
  (*host.force->pair_map)["sph/coupled"] = [](LAMMPS_NS::LAMMPS* owner) -> LAMMPS_NS::Pair* {
    return new LAMMPS_NS::PairSphCoupled(owner);
  };
  auto& commands = dembark_liggghts::commands(*host.input);
  auto& run = commands["run"];
  if (run != &run_and_keep_histories) stock_run = std::exchange(run, &run_and_keep_histories);
  auto& delete_atoms = commands["delete_atoms"];
  if (delete_atoms != &delete_and_keep_numbers) stock_delete_atoms = std::exchange(delete_atoms, &delete_and_keep_numbers);
  dembark_liggghts::commands(*host.input)["resume_state"] = [](LAMMPS_NS::LAMMPS* owner, int narg, char** arg) {
    LAMMPS_NS::ResumeState(owner).command(narg, arg);
  };
  entered = true;
}

}  // namespace

/// Stands in front of the library's own, which LIGGGHTS calls when all its tables are new: at the start, and after the command `clear`.
void LAMMPS_NS::LAMMPS::post_create() {
  typedef void (*PostCreate)(LAMMPS*);
  static const PostCreate original = reinterpret_cast<PostCreate>(dlsym(RTLD_NEXT, "_ZN9LAMMPS_NS6LAMMPS11post_createEv"));
  original(this);
  enter_styles(*this);
}

int main(int argc, char** argv) {
  // The library expects its host to route signals, so that a run that is told to stop still writes what it has.
  struct sigaction stop = {}, restart = {};
  stop.sa_handler = LAMMPS_NS::SignalHandler::int_handler;
  restart.sa_handler = LAMMPS_NS::SignalHandler::usr1_handler;
  sigaction(SIGINT, &stop, nullptr);
  sigaction(SIGTERM, &stop, nullptr);
  sigaction(SIGUSR1, &restart, nullptr);

  // An error of one process ends all at once: what it says must be out before, also into a pipe.
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  start_alone();
  MPI_Init(&argc, &argv);
  LAMMPS_NS::LAMMPS* lammps = new LAMMPS_NS::LAMMPS(argc, argv, MPI_COMM_WORLD);
  // A library that is linked with -Bsymbolic calls its own function.
  if (!entered) enter_styles(*lammps);
  lammps->input->file();
  delete lammps;
  MPI_Finalize();
}
