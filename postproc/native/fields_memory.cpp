#include "fields_memory.hpp"

#include <sys/mman.h>

#include <algorithm>

namespace dembark::fields {

Blocks& Blocks::all() {
  static Blocks* const blocks = new Blocks;  // never destroyed: buffers may outlive other statics
  return *blocks;
}

Blocks::Block Blocks::take(std::size_t bytes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  // Steps of an eighth of a power of two, so that the next frame with a few grains more finds its block.
  std::size_t step = least;
  while (16 * step <= bytes) step *= 2;
  bytes = (bytes + step - 1) / step * step;
  auto best = idle_.end();
  for (auto block = idle_.begin(); block != idle_.end(); ++block)
    if (block->bytes >= bytes && block->bytes <= 2 * bytes && (best == idle_.end() || block->bytes < best->bytes)) best = block;
  Block found;
  if (best != idle_.end()) {
    found = *best;
    idle_.erase(best);
    kept_ -= found.bytes;
  } else {
    found.memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (found.memory == MAP_FAILED) throw std::bad_alloc();
    found.bytes = bytes;
#ifdef MADV_HUGEPAGE
    madvise(found.memory, bytes, MADV_HUGEPAGE);  // only advice: small pages are slower to get and to look up
#endif
  }
  in_use_ += found.bytes;
  most_ = std::max(most_, in_use_);
  return found;
}

void Blocks::give(const Block& block) {
  const std::lock_guard<std::mutex> lock(mutex_);
  in_use_ -= block.bytes;
  kept_ += block.bytes;
  idle_.push_back(block);
#ifdef MADV_FREE
  madvise(block.memory, block.bytes, MADV_FREE);
#endif
  while (in_use_ + kept_ > most_) {
    kept_ -= idle_.front().bytes;
    munmap(idle_.front().memory, idle_.front().bytes);
    idle_.erase(idle_.begin());
  }
}

}  // namespace dembark::fields
