#include "fields_images.hpp"

#include <algorithm>
#include <atomic>

namespace dembark::fields {
namespace {

constexpr double enough = 32.0;  // lines of a block: passing its part of the grid then costs little beside them
constexpr int ends = 4;          // ends of windows along y that are told apart

// An image with the cell in which its window begins, and the cells of this along y.
struct Found {
  Image image;
  std::uint16_t rows;
  std::int32_t start[3];
};

// What one thread finds.
struct Part {
  std::vector<Found> found;
  int most[3] = {1, 1, 1};
  std::vector<std::int64_t> change;  // (planes + 1,): lines that reach a plane, less those that reach the one before
  std::vector<std::int64_t> next;    // of each x: lines that begin there, then where the next one goes
};

// Calls `take(image)` for all images of a line that come within the kernel's reach of the cells.
template <class Take>
void for_images(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, std::int32_t line, const Take& take) {
  int from[3], to[3];
  Image image{line, {0, 0, 0}};
  const auto range = [&](int axis) {
    double a = lines.first[3 * std::int64_t(line) + axis];
    for (int edge = 2; edge > axis; --edge) a += image.edges[edge] * box.edge[edge][axis];
    const double b = lines.branch ? a + lines.branch[3 * std::int64_t(line) + axis] : a;
    const double low = cells.low[axis] - (std::max(a, b) + kernel.reach), high = cells.high[axis] - (std::min(a, b) - kernel.reach);
    if (box.folded[axis]) {
      from[axis] = to[axis] = -int(whole_below((a - box.home[axis]) / box.edge[axis][axis]));
    } else if (!box.periodic[axis]) {
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
    image.edges[2] = std::int16_t(c);
    image.edges[1] = image.edges[0] = 0;
    range(1);
    for (int b = from[1]; b <= to[1]; ++b) {
      image.edges[1] = std::int16_t(b);
      image.edges[0] = 0;
      range(0);
      for (int a = from[0]; a <= to[0]; ++a) {
        image.edges[0] = std::int16_t(a);
        take(image);
      }
    }
  }
}

Part find(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, const Range& range) {
  Part part;
  const int planes = cells.shape[0];
  part.change.assign(std::size_t(planes) + 1, 0);
  part.next.assign(std::size_t(planes), 0);
  part.found.reserve(std::size_t(range.end - range.begin) * 9 / 8);
  for (std::int64_t line = range.begin; line < range.end; ++line)
    for_images(cells, box, kernel, lines, std::int32_t(line), [&](const Image& image) {
      const Window window = window_of(cells, kernel, place_of(lines, box, image));
      Found found{image, std::uint16_t(std::min(window.count[1], 0xffff)), {}};
      for (int axis = 0; axis < 3; ++axis) {
        found.start[axis] = std::clamp(window.start[axis], 0, cells.shape[axis] - 1);
        part.most[axis] = std::max(part.most[axis], window.count[axis]);
      }
      ++part.change[std::size_t(std::clamp(window.start[0], 0, planes))];
      --part.change[std::size_t(std::clamp(window.start[0] + window.count[0], 0, planes))];
      ++part.next[std::size_t(found.start[0])];
      part.found.push_back(found);
    });
  return part;
}

// Sorts [begin, end) of `found`, all of one x, into the same range of the images; the first one of each block goes to `first`.
void sort_across(const Sorted& sorted, const Cells& cells, const Found* found, std::int64_t begin, std::int64_t end, std::int64_t* first) {
  const int height = sorted.block[1], depth = cells.shape[2], kinds = ends * height, last = sorted.most[1] + height - ends;
  const auto key = [&](const Found& one) {
    const int block = one.start[1] / height, start = one.start[1] - block * height;
    const int stop = std::clamp(start + one.rows - last, 0, ends - 1);
    return std::size_t(((std::int64_t(block) * depth + one.start[2]) * ends + stop) * height + start);
  };
  std::vector<std::int64_t> next(std::size_t(sorted.across * kinds) + 1, 0);
  for (std::int64_t n = begin; n < end; ++n) ++next[key(found[n]) + 1];
  next[0] = begin;
  for (std::size_t n = 1; n < next.size(); ++n) next[n] += next[n - 1];
  for (std::int64_t block = 0; block < sorted.across; ++block) first[block] = next[std::size_t(block * kinds)];
  for (std::int64_t n = begin; n < end; ++n) sorted.images[std::size_t(next[key(found[n])]++)] = found[n].image;
}

}  // namespace

Sorted sort_images(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, int threads) {
  std::vector<Part> parts(static_cast<std::size_t>(threads));
  on_threads(threads, [&](int n) { parts[std::size_t(n)] = find(cells, box, kernel, lines, Range(lines.count, n, threads)); });
  Sorted sorted;
  const std::size_t planes = std::size_t(cells.shape[0]);
  sorted.work.assign(planes + 1, 0);
  for (const Part& part : parts) {
    sorted.count += std::int64_t(part.found.size());
    for (int axis = 0; axis < 3; ++axis) sorted.most[axis] = std::max(sorted.most[axis], part.most[axis]);
    for (std::size_t plane = 0; plane < planes; ++plane) sorted.work[plane + 1] += part.change[plane];
  }
  for (int twice = 0; twice < 2; ++twice)
    for (std::size_t plane = 0; plane < planes; ++plane) sorted.work[plane + 1] += sorted.work[plane];
  // Larger blocks give larger groups, which pass the grid less often, but larger windows.
  double together = double(sorted.count) / (double(cells.shape[0]) * cells.shape[1] * cells.shape[2]);
  for (int axis = 1; together < enough && 3 * sorted.block[axis] < sorted.most[axis]; axis = 1 - axis, together *= 2.0)
    sorted.block[axis] *= 2;
  const std::size_t thick = std::size_t(sorted.block[0]), deep = (planes - 1) / thick + 1;
  sorted.across = std::int64_t((cells.shape[1] - 1) / sorted.block[1] + 1) * cells.shape[2];
  sorted.begin.assign(deep * std::size_t(sorted.across) + 1, sorted.count);
  // First by the x of the block, each thread what it found, then across x, each thread some x.
  std::vector<std::int64_t> bounds(deep + 1, 0);
  std::int64_t place = 0;
  for (std::size_t x = 0; x < deep; ++x) {
    for (Part& part : parts) {
      std::int64_t here = 0;
      for (std::size_t plane = x * thick; plane < std::min(planes, (x + 1) * thick); ++plane) here += part.next[plane];
      part.next[x] = place;
      place += here;
    }
    bounds[x + 1] = place;
  }
  const Buffer<Found> found = zeros<Found>(std::size_t(sorted.count));
  on_threads(threads, [&](int n) {
    Part& part = parts[std::size_t(n)];
    for (const Found& one : part.found) found[std::size_t(part.next[std::size_t(one.start[0]) / thick]++)] = one;
    part.found = {};
  });
  sorted.images = zeros<Image>(std::size_t(sorted.count));
  std::atomic<std::size_t> next{0};
  on_threads(threads, [&](int) {
    for (std::size_t x = next++; x < deep; x = next++)
      sort_across(sorted, cells, found.get(), bounds[x], bounds[x + 1], sorted.begin.data() + x * std::size_t(sorted.across));
  });
  return sorted;
}

}  // namespace dembark::fields
