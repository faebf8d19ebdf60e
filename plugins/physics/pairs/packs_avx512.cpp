#include "pair_step.hpp"
#ifdef DEMBARK_PAIR_PACKS_X86
#pragma GCC target("avx512f,avx512dq,avx512vl,avx512bw,avx2")
#if __GNUC__ >= 10
#pragma GCC target("prefer-vector-width=512")
#endif
#include "pair_packs.hpp"

template void dembark::pair_packs<dembark::Pack<8, dembark::Avx512>>(const PairStep&, PairBlock&);
template void dembark::picked_packs<dembark::Pack<8, dembark::Avx512>>(const PairStep&, PairBlock&, int);
#endif
