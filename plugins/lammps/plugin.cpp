// dembarkplugin.so: the table of dembark's styles for LAMMPS.
#include "lammps_plugin.h"

#include <cstring>
#include <string>

#include "comm.h"
#include "error.h"
#include "lammps.h"

#include "atom_numbers.h"
#include "fix_arguments.h"
#include "fix_capillary_liquid.h"
#include "fix_energy_account.h"
#include "fix_integration_monitor.h"
#include "fix_lcp_impact.h"
#include "fix_resume_exact.h"
#include "fix_wall_dembark.h"
#include "pair_dembark_granular.h"
#include "self_test.h"

#ifdef DEMBARK_KOKKOS
#include "kokkos/kokkos_styles.h"
#endif

namespace {

using LAMMPS_NS::LAMMPS;

template <class Style>
void* create_pair(void* lammps) {
  return static_cast<LAMMPS_NS::Pair*>(new Style(static_cast<LAMMPS*>(lammps)));
}

template <class Style>
void* create_fix(void* lammps, int narg, char** arg) {
  return static_cast<LAMMPS_NS::Fix*>(new Style(static_cast<LAMMPS*>(lammps), narg, arg));
}

template <class Style>
void* create_command(void* lammps) {
  return static_cast<LAMMPS_NS::Command*>(new Style(static_cast<LAMMPS*>(lammps)));
}

}  // namespace

void lammpsplugin_init(void* host, void* handle, void* register_style) {
  LAMMPS* const lammps = static_cast<LAMMPS*>(host);
  // The loader only warns of another version, and virtual functions are not the same in all.
  if (std::strcmp(lammps->version, DEMBARK_LAMMPS_VERSION) != 0)
    lammps->error->all(FLERR, std::string("dembark's styles were built for LAMMPS " DEMBARK_LAMMPS_VERSION ", and this is LAMMPS ") +
                                  lammps->version + "; build them with 'make lammps' for the LAMMPS that runs");
#ifdef DEMBARK_SELF_TEST
  static bool tested = false;
  if (!tested) {
    tested = true;
    const std::string wrong = dembark_lammps::self_test(&lammpsplugin_init);
    if (!wrong.empty())
      lammps->error->all(FLERR, std::string("dembark's styles do not fit LAMMPS ") + lammps->version + ": " + wrong +
                                    "; use a release that docs/how-to/lammps_build.md names");
    if (lammps->comm->me == 0)
      lammps->error->warning(FLERR, std::string("dembark's tests have not run with LAMMPS ") + lammps->version +
                                        "; ten contacts were computed at the start, and their forces are right");
  }
#endif
  PluginStyle style = {};
  style.version = DEMBARK_LAMMPS_VERSION;
  style.author = "dembark";
  style.handle = handle;
  const auto add = [&](const char* kind, const char* name, const char* info) {
    style.style = kind;
    style.name = name;
    style.info = info;
    reinterpret_cast<RegisterStyle>(register_style)(&style, host);
  };
  style.creator.pair = &create_pair<LAMMPS_NS::PairDembarkGranular>;
  add("pair", "dembark/granular", "Hertz or Hooke with Finnie-Rabinowicz friction, rolling resistance, dry adhesion and liquid bridges");
#ifdef DEMBARK_KOKKOS
  style.creator.pair = &dembark_lammps::create_kokkos_pair;
  for (const char* const name : {"dembark/granular/kk", "dembark/granular/kk/device"}) add("pair", name, "the same in a Kokkos kernel");
  style.creator.fix = &dembark_lammps::create_kokkos_history;
  add("fix", "NEIGH_HISTORY/DEMBARK/KK", "histories of its contacts");
  style.creator.fix = &dembark_lammps::create_kokkos_wall;
  add("fix", "wall/dembark/kk", "contacts with planes and cylinders in a Kokkos kernel");
#endif
  style.creator.fix = &create_fix<LAMMPS_NS::FixWallDembark>;
  add("fix", "wall/dembark", "the same contacts with the surface of a region or of an STL file");
  style.creator.fix = &create_fix<LAMMPS_NS::FixCapillaryLiquid>;
  add("fix", "capillary/liquid", "liquid that grains and walls own and lend to bridges");
  style.creator.fix = &create_fix<LAMMPS_NS::FixEnergyAccount>;
  add("fix", "energy/account", "energies and works that balance");
  style.creator.fix = &create_fix<LAMMPS_NS::FixIntegrationMonitor>;
  add("fix", "integration/monitor", "how wrong the steps of a run are");
  style.creator.fix = &create_fix<LAMMPS_NS::FixResumeExact>;
  add("fix", "resume/exact", "states from which a run goes on to the bit");
  style.creator.command = &create_command<LAMMPS_NS::ResumeState>;
  add("command", "resume_state", "read the newest of these states");
  style.creator.fix = &create_fix<LAMMPS_NS::FixLcpImpact>;
  add("fix", "lcp/impact", "impacts of logs by a linear complementarity problem a step");
  dembark_lammps::watch_fixes(lammps);
  dembark_lammps::keep_numbers(lammps);
}
