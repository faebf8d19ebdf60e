#include "pair_packs.hpp"

template void dembark::pair_packs<dembark::Pack<2>>(const PairStep&, PairBlock&);
template void dembark::picked_packs<dembark::Pack<2>>(const PairStep&, PairBlock&, int);
