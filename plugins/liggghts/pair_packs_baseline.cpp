#include "pair_packs.hpp"

#include <cstdlib>

namespace dembark_liggghts {

extern template void pair_packs<dembark::Pack<4, dembark::Avx2>>(const PairStep&, PairBlock&);
extern template void pair_packs<dembark::Pack<8, dembark::Avx512>>(const PairStep&, PairBlock&);

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

template void pair_packs<dembark::Pack<2>>(const PairStep&, PairBlock&);

}  // namespace dembark_liggghts
