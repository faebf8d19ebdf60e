// The loops of fluids for processors with AVX2. No other code may come into this file: it would run on no other processor.
#if defined(__x86_64__)
#pragma GCC target("avx2")
#endif
#include "dembark/sph/loops.hpp"

namespace dembark::sph {

#if defined(__x86_64__)
extern const Loops avx2_loops;
const Loops avx2_loops = loops_of<Pack<4, Avx2>>();
#endif

}  // namespace dembark::sph
