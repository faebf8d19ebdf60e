// What fix lcp/impact puts out: the local array, the vector, restart files.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <tuple>

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

/// The contacts of the last step; the model itself does not keep those of a restart file.
const std::vector<ContactResult> &FixLcpImpact::results() const { return results_.empty() ? system_->contacts() : results_; }

/// The contacts with a force, all of them on the first rank.
void FixLcpImpact::fill_local() {
  size_local_rows = 0;
  if (comm->me != 0) return;
  const std::vector<ContactResult> &all = results();
  if (int(all.size()) > local_capacity_) {
    local_capacity_ = 2 * int(all.size());
    memory->destroy(array_local);
    memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
  }
  for (const ContactResult &c : all)
    if (c.normal_force > 0.0) std::copy_n(table_row(c).begin(), int(local_columns), array_local[size_local_rows++]);
}

double FixLcpImpact::compute_vector(int i) { return to_numbers(report_)[std::size_t(i)]; }

double FixLcpImpact::memory_usage() {
  return double(bodies_.size() * (sizeof(Body) + 2 * sizeof(Push)) + std::size_t(report_.contacts) * sizeof(Contact) +
                std::size_t(local_capacity_) * local_columns * sizeof(double));
}

/// What restart files keep, bit for bit.
void FixLcpImpact::archive(Archive &a) {
  FormatVersion format{3.0};
  std::size_t types = options_.types, here = types;
  std::vector<std::string> walls = options_.walls;
  a.all(std::tie(format, types, walls));
  if (types != here)
    throw std::invalid_argument("the restart file has " + std::to_string(types) + " atom types, the command " + std::to_string(here));
  for (std::size_t k = 0; k < std::min(walls.size(), options_.walls.size()); ++k)
    if (options_.walls[k] != walls[k])
      throw std::invalid_argument("wall " + std::to_string(k + 1) + " is " + walls[k] + " in the restart file and " + options_.walls[k] +
                                  " in the command; keep the order, add walls at the end, take them away from the end");
  std::vector<double> state = system_->state();
  std::vector<ContactResult> contacts = results();
  a.all(std::tie(last_step_, last_dt_, clock_time_, clock_step_, last_, report_, file_, state, contacts));
  a.end();
  results_ = contacts;
  if (!a.reading()) return;
  system_->restore(state);
  kept_ = true;
}

void FixLcpImpact::write_restart(FILE *file) {
  keep_end_of_step();
  if (comm->me != 0) return;
  Archive out;
  archive(out);
  const double count = double(out.numbers().size() + 1);
  const int bytes = static_cast<int>(count * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(&count, sizeof(double), 1, file);
  fwrite(out.numbers().data(), sizeof(double), out.numbers().size(), file);
}

void FixLcpImpact::restart(char *buffer) {
  const double *numbers = reinterpret_cast<const double *>(buffer);  // the engine hands over the numbers without their size
  Archive in(std::vector<double>(numbers + 1, numbers + static_cast<std::size_t>(numbers[0])));
  checked([&] { archive(in); });
}
