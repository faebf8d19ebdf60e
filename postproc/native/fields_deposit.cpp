#include "fields_deposit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace dembark::fields {
namespace {

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

// Takes the lines of one block together: the sums over them stay in registers, and the part of the grid they reach in the cache.
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
    for (std::size_t block = 0; block + 1 < sorted_.begin.size(); ++block) {
      const int first = int(block / std::size_t(sorted_.across)) * sorted_.block[0];
      if (first >= to || first + sorted_.block[0] - 1 + sorted_.most[0] <= from) continue;
      const std::int64_t count = sorted_.begin[block + 1] - sorted_.begin[block];
      const int groups = int((count + at_once_ - 1) / at_once_);
      for (int n = 0; n < groups; ++n) {
        const Range range(count, n, groups);
        const Group group = gather(sorted_.begin[block] + range.begin, sorted_.begin[block] + range.end, from, to);
        if (group.count > 0) spread(cells_, kernel_, nodes_, group, from, to, scratch_.data(), out_);
      }
    }
  }

 private:
  Group gather(std::int64_t begin, std::int64_t end, int from, int to) {
    Group group{int(end - begin), source_.columns, first_.data(), branch_.data(), values_.data(), windows_.data(), {}};
    int stop[3] = {0, 0, 0};
    // The lines of a group lie anywhere in memory: those of the next groups are fetched while this one is spread, and what they point
    // to when they are there.
    const auto ahead = [&](std::int64_t distance, const auto& fetch) {
      const std::int64_t stop = std::min(end + distance, sorted_.count);
      for (std::int64_t next = std::min(begin + distance, stop); next < stop; ++next) fetch(sorted_.images[std::size_t(next)].line);
    };
    ahead(2 * max_group, [&](std::int64_t line) {
      __builtin_prefetch(lines_.first + 3 * line);
      if (lines_.branch) __builtin_prefetch(lines_.branch + 3 * line);
      source_.prefetch(line);
    });
    ahead(max_group, [&](std::int64_t line) { source_.prefetch_linked(line); });
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
  const Buffer<double> sums = zeros<double>(std::size_t(wide.cells.shape[0]) * wide.cells.shape[1] * wide.cells.shape[2] * source.columns);
  deposit_on(wide.cells, wide.box, kernel, nodes, lines, source, threads, sums.get());
  wide.fold(cells, source.columns, threads, sums.get(), out);
}

template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const Lines&, const PlainSource&, int, double*);
template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const Lines&, const GrainSource&, int, double*);
template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const Lines&, const ContactSource&, int, double*);

}  // namespace dembark::fields
