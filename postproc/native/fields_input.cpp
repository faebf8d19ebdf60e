#include "fields_input.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>
#include <vector>

#include "fields_memory.hpp"

namespace dembark::fields {
namespace {

// Rows of rising ids: counted where no number is left out, else by a table where this is not much larger than they are, else by bisection.
class RowOf {
 public:
  RowOf(const std::int64_t* ids, std::int64_t count) : ids_(ids), count_(count) {
    // Unsigned: ids may span more than the largest signed number.
    const std::uint64_t span = count > 0 ? std::uint64_t(ids[count - 1]) - std::uint64_t(ids[0]) : 0;
    if (count == 0 || span >= 8 * std::uint64_t(count) + 1000) return;
    size_ = span + 1;
    std::int64_t row = 0;
    while (row < count && ids[row] - ids[0] == row) ++row;
    if (row == count) return;
    table_ = zeros<std::int32_t>(size_, 1);
    for (row = 0; row < count; ++row) table_[std::uint64_t(ids[row]) - std::uint64_t(ids[0])] = std::int32_t(row + 1);
  }

  // -1 when it is not there.
  std::int64_t operator()(std::int64_t id) const {
    if (size_ > 0) {
      const std::uint64_t place = std::uint64_t(id) - std::uint64_t(ids_[0]);
      return place >= size_ ? -1 : table_ ? table_[place] - 1 : std::int64_t(place);
    }
    const std::int64_t* found = std::lower_bound(ids_, ids_ + count_, id);
    return found != ids_ + count_ && *found == id ? found - ids_ : -1;
  }

 private:
  const std::int64_t* ids_;
  std::int64_t count_;
  std::uint64_t size_ = 0;
  Buffer<std::int32_t> table_;
};

}  // namespace

bool all_finite(const double* values, std::int64_t count, int threads) {
  static_assert(std::numeric_limits<double>::is_iec559);
  std::vector<char> good(std::size_t(threads), 1);
  on_threads(threads, [&](int n) {
    const Range range(count, n, threads);
    std::uint64_t carry = 0;
    for (std::int64_t at = range.begin; at < range.end; ++at) {
      std::uint64_t bits;
      std::memcpy(&bits, values + at, sizeof bits);
      // An exponent of ones alone, that of no finite number, overflows into the sign.
      carry |= (bits & 0x7ff0000000000000u) + 0x0010000000000000u;
    }
    good[std::size_t(n)] = carry >> 63 == 0;
  });
  return std::all_of(good.begin(), good.end(), [](char one) { return one; });
}

std::int64_t link(const Links& links, int threads, std::int64_t* rows, bool* touching, double* touches) {
  const RowOf row_of(links.ids, links.grains);
  const Buffer<std::atomic<std::int32_t>> counts = zeros<std::atomic<std::int32_t>>(std::size_t(links.grains), threads);
  std::vector<std::int64_t> missing(std::size_t(threads), -1);
  on_threads(threads, [&](int n) {
    const Range range(links.contacts, n, threads);
    for (std::int64_t m = range.begin; m < range.end; ++m) {
      for (std::int64_t side = 2 * m; side < 2 * m + 2; ++side)
        if ((rows[side] = row_of(links.wanted[side])) < 0) {
          missing[std::size_t(n)] = side;
          return;
        }
      const std::int64_t one = rows[2 * m], two = rows[2 * m + 1];
      const double *l = links.branch + 3 * m, reach = (links.radii[one] + links.radii[two]) * links.slack;
      touching[m] = l[0] * l[0] + l[1] * l[1] + l[2] * l[2] <= reach * reach;
      if (!touching[m]) continue;
      counts[std::size_t(one)].fetch_add(1, std::memory_order_relaxed);
      counts[std::size_t(two)].fetch_add(1, std::memory_order_relaxed);
    }
  });
  for (const std::int64_t side : missing)
    if (side >= 0) return side;
  for (std::int64_t grain = 0; grain < links.grains; ++grain) touches[grain] = counts[std::size_t(grain)].load(std::memory_order_relaxed);
  return -1;
}

}  // namespace dembark::fields
