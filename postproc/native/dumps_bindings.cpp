#include <nanobind/nanobind.h>

NB_MODULE(_dumps, module) { module.doc() = "Text dumps as arrays."; }
