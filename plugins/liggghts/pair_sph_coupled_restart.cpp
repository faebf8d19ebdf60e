// Restart files hold the words of the pair style.
#include <cstdio>

#include <algorithm>

#include "comm.h"

#include "pair_sph_coupled.h"

using namespace LAMMPS_NS;

void PairSphCoupled::write_restart(FILE *file) {
  std::string line;
  for (const std::string &word : words_) line += word + "\n";
  const int size = int(line.size());
  fwrite(&size, sizeof size, 1, file);
  fwrite(line.data(), 1, line.size(), file);
}

void PairSphCoupled::read_restart(FILE *file, const int, const int) {
  int size = 0, whole = 1;
  if (comm->me == 0) whole = fread(&size, sizeof size, 1, file) == 1 && size >= 0;
  MPI_Bcast(&size, 1, MPI_INT, 0, world);
  std::string line(std::size_t(std::max(size, 0)), '\0');
  if (comm->me == 0) whole = whole && fread(line.data(), 1, line.size(), file) == line.size();
  MPI_Bcast(&whole, 1, MPI_INT, 0, world);
  if (!whole) refuse("the restart file ends too early");
  MPI_Bcast(line.data(), size, MPI_CHAR, 0, world);
  std::vector<std::string> words;
  for (std::size_t at = 0, end; (end = line.find('\n', at)) != std::string::npos; at = end + 1) words.push_back(line.substr(at, end - at));
  read(words);
  char all[] = "*";
  char *types[] = {all, all};
  coeff(2, types);
  all_types_ = true;
}
