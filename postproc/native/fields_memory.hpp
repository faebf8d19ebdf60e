// Large memory and the threads that work on it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <type_traits>
#include <vector>

namespace dembark::fields {

// Large blocks, kept for the next frame: to get them from the system and have it clear them takes as long as to fill them. The system may
// take back what lies idle. All that is kept is never more than what was in use at one time.
class Blocks {
 public:
  struct Block {
    void* memory = nullptr;
    std::size_t bytes = 0;
    bool cleared = true;  // never used
  };

  static constexpr std::size_t least = std::size_t(1) << 22;

  static Blocks& all();

  // Of at least `bytes`; what it holds is unknown unless it is `cleared`.
  Block take(std::size_t bytes);
  void give(const Block& block);

 private:
  std::mutex mutex_;
  std::vector<Block> idle_;  // the last one was given back last
  std::size_t in_use_ = 0, most_ = 0, kept_ = 0;
};

struct Free {
  std::size_t bytes = 0;  // of a block; 0: from the heap

  void operator()(void* memory) const {
    if (bytes > 0) return Blocks::all().give({memory, bytes, false});
    std::free(memory);
  }
};

template <class T>
using Buffer = std::unique_ptr<T[], Free>;

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

// Room for `count` values that are to be written before they are read, aligned to lines of the cache.
template <class T>
Buffer<T> room(std::size_t count, bool* cleared = nullptr) {
  static_assert(std::is_trivially_destructible<T>::value, "nothing is made and nothing destroyed");
  const std::size_t line = 64, bytes = ((count > 0 ? count : 1) * sizeof(T) + line - 1) / line * line;
  Blocks::Block block{nullptr, 0, false};
  if (bytes >= Blocks::least) {
    block = Blocks::all().take(bytes);
  } else {
    block.memory = std::aligned_alloc(line, bytes);
    if (block.memory == nullptr) throw std::bad_alloc();
  }
  if (cleared) *cleared = block.cleared;
  return Buffer<T>(static_cast<T*>(block.memory), Free{block.bytes});
}

// `count` zeros, written by several threads; those of new memory by the system, where it is touched first.
template <class T>
Buffer<T> zeros(std::size_t count, int threads) {
  bool cleared;
  Buffer<T> values = room<T>(count, &cleared);
  if (cleared) return values;
  on_threads(threads, [&](int n) {
    const Range range(std::int64_t(count), n, threads);
    std::memset(static_cast<void*>(values.get() + range.begin), 0, std::size_t(range.end - range.begin) * sizeof(T));
  });
  return values;
}

}  // namespace dembark::fields
