#include "fields_deposit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <thread>
#include <utility>
#include <vector>

namespace dembark::fields {
namespace {

// A line shifted by whole box edges.
struct Image {
  std::int32_t line;
  std::int16_t edges[3];
};

struct Place {
  double first[3], branch[3];
};

Place place_of(const Lines& lines, const Box& box, const Image& image) {
  Place place;
  for (int axis = 0; axis < 3; ++axis) {
    double shift = 0.0;
    for (int edge = 2; edge >= axis; --edge) shift += image.edges[edge] * box.edge[edge][axis];
    place.first[axis] = lines.first[3 * std::int64_t(image.line) + axis] + shift;
    place.branch[axis] = lines.branch ? lines.branch[3 * std::int64_t(image.line) + axis] : 0.0;
  }
  return place;
}

Window window_of(const Cells& cells, const Kernel& kernel, const Place& place) {
  Window window;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = place.first[axis], b = a + place.branch[axis];
    const double count = cells.shape[axis];
    double start = std::floor((std::min(a, b) - kernel.reach - cells.low[axis]) / cells.spacing[axis]);
    double stop = std::ceil((std::max(a, b) + kernel.reach - cells.low[axis]) / cells.spacing[axis]);
    // A factor of each axis needs no cells outside the grid; a spherical kernel is normalised over the whole ball.
    if (kernel.kind == KernelKind::gaussian) {
      start = std::clamp(start, 0.0, count - 1.0);
      stop = std::clamp(stop, 1.0, count);
    }
    window.start[axis] = int(start);
    window.count[axis] = int(std::max(1.0, stop - start));
  }
  return window;
}

// Appends all images of a line that come within the kernel's reach of the cells.
void add_images(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, std::int32_t line,
                std::vector<Image>& images) {
  int from[3], to[3];
  Image image{line, {0, 0, 0}};
  const auto range = [&](int axis) {
    const Place place = place_of(lines, box, image);
    const double a = place.first[axis], b = a + place.branch[axis];
    const double low = cells.low[axis] - (std::max(a, b) + kernel.reach), high = cells.high[axis] - (std::min(a, b) - kernel.reach);
    if (box.folded[axis]) {
      from[axis] = to[axis] = -int(std::floor((a - box.home[axis]) / box.edge[axis][axis]));
    } else if (!box.periodic[axis]) {
      from[axis] = 0;
      to[axis] = low < 0.0 && high > 0.0 ? 0 : -1;
    } else {
      const double length = box.edge[axis][axis];
      // Open ends: an image that only touches the grid has no share in it.
      from[axis] = int(std::floor(low / length)) + 1;
      to[axis] = int(std::ceil(high / length)) - 1;
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
        images.push_back(image);
      }
    }
  }
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

// All images of all lines, in the order of the lines.
std::vector<Image> images_of(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, int threads) {
  std::vector<std::vector<Image>> parts(static_cast<std::size_t>(threads));
  on_threads(threads, [&](int n) {
    const Range range(lines.count, n, threads);
    std::vector<Image>& part = parts[std::size_t(n)];
    part.reserve(std::size_t(range.end - range.begin) * 5 / 4);
    for (std::int64_t line = range.begin; line < range.end; ++line) add_images(cells, box, kernel, lines, std::int32_t(line), part);
  });
  for (int n = 1; n < threads; ++n) parts[0].insert(parts[0].end(), parts[std::size_t(n)].begin(), parts[std::size_t(n)].end());
  return std::move(parts[0]);
}

// Images sorted by the block in which their windows begin, ties in the order they came, and where each block begins. Blocks are of
// block[axis] cells, numbered x, y, z with z running fastest.
struct Sorted {
  std::vector<Image> images;
  int block[3] = {1, 1, 1};
  std::vector<std::int64_t> begin;
  std::vector<std::int64_t> work;  // (planes + 1,): lines that reach the planes before each, summed over these
  int most[3] = {1, 1, 1};  // cells of the largest window
};

Sorted sort_images(const Cells& cells, const Box& box, const Kernel& kernel, const Lines& lines, int threads) {
  Sorted sorted;
  const std::vector<Image> images = images_of(cells, box, kernel, lines, threads);
  std::vector<Window> windows(images.size());
  on_threads(threads, [&](int n) {
    const Range range(std::int64_t(images.size()), n, threads);
    for (std::size_t at = std::size_t(range.begin); at < std::size_t(range.end); ++at)
      windows[at] = window_of(cells, kernel, place_of(lines, box, images[at]));
  });
  const int planes = cells.shape[0];
  std::vector<std::int64_t> change(std::size_t(planes) + 1, 0);
  for (const Window& window : windows) {
    for (int axis = 0; axis < 3; ++axis) sorted.most[axis] = std::max(sorted.most[axis], window.count[axis]);
    ++change[std::size_t(std::clamp(window.start[0], 0, planes))];
    --change[std::size_t(std::clamp(window.start[0] + window.count[0], 0, planes))];
  }
  // Larger blocks give larger groups, which pass the grid less often, but larger windows.
  double together = double(images.size()) / (double(cells.shape[0]) * cells.shape[1] * cells.shape[2]);
  for (int axis = 1; together < 8.0 && 3 * sorted.block[axis] < sorted.most[axis]; axis = 1 - axis, together *= 2.0)
    sorted.block[axis] *= 2;
  std::int64_t blocks[3], total = 1;
  for (int axis = 0; axis < 3; ++axis) total *= blocks[axis] = (cells.shape[axis] - 1) / sorted.block[axis] + 1;
  sorted.begin.assign(std::size_t(total) + 1, 0);
  const auto key = [&](const Window& window) {
    std::int64_t number = 0;
    for (int axis = 0; axis < 3; ++axis)
      number = number * blocks[axis] + std::clamp(window.start[axis], 0, cells.shape[axis] - 1) / sorted.block[axis];
    return std::size_t(number);
  };
  for (const Window& window : windows) ++sorted.begin[key(window) + 1];
  sorted.work.assign(std::size_t(planes) + 1, 0);
  std::int64_t here = 0;
  for (std::size_t plane = 0; plane < std::size_t(planes); ++plane) sorted.work[plane + 1] = sorted.work[plane] + (here += change[plane]);
  for (std::size_t cell = 1; cell < sorted.begin.size(); ++cell) sorted.begin[cell] += sorted.begin[cell - 1];
  std::vector<std::int64_t> next(sorted.begin.begin(), sorted.begin.end() - 1);  // the next free place of each block
  sorted.images.resize(images.size());
  for (std::size_t n = 0; n < images.size(); ++n) sorted.images[std::size_t(next[key(windows[n])]++)] = images[n];
  return sorted;
}

// Bounds (threads + 1,) of slabs of planes with about the same work in each.
std::vector<int> slabs(const Sorted& sorted, int threads) {
  std::vector<int> bounds;
  for (int thread = 0; thread < threads; ++thread) {
    const auto found = std::lower_bound(sorted.work.begin(), sorted.work.end() - 1, sorted.work.back() * thread / threads);
    bounds.push_back(int(found - sorted.work.begin()));
  }
  bounds[0] = 0;
  bounds.push_back(int(sorted.work.size()) - 1);
  return bounds;
}

Spread* best_spread() {
#ifdef DEMBARK_SPREAD_X86
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw"))
    return spread_avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return spread_avx2;
#endif
  return spread_baseline;
}

// Takes the lines of one cell together: the sums over them stay in registers, and the part of the grid they reach in the cache.
template <class Source>
class Worker {
 public:
  Worker(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Lines& lines, const Source& source,
         const Sorted& sorted, double* out)
      : cells_(cells), box_(box), kernel_(kernel), nodes_(nodes), lines_(lines), source_(source), sorted_(sorted), out_(out) {
    // As many lines at once as keep their shares within a cache of the second level.
    int most[3];
    for (int axis = 0; axis < 3; ++axis) most[axis] = sorted.most[axis] + sorted.block[axis] - 1;
    const long each = long(nodes.count) * (most[0] + most[1] + most[2]) + long(most[1]) * most[2];
    at_once_ = int(std::clamp(32768L / each, 1L, long(max_group)));
    first_.resize(std::size_t(at_once_) * 3);
    branch_.resize(std::size_t(at_once_) * 3);
    windows_.resize(std::size_t(at_once_));
    values_.resize(std::size_t(at_once_) * std::size_t(source.columns));
    scratch_.resize(std::size_t(scratch_size(nodes, at_once_, most)));
  }

  // Adds all lines to the planes [from, to).
  void run(int from, int to) {
    static Spread* const spread = best_spread();
    const std::size_t across = (sorted_.begin.size() - 1) / std::size_t((cells_.shape[0] - 1) / sorted_.block[0] + 1);
    for (std::size_t block = 0; block + 1 < sorted_.begin.size(); ++block) {
      const int first = int(block / across) * sorted_.block[0];
      if (first >= to || first + sorted_.block[0] - 1 + sorted_.most[0] <= from) continue;
      for (std::int64_t at = sorted_.begin[block]; at < sorted_.begin[block + 1]; at += at_once_) {
        const Group group = gather(at, std::min<std::int64_t>(at + at_once_, sorted_.begin[block + 1]), from, to);
        if (group.count > 0) spread(cells_, kernel_, nodes_, group, from, to, scratch_.data(), out_);
      }
    }
  }

 private:
  Group gather(std::int64_t begin, std::int64_t end, int from, int to) {
    Group group{int(end - begin), source_.columns, first_.data(), branch_.data(), values_.data(), windows_.data(), {}};
    int stop[3] = {0, 0, 0};
    // The lines of a group lie anywhere in memory: those of the next groups are fetched while this one is spread.
    const std::int64_t ahead = std::min<std::int64_t>(end + ahead_, std::int64_t(sorted_.images.size()));
    for (std::int64_t next = std::min<std::int64_t>(begin + ahead_, ahead); next < ahead; ++next) {
      const std::int64_t line = sorted_.images[std::size_t(next)].line;
      __builtin_prefetch(lines_.first + 3 * line);
      if (lines_.branch) __builtin_prefetch(lines_.branch + 3 * line);
      source_.prefetch(line);
    }
    for (int line = 0; line < group.count; ++line) {
      const Place place = place_of(lines_, box_, sorted_.images[std::size_t(begin + line)]);
      const Window window = windows_[std::size_t(line)] = window_of(cells_, kernel_, place);
      for (int axis = 0; axis < 3; ++axis) {
        first_[std::size_t(3 * line + axis)] = place.first[axis];
        branch_[std::size_t(3 * line + axis)] = place.branch[axis];
        const int last = window.start[axis] + window.count[axis];
        group.all.start[axis] = line ? std::min(group.all.start[axis], window.start[axis]) : window.start[axis];
        stop[axis] = line ? std::max(stop[axis], last) : last;
      }
    }
    for (int axis = 0; axis < 3; ++axis) group.all.count[axis] = stop[axis] - group.all.start[axis];
    if (group.all.start[0] >= to || stop[0] <= from) {
      group.count = 0;
      return group;
    }
    for (int line = 0; line < group.count; ++line) {
      double* values = values_.data() + std::ptrdiff_t(line) * source_.columns;
      source_.fill(sorted_.images[std::size_t(begin + line)].line, first_.data() + 3 * line, values);
    }
    return group;
  }

  static constexpr std::int64_t ahead_ = 64;

  const Cells& cells_;
  const Box& box_;
  const Kernel& kernel_;
  const Nodes& nodes_;
  const Lines& lines_;
  const Source& source_;
  const Sorted& sorted_;
  double* out_;
  int at_once_;
  std::vector<double> first_, branch_, values_, scratch_;
  std::vector<Window> windows_;
};

// A grid that is wider than `inner` by `halo` cells on both sides: what leaves a periodic grid is caught there and added on the other
// side, which saves spreading the images of all lines near a border.
struct Wide {
  Cells cells;
  Box box;
  int halo[3] = {0, 0, 0};

  Wide(const Cells& inner, const Box& around, const Kernel& kernel, const Lines& lines, int threads) : cells(inner), box(around) {
    // Across a sheared border the cells do not meet; a spherical kernel is normalised over its window, wherever that is.
    const bool sheared = box.edge[1][0] != 0.0 || box.edge[2][0] != 0.0 || box.edge[2][1] != 0.0;
    if (sheared || kernel.kind != KernelKind::gaussian || lines.count == 0) return;
    const std::array<double, 3> longest = reach_of_branches(lines, threads);
    for (int axis = 0; axis < 3; ++axis) {
      if (!inner.periodic[axis] || !box.periodic[axis]) continue;
      halo[axis] = int(std::ceil((kernel.reach + longest[std::size_t(axis)]) / inner.spacing[axis])) + 1;
      box.folded[axis] = true;
      box.home[axis] = inner.low[axis];
      cells.low[axis] -= halo[axis] * inner.spacing[axis];
      cells.high[axis] += halo[axis] * inner.spacing[axis];
      cells.shape[axis] += 2 * halo[axis];
    }
  }

  bool any() const { return halo[0] || halo[1] || halo[2]; }

  // Adds `wide` (this grid) to `out` (the inner one), each with `columns`; the planes of `out` are shared among the threads.
  void fold(const Cells& inner, int columns, int threads, const double* wide, double* out) const {
    const auto home = [&](int axis, int cell) {
      const int count = inner.shape[axis];
      return ((cell - halo[axis]) % count + count) % count;
    };
    const std::size_t depth = std::size_t(cells.shape[2]), inner_depth = std::size_t(inner.shape[2]);
    std::vector<std::size_t> place(depth);
    for (std::size_t k = 0; k < depth; ++k) place[k] = std::size_t(home(2, int(k)));
    on_threads(threads, [&](int n) {
      const Range range(inner.shape[0], n, threads);
      for (int i = 0; i < cells.shape[0]; ++i) {
        const int x = home(0, i);
        if (x < range.begin || x >= range.end) continue;
        for (int j = 0; j < cells.shape[1]; ++j) {
          const double* from = wide + (std::size_t(i) * cells.shape[1] + j) * columns * depth;
          double* to = out + (std::size_t(x) * inner.shape[1] + home(1, j)) * columns * inner_depth;
          for (int c = 0; c < columns; ++c, from += depth, to += inner_depth)
            for (std::size_t k = 0; k < depth; ++k) to[place[k]] += from[k];
        }
      }
    });
  }

 private:
  static std::array<double, 3> reach_of_branches(const Lines& lines, int threads) {
    if (!lines.branch) return {0.0, 0.0, 0.0};
    std::vector<std::array<double, 3>> parts(std::size_t(threads), {0.0, 0.0, 0.0});
    on_threads(threads, [&](int n) {
      const Range range(lines.count, n, threads);
      for (std::int64_t at = 3 * range.begin; at < 3 * range.end; at += 3)
        for (std::size_t axis = 0; axis < 3; ++axis)
          parts[std::size_t(n)][axis] = std::max(parts[std::size_t(n)][axis], std::abs(lines.branch[at + std::int64_t(axis)]));
    });
    for (const auto& part : parts)
      for (std::size_t axis = 0; axis < 3; ++axis) parts[0][axis] = std::max(parts[0][axis], part[axis]);
    return parts[0];
  }
};

template <class Source>
void deposit_on(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Lines& lines, const Source& source,
                int threads, double* out) {
  const Sorted sorted = sort_images(cells, box, kernel, lines, threads);
  const int count = std::clamp(threads, 1, cells.shape[0]);
  const std::vector<int> bounds = slabs(sorted, count);
  std::vector<Worker<Source>> workers(std::size_t(count), Worker<Source>(cells, box, kernel, nodes, lines, source, sorted, out));
  on_threads(count, [&](int n) { workers[std::size_t(n)].run(bounds[std::size_t(n)], bounds[std::size_t(n) + 1]); });
}

}  // namespace

const char* instruction_set() {
  const Spread* spread = best_spread();
  if (spread == spread_baseline) return "baseline";
#ifdef DEMBARK_SPREAD_X86
  if (spread == spread_avx2) return "avx2";
#endif
  return "avx512";
}

template <class Source>
void deposit(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Lines& lines, const Source& source,
             int threads, double* out) {
  threads = std::max(1, threads);
  if constexpr (Source::placed) return deposit_on(cells, box, kernel, nodes, lines, source, threads, out);
  const Wide wide(cells, box, kernel, lines, threads);
  if (!wide.any()) return deposit_on(cells, box, kernel, nodes, lines, source, threads, out);
  std::vector<double> sums(std::size_t(wide.cells.shape[0]) * wide.cells.shape[1] * wide.cells.shape[2] * source.columns, 0.0);
  deposit_on(wide.cells, wide.box, kernel, nodes, lines, source, threads, sums.data());
  wide.fold(cells, source.columns, threads, sums.data(), out);
}

template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const Lines&, const PlainSource&, int, double*);
template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const Lines&, const GrainSource&, int, double*);
template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const Lines&, const ContactSource&, int, double*);

}  // namespace dembark::fields
