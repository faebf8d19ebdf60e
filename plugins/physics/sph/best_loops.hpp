// The loops of fluids for the processor that runs the program; loops_avx2.cpp belongs to programs that include this.
#pragma once

#include "loops.hpp"

namespace dembark::sph {

#if defined(__x86_64__)
extern const Loops avx2_loops;
#endif

inline const Loops& best_loops() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return avx2_loops;
#endif
  return portable_loops();
}

}  // namespace dembark::sph
