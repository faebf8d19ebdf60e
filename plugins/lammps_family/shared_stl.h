// An STL file that the first rank reads for all: the others may not have it.
#ifndef DEMBARK_SHARED_STL_H
#define DEMBARK_SHARED_STL_H

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "dembark/surface/stl.hpp"

namespace dembark_family {

template <class Number>
void broadcast(std::vector<Number>& numbers, MPI_Datatype type, MPI_Comm world) {
  std::int64_t size = std::int64_t(numbers.size());
  MPI_Bcast(&size, 1, MPI_INT64_T, 0, world);
  numbers.resize(std::size_t(size));
  constexpr std::size_t most = 1 << 24;  // of one message, whose length is an int
  for (std::size_t k = 0; k < numbers.size(); k += most)
    MPI_Bcast(numbers.data() + k, int(std::min(most, numbers.size() - k)), type, 0, world);
}

/// Collective. Triangles and lines are on all ranks, the rest on the first one. What is wrong is thrown on all ranks.
inline dembark::StlSurface read_shared_stl(const std::string& name, double precision, MPI_Comm world) {
  int rank = 0;
  MPI_Comm_rank(world, &rank);
  dembark::StlSurface found;
  std::vector<char> wrong;
  std::vector<double> corners;
  if (rank == 0) {
    try {
      found = dembark::read_stl(name, precision);
      corners.reserve(9 * found.triangles.size());
      for (const dembark::Triangle& t : found.triangles)
        for (const dembark::Vec3<double>& n : t.node) corners.insert(corners.end(), {n.x, n.y, n.z});
    } catch (const std::exception& error) {
      const std::string text = error.what();
      wrong.assign(text.begin(), text.end());
    }
  }
  broadcast(wrong, MPI_CHAR, world);
  if (!wrong.empty()) throw std::invalid_argument(std::string(wrong.begin(), wrong.end()));
  broadcast(corners, MPI_DOUBLE, world);
  broadcast(found.line, MPI_INT, world);
  if (rank == 0) return found;
  found.triangles.resize(corners.size() / 9);
  for (std::size_t i = 0; i < found.triangles.size(); ++i) {
    found.triangles[i].id = std::int64_t(i);
    for (std::size_t k = 0; k < 3; ++k) {
      const double* const n = &corners[9 * i + 3 * k];
      found.triangles[i].node[k] = {n[0], n[1], n[2]};
    }
  }
  return found;
}

}  // namespace dembark_family

#endif
