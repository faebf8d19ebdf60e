#include <cmath>

#include "pair_packs.h"
#ifdef DEMBARK_PAIR_PACKS_X86
#include <immintrin.h>
#pragma GCC target("avx512f,avx512dq,avx512vl,avx512bw,avx2,prefer-vector-width=512")
#define DEMBARK_LANES 8
#define PAIR_PACKS pair_packs_avx512
#include "pair_packs.hpp"
#endif
