#include <cstdlib>

#include "pair_packs.h"
#include "dembark/pack.hpp"

namespace dembark_liggghts {

PairPacks* choose_pair_packs() {
#ifdef DEMBARK_PAIR_PACKS_X86
  const char* const asked = std::getenv("DEMBARK_LANES");
  const int lanes = asked ? std::atoi(asked) : 8;
  __builtin_cpu_init();
  if (lanes >= 8 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw"))
    return pair_packs<dembark::Pack<8, dembark::Avx512>>;
  if (lanes >= 4 && __builtin_cpu_supports("avx2")) return pair_packs<dembark::Pack<4, dembark::Avx2>>;
#endif
  return pair_packs<dembark::Pack<2>>;
}

}  // namespace dembark_liggghts
