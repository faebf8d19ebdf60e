// The inner loops of coarse graining; included once for each instruction set with SPREAD set to the function's name and LANES to the
// doubles in a vector. What a cell gets from a group does not depend on `from` and `to`, so that any split of the grid among threads gives
// the same bits.
#include "fields_ball.hpp"
#include "fields_gaussian.hpp"

namespace dembark::fields {

void SPREAD(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int from, int to, double* scratch,
            double* out) {
  if (kernel.kind == KernelKind::gaussian) {
    spread_gaussian(cells, kernel, nodes, group, from, to, scratch, out);
  } else {
    for (int line = 0; line < group.count; ++line) spread_ball(cells, kernel, nodes, group, line, from, to, scratch, out);
  }
}

}  // namespace dembark::fields
