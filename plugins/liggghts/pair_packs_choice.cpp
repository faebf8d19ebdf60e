#include "pair_packs.h"

#include <cstdlib>

namespace dembark_liggghts {

PairPacks* choose_pair_packs() {
  const char* const asked = std::getenv("DEMBARK_LANES");
  const int lanes = asked ? std::atoi(asked) : 8;
#ifdef DEMBARK_PAIR_PACKS_X86
  __builtin_cpu_init();
  if (lanes >= 8 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw"))
    return pair_packs_avx512;
  if (lanes >= 4 && __builtin_cpu_supports("avx2")) return pair_packs_avx2;
#else
  (void)lanes;
#endif
  return pair_packs_baseline;
}

}  // namespace dembark_liggghts
