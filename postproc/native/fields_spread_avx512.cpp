#include <cmath>

#include "fields_lines.hpp"
#ifdef DEMBARK_SPREAD_X86
#pragma GCC target("avx512f,avx512dq,avx512vl,avx512bw,avx2,fma,prefer-vector-width=512")
#define LANES 8
#define SPREAD spread_avx512
#include "fields_spread.hpp"
#endif
