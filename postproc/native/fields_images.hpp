// Points and lines, their periodic images, and the cells that these reach.
#pragma once

#include <algorithm>
#include <cstdint>

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

struct Point {
  double first[3];
  static constexpr double branch[3] = {0.0, 0.0, 0.0};
};

// From `first` to `first + branch`.
struct Segment {
  double first[3], branch[3];
};

// `place` shifted by full edges of the box.
template <class Place>
Place shifted(Place place, const Box& box, const int edges[3]) {
  if (edges[0] == 0 && edges[1] == 0 && edges[2] == 0) return place;
  for (int axis = 0; axis < 3; ++axis) {
    double shift = 0.0;
    for (int edge = 2; edge >= axis; --edge) shift += edges[edge] * box.edge[edge][axis];
    place.first[axis] += shift;
  }
  return place;
}

// std::floor is a call where the processor is not known to have an instruction for it.
inline double whole_below(double value) {
  const double truncated = double(std::int64_t(value));
  return truncated > value ? truncated - 1.0 : truncated;
}

template <class Place>
Window window_of(const Cells& cells, const Kernel& kernel, const Place& place) {
  Window window;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = place.first[axis], b = a + place.branch[axis];
    const double count = cells.shape[axis];
    double start = (std::min(a, b) - kernel.reach - cells.low[axis]) * cells.per_metre[axis];
    double stop = (std::max(a, b) + kernel.reach - cells.low[axis]) * cells.per_metre[axis];
    // A factor of each axis needs no cells outside the grid; a spherical kernel is normalised over the complete ball.
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

// Calls `take(edges)` for all images of `place`, shifted by full edges of the box, that come within the kernel's reach of the cells.
template <class Place, class Take>
void for_images(const Cells& cells, const Box& box, const Kernel& kernel, const Place& place, const Take& take) {
  int from[3], to[3], edges[3] = {0, 0, 0};
  const auto range = [&](int axis) {
    double a = place.first[axis];
    for (int edge = 2; edge > axis; --edge) a += edges[edge] * box.edge[edge][axis];
    const double b = a + place.branch[axis];
    if (box.folded[axis]) {
      from[axis] = to[axis] = -int(whole_below((a - box.home[axis]) / box.edge[axis][axis]));
      return;
    }
    const double low = cells.low[axis] - (std::max(a, b) + kernel.reach), high = cells.high[axis] - (std::min(a, b) - kernel.reach);
    if (!box.periodic[axis]) {
      from[axis] = 0;
      to[axis] = low < 0.0 && high > 0.0 ? 0 : -1;
    } else {
      const double length = box.edge[axis][axis];
      // Open ends: an image that only touches the grid has no share in it.
      from[axis] = int(whole_below(low / length)) + 1;
      to[axis] = -int(whole_below(-high / length)) - 1;
    }
  };
  // From z to x: a later edge no longer moves an image along the axes done before.
  range(2);
  for (int c = from[2]; c <= to[2]; ++c) {
    edges[2] = c;
    edges[1] = edges[0] = 0;
    range(1);
    for (int b = from[1]; b <= to[1]; ++b) {
      edges[1] = b;
      edges[0] = 0;
      range(0);
      for (int a = from[0]; a <= to[0]; ++a) {
        edges[0] = a;
        take(edges);
      }
    }
  }
}

}  // namespace dembark::fields
