#include "pair_packs.h"
#ifdef DEMBARK_PAIR_PACKS_X86
#pragma GCC target("avx2")
#include "pair_packs.hpp"

template void dembark_liggghts::pair_packs<dembark::Pack<4, dembark::Avx2>>(const PairStep&, PairBlock&);
#endif
