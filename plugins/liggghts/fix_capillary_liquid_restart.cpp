// fix capillary/liquid: its numbers per atom as atoms move, and in restart files.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>

#include "atom.h"
#include "comm.h"
#include "fix_capillary_liquid.h"

using namespace LAMMPS_NS;

void FixCapillaryLiquid::grow_arrays(int n) {
  books_.resize(std::size_t(n) * width(), 0.0);
  grants_.resize(std::size_t(n), -1.0);
}

void FixCapillaryLiquid::copy_arrays(int i, int j, int) { std::copy_n(book(i), width(), book(j)); }

void FixCapillaryLiquid::set_arrays(int i) { std::fill_n(book(i), width(), 0.0); }

int FixCapillaryLiquid::pack_exchange(int i, double *buffer) {
  std::copy_n(book(i), width(), buffer);
  return int(width());
}

int FixCapillaryLiquid::unpack_exchange(int i, double *buffer) {
  std::copy_n(buffer, width(), book(i));
  return int(width());
}

int FixCapillaryLiquid::pack_restart(int i, double *buffer) {
  buffer[0] = double(width() + 1);
  std::copy_n(book(i), width(), buffer + 1);
  return int(width()) + 1;
}

void FixCapillaryLiquid::unpack_restart(int i, int nth) {
  const double *from = atom->extra[i];
  for (int k = 0; k < nth; ++k) from += static_cast<int>(*from);
  std::copy_n(from + 1, std::min(width(), static_cast<std::size_t>(*from) - 1), book(i));
}

int FixCapillaryLiquid::size_restart(int) { return int(width()) + 1; }

int FixCapillaryLiquid::maxsize_restart() { return int(width()) + 1; }

void FixCapillaryLiquid::write_restart(FILE *file) {
  if (comm->me != 0) return;
  std::vector<double> numbers = {double(walls_.size()), reference_, lost_, added_, double(atoms_)};
  std::string names;
  for (const Wall &wall : walls_) {
    numbers.push_back(wall.pool);
    names += wall.id + '\n';
  }
  const int bytes = int(numbers.size() * sizeof(double) + names.size() + 1);
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(numbers.data(), sizeof(double), numbers.size(), file);
  fwrite(names.c_str(), 1, names.size() + 1, file);
}

/// The walls of the file, with what they held; init() finds their fixes. What the arguments say of a wall, but for its liquid, holds.
void FixCapillaryLiquid::restart(char *buffer) {
  std::vector<double> numbers(5);
  std::memcpy(numbers.data(), buffer, 5 * sizeof(double));
  const std::size_t n = static_cast<std::size_t>(numbers[0]);
  reference_ = numbers[1];
  lost_ = numbers[2];
  added_ = numbers[3];
  atoms_ = static_cast<bigint>(numbers[4]);
  std::vector<Wall> walls;
  const char *name = buffer + (5 + n) * sizeof(double);
  for (std::size_t w = 0; w < n; ++w) {
    const char *const end = std::strchr(name, '\n');
    Wall wall;
    wall.id.assign(name, end);
    for (const Wall &given : walls_)
      if (given.id == wall.id) wall = given;
    std::memcpy(&wall.pool, buffer + (5 + w) * sizeof(double), sizeof(double));
    walls.push_back(wall);
    name = end + 1;
  }
  for (const Wall &given : walls_)
    if (std::none_of(walls.begin(), walls.end(), [&](const Wall &wall) { return wall.id == given.id; })) walls.push_back(given);
  walls_ = walls;
  books_.assign(std::size_t(atom->nmax) * width(), 0.0);
}

double FixCapillaryLiquid::memory_usage() { return double((books_.size() + grants_.size()) * sizeof(double)); }
