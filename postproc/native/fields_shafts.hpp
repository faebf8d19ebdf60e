// Lines with what they carry, brought together by where on the grid their windows begin.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fields_images.hpp"
#include "fields_memory.hpp"

namespace dembark::fields {

// One image of a line with all that is known of the line: what lies anywhere in memory is read once, in order.
template <class Source>
struct Record {
  typename Source::Place place;
  typename Source::Contribution contribution;
};

// All images that come within the kernel's reach of the cells. Those whose windows begin in the same block[0] x block[1] cells across x
// and y make a shaft along z; shafts are numbered x, y with y running fastest. In a shaft records come in the order of the lines.
template <class Source>
struct Shafts {
  std::int64_t count = 0;
  Buffer<Record<Source>> records;
  int block[2] = {1, 1};
  std::int64_t across = 1;          // shafts with the same x
  std::vector<std::int64_t> begin;  // (shafts + 1,)
  std::vector<std::int64_t> work;   // (planes + 1,): lines that reach the planes before each, summed over these
  int most[3] = {1, 1, 1};          // cells of the largest window
};

// First cell of a window along an axis, of the part of it within the grid.
inline int first_within(const Cells& cells, const Window& window, int axis) {
  return std::clamp(window.start[axis], 0, cells.shape[axis] - 1);
}

// Calls `take(line, edges, window)` for all images of a range of lines.
template <class Source, class Take>
void for_windows(const Cells& cells, const Box& box, const Kernel& kernel, const Source& source, const Range& range, const Take& take) {
  for (std::int64_t line = range.begin; line < range.end; ++line) {
    const typename Source::Place place = source.place(line);
    for_images(cells, box, kernel, place,
               [&](const int (&edges)[3]) { take(line, edges, window_of(cells, kernel, shifted(place, box, edges))); });
  }
}

// What one thread counts.
struct Counts {
  int most[3] = {1, 1, 1};
  std::vector<std::int64_t> change;  // (planes + 1,): lines that reach a plane, less those that reach the one before
  std::vector<std::int64_t> next;    // windows that begin at each x and y; then where the next one of each shaft goes
};

template <class Source>
Counts count_windows(const Cells& cells, const Box& box, const Kernel& kernel, const Source& source, const Range& range) {
  Counts counts;
  const int planes = cells.shape[0];
  counts.change.assign(std::size_t(planes) + 1, 0);
  counts.next.assign(std::size_t(planes) * std::size_t(cells.shape[1]), 0);
  for_windows(cells, box, kernel, source, range, [&](std::int64_t, const auto&, const Window& window) {
    for (int axis = 0; axis < 3; ++axis) counts.most[axis] = std::max(counts.most[axis], window.count[axis]);
    ++counts.change[std::size_t(std::clamp(window.start[0], 0, planes))];
    --counts.change[std::size_t(std::clamp(window.start[0] + window.count[0], 0, planes))];
    ++counts.next[std::size_t(first_within(cells, window, 0)) * std::size_t(cells.shape[1]) + std::size_t(first_within(cells, window, 1))];
  });
  return counts;
}

// Larger blocks give larger groups, which pass the grid less often, but larger windows.
inline void choose_block(const Cells& cells, std::int64_t count, const int most[3], int block[2]) {
  constexpr double enough = 32.0;  // lines of a block: passing its part of the grid then costs little compared with them
  double together = double(count) / (double(cells.shape[0]) * cells.shape[1] * cells.shape[2]);
  for (int axis = 1; together < enough && 3 * block[axis] < most[axis]; axis = 1 - axis, together *= 2.0) block[axis] *= 2;
}

// Where the record of an image goes.
struct Placed {
  std::int64_t line, to;
  int edges[3];
};

template <class Source>
Shafts<Source> sort_images(const Cells& cells, const Box& box, const Kernel& kernel, const Source& source, int threads) {
  std::vector<Counts> counts(static_cast<std::size_t>(threads));
  on_threads(threads, [&](int n) {
    counts[std::size_t(n)] = count_windows(cells, box, kernel, source, Range(source.count, n, threads));
  });
  Shafts<Source> shafts;
  const std::size_t planes = std::size_t(cells.shape[0]), height = std::size_t(cells.shape[1]);
  shafts.work.assign(planes + 1, 0);
  for (const Counts& part : counts) {
    for (const std::int64_t here : part.next) shafts.count += here;
    for (int axis = 0; axis < 3; ++axis) shafts.most[axis] = std::max(shafts.most[axis], part.most[axis]);
    for (std::size_t plane = 0; plane < planes; ++plane) shafts.work[plane + 1] += part.change[plane];
  }
  for (int twice = 0; twice < 2; ++twice)
    for (std::size_t plane = 0; plane < planes; ++plane) shafts.work[plane + 1] += shafts.work[plane];
  choose_block(cells, shafts.count, shafts.most, shafts.block);
  const std::size_t thick = std::size_t(shafts.block[0]), wide = std::size_t(shafts.block[1]);
  const std::size_t across = (height - 1) / wide + 1, total = ((planes - 1) / thick + 1) * across;
  const auto shaft_of = [=](std::size_t x, std::size_t y) { return x / thick * across + y / wide; };
  for (Counts& part : counts) {
    std::vector<std::int64_t> here(total, 0);
    for (std::size_t x = 0; x < planes; ++x)
      for (std::size_t y = 0; y < height; ++y) here[shaft_of(x, y)] += part.next[x * height + y];
    part.next = std::move(here);
  }
  shafts.across = std::int64_t(across);
  std::int64_t place = 0;
  for (std::size_t shaft = 0; shaft < total; ++shaft) {
    shafts.begin.push_back(place);
    for (Counts& part : counts) {
      const std::int64_t here = part.next[shaft];
      part.next[shaft] = place;
      place += here;
    }
  }
  shafts.begin.push_back(place);
  shafts.records = room<Record<Source>>(std::size_t(shafts.count));
  on_threads(threads, [&](int n) {
    std::vector<std::int64_t>& next = counts[std::size_t(n)].next;
    // Some are placed before they are written: writes that wait for memory would hold up all reads of what has just been worked out.
    std::vector<Placed> some;
    const auto write = [&] {
      for (const Placed& one : some)
        shafts.records[std::size_t(one.to)] = {shifted(source.place(one.line), box, one.edges), source.contribution(one.line)};
      some.clear();
    };
    const Range range(source.count, n, threads);
    for_windows(cells, box, kernel, source, range, [&](std::int64_t line, const auto& edges, const Window& window) {
      const std::size_t shaft = shaft_of(std::size_t(first_within(cells, window, 0)), std::size_t(first_within(cells, window, 1)));
      some.push_back({line, next[shaft]++, {edges[0], edges[1], edges[2]}});
      if (some.size() == 256) write();
    });
    write();
  });
  return shafts;
}

}  // namespace dembark::fields
