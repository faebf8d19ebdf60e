#include "fields_deposit.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "fields_wide.hpp"

namespace dembark::fields {
namespace {

// Bounds (threads + 1,) of slabs of planes with about the same work in each.
std::vector<int> slabs(const std::vector<std::int64_t>& work, int threads) {
  std::vector<int> bounds;
  for (int thread = 0; thread < threads; ++thread) {
    const auto found = std::lower_bound(work.begin(), work.end() - 1, work.back() * thread / threads);
    bounds.push_back(int(found - work.begin()));
  }
  bounds[0] = 0;
  bounds.push_back(int(work.size()) - 1);
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
  Worker(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Source& source, const Shafts<Source>& shafts, double* out)
      : cells_(cells), kernel_(kernel), nodes_(nodes), source_(source), shafts_(shafts), out_(out) {
    // As many lines at once as keep their shares within a cache of the second level.
    int most[3];
    for (int axis = 0; axis < 3; ++axis) most[axis] = shafts.most[axis] + (axis < 2 ? shafts.block[axis] - 1 : 0);
    const long each = long(nodes.count) * (most[0] + most[1] + most[2]) + long(most[1]) * most[2];
    at_once_ = int(std::clamp(32768L / each, 1L, long(max_group)));
    first_.resize(std::size_t(at_once_) * 3);
    branch_.resize(std::size_t(at_once_) * 3);
    together_.resize(std::size_t(at_once_));
    values_.resize(std::size_t(at_once_) * std::size_t(source.columns));
    scratch_.resize(std::size_t(scratch_size(nodes, at_once_, most)));
  }

  // Adds all lines to the planes [from, to).
  void run(int from, int to) {
    static Spread* const spread = best_spread();
    for (std::size_t shaft = 0; shaft + 1 < shafts_.begin.size(); ++shaft) {
      const int first = int(std::int64_t(shaft) / shafts_.across) * shafts_.block[0];
      if (first >= to || first + shafts_.block[0] - 1 + shafts_.most[0] <= from) continue;
      sort(shaft);
      for (std::size_t z = 0; z + 1 < layer_.size(); ++z) {
        const std::int64_t count = layer_[z + 1] - layer_[z];
        const int groups = int((count + at_once_ - 1) / at_once_);
        for (int n = 0; n < groups; ++n) {
          const Range range(count, n, groups);
          const Group group = gather(layer_[z] + range.begin, layer_[z] + range.end, from, to);
          if (group.count > 0) spread(cells_, kernel_, nodes_, group, from, to, scratch_.data(), out_);
        }
      }
    }
  }

 private:
  // The order in which the records of a shaft are taken: by where along z their windows begin, then by where along y they end and begin,
  // so that those that reach a row of cells lie close together; ties in the order of the lines.
  void sort(std::size_t shaft) {
    constexpr int ends = 4;  // ends of windows along y that are distinguished
    records_ = shafts_.records.get() + shafts_.begin[shaft];
    const std::size_t count = std::size_t(shafts_.begin[shaft + 1] - shafts_.begin[shaft]);
    const int height = shafts_.block[1], kinds = ends * height, last = shafts_.most[1] + height - ends;
    const int y = int(std::int64_t(shaft) % shafts_.across) * height;
    windows_.resize(count);
    keys_.resize(count);
    order_.resize(count);
    next_.assign(std::size_t(cells_.shape[2]) * std::size_t(kinds) + 1, 0);
    for (std::size_t n = 0; n < count; ++n) {
      const Window window = windows_[n] = window_of(cells_, kernel_, records_[n].place);
      const int start = first_within(cells_, window, 1) - y, stop = std::clamp(start + window.count[1] - last, 0, ends - 1);
      keys_[n] = (std::int64_t(first_within(cells_, window, 2)) * ends + stop) * height + start;
      ++next_[std::size_t(keys_[n]) + 1];
    }
    for (std::size_t key = 1; key < next_.size(); ++key) next_[key] += next_[key - 1];
    layer_.clear();
    for (std::size_t key = 0; key < next_.size(); key += std::size_t(kinds)) layer_.push_back(next_[key]);
    for (std::size_t n = 0; n < count; ++n) order_[std::size_t(next_[std::size_t(keys_[n])]++)] = std::int64_t(n);
  }

  // The lines [begin, end) in the order of the shaft; none when they do not reach the planes.
  Group gather(std::int64_t begin, std::int64_t end, int from, int to) {
    Group group{int(end - begin), source_.columns, first_.data(), branch_.data(), values_.data(), together_.data(), {}};
    // Records of the next groups are fetched while this one is spread, and what they point to when they are there.
    const auto ahead = [&](std::int64_t distance, const auto& fetch) {
      const std::int64_t stop = std::min(end + distance, std::int64_t(order_.size()));
      for (std::int64_t next = std::min(begin + distance, stop); next < stop; ++next) fetch(records_[order_[std::size_t(next)]]);
    };
    ahead(2 * max_group, [](const Record<Source>& record) {
      __builtin_prefetch(&record);
      __builtin_prefetch(reinterpret_cast<const char*>(&record + 1) - 1);
    });
    ahead(max_group, [&](const Record<Source>& record) { source_.prefetch(record.contribution); });
    int stop[3] = {0, 0, 0};
    for (int line = 0; line < group.count; ++line) {
      const std::int64_t n = order_[std::size_t(begin + line)];
      const typename Source::Place& place = records_[n].place;
      const Window& window = together_[std::size_t(line)] = windows_[std::size_t(n)];
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
    for (int line = 0; line < group.count; ++line)
      source_.fill(records_[order_[std::size_t(begin + line)]], values_.data() + std::ptrdiff_t(line) * source_.columns);
    return group;
  }

  const Cells& cells_;
  const Kernel& kernel_;
  const Nodes& nodes_;
  const Source& source_;
  const Shafts<Source>& shafts_;
  double* out_;
  // Of a shaft.
  const Record<Source>* records_ = nullptr;
  std::vector<Window> windows_;
  std::vector<std::int64_t> keys_, next_, order_, layer_;
  // Of a group.
  int at_once_;
  std::vector<double> first_, branch_, values_, scratch_;
  std::vector<Window> together_;
};

template <class Source>
void deposit_on(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Source& source, int threads,
                double* out) {
  const Shafts<Source> shafts = sort_images(cells, box, kernel, source, threads);
  const int count = std::clamp(threads, 1, cells.shape[0]);
  const std::vector<int> bounds = slabs(shafts.work, count);
  on_threads(count, [&](int n) {
    Worker<Source>(cells, kernel, nodes, source, shafts, out).run(bounds[std::size_t(n)], bounds[std::size_t(n) + 1]);
  });
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
void deposit(const Cells& cells, const Box& box, const Kernel& kernel, const Nodes& nodes, const Source& source, int threads, double* out) {
  threads = std::max(1, threads);
  const Wide wide(cells, box, kernel, source, threads);
  if (!wide.any()) return deposit_on(cells, box, kernel, nodes, source, threads, out);
  const int* const shape = wide.cells.shape;
  const Buffer<double> sums = zeros<double>(std::size_t(shape[0]) * shape[1] * shape[2] * source.columns, threads);
  deposit_on(wide.cells, wide.box, kernel, nodes, source, threads, sums.get());
  wide.fold(cells, source, threads, sums.get(), out);
}

template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const PlainSource&, int, double*);
template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const GrainSource&, int, double*);
template void deposit(const Cells&, const Box&, const Kernel&, const Nodes&, const ContactSource&, int, double*);

}  // namespace dembark::fields
