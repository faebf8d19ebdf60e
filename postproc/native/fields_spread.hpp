// The inner loops of coarse graining; included once for each instruction set with SPREAD set to the function's name and LANES to the
// doubles in a vector. What a cell gets from a group does not depend on `from` and `to`, so that any split of the grid among threads gives
// the same bits.

namespace dembark::fields {
namespace {

inline double clamp(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

// Integral from 0 to x of the Gaussian of standard deviation 1, cut at 3 and normalised: x times a polynomial in x^2 of degree 16, fitted
// to 1e-15 (erf(x / sqrt 2) / (2 erf(3 / sqrt 2)) at Chebyshev points).
inline double half_gaussian(double x) {
  x = clamp(x, -3.0, 3.0);
  const double u = x * x * (1.0 / 4.5) - 1.0;
  static constexpr double c[17] = {0.22832961018667941, -0.09308378714444443, 0.046096695165837726, -0.020626803743848798,
                                   0.0080432045225557868, -0.0027365221310244204, 0.00082009289492281979, -0.00021881942106935577,
                                   5.2510114069543034e-05, -1.1434606565200895e-05, 2.2772871863171932e-06, -4.1764135591387858e-07,
                                   7.0927769907576937e-08, -1.1192516199860439e-08, 1.6650237004264441e-09, -2.464845016263867e-10,
                                   2.9930377544698147e-11};
  double sum = c[16];
  for (int k = 15; k >= 0; --k) sum = sum * u + c[k];
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
// zero beyond the line's own.
struct Factors {
  double* of[3];
  long stride[3];
};

inline double* aligned(double* p) { return reinterpret_cast<double*>((reinterpret_cast<unsigned long long>(p) + 63) & ~63ull); }

inline Factors gaussian_factors(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, double* scratch,
                                double** free) {
  const long places = long(group.count) * nodes.count;
  Factors factors;
  double* next = aligned(scratch);
  for (int axis = 0; axis < 3; ++axis) {
    factors.stride[axis] = (group.all.count[axis] + LANES - 1) / LANES * LANES;
    factors.of[axis] = next;
    next = aligned(next + factors.stride[axis] * places);
  }
  *free = next;
  double* edges = next;
  const double scale = 1.0 / kernel.width;
  long total = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double step = cells.spacing[axis], low = cells.low[axis];
    for (int line = 0; line < group.count; ++line) {
      const int start = group.windows[line].start[axis], count = group.windows[line].count[axis];
      for (int q = 0; q < nodes.count; ++q, total += count + 1) {
        const double place = group.first[3 * line + axis] + nodes.place[q] * group.branch[3 * line + axis];
        for (int i = 0; i <= count; ++i) edges[total + i] = (low + double(start + i) * step - place) * scale;
      }
    }
  }
  // One long loop over all edges: it fills the vector lanes and hides the latency of the polynomial.
  for (long n = 0; n < total; ++n) edges[n] = half_gaussian(edges[n]);
  for (int axis = 0; axis < 3; ++axis) {
    double* to = factors.of[axis];
    for (int line = 0; line < group.count; ++line) {
      const int count = group.windows[line].count[axis];
      const int lead = group.windows[line].start[axis] - group.all.start[axis];
      for (int q = 0; q < nodes.count; ++q, to += factors.stride[axis], edges += count + 1) {
        double factor = 1.0;
        if (kernel.closed && !cells.periodic[axis]) {
          const double place = group.first[3 * line + axis] + nodes.place[q] * group.branch[3 * line + axis];
          const double inside = half_gaussian((cells.high[axis] - place) * scale) - half_gaussian((cells.low[axis] - place) * scale);
          factor = place >= cells.low[axis] && place <= cells.high[axis] && inside > 0.0 ? 1.0 / inside : 0.0;
        }
        for (int i = 0; i < lead; ++i) to[i] = 0.0;
        for (int i = 0; i < count; ++i) to[lead + i] = (edges[i + 1] - edges[i]) * factor;
        for (long i = lead + count; i < factors.stride[axis]; ++i) to[i] = 0.0;
      }
    }
  }
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

// rows (cells of y, lines, z_stride) of the plane `x` of a group's window: the line's mean shares. Q: the number of nodes, or 0 for any.
template <int Q>
inline void plane_rows(const Factors& factors, const Nodes& nodes, int lines, int y_count, long x, double* across, double* rows) {
  const int count = Q ? Q : nodes.count;
  const long x_stride = factors.stride[0], y_stride = factors.stride[1], z_stride = factors.stride[2];
  for (int line = 0; line < lines; ++line) {
    const long first = long(line) * count;
    for (int q = 0; q < count; ++q) {
      const double here = nodes.weight[q] * factors.of[0][(first + q) * x_stride + x];
      const double* y = factors.of[1] + (first + q) * y_stride;
      for (long j = 0; j < y_stride; j += LANES) store(across + q * y_stride + j, load(y + j) * here);
    }
    for (long k = 0; k < z_stride; k += LANES) {
      const double* z = factors.of[2] + first * z_stride + k;
      double* row = rows + line * z_stride + k;
      for (int j = 0; j < y_count; ++j) {
        Pack sum = load(z) * across[j];
        for (int q = 1; q < count; ++q) sum += load(z + q * z_stride) * across[q * y_stride + j];
        store(row + j * lines * z_stride, sum);
      }
    }
  }
}

// out (N columns of stride `depth`, `cells` <= LANES of them) += sum over lines of row[0 ... LANES) times values[0 ... N).
// The sums stay in registers; lanes beyond `cells` hold zeros, and are not stored where `room` does not allow it.
template <int N>
inline void add_columns(int lines, const double* row, long row_stride, const double* values, long value_stride, int cells, long depth,
                        bool room, double* out) {
  Pack sum[N];
#pragma GCC unroll 32
  for (int c = 0; c < N; ++c) sum[c] = Pack{};
  for (int line = 0; line < lines; ++line, row += row_stride, values += value_stride) {
    const Pack share = load(row);
#pragma GCC unroll 32
    for (int c = 0; c < N; ++c) sum[c] += share * values[c];
  }
  if (room) {
#pragma GCC unroll 32
    for (int c = 0; c < N; ++c) store(out + c * depth, load(out + c * depth) + sum[c]);
    return;
  }
  double last[N * LANES];
#pragma GCC unroll 32
  for (int c = 0; c < N; ++c) store(last + c * LANES, sum[c]);
  for (int c = 0; c < N; ++c)
    for (int k = 0; k < cells; ++k) out[c * depth + k] += last[c * LANES + k];
}

inline void spread_gaussian(const Cells& cells, const Kernel& kernel, const Nodes& nodes, const Group& group, int from, int to,
                            double* scratch, double* out) {
  double* free;
  const Factors factors = gaussian_factors(cells, kernel, nodes, group, scratch, &free);
  double *across = free, *rows = aligned(across + nodes.count * factors.stride[1]);
  const int *start = group.all.start, *count = group.all.count, columns = group.columns, lines = group.count;
  const long depth = cells.shape[2], stride = factors.stride[2];
  const int begin = from > start[0] ? from : start[0], end = to < start[0] + count[0] ? to : start[0] + count[0];
  constexpr decltype(&plane_rows<0>) fills[] = {plane_rows<0>, plane_rows<1>, plane_rows<2>, plane_rows<3>, plane_rows<4>};
  const auto fill = fills[nodes.count <= 4 ? nodes.count : 0];
  // As many columns at once as registers hold.
  constexpr int at_once = LANES == 8 ? 20 : 8;
  for (int i = begin; i < end; ++i) {
    fill(factors, nodes, lines, count[1], i - start[0], across, rows);
    for (int j = 0; j < count[1]; ++j) {
      double* cell = out + (long(i) * cells.shape[1] + start[1] + j) * columns * depth + start[2];
      for (int k = 0; k < count[2]; k += LANES) {
        const double* row = rows + j * lines * stride + k;
        const bool room = start[2] + k + LANES <= depth;
        const int inside = count[2] - k < LANES ? count[2] - k : LANES;
        int c = 0;
        for (; c + at_once <= columns; c += at_once)
          add_columns<at_once>(lines, row, stride, group.values + c, columns, inside, depth, room, cell + c * depth + k);
        if (LANES == 8 && c + 12 <= columns) {
          add_columns<12>(lines, row, stride, group.values + c, columns, inside, depth, room, cell + c * depth + k);
          c += 12;
        }
        for (; c + 4 <= columns; c += 4)
          add_columns<4>(lines, row, stride, group.values + c, columns, inside, depth, room, cell + c * depth + k);
        for (; c < columns; ++c)
          add_columns<1>(lines, row, stride, group.values + c, columns, inside, depth, room, cell + c * depth + k);
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
