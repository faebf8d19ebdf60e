// What fix lcp/impact puts out: the local array, the vector, restart files.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

#include "comm.h"
#include "compute.h"
#include "dump.h"
#include "memory.h"
#include "modify.h"
#include "output.h"
#include "update.h"

#include "fix_lcp_impact.h"

using namespace LAMMPS_NS;
using namespace dembark::impact;

/// Whether something reads the local array in this step; dumps tell their steps.
bool FixLcpImpact::local_is_read() const {
  for (int i = 0; i < modify->ncompute; ++i)
    if (std::strncmp(modify->compute[i]->style, "reduce", 6) == 0) return true;
  for (int i = 0; i < modify->nfix; ++i)
    if (std::strncmp(modify->fix[i]->style, "ave/histo", 9) == 0) return true;
  for (int i = 0; i < output->ndump; ++i)
    if (output->next_dump[i] == update->ntimestep && std::strncmp(output->dump[i]->style, "local", 5) == 0) return true;
  return false;
}

/// The contacts with a force, all of them on the first rank.
void FixLcpImpact::fill_local() {
  size_local_rows = 0;
  if (comm->me != 0) return;
  const std::vector<ContactResult> &all = impacts_->contacts();
  if (int(all.size()) > local_capacity_) {
    local_capacity_ = 2 * int(all.size());
    memory->destroy(array_local);
    memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
  }
  for (const ContactResult &c : all)
    if (c.normal_force > 0.0) std::copy_n(table_row(c).begin(), int(local_columns), array_local[size_local_rows++]);
}

double FixLcpImpact::compute_vector(int i) { return to_numbers(impacts_->report)[std::size_t(i)]; }

double FixLcpImpact::memory_usage() { return impacts_->memory() + double(local_capacity_) * local_columns * sizeof(double); }

void FixLcpImpact::write_restart(FILE *file) {
  keep_end_of_step();
  if (comm->me != 0) return;
  const std::vector<double> state = impacts_->state();
  const double count = double(state.size() + 1);
  const int bytes = static_cast<int>(count * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(&count, sizeof(double), 1, file);
  fwrite(state.data(), sizeof(double), state.size(), file);
}

void FixLcpImpact::restart(char *buffer) {
  const double *numbers = reinterpret_cast<const double *>(buffer);  // the engine hands over the numbers without their size
  checked([&] { impacts_->restore({numbers + 1, numbers + static_cast<std::size_t>(numbers[0])}); });
}
