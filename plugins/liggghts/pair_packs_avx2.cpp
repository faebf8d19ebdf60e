#include <cmath>

#include "pair_packs.h"
#ifdef DEMBARK_PAIR_PACKS_X86
#include <immintrin.h>
#pragma GCC target("avx2")
#define DEMBARK_LANES 4
#define PAIR_PACKS pair_packs_avx2
#include "pair_packs.hpp"
#endif
