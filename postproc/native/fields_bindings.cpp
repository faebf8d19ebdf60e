#include <nanobind/nanobind.h>

NB_MODULE(_fields, module) { module.doc() = "Grains and contacts on a grid."; }
