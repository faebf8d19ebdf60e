#include <cmath>

#include "pair_packs.h"
#define DEMBARK_LANES 2
#define PAIR_PACKS pair_packs_baseline
#include "pair_packs.hpp"
