#include "pair_step.hpp"
#ifdef DEMBARK_PAIR_PACKS_X86
#pragma GCC target("avx2")
#include "pair_packs.hpp"

template void dembark::pair_packs<dembark::Pack<4, dembark::Avx2>>(const PairStep&, PairBlock&);
template void dembark::picked_packs<dembark::Pack<4, dembark::Avx2>>(const PairStep&, PairBlock&, int);
#endif
