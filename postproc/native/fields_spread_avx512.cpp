#include <cmath>

#include "fields_lines.hpp"
#ifdef DEMBARK_SPREAD_X86
#pragma GCC target("avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")
#if __GNUC__ >= 10
#pragma GCC target("prefer-vector-width=512")
#endif
#define LANES 8
#define SPREAD spread_avx512
#include "fields_spread.hpp"
#endif
