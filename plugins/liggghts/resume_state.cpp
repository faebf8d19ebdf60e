#include "resume_state.h"

#include <algorithm>
#include <string>
#include <vector>

#include <mpi.h>

#include "comm.h"
#include "error.h"
#include "read_restart.h"

#include "state_files.h"

using namespace LAMMPS_NS;

void ResumeState::command(int narg, char **arg) {
  if (narg != 1) error->all(FLERR, "resume_state: it must have the form resume_state BASE");
  long long step = -1;
  int grid[3] = {0, 0, 0};
  if (comm->me == 0) {
    const std::vector<long long> steps = dembark_liggghts::whole_states(arg[0]);
    if (!steps.empty()) {
      step = steps.front();
      dembark_liggghts::processor_grid(dembark_liggghts::state_name(arg[0], step), grid);
    }
  }
  MPI_Bcast(&step, 1, MPI_LONG_LONG, 0, world);
  MPI_Bcast(grid, 3, MPI_INT, 0, world);
  if (step < 0) {
    const std::string line = "resume_state: there is no whole state " + std::string(arg[0]) +
                             ".<step>.restart in this folder; write states first (fix resume/exact, restart_every > 0 in dembark's decks)";
    error->all(FLERR, line.c_str());
  }
  int *const wanted = comm->user_procgrid;
  if (grid[0] * grid[1] * grid[2] == comm->nprocs && !wanted[0] && !wanted[1] && !wanted[2]) std::copy(grid, grid + 3, wanted);
  std::string name = dembark_liggghts::state_name(arg[0], step);
  dembark_liggghts::name_state_that_is_read(name);
  char *words[] = {&name[0]};
  ReadRestart(lmp).command(1, words);
}
