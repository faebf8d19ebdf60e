// Loops on several threads where OpenMP is there, on one elsewhere.
#pragma once

namespace dembark::sph {

/// Calls work(k) for k = 0 ... count - 1, in any order, on `threads` threads.
template <class Work>
void parallel_for(int count, [[maybe_unused]] int threads, const Work& work) {
#if defined(_OPENMP)
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) if (threads > 1)
#endif
  for (int k = 0; k < count; ++k) work(k);
}

}  // namespace dembark::sph
