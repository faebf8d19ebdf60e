#include "pair_packs.hpp"

template void dembark_liggghts::pair_packs<dembark::Pack<2>>(const PairStep&, PairBlock&);
