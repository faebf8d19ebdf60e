// What fix lcp/impact puts out: the local array, the vector, restart files.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "comm.h"
#include "compute.h"
#include "dump.h"
#include "memory.h"
#include "modify.h"
#include "output.h"
#include "update.h"

#include "fix_lcp_impact.h"

using namespace LAMMPS_NS;
using dembark::impact::Archive;
using dembark::impact::Body;
using dembark::impact::Contact;
using dembark::impact::ContactResult;
using dembark_liggghts::ImpactWall;

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
  if (me_ != 0) return;
  const std::vector<ContactResult> &all = results();
  if (int(all.size()) > local_capacity_) {
    local_capacity_ = 2 * int(all.size());
    memory->destroy(array_local);
    memory->create(array_local, local_capacity_, local_columns, "lcp/impact:array_local");
  }
  for (const ContactResult &c : all) {
    if (!(c.normal_force > 0.0)) continue;
    const double row[local_columns] = {double(c.key_a), double(dembark::impact::shown_id(c.key_b)),
                                       c.normal.x,      c.normal.y,
                                       c.normal.z,      c.gap,
                                       c.normal_force,  c.tangential.x,
                                       c.tangential.y,  c.tangential.z,
                                       c.point.x,       c.point.y,
                                       c.point.z};
    std::copy(row, row + local_columns, array_local[size_local_rows++]);
  }
}

double FixLcpImpact::compute_vector(int i) { return report_.values()[std::size_t(i)]; }

double FixLcpImpact::memory_usage() {
  return double(bodies_.size() * (sizeof(Body) + 4 * sizeof(Vec)) + std::size_t(report_.contacts) * sizeof(Contact) +
                std::size_t(local_capacity_) * local_columns * sizeof(double));
}

/// What restart files keep, bit for bit.
void FixLcpImpact::archive(Archive &a) {
  a.version(2.0);
  std::size_t types = options_.types, here = types;
  std::vector<std::string> walls;
  for (const ImpactWall &wall : options_.walls) walls.push_back(wall.name);
  a(types), a(walls);
  if (types != here)
    throw std::invalid_argument("the restart file has " + std::to_string(types) + " atom types, the command " + std::to_string(here));
  for (std::size_t k = 0; k < std::min(walls.size(), options_.walls.size()); ++k)
    if (options_.walls[k].name != walls[k])
      throw std::invalid_argument("wall " + std::to_string(k + 1) + " is " + walls[k] + " in the restart file and " +
                                  options_.walls[k].name +
                                  " in the command; keep the order, add walls at the end, take them away from the end");
  a(last_step_), a(last_dt_), a(clock_time_), a(clock_step_), a(last_), a(report_);
  std::string path = options_.impacts_file;
  long long bytes = file_.path().empty() ? file_kept_ : file_.bytes();
  a(path), a(bytes);
  if (a.reading()) file_kept_ = path == options_.impacts_file ? bytes : -1;  // another file begins anew
  std::vector<double> state = system_->state();
  a(state);
  if (a.reading()) {
    system_->restore(state);
    kept_ = true;
  } else {
    results_ = results();
  }
  a(results_);
  a.end();
}

void FixLcpImpact::write_restart(FILE *file) {
  keep_end_of_step();
  if (me_ != 0) return;
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
  try {
    archive(in);
  } catch (const std::invalid_argument &e) {
    refuse(e.what());
  }
}
