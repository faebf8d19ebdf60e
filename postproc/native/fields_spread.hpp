// The inner loops of coarse graining; included once for each instruction set with SPREAD set to the function's name and LANES to the
// doubles in a vector. What a cell gets from a group does not depend on `from` and `to`, so that any split of the grid among threads gives
// the same bits.

namespace dembark::fields {
namespace {

inline double clamp(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

// Integral from 0 to x of the Gaussian of standard deviation 1, cut at 3 and normalised: x times a polynomial in x^2 of degree 16, fitted
// to 1e-15 (erf(x / sqrt 2) / (2 erf(3 / sqrt 2)) at Chebyshev points).
template <class Number>
inline Number half_gaussian(Number x) {
  x = x < -3.0 ? Number{} - 3.0 : x > 3.0 ? Number{} + 3.0 : x;
  const Number u = x * x * (1.0 / 4.5) - 1.0;
  static constexpr double c[17] = {0.22832961018667941, -0.09308378714444443, 0.046096695165837726, -0.020626803743848798,
                                   0.0080432045225557868, -0.0027365221310244204, 0.00082009289492281979, -0.00021881942106935577,
                                   5.2510114069543034e-05, -1.1434606565200895e-05, 2.2772871863171932e-06, -4.1764135591387858e-07,
                                   7.0927769907576937e-08, -1.1192516199860439e-08, 1.6650237004264441e-09, -2.464845016263867e-10,
                                   2.9930377544698147e-11};
  Number sum = u * c[16] + c[15];
  for (int k = 14; k >= 0; --k) sum = sum * u + c[k];
  return sum * x;
}

using Pack = double __attribute__((vector_size(8 * LANES)));

inline Pack load(const double* p) {
  Pack pack;
  __builtin_memcpy(&pack, p, sizeof pack);
  return pack;
}

inline void store(double* p, const Pack& pack) { __builtin_memcpy(p, &pack, sizeof pack); }

// Shares along each axis of all places on the lines of a group: (count, nodes, stride) for each axis, in the cells of the group's window,
// zero beyond the line's own; those along x times the nodes' weights.
struct Factors {
  double* of[3];
  long stride[3];
};

inline double* aligned(double* p) { return reinterpret_cast<double*>((reinterpret_cast<unsigned long long>(p) + 63) & ~63ull); }

// `pack` moved up by one lane, with the last lane of `before` in the first.
inline Pack moved_up(const Pack& before, const Pack& pack) {
#if LANES == 8
  return __builtin_shufflevector(before, pack, 7, 8, 9, 10, 11, 12, 13, 14);
#elif LANES == 4
  return __builtin_shufflevector(before, pack, 3, 4, 5, 6);
#else
  return __builtin_shufflevector(before, pack, 1, 2);
#endif
}

// What the shares along an axis about `place` are scaled by.
inline double closing(const Cells& cells, const Kernel& kernel, int axis, double place) {
  if (!kernel.closed || cells.periodic[axis]) return 1.0;
  const double scale = 1.0 / kernel.width;
  const double inside = half_gaussian((cells.high[axis] - place) * scale) - half_gaussian((cells.low[axis] - place) * scale);
  return place >= cells.low[axis] && place <= cells.high[axis] && inside > 0.0 ? 1.0 / inside : 0.0;
}

inline Factors gaussian_factors(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, double* scratch,
                                double** free) {
  const double scale = 1.0 / kernel.width;
  Pack above;  // numbers of the upper edges of the first cells
  for (int lane = 0; lane < LANES; ++lane) above[lane] = lane + 1;
  Factors factors;
  for (int axis = 0; axis < 3; ++axis) {
    const long stride = factors.stride[axis] = (group.all.count[axis] + LANES - 1) / LANES * LANES;
    const double step = cells.spacing[axis], low = cells.low[axis];
    double* to = factors.of[axis] = aligned(scratch);
    for (int line = 0; line < group.count; ++line) {
      const int start = group.windows[line].start[axis], count = group.windows[line].count[axis];
      const Pack edges = (above + double(start)) * step + low;
      double* const from = to + (start - group.all.start[axis]);
      for (int q = 0; q < nodes.count; ++q, to += stride) {
        const double place = group.first[3 * line + axis] + nodes.place[q] * group.branch[3 * line + axis];
        // The node's weight goes into the shares along x.
        const double factor = closing(cells, kernel, axis, place) * (axis == 0 ? nodes.weight[q] : 1.0);
        const double lowest = (low + double(start) * step - place) * scale;
        Pack below = Pack{} + (lowest > -3.0 ? half_gaussian(lowest) : half_gaussian(-3.0));
        for (long i = 0; i < stride; i += LANES) store(to + i, Pack{});
        // What a pack has too much belongs to the next place, which is filled later.
        for (int i = 0; i < count; i += LANES) {
          const Pack upper = half_gaussian<Pack>((edges + double(i) * step - place) * scale);
          store(from + q * stride + i, (upper - moved_up(below, upper)) * factor);
          below = upper;
        }
      }
    }
    scratch = to + LANES;
  }
  *free = aligned(scratch);
  return factors;
}

inline double radial(const Kernel& kernel, double square) {
  const double share = clamp(std::sqrt(square) / kernel.width, 0.0, 1.0), rest = 1.0 - share;
  return kernel.kind == KernelKind::lucy ? (1.0 + 3.0 * share) * rest * rest * rest : 1.0;
}

// Integral of a spherical kernel about 0 along z between `low` and `high` within +-chord, at the distance^2 `flat` from the axis.
inline double along_z(const Kernel& kernel, double low, double high, double chord, double flat) {
  const double a = clamp(low, -chord, chord), length = clamp(high, -chord, chord) - a;
  if (length <= 0.0) return 0.0;
  if (kernel.kind == KernelKind::heaviside) return length;
  double sum = 0.0;
  for (int n = 0; n < kernel.cell_nodes; ++n) {
    const double z = a + length * kernel.cell_place[n];
    sum += kernel.cell_weight[n] * radial(kernel, flat + z * z);
  }
  return sum * length;
}

inline double root(double square) { return square > 0.0 ? std::sqrt(square) : 0.0; }

// Shares of a spherical kernel about `place` in the window, normalised over the window (over its part within the cells when closed).
inline void ball_shares(const Cells& cells, const Kernel& kernel, const Window& window, const double place[3], double* share) {
  const int nx = window.count[0], ny = window.count[1], nz = window.count[2], nodes = kernel.cell_nodes;
  const double radius = kernel.width;
  const auto edge = [&](int axis, int i) { return cells.low[axis] + (window.start[axis] + i) * cells.spacing[axis] - place[axis]; };
  const auto open = [&](int axis, int i) {
    if (!kernel.closed || cells.periodic[axis]) return true;
    if (place[axis] < cells.low[axis] || place[axis] > cells.high[axis]) return false;
    return window.start[axis] + i >= 0 && window.start[axis] + i < cells.shape[axis];
  };
  for (long n = 0, end = long(nx) * ny * nz; n < end; ++n) share[n] = 0.0;
  for (int i = 0; i < nx; ++i) {
    const double x0 = clamp(edge(0, i), -radius, radius), x_length = clamp(edge(0, i + 1), -radius, radius) - x0;
    if (x_length <= 0.0 || !open(0, i)) continue;
    for (int a = 0; a < nodes; ++a) {
      const double x = x0 + x_length * kernel.cell_place[a], chord = root(radius * radius - x * x);
      if (chord <= 0.0) continue;
      for (int j = 0; j < ny; ++j) {
        // In the angle the chords along z are smooth up to the rim of the ball.
        const double from = std::asin(clamp(edge(1, j) / chord, -1.0, 1.0));
        const double angle = std::asin(clamp(edge(1, j + 1) / chord, -1.0, 1.0)) - from;
        if (angle <= 0.0 || !open(1, j)) continue;
        for (int b = 0; b < nodes; ++b) {
          const double at = from + angle * kernel.cell_place[b];
          const double y = chord * std::sin(at), flat = x * x + y * y, reach = root(radius * radius - flat);
          const double weight = x_length * kernel.cell_weight[a] * chord * std::cos(at) * angle * kernel.cell_weight[b];
          double* row = share + (long(i) * ny + j) * nz;
          for (int k = 0; k < nz; ++k)
            if (open(2, k)) row[k] += weight * along_z(kernel, edge(2, k), edge(2, k + 1), reach, flat);
        }
      }
    }
  }
  double total = 0.0;
  for (long n = 0, end = long(nx) * ny * nz; n < end; ++n) total += share[n];
  const double scale = total > 0.0 ? 1.0 / total : 0.0;
  for (long n = 0, end = long(nx) * ny * nz; n < end; ++n) share[n] *= scale;
}

// Those lines of a group that reach a plane, with what they carry.
struct Plane {
  int count = 0;
  int lines[max_group];
  const double* values[max_group];
};

inline Plane plane_of(const Group& group, int x) {
  Plane plane;
  for (int line = 0; line < group.count; ++line) {
    plane.lines[plane.count] = line;
    plane.values[plane.count] = group.values + long(line) * group.columns;
    plane.count += x >= group.windows[line].start[0] && x < group.windows[line].start[0] + group.windows[line].count[0];
  }
  return plane;
}

// Adds Q nodes of a line, from the node `place` of all lines on, to its `rows` of a plane: `height` ones, `pitch` apart. `first`: nothing
// is there yet.
template <int Q>
inline void add_nodes(const Factors& factors, long place, long x, long y, int height, long pitch, bool first, double* rows) {
  const long y_stride = factors.stride[1], z_stride = factors.stride[2];
  const double* across = factors.of[1] + place * y_stride + y;
  for (long k = 0; k < z_stride; k += LANES) {
    Pack along[Q];
    for (int q = 0; q < Q; ++q)
      along[q] = load(factors.of[2] + (place + q) * z_stride + k) * factors.of[0][(place + q) * factors.stride[0] + x];
    for (int j = 0; j < height; ++j) {
      Pack sum = along[0] * across[j];
      for (int q = 1; q < Q; ++q) sum += along[q] * across[q * y_stride + j];
      double* row = rows + j * pitch + k;
      store(row, first ? sum : load(row) + sum);
    }
  }
}

// rows (cells of y, lines of the plane, z_stride) of the plane `x`: the lines' mean shares.
inline void plane_rows(const Factors& factors, const Nodes& nodes, const Group& group, const Plane& plane, int x, double* rows) {
  const long z_stride = factors.stride[2], pitch = plane.count * z_stride;
  for (int n = 0; n < plane.count; ++n, rows += z_stride) {
    const Window& window = group.windows[plane.lines[n]];
    const int begin = window.start[1] - group.all.start[1], height = window.count[1];
    const auto clear = [&](int from, int to) {
      for (int j = from; j < to; ++j)
        for (long k = 0; k < z_stride; k += LANES) store(rows + j * pitch + k, Pack{});
    };
    clear(0, begin);
    clear(begin + height, group.all.count[1]);
    const long first = long(plane.lines[n]) * nodes.count;
    int q = 0;
    for (; q + 4 <= nodes.count; q += 4) add_nodes<4>(factors, first + q, x, begin, height, pitch, q == 0, rows + begin * pitch);
    for (; q < nodes.count; ++q) add_nodes<1>(factors, first + q, x, begin, height, pitch, q == 0, rows + begin * pitch);
  }
}

// A part of a row of cells: `cells` <= LANES of them, columns `depth` apart. `room`: a whole pack may be stored, whose lanes beyond hold
// zeros.
struct Row {
  int cells;
  long depth;
  bool room;
};

// out (N columns) += sum over lines of shares[0 ... LANES) times values[column ... column + N). The sums stay in registers.
template <int N>
inline void add_columns(int lines, const double* shares, long stride, const double* const* values, int column, const Row& row,
                        double* out) {
  Pack sum[N];
#pragma GCC unroll 32
  for (int c = 0; c < N; ++c) sum[c] = Pack{};
  for (int line = 0; line < lines; ++line, shares += stride) {
    const Pack share = load(shares);
    const double* value = values[line] + column;
    // Otherwise the compiler adds `column` to each of the N offsets beforehand, which needs more registers than there are.
    __asm__("" : "+r"(value));
#pragma GCC unroll 32
    for (int c = 0; c < N; ++c) sum[c] += share * value[c];
  }
  out += column * row.depth;
  if (row.room) {
#pragma GCC unroll 32
    for (int c = 0; c < N; ++c) store(out + c * row.depth, load(out + c * row.depth) + sum[c]);
    return;
  }
  double last[N * LANES];
#pragma GCC unroll 32
  for (int c = 0; c < N; ++c) store(last + c * LANES, sum[c]);
  for (int c = 0; c < N; ++c)
    for (int k = 0; k < row.cells; ++k) out[c * row.depth + k] += last[c * LANES + k];
}

// The same for all columns, as many at once as registers hold.
inline void add_lines(int lines, const double* shares, long stride, const double* const* values, int columns, const Row& row, double* out) {
  constexpr int at_once = LANES == 8 ? 20 : 8;
  int c = 0;
  for (; c + at_once <= columns; c += at_once) add_columns<at_once>(lines, shares, stride, values, c, row, out);
  if (LANES == 8 && c + 12 <= columns) {
    add_columns<12>(lines, shares, stride, values, c, row, out);
    c += 12;
  }
  for (; c + 4 <= columns; c += 4) add_columns<4>(lines, shares, stride, values, c, row, out);
  for (; c < columns; ++c) add_columns<1>(lines, shares, stride, values, c, row, out);
}

inline void spread_gaussian(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int from, int to,
                            double* scratch, double* out) {
  double* rows;
  const Factors factors = gaussian_factors(cells, kernel, nodes, group, scratch, &rows);
  const int *start = group.all.start, *count = group.all.count;
  const long depth = cells.shape[2], stride = factors.stride[2];
  const int begin = from > start[0] ? from : start[0], end = to < start[0] + count[0] ? to : start[0] + count[0];
  for (int i = begin; i < end; ++i) {
    const Plane plane = plane_of(group, i);
    plane_rows(factors, nodes, group, plane, i - start[0], rows);
    const auto window = [&](int n) -> const Window& { return group.windows[plane.lines[n]]; };
    // Lines come by where they end and begin along y: those that reach a row lie between two of them.
    for (int j = 0, first = 0; j < count[1]; ++j) {
      const int y = start[1] + j;
      while (first < plane.count && window(first).start[1] + window(first).count[1] <= y) ++first;
      int last = plane.count;
      while (last > first && window(last - 1).start[1] > y) --last;
      if (first == last) continue;
      double* cell = out + (long(i) * cells.shape[1] + y) * group.columns * depth + start[2];
      for (int k = 0; k < count[2]; k += LANES) {
        const Row row{count[2] - k < LANES ? count[2] - k : LANES, depth, start[2] + k + LANES <= depth};
        add_lines(last - first, rows + (long(j) * plane.count + first) * stride + k, stride, plane.values + first, group.columns, row,
                  cell + k);
      }
    }
  }
}

inline void spread_ball(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int line, int from, int to,
                        double* scratch, double* out) {
  const Window& window = group.windows[line];
  const int *n = window.count, *start = window.start, columns = group.columns;
  if (start[0] >= to || start[0] + n[0] <= from) return;
  const long size = long(n[0]) * n[1] * n[2], depth = cells.shape[2];
  double *share = scratch, *sum = scratch + size;
  for (long m = 0; m < size; ++m) sum[m] = 0.0;
  for (int q = 0; q < nodes.count; ++q) {
    double place[3];
    for (int axis = 0; axis < 3; ++axis) place[axis] = group.first[3 * line + axis] + nodes.place[q] * group.branch[3 * line + axis];
    ball_shares(cells, kernel, window, place, share);
    for (long m = 0; m < size; ++m) sum[m] += nodes.weight[q] * share[m];
  }
  // A window of a spherical kernel may reach beyond the grid; only what is inside is added.
  const int z_begin = start[2] < 0 ? -start[2] : 0, z_end = start[2] + n[2] > depth ? int(depth) - start[2] : n[2];
  const double* values = group.values + long(line) * columns;
  for (int i = 0; i < n[0]; ++i) {
    if (start[0] + i < from || start[0] + i >= to) continue;
    for (int j = 0; j < n[1]; ++j) {
      if (start[1] + j < 0 || start[1] + j >= cells.shape[1]) continue;
      const double* row = sum + (long(i) * n[1] + j) * n[2];
      double* cell = out + (long(start[0] + i) * cells.shape[1] + start[1] + j) * columns * depth + start[2];
      for (int c = 0; c < columns; ++c, cell += depth)
        for (int k = z_begin; k < z_end; ++k) cell[k] += values[c] * row[k];
    }
  }
}

}  // namespace

void SPREAD(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int from, int to, double* scratch,
            double* out) {
  if (kernel.kind == KernelKind::gaussian) {
    spread_gaussian(cells, kernel, nodes, group, from, to, scratch, out);
  } else {
    for (int line = 0; line < group.count; ++line) spread_ball(cells, kernel, nodes, group, line, from, to, scratch, out);
  }
}

}  // namespace dembark::fields
