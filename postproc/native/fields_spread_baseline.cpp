#include <cmath>

#include "fields_lines.hpp"
#define LANES 2
#define SPREAD spread_baseline
#include "fields_spread.hpp"
