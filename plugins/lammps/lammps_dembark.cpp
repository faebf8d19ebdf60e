// The program lammps-dembark over the library of an installed LAMMPS that has no package PLUGIN: it starts as LAMMPS's own program does,
// and puts dembark's styles into LAMMPS's tables by the function that a plugin has for that.
#include <dlfcn.h>
#include <mpi.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "exceptions.h"
#include "input.h"
#include "lammps.h"
#include "library.h"

#include "lammps_plugin.h"
#include "self_test.h"

namespace {

bool filled = false;  // the tables have the styles

int run(int argc, char** argv) {
  // As in LAMMPS's own program: after an error nothing is destroyed, for a destructor may wait for the other ranks.
  auto* const lammps = new LAMMPS_NS::LAMMPS(argc, argv, MPI_COMM_WORLD);
  if (!filled) {
    std::fputs("dembark: this LAMMPS's library does not let a program add styles; use a LAMMPS with the package PLUGIN\n", stderr);
    return 1;
  }
  lammps->input->file();
  delete lammps;
  return 0;
}

}  // namespace

/// Stands in front of the library's own, which LAMMPS calls when all its tables are new: at the start, and after the command `clear`.
void LAMMPS_NS::LAMMPS::post_create() {
  typedef void (*PostCreate)(LAMMPS*);
  static const PostCreate original = reinterpret_cast<PostCreate>(dlsym(RTLD_NEXT, "_ZN9LAMMPS_NS6LAMMPS11post_createEv"));
  original(this);
  lammpsplugin_init(this, nullptr, reinterpret_cast<void*>(&dembark_lammps::enter));
  filled = true;
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int code = 1;
  // LAMMPS has said what is wrong.
  try {
    code = run(argc, argv);
  } catch (const LAMMPS_NS::LAMMPSAbortException& wrong) {
    MPI_Abort(wrong.get_universe(), 1);
  } catch (const LAMMPS_NS::LAMMPSException&) {
  } catch (const std::exception& wrong) {
    std::fprintf(stderr, "lammps-dembark: %s\n", wrong.what());
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  lammps_python_finalize();
  MPI_Barrier(MPI_COMM_WORLD);
  MPI_Finalize();
  return code;
}
