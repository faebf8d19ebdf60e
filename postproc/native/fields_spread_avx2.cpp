#include <cmath>

#include "fields_lines.hpp"
#ifdef DEMBARK_SPREAD_X86
#pragma GCC target("avx2,fma")
#define LANES 4
#define SPREAD spread_avx2
#include "fields_spread.hpp"
#endif
