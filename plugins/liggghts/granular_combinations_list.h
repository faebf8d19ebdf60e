// Combinations of contact models that are compiled: each line stands for every choice of one model from each bracket. The one list for
// liggghts-dembark, for the line that refuses all others, and for packaging/install_liggghts.sh.
GRAN_MODELS((HERTZ, HOOKE), TANGENTIAL_FINNIE_RABINOWICZ, COHESION_OFF, (ROLLING_OFF, ROLLING_CDT, ROLLING_EPSD2), SURFACE_DEFAULT)
GRAN_MODELS((HERTZ, HOOKE), TANGENTIAL_FINNIE_RABINOWICZ, COHESION_CAPILLARY, (ROLLING_OFF, ROLLING_CDT, ROLLING_EPSD2), SURFACE_DEFAULT)
GRAN_MODELS((HERTZ, HOOKE), TANGENTIAL_HISTORY, COHESION_CAPILLARY, (ROLLING_OFF, ROLLING_CDT, ROLLING_EPSD2), SURFACE_DEFAULT)
