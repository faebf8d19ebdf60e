// The periodic images of lines, sorted by where on the grid they begin.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include "fields_lines.hpp"

namespace dembark::fields {

// Edge vectors of the simulation box, (lx, 0, 0), (xy, ly, 0), (xz, yz, lz), and along which of them it is periodic.
struct Box {
  double edge[3][3];
  bool periodic[3];
  // Along these axes one image of each line counts, the one that begins at or above `home`.
  bool folded[3] = {false, false, false};
  double home[3] = {0.0, 0.0, 0.0};
};

// Lines from `first` (count, 3) to `first + branch` (count, 3), or points where `branch` is null.
struct Lines {
  std::int64_t count;
  const double *first, *branch;
};

// A line shifted by whole box edges.
struct Image {
  std::int32_t line;
  std::int16_t edges[3];
};

struct Place {
  double first[3], branch[3];
};

inline Place place_of(const Lines& lines, const Box& box, const Image& image) {
  Place place;
  const std::int64_t at = 3 * std::int64_t(image.line);
  for (int axis = 0; axis < 3; ++axis) {
    place.first[axis] = lines.first[at + axis];
    place.branch[axis] = lines.branch ? lines.branch[at + axis] : 0.0;
  }
  if (image.edges[0] == 0 && image.edges[1] == 0 && image.edges[2] == 0) return place;
  for (int axis = 0; axis < 3; ++axis) {
    double shift = 0.0;
    for (int edge = 2; edge >= axis; --edge) shift += image.edges[edge] * box.edge[edge][axis];
    place.first[axis] += shift;
  }
  return place;
}

// std::floor is a call where the processor is not known to have an instruction for it.
inline double whole_below(double value) {
  const double whole = double(std::int64_t(value));
  return whole > value ? whole - 1.0 : whole;
}

inline Window window_of(const Cells& cells, const Kernel& kernel, const Place& place) {
  Window window;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = place.first[axis], b = a + place.branch[axis];
    const double count = cells.shape[axis];
    double start = (std::min(a, b) - kernel.reach - cells.low[axis]) / cells.spacing[axis];
    double stop = (std::max(a, b) + kernel.reach - cells.low[axis]) / cells.spacing[axis];
    // A factor of each axis needs no cells outside the grid; a spherical kernel is normalised over the whole ball.
    if (kernel.kind == KernelKind::gaussian) {
      start = std::clamp(start, 0.0, count - 1.0);
      stop = std::clamp(stop, 1.0, count);
    }
    start = whole_below(start);
    stop = -whole_below(-stop);
    window.start[axis] = int(start);
    window.count[axis] = int(std::max(1.0, stop - start));
  }
  return window;
}

struct Free {
  void operator()(void* memory) const { std::free(memory); }
};

template <class T>
using Buffer = std::unique_ptr<T[], Free>;

// `count` zeros. The system clears large memory where it is touched first, which is the work of many threads.
template <class T>
Buffer<T> zeros(std::size_t count) {
  void* memory = std::calloc(count > 0 ? count : 1, sizeof(T));
  if (memory == nullptr) throw std::bad_alloc();
  return Buffer<T>(static_cast<T*>(memory));
}

// Calls `work(n)` for n = 0 ... count - 1, each on its own thread.
template <class Work>
void on_threads(int count, const Work& work) {
  std::vector<std::thread> team;
  for (int n = 1; n < count; ++n) team.emplace_back(work, n);
  work(0);
  for (std::thread& thread : team) thread.join();
}

// Part `n` of `parts` of a range of `size`.
struct Range {
  std::int64_t begin, end;
  Range(std::int64_t size, int n, int parts) : begin(size * n / parts), end(size * (n + 1) / parts) {}
};

// All images of lines that come within the kernel's reach of the cells, by the block in which their windows begin. Blocks are of
// block[axis] cells, numbered x, y, z with z running fastest. In a block they come by where along y their windows end and begin, so that
// those that reach a row of cells lie close together; ties in the order of the lines.
struct Sorted {
  std::int64_t count = 0;
  Buffer<Image> images;
  int block[3] = {1, 1, 1};
  std::int64_t across = 1;          // blocks with the same x
  std::vector<std::int64_t> begin;  // of each block
  std::vector<std::int64_t> work;   // (planes + 1,): lines that reach the planes before each, summed over these
  int most[3] = {1, 1, 1};          // cells of the largest window
};

Sorted sort_images(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, int threads);

}  // namespace dembark::fields
